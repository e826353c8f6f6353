//! Intervals of what a skill expects.

use proptest::prelude::*;
use tonus::model::recognise::Recogniser;
use tonus::model::{Dof, Hyperparameters, Model, Parts, ProbabilityError, learn};
use tonus_shared::promp::Basis;

use super::reference;

fn model(freedom: Option<f64>) -> Model {
    let demonstrations = reference(&["hx", "Khx"], false);
    let dofs = vec![Dof::position("hx"), Dof::stiffness("Khx")];
    let given = Hyperparameters::new(dofs, Basis::gaussian(8).unwrap());
    let model = learn(&demonstrations, &given.check().unwrap()).unwrap();
    let parts = Parts {
        freedom: vec![freedom; 3],
        ..model.parts().clone()
    };
    Model::assemble(parts).unwrap()
}

/// Half widths in standard deviations of the distribution, from SciPy: `norm.ppf` and `t.ppf` times
/// `sqrt((nu - 2) / nu)`.
#[test]
fn half_widths_are_those_of_scipy() {
    for (freedom, probability, half) in [
        (None, 0.95, 1.959_963_984_540_054),
        (None, 0.5, 0.674_489_750_196_081_7),
        (Some(5.0), 0.95, 2.570_581_836_614_739_5 * 0.6_f64.sqrt()),
        (
            Some(3.0),
            0.95,
            3.182_446_305_284_263 * (1.0_f64 / 3.0).sqrt(),
        ),
        (Some(10.0), 0.9, 1.812_461_122_810_733_5 * 0.8_f64.sqrt()),
    ] {
        let model = model(freedom);
        let view = model.view().unwrap();
        let recogniser = Recogniser::new(&model, &view).unwrap();
        let spread = recogniser.spread(1, 0, 0.4).unwrap();
        let (low, high) = spread.interval(probability).unwrap();
        let got = 0.5 * (high - low) / spread.variance.sqrt();
        assert!(
            (got / half - 1.0).abs() < 1e-9,
            "{freedom:?} {probability}: {got} for {half}"
        );
        assert!((0.5 * (high + low) - spread.mean).abs() < 1e-12);
        assert_eq!(spread.interval(1.0), Err(ProbabilityError(1.0)));
        assert!(spread.interval(f64::NAN).is_err());
        assert!(recogniser.spread(3, 0, 0.4).is_err() && recogniser.spread(0, 2, 0.4).is_err());
    }
}

#[test]
fn each_observation_is_a_degree_of_freedom() {
    let model = model(Some(4.0));
    let view = model.view().unwrap();
    let mut recogniser = Recogniser::new(&model, &view).unwrap();
    recogniser.observe(0, 0.1, 0.01, 0.02).unwrap();
    recogniser.observe(1, 0.2, 200.0, 20.0).unwrap();
    assert_eq!(recogniser.spread(0, 0, 0.5).unwrap().freedom, Some(6.0));
}

proptest! {
    #![proptest_config(tonus_tests::seeded(200))]

    /// Whatever was observed, and however wide.
    #[test]
    fn no_inferred_stiffness_is_negative(
        phase in 0.0..1.0_f64, value in 1e-6..1e6_f64, place in -10.0..10.0_f64, at in -0.5..1.5_f64,
        probability in 0.01..0.999_999_f64, freedom in prop::option::of(2.01..50.0_f64),
    ) {
        let model = model(freedom);
        let view = model.view().unwrap();
        let mut recogniser = Recogniser::new(&model, &view).unwrap();
        recogniser.observe(0, phase, place, 0.01).unwrap();
        recogniser.observe(1, phase, value, 0.2 * value).unwrap();
        for skill in 0..3 {
            let (low, high) = recogniser.spread(skill, 1, at).unwrap().interval(probability).unwrap();
            prop_assert!(low >= 0.0 && high >= low, "{low} {high}");
            prop_assert!(recogniser.predict(skill, 1, at).unwrap().mean >= 0.0);
        }
    }
}

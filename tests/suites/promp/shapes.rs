//! Shapes, storage and the errors that name what was expected.

use tonus_shared::promp::{
    Basis, Belief, ConditionError, Latent, Mixture, ModelError, Observation, Row, RowError, Skill,
    Trajectory, belief_len, loading_len, mixture_len, root_len, trajectory_scratch_len,
};

// The paper's hand-over (12 DoFs, 30 functions, 30 demonstrations) with three skills, in `f32`.
const _: () = {
    assert!(4 * loading_len(12, 30, 29) == 41_760);
    assert!(4 * belief_len(29) == 2_128);
    assert!(4 * mixture_len(3, 30, 29) == 6_620);
    assert!(4 * trajectory_scratch_len(30, 29) == 468);
};

const DOFS: usize = 2;
const BASIS: usize = 4;
const RANK: usize = 3;

fn loading() -> [f32; DOFS * BASIS * RANK] {
    std::array::from_fn(|i| (i as f32 * 0.7).sin())
}

fn latent(loading: &[f32]) -> Latent<'_, f32> {
    Latent::new(Basis::gaussian(BASIS).unwrap(), DOFS, RANK, loading).unwrap()
}

fn row(phase: f32) -> Observation<f32> {
    Observation {
        row: Row::position(1, phase),
        value: 0.3,
        variance: 0.01,
    }
}

#[test]
fn an_array_and_a_longer_vector_give_the_same_bits() {
    let loading = loading();
    let latent = latent(&loading);
    let (mean, residual) = ([0.1; DOFS * BASIS], [0.0; DOFS]);
    let root: [f32; root_len(RANK)] = std::array::from_fn(|i| (i as f32).cos());
    let skills = [
        Skill::new(&latent, &mean, None, &residual, 0.0).unwrap(),
        Skill::new(&latent, &mean, Some(&root), &residual, 0.0).unwrap(),
    ];
    const LEN: usize = mixture_len(2, BASIS, RANK);
    let mut chip = Mixture::new(latent, &skills, [f32::NAN; LEN]).unwrap();
    let mut host = Mixture::new(latent, &skills, vec![f32::NAN; LEN + 100]).unwrap();
    for i in 0..20 {
        chip.observe(&row(i as f32 / 19.0)).unwrap();
        host.observe(&row(i as f32 / 19.0)).unwrap();
    }
    for q in 0..2 {
        let (a, b) = (chip.belief(q).unwrap(), host.belief(q).unwrap());
        assert_eq!(a.mean(), b.mean());
        assert_eq!(a.root(), b.root());
        assert_eq!(chip.log_joint(q), host.log_joint(q));
    }
    assert!(chip.belief(2).is_none() && host.belief(2).is_none());
    assert!(host.trajectory(2).is_none() && host.log_joint(2).is_none());
    assert_eq!(chip.skills().len(), 2);
    assert_eq!(chip.latent().rank(), RANK);
}

#[test]
fn a_loading_must_fit_its_shape() {
    let numbers = loading();
    let basis = Basis::gaussian(BASIS).unwrap();
    let make = |dofs, rank, loading| Latent::new(basis, dofs, rank, loading).map(|_| ());
    assert_eq!(
        make(DOFS, RANK + 1, &numbers),
        Err(ModelError::Length {
            what: "the loading",
            expected: DOFS * BASIS * (RANK + 1),
            got: numbers.len()
        })
    );
    assert_eq!(make(0, RANK, &[]), Err(ModelError::Empty { what: "DoF" }));
    let no_rank = ModelError::Empty {
        what: "latent dimension",
    };
    assert_eq!(make(DOFS, 0, &[]), Err(no_rank));
    let huge = make(usize::MAX / 2, RANK, &numbers);
    assert!(matches!(huge, Err(ModelError::TooLarge { rank: RANK, .. })));
    let mut damaged = numbers;
    damaged[7] = f32::INFINITY;
    assert_eq!(
        make(DOFS, RANK, &damaged),
        Err(ModelError::NonFinite {
            what: "the loading",
            index: 7,
            value: f64::INFINITY
        })
    );
}

#[test]
fn a_skill_must_fit_its_latent_space() {
    let loading = loading();
    let latent = latent(&loading);
    let (mean, residual) = ([0.1; DOFS * BASIS], [0.0; DOFS]);
    let root = [0.0; root_len(RANK)];
    let error = |mean: &[f32], root: Option<&[f32]>, residual: &[f32], log_prior| {
        Skill::new(&latent, mean, root, residual, log_prior)
            .unwrap_err()
            .to_string()
    };
    assert_eq!(
        error(&mean[1..], None, &residual, 0.0),
        "the weight mean has 7 numbers where the shape needs 8"
    );
    assert_eq!(
        error(&mean, Some(&root[1..]), &residual, 0.0),
        "the root has 5 numbers where the shape needs 6"
    );
    assert_eq!(
        error(&mean, None, &[0.0], 0.0),
        "the residual variance has 1 numbers where the shape needs 2"
    );
    assert_eq!(
        error(&mean, None, &[0.0, -0.5], 0.0),
        "the residual variance of DoF 1 is -0.5: it cannot be negative"
    );
    assert!(error(&[f32::NAN; 8], None, &residual, 0.0).starts_with("the weight mean[0] is NaN"));
    assert!(error(&mean, None, &residual, f32::NEG_INFINITY).contains("log prior"));
    assert!(error(&mean, None, &residual, f32::MIN).contains("log prior"));
    let large = [0.0, 0.0, 0.0, 2e19, 0.0, 0.0];
    assert!(error(&mean, Some(&large), &residual, 0.0).starts_with("row 1 of the root"));
}

#[test]
fn storage_too_short_says_how_much_it_needs() {
    let loading = loading();
    let latent = latent(&loading);
    let (mean, residual) = ([0.1; DOFS * BASIS], [0.0; DOFS]);
    let skills = [Skill::new(&latent, &mean, None, &residual, 0.0).unwrap()];
    let short = Mixture::new(latent, &skills, [0.0; mixture_len(1, BASIS, RANK) - 1]).unwrap_err();
    assert_eq!(
        short.to_string(),
        "the mixture's storage holds 31 numbers and needs at least 32"
    );
    let short = Belief::new(&skills[0], [0.0; belief_len(RANK) - 1]).unwrap_err();
    assert_eq!(
        short.to_string(),
        "the belief's storage holds 24 numbers and needs at least 25"
    );
    let none = Mixture::new(latent, &[], [0.0; 100]).unwrap_err();
    assert_eq!(none, ModelError::Empty { what: "skill" });
    let wide = [0.0; DOFS * BASIS * (RANK + 1)];
    let wider = Latent::new(Basis::gaussian(BASIS).unwrap(), DOFS, RANK + 1, &wide).unwrap();
    let belief = Belief::new(&skills[0], [0.0; belief_len(RANK)]).unwrap();
    assert!(Trajectory::posterior(wider, skills[0], &belief).is_err());
    let trajectory = Trajectory::posterior(latent, skills[0], &belief).unwrap();
    let refused = trajectory.moments(&Row::position(0, 0.5), &mut [0.0; 12]);
    assert!(matches!(
        refused,
        Err(RowError::Buffer {
            expected: 13,
            got: 12,
            ..
        })
    ));
    assert!(trajectory.weight_mean(&mut [0.0; 7]).is_err());
    let mixture = Mixture::new(latent, &skills, [0.0; mixture_len(1, BASIS, RANK)]).unwrap();
    assert!(mixture.log_posterior(&mut [0.0; 2]).is_err());
}

#[test]
fn bad_observations_say_what_to_do() {
    let loading = loading();
    let latent = latent(&loading);
    let (mean, residual) = ([0.1; DOFS * BASIS], [0.5; DOFS]);
    let skills = [Skill::new(&latent, &mean, None, &residual, 0.0).unwrap()];
    let storage = [0.0; mixture_len(1, BASIS, RANK)];
    let mut mixture = Mixture::new(latent, &skills, storage).unwrap();
    let mut refuse = |row, value, variance| {
        let refused: ConditionError = mixture
            .observe(&Observation {
                row,
                value,
                variance,
            })
            .unwrap_err();
        refused.to_string()
    };
    let fine = Row::position(0, 0.5);
    let text = refuse(Row::position(2, 0.5), 0.0, 1.0);
    assert_eq!(text, "DoF 2 was named, the model has 2 (0 to 1)");
    let text = refuse(Row::velocity(0, 0.5, 0.0), 0.0, 1.0);
    assert_eq!(
        text,
        "the movement's duration is 0 s: give a positive finite number"
    );
    assert!(refuse(Row::position(0, f32::NAN), 0.0, 1.0).starts_with("the phase is NaN"));
    assert!(refuse(fine, f32::NAN, 1.0).starts_with("the observed value is NaN"));
    assert!(refuse(fine, 0.0, f32::INFINITY).starts_with("the noise variance is inf"));
    // The skill's residual does not excuse a sensor without noise.
    assert!(refuse(fine, 0.0, 0.0).starts_with("the noise variance is 0"));
    assert!(refuse(fine, 0.0, -0.1).starts_with("the noise variance is -0.1"));
    assert!(refuse(fine, 3e38, 1.0).contains("overflows the scalar"));
    let text = refuse(Row::velocity(0, 0.5, 1e-40), 0.0, 1.0);
    assert!(text.starts_with("DoF 0 at phase 0.5 overflows"), "{text}");
}

/// A mixture keeps the basis functions of the last phase; neither another order nor a refusal in between may leave
/// it with the wrong ones.
#[test]
fn one_phase_again_gives_the_same_bits() {
    let loading = loading();
    let latent = latent(&loading);
    let (mean, residual) = ([0.1; DOFS * BASIS], [0.0; DOFS]);
    let skills = [Skill::new(&latent, &mean, None, &residual, 0.0).unwrap()];
    let rows = [
        Row::position(0, 0.3),
        Row::position(1, 0.3),
        Row::velocity(0, 0.3, 2.0),
        Row::velocity(1, 0.3, 1.0),
        Row::position(1, 0.3),
        Row::position(0, 0.6),
    ];
    let mut mixture = Mixture::new(latent, &skills, [0.0; mixture_len(1, BASIS, RANK)]).unwrap();
    let mut belief = Belief::new(&skills[0], [0.0; belief_len(RANK)]).unwrap();
    let (mut psi, mut a) = ([0.0; BASIS], [0.0; RANK]);
    for row in rows {
        let (value, variance) = (0.4, 0.01);
        let seen = |row, value| Observation {
            row,
            value,
            variance,
        };
        mixture.observe(&seen(row, value)).unwrap();
        mixture.observe(&seen(row, f32::NAN)).unwrap_err();
        mixture
            .observe(&seen(Row::position(0, f32::NAN), value))
            .unwrap_err();
        mixture
            .observe(&seen(Row { dof: 7, ..row }, value))
            .unwrap_err();
        latent.row(&row, &mut psi, &mut a).unwrap();
        let offset = skills[0].offset(latent.basis(), &row, &psi).unwrap();
        belief.condition(&a, offset, value, variance).unwrap();
        assert_eq!(mixture.belief(0).unwrap().mean(), belief.mean());
        assert_eq!(mixture.log_joint(0), Some(belief.log_likelihood()));
    }
}

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::{
    CalibrationError, Decision, Early, Forecast, Reliability, Temperature, Tempering, brier,
    decide, log_loss,
};

fn forecast(probabilities: &[f64], truth: usize) -> Forecast {
    let logs = probabilities.iter().map(|p| p.ln()).collect();
    Forecast::new(logs, truth).unwrap()
}

fn close(got: f64, expected: f64) {
    assert!((got - expected).abs() < 1e-12, "{got} is not {expected}");
}

/// Forecasts of three classes with a truth drawn from each posterior: calibrated by construction.
fn calibrated(count: usize, seed: u64) -> Vec<Forecast> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let one = |_| {
        let scores = [(); 3].map(|()| 3.0 * random.random::<f64>());
        let sum: f64 = scores.iter().map(|s| s.exp()).sum();
        let probabilities = scores.map(|s| s.exp() / sum);
        let truth = drawn(&probabilities, &mut random);
        forecast(&probabilities, truth)
    };
    (0..count).map(one).collect()
}

fn drawn(probabilities: &[f64; 3], random: &mut impl Rng) -> usize {
    let at: f64 = random.random();
    usize::from(at > probabilities[0]) + usize::from(at > probabilities[0] + probabilities[1])
}

#[test]
fn scores_are_the_closed_forms() {
    let even = [forecast(&[0.5, 0.5], 0), forecast(&[0.25, 0.75], 0)];
    close(
        log_loss(&even).unwrap(),
        0.5 * (2.0_f64.ln() + 4.0_f64.ln()),
    );
    // (0.25 + 0.25 + 0.5625 + 0.5625) / 2
    close(brier(&even).unwrap(), 0.8125);
    let sure = [forecast(&[0.0, 1.0], 1)];
    close(log_loss(&sure).unwrap(), 0.0);
    close(brier(&sure).unwrap(), 0.0);
    assert!(log_loss(&[forecast(&[0.0, 1.0], 0)]).unwrap().is_infinite());
}

#[test]
fn bins_hold_equal_counts_and_never_part_equal_confidences() {
    // Confidences 0.6 (right), 0.7 (wrong), 0.8 (right), 0.9 (right).
    let four = [
        forecast(&[0.9, 0.1], 0),
        forecast(&[0.3, 0.7], 0),
        forecast(&[0.8, 0.2], 0),
        forecast(&[0.6, 0.4], 0),
    ];
    let two = Reliability::of(&four, 2).unwrap();
    let bins = two.bins();
    assert_eq!((bins.len(), bins[0].count, bins[1].count), (2, 2, 2));
    close(bins[0].confidence, 0.65);
    close(bins[0].accuracy, 0.5);
    close(bins[1].confidence, 0.85);
    close(two.expected_calibration_error(), 0.5 * (0.15 + 0.15));
    // E|x| of a Gaussian of variance v is sqrt(2 v / pi).
    let chance = |c: f64| (2.0 * c * (1.0 - c) / 2.0 / core::f64::consts::PI).sqrt();
    close(two.by_chance(), 0.5 * (chance(0.65) + chance(0.85)));
    let one = Reliability::of(&four, 1).unwrap();
    close(one.expected_calibration_error(), 0.0);

    let same = vec![forecast(&[0.8, 0.2], 0); 5];
    let diagram = Reliability::of(&same, 3).unwrap();
    assert_eq!(diagram.bins().len(), 1);
    close(diagram.expected_calibration_error(), 0.2);
}

#[test]
fn a_calibrated_predictor_errs_by_chance_alone() {
    for seed in 1..=5 {
        let diagram = Reliability::of(&calibrated(4000, seed), 10).unwrap();
        let error = diagram.expected_calibration_error();
        // Ten bins: the error's own standard deviation is a quarter of its mean.
        let chance = diagram.by_chance();
        assert!(
            (0.3 * chance..1.9 * chance).contains(&error),
            "{error} against {chance}"
        );
    }
}

#[test]
fn an_overconfident_predictor_is_found_and_mended() {
    let honest = calibrated(4000, 6);
    let sharp = Temperature(1.0 / 3.0);
    let overconfident: Vec<_> = honest.iter().map(|f| sharp.softened(f)).collect();
    let before = Reliability::of(&overconfident, 10).unwrap();
    assert!(before.expected_calibration_error() > 0.1);
    let temperature = Temperature::fit(&overconfident[..2000]).unwrap();
    assert!((temperature.get() - 3.0).abs() < 0.3, "{temperature:?}");
    let mended: Vec<_> = overconfident[2000..]
        .iter()
        .map(|f| temperature.softened(f))
        .collect();
    let after = Reliability::of(&mended, 10).unwrap();
    assert!(after.expected_calibration_error() < 2.0 * after.by_chance());
    assert!(log_loss(&mended).unwrap() < log_loss(&overconfident[2000..]).unwrap());
}

#[test]
fn a_temperature_is_the_stationary_point_of_its_loss() {
    // Two classes, log odds a, always right n times and wrong m times:
    // n a (sigmoid(b a) - 1) + m a sigmoid(b a) + (b - 1) / s^2 = 0.
    let (odds, right, wrong) = (4.0_f64, 30, 10);
    let p = 1.0 / (1.0 + (-odds).exp());
    let mut forecasts = vec![forecast(&[p, 1.0 - p], 0); right];
    forecasts.extend(vec![forecast(&[p, 1.0 - p], 1); wrong]);
    let inverse = 1.0 / Temperature::fit(&forecasts).unwrap().get();
    let q = 1.0 / (1.0 + (-inverse * odds).exp());
    let slope = right as f64 * odds * (q - 1.0) + wrong as f64 * odds * q;
    assert!((slope + (inverse - 1.0) / 0.25).abs() < 1e-9, "{inverse}");
    // All right, and few: the prior keeps the temperature near one.
    let few = vec![forecast(&[0.99, 0.01], 0); 5];
    let temperature = Temperature::fit(&few).unwrap().get();
    assert!((0.8..1.0).contains(&temperature), "{temperature}");
}

#[test]
fn softening_keeps_the_order_and_holds_certainty() {
    let softened = Temperature(2.0).soften(&[0.64_f64.ln(), 0.36_f64.ln()]);
    close(softened[0].exp(), 0.8 / 1.4);
    let certain = Temperature(2.0).soften(&[0.0, f64::NEG_INFINITY]);
    assert_eq!(certain, vec![0.0, f64::NEG_INFINITY]);
    let far = Temperature(2.0).soften(&[0.0, -3000.0]);
    close(far[1], -1500.0);
}

#[test]
fn decides_at_the_first_observation_sure_enough() {
    let stream = [
        (0.1, [0.5_f64.ln(), 0.5_f64.ln()]),
        (0.2, [0.15_f64.ln(), 0.85_f64.ln()]),
        (0.3, [0.95_f64.ln(), 0.05_f64.ln()]),
    ];
    let made = decide(stream, 0.8).unwrap().unwrap();
    let expected = Decision {
        time_s: 0.2,
        observations: 2,
        class: 1,
    };
    assert_eq!(made, expected);
    assert_eq!(decide(stream, 0.9).unwrap().unwrap().class, 0);
    assert_eq!(decide(stream, 0.99).unwrap(), None);

    let late = Decision {
        time_s: 0.4,
        ..expected
    };
    let early = Early::of(&[(Some(expected), 1), (Some(late), 0), (None, 0)]);
    assert_eq!((early.total, early.decided, early.wrong), (3, 2, 1));
    assert_eq!(early.median_time_s, Some(0.2));
    assert_eq!(early.error_rate(), Some(0.5));
    assert_eq!(Early::of(&[(None, 0)]).error_rate(), None);
}

#[test]
fn what_is_no_forecast_is_refused() {
    let refused = |logs: &[f64], truth| Forecast::new(logs.to_vec(), truth).unwrap_err();
    assert!(matches!(refused(&[0.0], 1), CalibrationError::Truth { .. }));
    assert!(matches!(
        refused(&[f64::NAN, 0.0], 0),
        CalibrationError::Probability { class: 0, .. }
    ));
    assert!(matches!(
        refused(&[-1.0, -1.0], 0),
        CalibrationError::Sum { .. }
    ));
    assert_eq!(log_loss(&[]), Err(CalibrationError::None));
    assert_eq!(Reliability::of(&[], 3), Err(CalibrationError::None));
    assert_eq!(
        Reliability::of(&[forecast(&[1.0], 0)], 0),
        Err(CalibrationError::NoBins)
    );
    assert!(Temperature::fit(&[]).is_err());
    assert!(matches!(
        decide([(0.0, [0.0])], 1.0),
        Err(CalibrationError::Confidence { .. })
    ));
    assert!(matches!(
        decide([(f64::NAN, [0.0])], 0.5),
        Err(CalibrationError::Time { .. })
    ));
}

/// Two classes of log odds `odds`, so often right and wrong.
fn of_odds(odds: f64, right: usize, wrong: usize) -> Vec<Forecast> {
    let p = 1.0 / (1.0 + (-odds).exp());
    let mut forecasts = vec![forecast(&[p, 1.0 - p], 0); right];
    forecasts.extend(vec![forecast(&[p, 1.0 - p], 1); wrong]);
    forecasts
}

#[test]
fn tempering_is_the_integral_over_the_inverse_temperature() {
    // The mean of sigmoid(4 b) where P(b | forecasts) ~ exp(-2 (b - 1)^2) sigmoid(4 b)^right sigmoid(-4 b)^wrong, by
    // SciPy 1.17's `quad` over b from 0 to 10.
    let integrals = [
        (9, 1, 0.925_676_335),
        (30, 10, 0.767_364_224),
        (5, 0, 0.971_031_207),
    ];
    for (right, wrong, expected) in integrals {
        let tempering = Tempering::fit(&of_odds(4.0, right, wrong)).unwrap();
        let sure = forecast(
            &[1.0 / (1.0 + (-4.0_f64).exp()), 1.0 / (1.0 + 4.0_f64.exp())],
            0,
        );
        let softened = tempering.softened(&sure);
        let got = softened.log_posterior()[0].exp();
        assert!((got - expected).abs() < 1e-5, "{right}, {wrong}: {got}");
        let sum: f64 = softened.log_posterior().iter().map(|l| l.exp()).sum();
        close(sum, 1.0);
    }
}

#[test]
fn few_forecasts_leave_a_posterior_less_sure_than_their_best_temperature() {
    let sure = forecast(&[0.999, 0.001], 0);
    let gap = |times: usize| {
        let forecasts = of_odds(4.0, 9 * times, times);
        let plug_in = Temperature::fit(&forecasts).unwrap().softened(&sure);
        let averaged = Tempering::fit(&forecasts).unwrap().softened(&sure);
        plug_in.answer().1 - averaged.answer().1
    };
    let (few, many) = (gap(1), gap(100));
    assert!(few > 0.005 && many.abs() < 0.1 * few, "{few} {many}");
    assert!(Tempering::fit(&[]).is_err());
}

#[test]
fn tempering_keeps_the_answer_and_impossible_stays_impossible() {
    let tempering = Tempering::fit(&of_odds(2.0, 3, 2)).unwrap();
    let softened = tempering.soften(&[0.5_f64.ln(), f64::NEG_INFINITY, 0.3_f64.ln(), 0.2_f64.ln()]);
    assert_eq!(softened[1], f64::NEG_INFINITY);
    assert!(softened[0] > softened[2] && softened[2] > softened[3]);
    // A truth held impossible is so at any temperature: only the prior and the others speak.
    let mut forecasts = of_odds(2.0, 3, 2);
    forecasts.push(forecast(&[0.0, 1.0], 0));
    assert_eq!(Tempering::fit(&forecasts).unwrap(), tempering);
}

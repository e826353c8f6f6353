//! The measures of calibration against numpy's; what they are on real movements is in suite `recordings`.
#![allow(missing_docs, reason = "test suite")]

use tonus::model::calibration::{Forecast, Reliability, Temperature, brier, log_loss};

/// The values of `golden/calibration.py`, which computes them with numpy in its own way.
#[test]
fn measures_are_those_of_numpy() {
    let golden: serde_json::Value =
        serde_json::from_str(include_str!("../golden/calibration.json")).unwrap();
    let number = |key: &str| golden[key].as_f64().unwrap();
    let list = |value: &serde_json::Value| -> Vec<f64> {
        value
            .as_array()
            .unwrap()
            .iter()
            .map(|v| v.as_f64().unwrap())
            .collect()
    };
    let posteriors = golden["log_posterior"].as_array().unwrap();
    let truths = golden["truth"].as_array().unwrap();
    let one = |(posterior, truth): (&serde_json::Value, &serde_json::Value)| {
        let truth = usize::try_from(truth.as_u64().unwrap()).unwrap();
        Forecast::new(list(posterior), truth).unwrap()
    };
    let forecasts: Vec<Forecast> = posteriors.iter().zip(truths).map(one).collect();
    let bins = usize::try_from(golden["bins"].as_u64().unwrap()).unwrap();
    let error = Reliability::of(&forecasts, bins)
        .unwrap()
        .expected_calibration_error();
    let close = |got: f64, key: &str, tolerance: f64| {
        let expected = number(key);
        assert!(
            (got - expected).abs() < tolerance,
            "{key}: {got}, numpy {expected}"
        );
    };
    close(error, "expected_calibration_error", 1e-12);
    close(log_loss(&forecasts).unwrap(), "log_loss", 1e-12);
    close(brier(&forecasts).unwrap(), "brier", 1e-12);
    // The grid finds a minimum of a flat bottom to the root of the rounding.
    close(
        Temperature::fit(&forecasts).unwrap().get(),
        "temperature",
        1e-6,
    );
}

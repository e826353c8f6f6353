//! Parts against gmr, hmmlearn, dtaidistance, movement_primitives and SciPy.

use nalgebra::{DMatrix, DVector};
use serde_json::Value;
use tonus::baseline::dmp::rollout;
use tonus::baseline::hidden_markov::segments;
use tonus::baseline::mixture_regression::GaussianMixture;
use tonus::baseline::nearest::time_warped;
use tonus::baseline::{Gaussian, Seen};

fn answers(key: &str) -> Value {
    let path = format!("{}/golden/baselines.json", env!("CARGO_MANIFEST_DIR"));
    let text = std::fs::read_to_string(path).unwrap();
    serde_json::from_str::<Value>(&text).unwrap()[key].clone()
}

fn number(value: &Value) -> f64 {
    value.as_f64().unwrap()
}

fn list(value: &Value) -> Vec<f64> {
    value.as_array().unwrap().iter().map(number).collect()
}

fn rows(value: &Value) -> Vec<Vec<f64>> {
    value.as_array().unwrap().iter().map(list).collect()
}

fn matrix(value: &Value) -> DMatrix<f64> {
    let rows = rows(value);
    DMatrix::from_fn(rows.len(), rows[0].len(), |i, j| rows[i][j])
}

fn near(got: &DMatrix<f64>, expected: &DMatrix<f64>, within: f64) {
    let worst = (got - expected).abs().max();
    assert!(worst < within, "{worst} off: {got} against {expected}");
}

fn gaussians(golden: &Value) -> Vec<Gaussian> {
    let means = rows(&golden["means"]);
    let covariances = golden["covariances"].as_array().unwrap();
    let pairs = means.into_iter().zip(covariances);
    pairs
        .map(|(mean, covariance)| Gaussian {
            mean: DVector::from_vec(mean),
            covariance: matrix(covariance),
        })
        .collect()
}

#[test]
fn mixture_densities_and_regression_equal_gmr() {
    let golden = answers("mixture");
    let logs = list(&golden["priors"]).into_iter().map(f64::ln);
    let mixture = GaussianMixture {
        components: logs.zip(gaussians(&golden)).collect(),
    };
    let log_density = mixture
        .log_density(&Seen::all(list(&golden["point"])))
        .unwrap();
    assert!((log_density - number(&golden["log_density"])).abs() < 1e-9);
    let seen = Seen {
        which: vec![1, 3],
        values: list(&golden["seen"]),
        noise: vec![0.0; 2],
    };
    let given = mixture.given(&seen).unwrap();
    let rest = [0, 2];
    for (i, expected) in rest.into_iter().zip(list(&golden["mean"])) {
        assert!((given.mean[i] - expected).abs() < 1e-9);
    }
    let covariance = given.covariance.select_rows(&rest).select_columns(&rest);
    near(&covariance, &matrix(&golden["covariance"]), 1e-9);
    // What was seen without noise is known.
    assert!((given.mean[1] - seen.values[0]).abs() < 1e-9);
    assert!(given.covariance[(1, 1)].abs() < 1e-9);
}

#[test]
fn geometric_durations_make_the_hidden_markov_model_of_hmmlearn() {
    let golden = answers("markov");
    let states = gaussians(&golden);
    let points = rows(&golden["points"]);
    let density = |state: usize, t: usize| {
        let seen = Seen::all(points[t].iter().copied());
        states[state].log_density(&seen).unwrap()
    };
    let emission = DMatrix::from_fn(states.len(), points.len(), density);
    near(&emission, &matrix(&golden["log_emission"]), 1e-9);
    // Staying d - 1 times and leaving once; the last state never leaves.
    let stay = list(&golden["stay"]);
    let duration = DMatrix::from_fn(states.len(), points.len(), |state, d| {
        let leave = if stay[state] < 1.0 {
            (1.0 - stay[state]).ln()
        } else {
            0.0
        };
        d as f64 * stay[state].ln() + leave
    });
    let cut = segments(&emission, &duration);
    assert!((cut.log_likelihood - number(&golden["log_likelihood"])).abs() < 1e-9);
    near(&cut.occupancy, &matrix(&golden["occupancy"]), 1e-9);
}

#[test]
fn any_durations_equal_the_sum_over_every_cut() {
    let golden = answers("semi_markov");
    let cut = segments(
        &matrix(&golden["log_emission"]),
        &matrix(&golden["log_duration"]),
    );
    assert!((cut.log_likelihood - number(&golden["log_likelihood"])).abs() < 1e-9);
    near(&cut.occupancy, &matrix(&golden["occupancy"]), 1e-9);
    near(&cut.lasting, &matrix(&golden["lasting"]), 1e-9);
}

#[test]
fn warped_distances_equal_dtaidistance() {
    for pair in answers("warp").as_array().unwrap() {
        let distance = time_warped(&rows(&pair["one"]), &rows(&pair["other"]));
        assert!((distance - number(&pair["distance"])).abs() < 1e-9);
    }
}

#[test]
fn rollouts_equal_movement_primitives_and_scipy() {
    let golden = answers("dmp");
    let weights = list(&golden["weights"]);
    let (start, goal) = (number(&golden["start"]), number(&golden["goal"]));
    let path = rollout(&weights, start, goal, 1000);
    let sampled = || path.iter().step_by(100);
    for (got, exact) in sampled().zip(list(&golden["exact"])) {
        assert!((got - exact).abs() < 1e-9, "{got} {exact}");
    }
    // The package takes the forcing term one step of 0.1 ms late.
    for (got, package) in sampled().zip(list(&golden["package"])) {
        assert!((got - package).abs() < 2e-4, "{got} {package}");
    }
}

//! The reference values of an independent `f64` implementation on 30 demonstrations of 12 DoFs.

use std::sync::LazyLock;

use serde_json::Value;
use tonus_shared::Real;
use tonus_shared::promp::{
    Mixture, Observation, Row, Skill, Trajectory, mixture_len, trajectory_scratch_len,
};

use super::learn::{BASIS, Demonstrations, Model, Table};

static CONVENTION: LazyLock<Value> = LazyLock::new(|| {
    let text = std::fs::read_to_string(tonus_tests::reference().join("reference.json")).unwrap();
    serde_json::from_str(&text).unwrap()
});

static DEMONSTRATIONS: LazyLock<Demonstrations> = LazyLock::new(|| {
    let names = CONVENTION["convention"]["dofs"].as_array().unwrap();
    let dofs: Vec<String> = names
        .iter()
        .map(|name| name.as_str().unwrap().into())
        .collect();
    Demonstrations::fit(&tonus_tests::reference(), &dofs)
});

fn table(name: &str) -> Table {
    Table::read(&tonus_tests::reference().join(name))
}

/// Mean and standard deviation, by DoF and phase.
type Curves = Vec<Vec<(f64, f64)>>;

fn numbers(value: &Value) -> Vec<f64> {
    value
        .as_array()
        .unwrap()
        .iter()
        .map(|v| v.as_f64().unwrap())
        .collect()
}

fn mixture<'a, T: Real>(model: &'a Model<T>, skills: &'a [Skill<'a, T>]) -> Mixture<'a, T, Vec<T>> {
    let length = mixture_len(skills.len(), BASIS, model.rank);
    Mixture::new(model.latent(), skills, vec![T::zero(); length]).unwrap()
}

fn observe<T: Real>(
    mixture: &mut Mixture<'_, T, Vec<T>>,
    dof: usize,
    phase: f64,
    value: f64,
    variance: f64,
) {
    mixture
        .observe(&Observation {
            row: Row::position(dof, T::of(phase)),
            value: T::of(value),
            variance: T::of(variance),
        })
        .unwrap();
}

/// The three positions of the hand at every one of 200 phases.
fn observe_200<T: Real>(mixture: &mut Mixture<'_, T, Vec<T>>, variance: f64) {
    let observed = table("posterior_200_observations.csv");
    let phases = observed.column("s");
    let hand = ["obs_hx", "obs_hy", "obs_hz"].map(|name| observed.column(name));
    for (i, phase) in phases.iter().enumerate() {
        for (dof, values) in hand.iter().enumerate() {
            observe(mixture, dof, *phase, values[i], variance);
        }
    }
}

/// Mean and standard deviation of every DoF at every phase of `phases`, DoF by DoF.
fn curve<T: Real>(trajectory: &Trajectory<'_, T>, phases: &[f64]) -> Curves {
    let rank = DEMONSTRATIONS.weights.nrows();
    let mut scratch = vec![T::zero(); trajectory_scratch_len(BASIS, rank)];
    (0..DEMONSTRATIONS.dofs.len())
        .map(|dof| {
            phases
                .iter()
                .map(|phase| {
                    let row = Row::position(dof, T::of(*phase));
                    let moments = trajectory.moments(&row, &mut scratch).unwrap();
                    (moments.mean.widen(), moments.variance.widen().sqrt())
                })
                .collect()
        })
        .collect()
}

/// The largest difference in mean or standard deviation, in prior standard deviations of the DoF
/// (root mean square over the movement).
fn worst_against(trajectory: &Trajectory<'_, f64>, name: &str) -> f64 {
    let (prior, expected) = (table("prior.csv"), table(name));
    let curve = curve(trajectory, &expected.column("s"));
    let mut worst: f64 = 0.0;
    for (dof, points) in DEMONSTRATIONS.dofs.iter().zip(curve) {
        let spread = prior.column(&format!("std_{dof}"));
        let scale = (spread.iter().map(|s| s * s).sum::<f64>() / spread.len() as f64).sqrt();
        let means = expected.column(&format!("mean_{dof}"));
        let stds = expected.column(&format!("std_{dof}"));
        for ((mean, std), (m, s)) in points.into_iter().zip(means.iter().zip(stds)) {
            worst = worst
                .max((mean - m).abs() / scale)
                .max((std - s).abs() / scale);
        }
    }
    println!("{name}: worst difference {worst:.2e} standard deviations");
    worst
}

fn worst_weight(trajectory: &Trajectory<'_, f64>, name: &str) -> f64 {
    let expected = table(name).column("mu");
    let mut weights = vec![0.0; expected.len()];
    trajectory.weight_mean(&mut weights).unwrap();
    let mut worst: f64 = 0.0;
    for (dof, block) in expected.chunks(BASIS).enumerate() {
        let learned = DEMONSTRATIONS.weights.columns(dof * BASIS, BASIS);
        let scale = learned.variance().sqrt();
        for (k, weight) in block.iter().enumerate() {
            worst = worst.max((weights[dof * BASIS + k] - weight).abs() / scale);
        }
    }
    println!("{name}: worst difference {worst:.2e} standard deviations");
    worst
}

#[test]
fn prior_agrees() {
    let model = Model::single(&DEMONSTRATIONS);
    let skills = model.skills();
    let prior = Trajectory::prior(model.latent(), skills[0]).unwrap();
    assert!(worst_against(&prior, "prior.csv") < 1e-7);
    assert!(worst_weight(&prior, "weight_mean.csv") < 1e-7);
}

#[test]
fn posterior_after_one_observation_agrees() {
    let model = Model::single(&DEMONSTRATIONS);
    let skills = model.skills();
    let mut mixture = mixture(&model, &skills);
    let seen = &CONVENTION["one_observation"];
    let (y, noise) = (numbers(&seen["y"]), numbers(&seen["R_diag"]));
    for (dof, (value, variance)) in y.iter().zip(noise).enumerate() {
        let phase = seen["s"].as_f64().unwrap();
        observe(&mut mixture, dof, phase, *value, variance);
    }
    let posterior = mixture.trajectory(0).unwrap();
    assert!(worst_against(&posterior, "posterior_one_observation.csv") < 1e-7);
    assert!(worst_weight(&posterior, "posterior_weight_mean_one_observation.csv") < 1e-7);
}

#[test]
fn posterior_after_200_observations_agrees() {
    let model = Model::single(&DEMONSTRATIONS);
    let skills = model.skills();
    let mut mixture = mixture(&model, &skills);
    observe_200(&mut mixture, 1e-6);
    let posterior = mixture.trajectory(0).unwrap();
    assert!(worst_against(&posterior, "posterior_200_observations.csv") < 1e-7);
}

/// The largest difference of `f32` from `f64` after 200 observations, in posterior standard deviations.
fn worst_of_f32(variance: f64) -> f64 {
    let wide = Model::single(&DEMONSTRATIONS);
    let narrow = wide.narrow();
    let (wide_skills, narrow_skills) = (wide.skills(), narrow.skills());
    let mut exact = mixture(&wide, &wide_skills);
    let mut rounded = mixture(&narrow, &narrow_skills);
    observe_200(&mut exact, variance);
    observe_200(&mut rounded, variance);
    let phases = table("prior.csv").column("s");
    let exact = curve(&exact.trajectory(0).unwrap(), &phases);
    let rounded = curve(&rounded.trajectory(0).unwrap(), &phases);
    let mut worst: f64 = 0.0;
    for (e, r) in exact.iter().flatten().zip(rounded.iter().flatten()) {
        assert!(r.0.is_finite() && r.1.is_finite() && r.1 > 0.0);
        worst = worst
            .max((r.0 - e.0).abs() / e.1)
            .max((r.1 - e.1).abs() / e.1);
    }
    println!("f32, R = {variance:e}: worst {worst:.2e} posterior standard deviations");
    worst
}

#[test]
fn f32_follows_f64_through_200_observations() {
    assert!(worst_of_f32(1e-6) < 1e-3);
}

/// Nothing turns negative or NaN (asserted inside), and the answer is still right.
#[test]
fn f32_stands_a_tenth_of_a_millimetre() {
    assert!(worst_of_f32(1e-8) < 1e-2);
}

/// What a mixture says after the observations of one case.
struct Answer {
    log_joint: Vec<f64>,
    log_posterior: Vec<f64>,
    most_likely: usize,
    /// Of the most likely skill.
    curves: Curves,
}

fn recognise<T: Real>(model: &Model<T>, key: &str) -> Answer {
    let skills = model.skills();
    let mut mixture = mixture(model, &skills);
    let seen = &CONVENTION[key];
    let noise = numbers(&seen["R_diag"]);
    let rows = seen["y"].as_array().unwrap();
    for (phase, values) in numbers(&seen["s"]).iter().zip(rows) {
        for (dof, value) in numbers(values).iter().enumerate() {
            observe(&mut mixture, dof, *phase, *value, noise[dof]);
        }
    }
    let mut posterior = vec![T::zero(); skills.len()];
    mixture.log_posterior(&mut posterior).unwrap();
    let joint = |q| mixture.log_joint(q).unwrap().widen();
    let most_likely = mixture.most_likely();
    let best = mixture.trajectory(most_likely).unwrap();
    Answer {
        log_joint: (0..skills.len()).map(joint).collect(),
        log_posterior: posterior.iter().map(|p| p.widen()).collect(),
        most_likely,
        curves: curve(&best, &table("prior.csv").column("s")),
    }
}

#[test]
fn mixture_agrees() {
    let model = Model::classes(&DEMONSTRATIONS, 3);
    for key in ["mixture_pos3", "mixture_pos3stiff3"] {
        let seen = &CONVENTION[key];
        let answer = recognise(&model, key);
        let pairs = [
            (
                answer.log_joint,
                numbers(&seen["log_prior_plus_joint_loglik"]),
            ),
            (answer.log_posterior, numbers(&seen["log_posterior"])),
        ];
        for (got, expected) in pairs {
            for (g, e) in got.iter().zip(&expected) {
                println!("{key}: {g} against {e}: {:.2e}", (g - e).abs());
                assert!((g - e).abs() <= 1e-7 * e.abs().max(1.0), "{g} {e}");
            }
        }
        assert_eq!(answer.most_likely as u64, seen["argmax"].as_u64().unwrap());
    }
}

#[test]
fn trajectory_of_the_recognised_skill_agrees() {
    let model = Model::classes(&DEMONSTRATIONS, 3);
    for key in ["mixture_pos3", "mixture_pos3stiff3"] {
        let expected = table(&format!("{key}_posterior.csv"));
        let prior = table("prior.csv");
        let curve = recognise(&model, key).curves;
        for (dof, points) in DEMONSTRATIONS.dofs.iter().zip(curve) {
            let spread = prior.column(&format!("std_{dof}"));
            let means = expected.column(&format!("mean_{dof}"));
            let stds = expected.column(&format!("std_{dof}"));
            for (i, (mean, std)) in points.into_iter().enumerate() {
                assert!(
                    (mean - means[i]).abs() < 1e-7 * spread[i],
                    "{key} {dof} {i}"
                );
                assert!((std - stds[i]).abs() < 1e-7 * spread[i], "{key} {dof} {i}");
            }
        }
    }
}

#[test]
fn mixture_in_f32_gives_the_same_answer() {
    let narrow = Model::classes(&DEMONSTRATIONS, 3).narrow();
    for key in ["mixture_pos3", "mixture_pos3stiff3"] {
        let answer = recognise(&narrow, key);
        let expected = numbers(&CONVENTION[key]["log_prior_plus_joint_loglik"]);
        for (g, e) in answer.log_joint.iter().zip(&expected) {
            println!("{key} in f32: {g} against {e}");
            assert!((g - e).abs() < 1e-3 * e.abs().max(1.0), "{g} {e}");
        }
        assert_eq!(
            answer.most_likely as u64,
            CONVENTION[key]["argmax"].as_u64().unwrap()
        );
    }
}

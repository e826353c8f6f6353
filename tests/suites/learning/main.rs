//! The learner against the reference values, and against dense formulas that relearn from scratch.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "test suite"
)]

mod intervals;
mod relearned;

use serde_json::Value;
use tonus::demonstration::Demonstration;
use tonus::model::{Dof, Hyperparameters, LearnError, Model, Parts, Predictive, Shrinkage, learn};
use tonus::table::Table;
use tonus_shared::promp::{Basis, Observation, Row, Trajectory, trajectory_scratch_len};

fn convention() -> Value {
    let text = std::fs::read_to_string(tonus_tests::reference().join("reference.json")).unwrap();
    serde_json::from_str(&text).unwrap()
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().unwrap().iter();
    list.map(|v| v.as_f64().unwrap()).collect()
}

/// The 30 reference demonstrations of these DoFs, labelled by class or all alike.
fn reference(dofs: &[&str], one_label: bool) -> Vec<Demonstration> {
    let all = tonus_tests::demos(dofs);
    if one_label {
        all.iter().map(|one| one.with_label("all")).collect()
    } else {
        all
    }
}

fn plain(dofs: &[&str], functions: usize) -> Hyperparameters {
    let dofs = dofs.iter().map(|&name| Dof::position(name)).collect();
    Hyperparameters {
        predictive: Predictive::PlugIn,
        ..Hyperparameters::new(dofs, Basis::gaussian(functions).unwrap())
    }
}

/// Learns as the reference did, and leaves out what it leaves out: shrinkage and residual variance.
fn as_reference(demonstrations: &[Demonstration], dofs: &[&str]) -> Model {
    let given = Hyperparameters {
        ridge: 1e-8,
        shrinkage: Shrinkage::Fixed {
            pooled: 0.0,
            diagonal: 0.0,
        },
        ..plain(dofs, 30)
    };
    let model = learn(demonstrations, &given.check().unwrap()).unwrap();
    let parts = Parts {
        residual_variance: vec![0.0; dofs.len()],
        ..model.parts().clone()
    };
    Model::assemble(parts).unwrap()
}

#[test]
fn prior_and_posterior_are_the_references() {
    let convention = convention();
    let names = convention["convention"]["dofs"].as_array().unwrap();
    let dofs: Vec<_> = names.iter().map(|n| n.as_str().unwrap()).collect();
    let model = as_reference(&reference(&dofs, true), &dofs);
    assert_eq!(model.parts().rank, 29);
    let view = model.view().unwrap();
    let mut mixture = view.mixture().unwrap();
    let prior = Trajectory::prior(view.latent, view.skills[0]).unwrap();
    agrees(&prior, &dofs, "prior.csv");
    let one = &convention["one_observation"];
    let phase = one["s"].as_f64().unwrap();
    let values = numbers(&one["y"]).into_iter().zip(numbers(&one["R_diag"]));
    for (dof, (value, variance)) in numbers(&one["dofs"]).into_iter().zip(values) {
        let row = Row::position(dof as usize, phase);
        let observation = Observation {
            row,
            value,
            variance,
        };
        mixture.observe(&observation).unwrap();
    }
    let posterior = mixture.trajectory(0).unwrap();
    agrees(&posterior, &dofs, "posterior_one_observation.csv");
}

/// Mean and standard deviation within 1e-7 of each DoF's largest standard deviation in the reference prior.
fn agrees(trajectory: &Trajectory<'_, f64>, dofs: &[&str], file: &str) {
    let expected = Table::open(&tonus_tests::reference().join(file)).unwrap();
    let prior = Table::open(&tonus_tests::reference().join("prior.csv")).unwrap();
    let phases = expected.numbers("s").unwrap();
    let mut scratch = vec![0.0; trajectory_scratch_len(30, 64)];
    for (index, dof) in dofs.iter().enumerate() {
        let spread = prior.numbers(&format!("std_{dof}")).unwrap();
        let unit = spread.into_iter().fold(0.0, f64::max);
        let means = expected.numbers(&format!("mean_{dof}")).unwrap();
        let stds = expected.numbers(&format!("std_{dof}")).unwrap();
        for ((&phase, mean), std) in phases.iter().zip(means).zip(stds) {
            let moments = trajectory
                .moments(&Row::position(index, phase), &mut scratch)
                .unwrap();
            let off = (moments.mean - mean).abs() + (moments.variance.sqrt() - std).abs();
            assert!(off < 1e-7 * unit, "{file} {dof} at {phase}: off by {off}");
        }
    }
}

#[test]
fn recognition_is_the_references() {
    let convention = convention();
    let names = convention["convention"]["dofs"].as_array().unwrap();
    let dofs: Vec<_> = names.iter().map(|n| n.as_str().unwrap()).collect();
    let model = as_reference(&reference(&dofs, false), &dofs);
    assert_eq!(model.parts().rank, 27);
    let view = model.view().unwrap();
    for case in ["mixture_pos3", "mixture_pos3stiff3"] {
        let expected = &convention[case];
        let mut mixture = view.mixture().unwrap();
        let observed = numbers(&expected["dofs"])
            .into_iter()
            .zip(numbers(&expected["R_diag"]));
        let observed: Vec<_> = observed.collect();
        let rows = expected["y"].as_array().unwrap().iter();
        for (phase, row) in numbers(&expected["s"]).into_iter().zip(rows) {
            for (&(dof, variance), value) in observed.iter().zip(numbers(row)) {
                let row = Row::position(dof as usize, phase);
                let observation = Observation {
                    row,
                    value,
                    variance,
                };
                mixture.observe(&observation).unwrap();
            }
        }
        let joints = numbers(&expected["log_prior_plus_joint_loglik"]);
        for (skill, joint) in joints.into_iter().enumerate() {
            let got = mixture.log_joint(skill).unwrap();
            let off = (got - joint).abs() / joint.abs();
            assert!(off < 1e-7, "{case} {skill}: {got} for {joint}");
        }
    }
}

#[test]
fn a_placement_adds_a_constant_offset_to_positions_alone() {
    let names = ["hx", "hy", "Khx"];
    let demonstrations = reference(&names, false);
    for basis in [Basis::gaussian(15), Basis::bernstein(9), Basis::fourier(11)] {
        let mut dofs = names.map(Dof::position).to_vec();
        dofs[2] = Dof::stiffness("Khx");
        let fixed = Shrinkage::Fixed {
            pooled: 0.4,
            diagonal: 0.2,
        };
        let given = Hyperparameters {
            shrinkage: fixed,
            predictive: Predictive::PlugIn,
            ..Hyperparameters::new(dofs, basis.unwrap())
        };
        let placed = Hyperparameters {
            placement_m: 0.1,
            ..given.clone()
        };
        let without = learn(&demonstrations, &given.check().unwrap()).unwrap();
        let with = learn(&demonstrations, &placed.check().unwrap()).unwrap();
        for skill in 0..3 {
            for (one, other) in [
                ((0, 0.0), (0, 0.7)),
                ((1, 0.3), (1, 0.3)),
                ((0, 0.5), (1, 0.5)),
                ((2, 0.2), (2, 0.9)),
            ] {
                let added =
                    covariance(&with, skill, one, other) - covariance(&without, skill, one, other);
                let expected = if one.0 == other.0 && one.0 < 2 {
                    0.01
                } else {
                    0.0
                };
                assert!(
                    (added - expected).abs() < 1e-6,
                    "{one:?} {other:?}: {added}"
                );
            }
        }
    }
}

fn covariance(model: &Model, skill: usize, one: (usize, f64), other: (usize, f64)) -> f64 {
    let view = model.view().unwrap();
    let prior = Trajectory::prior(view.latent, view.skills[skill]).unwrap();
    let mut scratch =
        vec![0.0; trajectory_scratch_len(view.latent.basis().count(), view.latent.rank())];
    let row = |(dof, phase)| Row::position(dof, phase);
    prior
        .covariance(&row(one), &row(other), &mut scratch)
        .unwrap()
}

#[test]
fn a_logarithm_keeps_stiffness_positive_and_is_undone_on_the_way_out() {
    let demonstrations = reference(&["hx", "Khx"], false);
    let dofs = vec![Dof::position("hx"), Dof::stiffness("Khx")];
    let given = Hyperparameters::new(dofs, Basis::gaussian(12).unwrap());
    let model = learn(&demonstrations, &given.check().unwrap()).unwrap();
    let dof = &model.dofs()[1];
    let observation = model.observation(1, 0.5, 200.0, 10.0).unwrap().unwrap();
    assert!((observation.value - 200.0_f64.ln()).abs() < 1e-15);
    assert!((observation.variance - 0.0025).abs() < 1e-15);
    // Mean and standard deviation of a log-normal, from SciPy: lognorm(s=0.3, scale=exp(5)).
    let (mean, std) = dof.decode(5.0, 0.09);
    assert!((mean - 155.244_299_198).abs() < 1e-6, "{mean}");
    assert!((std - 47.641_104_775).abs() < 1e-6, "{std}");
    assert!(dof.decode(-800.0, 1.0).0 >= 0.0);
    assert!(model.observation(1, 0.5, 0.0, 10.0).unwrap().is_err());
    assert!(model.observation(2, 0.5, 1.0, 1.0).is_none());
}

#[test]
fn demonstrations_that_teach_nothing_are_refused_by_name() {
    let demo = |label: &str, x: &[f64]| {
        let t_s = (0..x.len()).map(|i| i as f64).collect();
        Demonstration::new(label, "1", "a.csv", t_s, vec![x.to_vec()]).unwrap()
    };
    let refused = |demos: &[Demonstration], dof: Dof| {
        let basis = Basis::gaussian(4).unwrap();
        let valid = Hyperparameters::new(vec![dof], basis).check().unwrap();
        learn(demos, &valid).unwrap_err()
    };
    let (a, b) = (demo("a", &[0.0, 1.0, 2.0]), demo("b", &[0.0, 2.0, 2.0]));
    let position = || Dof::position("x");
    assert!(matches!(refused(&[], position()), LearnError::None));
    let text = refused(&[a.clone(), a.clone(), b.clone()], position()).to_string();
    assert!(
        text.starts_with("skill `b` has 1 demonstration(s) and needs at least 2"),
        "{text}"
    );
    let text = refused(&[a.clone(), demo("a", &[1.0, 0.0])], position()).to_string();
    assert!(
        text.starts_with("skill `a` has 2 demonstration(s) and needs at least 3"),
        "{text}"
    );
    let twins = [a.clone(), a.clone(), b.clone(), b.clone()];
    assert!(matches!(refused(&twins, position()), LearnError::Identical));
    let still = demo("a", &[3.0, 3.0]);
    let still = [still.clone(), still.clone(), still];
    assert!(matches!(
        refused(&still, position()),
        LearnError::Constant { value: 3.0, .. }
    ));
    let text = refused(&twins, Dof::stiffness("k")).to_string();
    assert_eq!(
        text,
        "a.csv: `a` at 0 s: `k` is 0.0, and it enters the model as a logarithm: it must be positive"
    );
    let huge = [
        demo("a", &[-1e308, 1e308]),
        demo("a", &[1.0, 2.0]),
        demo("a", &[1.0, 3.0]),
    ];
    assert!(matches!(
        refused(&huge, position()),
        LearnError::TooLarge { .. }
    ));
    let wide =
        Demonstration::new("a", "1", "a.csv", vec![0.0, 1.0], vec![vec![0.0, 1.0]; 2]).unwrap();
    assert!(matches!(
        refused(&[wide], position()),
        LearnError::Dofs {
            expected: 1,
            got: 2,
            ..
        }
    ));
}

#[test]
fn fewer_samples_than_functions_are_learnt_from() {
    let line = |slope: f64| {
        let t_s: Vec<f64> = (0..5).map(|i| f64::from(i) * 0.25).collect();
        let x = t_s.iter().map(|t| slope * t).collect();
        Demonstration::new("a", "1", "a.csv", t_s, vec![x]).unwrap()
    };
    let demos: Vec<_> = [1.0, 1.1, 0.9, 1.05].map(line).to_vec();
    let given = plain(&["x"], 20);
    let model = learn(&demos, &given.check().unwrap()).unwrap();
    let view = model.view().unwrap();
    let prior = Trajectory::prior(view.latent, view.skills[0]).unwrap();
    let mut scratch = vec![0.0; trajectory_scratch_len(20, view.latent.rank())];
    for phase in [0.0, 0.25, 0.5, 0.75, 1.0] {
        let moments = prior
            .moments(&Row::position(0, phase), &mut scratch)
            .unwrap();
        assert!(
            (moments.mean - 1.0125 * phase).abs() < 0.01,
            "{phase}: {}",
            moments.mean
        );
    }
}

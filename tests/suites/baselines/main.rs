//! The methods that the mixture of ProMPs is held against: their parts against Python packages
//! (`golden/baselines.py`), what each can and cannot do as properties, and all of them on the experiments' data.
#![allow(missing_docs, reason = "test suite")]

mod packages;
mod properties;
mod table;

use std::f64::consts::PI;
use tonus::baseline::Observed;
use tonus::demonstration::Demonstration;
use tonus::model::{Dof, Hyperparameters, Shrinkage, Valid};
use tonus_shared::promp::Basis;

/// A position, a stiffness.
fn dofs() -> Vec<Dof> {
    vec![Dof::position("x"), Dof::stiffness("k")]
}

fn valid(functions: usize) -> Valid {
    let hyperparameters = Hyperparameters {
        shrinkage: Shrinkage::LeaveOneOut,
        ..Hyperparameters::new(dofs(), Basis::gaussian(functions).unwrap())
    };
    hyperparameters.check().unwrap()
}

/// A movement of 2 s: `x` rises to `reach` in a smooth step and bows by `bow`; `k` is `firm` times a rising curve.
fn movement(label: &str, reach: f64, bow: f64, firm: f64) -> Demonstration {
    let t_s: Vec<f64> = (0..101).map(|k| f64::from(k) * 0.02).collect();
    let phase = |t: &f64| t / 2.0;
    let x = t_s.iter().map(|t| {
        let s = phase(t);
        reach * s * s * (3.0 - 2.0 * s) + bow * (PI * s).sin()
    });
    let k = t_s.iter().map(|t| firm * (300.0 + 200.0 * phase(t)));
    let values = vec![x.collect(), k.collect()];
    Demonstration::new(label, "", "", t_s, values).unwrap()
}

/// Nine movements: three reaches, three bows, `firm` varied by a few percent.
fn movements(label: &str, reach: f64, firm: f64) -> Vec<Demonstration> {
    let spread = [-0.03, 0.0, 0.03];
    let pairs = spread.iter().flat_map(|a| spread.map(|b| (*a, b)));
    pairs
        .map(|(a, b)| movement(label, reach + a, b, firm * (1.0 + a + 0.4 * b)))
        .collect()
}

/// `movement` as seen at these phases.
fn seen(movement: &Demonstration, dofs: &[usize], phases: &[f64], std: f64) -> Observed {
    let of_dof = |dof: &usize| -> Vec<f64> {
        phases
            .iter()
            .map(|phase| movement.value_at(*dof, *phase).unwrap())
            .collect()
    };
    let values: Vec<Vec<f64>> = dofs.iter().map(of_dof).collect();
    let told = |series: &Vec<f64>| series.iter().map(|v| std * v.abs().max(0.2)).collect();
    Observed {
        dofs: dofs.to_vec(),
        phases: phases.to_vec(),
        std: values.iter().map(told).collect(),
        values,
    }
}

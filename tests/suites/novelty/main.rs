//! The novelty gate on real movements: each class is left out of the library in turn.
#![allow(missing_docs, reason = "test suite")]

mod kernel;
mod learnt;
mod throughout;

use std::collections::BTreeSet;

use tonus::demonstration::Demonstration;
use tonus::model::novelty::{GateConfig, HeldOut};
use tonus::model::{Dof, Hyperparameters, Valid};
use tonus_shared::promp::Basis;
use tonus_tests::motion;

fn valid(dofs: &[&str]) -> Valid {
    let dofs = dofs.iter().copied().map(Dof::position).collect();
    let given = Hyperparameters::new(dofs, Basis::gaussian(10).unwrap());
    given.check().unwrap()
}

/// Every movement is judged: once as novel, and once for each other class that is left out.
fn each_class_left_out(all: &[Demonstration], valid: &Valid, folds: usize) -> HeldOut {
    let classes: BTreeSet<&str> = all.iter().map(Demonstration::class).collect();
    let config = GateConfig::of(valid.get().dofs.len());
    let said = HeldOut::each_class(all, valid, &config, folds).unwrap();
    assert_eq!(said.novel.len(), all.len());
    assert_eq!(said.known.len(), all.len() * (classes.len() - 1));
    said
}

fn report(name: &str, said: &HeldOut) {
    println!(
        "{name}: {} of {} named unknown ({:.3}), {} of {} false alarms ({:.4}), AUROC {:.4}; at exactly 2 % false alarms {}",
        said.named_unknown(),
        said.novel.len(),
        said.named_unknown() as f64 / said.novel.len() as f64,
        said.false_alarms(),
        said.known.len(),
        said.false_alarms() as f64 / said.known.len() as f64,
        said.auroc(),
        said.named_unknown_at(0.02),
    );
}

#[test]
fn pick_and_place() {
    let all = motion::pick_and_place();
    let valid = valid(&["x", "y", "z"]);
    let said = each_class_left_out(&all, &valid, 15);
    report("pick and place", &said);
    // A plain Mahalanobis gate: 84 % at 2 % false alarms, area 0.989.
    assert!(said.named_unknown_at(0.02) * 10 >= said.novel.len() * 9);
    assert!(said.named_unknown() >= 79 && said.false_alarms() <= 10);
    assert!(said.auroc() >= 0.99);
}

#[test]
fn digits() {
    let all = motion::digits();
    let valid = valid(&["x", "y", "z"]);
    let said = each_class_left_out(&all, &valid, 3);
    report("digits", &said);
    assert!(said.auroc() >= 0.94 && said.false_alarms() * 50 <= said.known.len());
}

#[test]
fn reach_to_grasp() {
    let all = motion::reach_to_grasp();
    let valid = valid(&["x", "y", "z", "aperture"]);
    let said = each_class_left_out(&all, &valid, 11);
    report("reach to grasp", &said);
}

//! The novelty gate on real movements: each class is left out of the library in turn.
#![allow(missing_docs, reason = "test suite")]

mod kernel;
mod learnt;
mod throughout;

use std::collections::BTreeSet;

use tonus::demonstration::Demonstration;
use tonus::model::novelty::{Gate, GateConfig};
use tonus::model::{Dof, Hyperparameters, Valid};
use tonus_shared::promp::Basis;
use tonus_tests::motion;

fn valid(dofs: &[&str]) -> Valid {
    let dofs = dofs.iter().copied().map(Dof::position).collect();
    let given = Hyperparameters::new(dofs, Basis::gaussian(10).unwrap());
    given.check().unwrap()
}

/// What gates said of movements that they had not learnt from: score over threshold.
#[derive(Default)]
struct Said {
    known: Vec<f64>,
    novel: Vec<f64>,
    nearest: Vec<(String, String)>,
}

impl Said {
    fn false_alarms(&self) -> usize {
        self.known.iter().filter(|ratio| **ratio > 1.0).count()
    }

    fn detected(&self) -> usize {
        self.novel.iter().filter(|ratio| **ratio > 1.0).count()
    }

    /// Novel ones above a threshold that this share of the known exceed at most, whatever threshold was learnt.
    fn detected_at(&self, false_alarm_rate: f64) -> usize {
        let mut known = self.known.clone();
        known.sort_by(|a, b| b.total_cmp(a));
        let threshold = known[(false_alarm_rate * known.len() as f64) as usize];
        self.novel
            .iter()
            .filter(|ratio| **ratio > threshold)
            .count()
    }

    /// Probability that a novel movement scores above a known one.
    fn auroc(&self) -> f64 {
        let wins = self.novel.iter().flat_map(|novel| {
            let against = self.known.iter();
            against.map(move |known| match novel.total_cmp(known) {
                std::cmp::Ordering::Greater => 1.0,
                std::cmp::Ordering::Equal => 0.5,
                std::cmp::Ordering::Less => 0.0,
            })
        });
        wins.sum::<f64>() / (self.novel.len() * self.known.len()) as f64
    }
}

/// Each class left out in turn. The library's own movements are held out by trial, in `folds`; everything of
/// the gate is chosen and fixed on what is left.
fn each_class_left_out(
    all: &[Demonstration],
    valid: &Valid,
    config: &GateConfig,
    folds: usize,
) -> Said {
    let classes: BTreeSet<&str> = all.iter().map(Demonstration::class).collect();
    let trials: BTreeSet<&str> = all.iter().map(Demonstration::trial).collect();
    let fold = |d: &Demonstration| trials.iter().position(|t| *t == d.trial()).unwrap() % folds;
    let mut said = Said::default();
    for class in classes {
        let (novel, library): (Vec<_>, Vec<_>) =
            all.iter().cloned().partition(|d| d.class() == class);
        let gate = Gate::learn(&library, valid, config).unwrap();
        for movement in &novel {
            let novelty = gate.judge(movement, config.fraction).unwrap().unwrap();
            said.novel.push(novelty.score / novelty.threshold);
            said.nearest
                .push((class.to_owned(), gate.classes()[novelty.nearest].clone()));
        }
        for left_out in 0..folds {
            let (held, rest): (Vec<_>, Vec<_>) =
                library.iter().cloned().partition(|d| fold(d) == left_out);
            let gate = Gate::learn(&rest, valid, config).unwrap();
            for movement in &held {
                let novelty = gate.judge(movement, config.fraction).unwrap().unwrap();
                said.known.push(novelty.score / novelty.threshold);
            }
        }
    }
    said
}

fn report(name: &str, said: &Said) {
    println!(
        "{name}: {} of {} named unknown ({:.3}), {} of {} false alarms ({:.4}), AUROC {:.4}; at exactly 2 % false alarms {}",
        said.detected(),
        said.novel.len(),
        said.detected() as f64 / said.novel.len() as f64,
        said.false_alarms(),
        said.known.len(),
        said.false_alarms() as f64 / said.known.len() as f64,
        said.auroc(),
        said.detected_at(0.02),
    );
}

#[test]
fn pick_and_place() {
    let all = motion::pick_and_place();
    let valid = valid(&["x", "y", "z"]);
    let said = each_class_left_out(&all, &valid, &GateConfig::of(3), 15);
    report("pick and place", &said);
    // A plain Mahalanobis gate: 84 % at 2 % false alarms, area 0.989.
    assert!(said.detected_at(0.02) * 10 >= said.novel.len() * 9);
    assert!(said.detected() >= 79 && said.false_alarms() <= 10);
    assert!(said.auroc() >= 0.99);
}

#[test]
fn digits() {
    let all = motion::digits();
    let valid = valid(&["x", "y", "z"]);
    let said = each_class_left_out(&all, &valid, &GateConfig::of(3), 3);
    report("digits", &said);
    assert!(said.auroc() >= 0.94 && said.false_alarms() * 50 <= said.known.len());
}

#[test]
fn reach_to_grasp() {
    let all = motion::reach_to_grasp();
    let valid = valid(&["x", "y", "z", "aperture"]);
    let said = each_class_left_out(&all, &valid, &GateConfig::of(4), 11);
    report("reach to grasp", &said);
}

//! How well a gate keeps apart what it knows and what it does not, on movements that it had not learnt from.

use std::collections::BTreeSet;

use rayon::prelude::*;

use super::{Gate, GateConfig, GateError};
use crate::demonstration::Demonstration;
use crate::model::Valid;

/// What gates said of movements that they had not learnt from: scores over their thresholds, unknown above 1.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct HeldOut {
    /// Of movements whose class was in the library.
    pub known: Vec<f64>,
    /// Of movements whose class was not.
    pub novel: Vec<f64>,
    /// Of the latter: their class, and the one that they are nearest to.
    pub nearest: Vec<(String, String)>,
}

/// A gate's library lacks `class`. It judges the trials of a fold that were held out, or the class itself.
struct Task<'a> {
    class: &'a str,
    fold: Option<usize>,
}

impl HeldOut {
    /// Each class left out of the library in turn. The library's own movements are held out by trial, dealt into `folds`;
    /// everything of a gate is fixed on what is left. Movements too short to be judged are passed over.
    ///
    /// # Errors
    /// What [`Gate::learn`] and [`Gate::judge`] refuse.
    pub fn each_class(
        all: &[Demonstration],
        valid: &Valid,
        config: &GateConfig,
        folds: usize,
    ) -> Result<Self, GateError> {
        let classes: BTreeSet<&str> = all.iter().map(Demonstration::class).collect();
        let trials: BTreeSet<&str> = all.iter().map(Demonstration::trial).collect();
        let place = |d: &Demonstration| trials.iter().position(|t| *t == d.trial()).unwrap_or(0);
        let tasks = classes.into_iter().flat_map(|class| {
            let of_fold = (0..folds).map(Some).chain([None]);
            of_fold.map(move |fold| Task { class, fold })
        });
        let tasks: Vec<Task<'_>> = tasks.collect();
        let one = |task: &Task<'_>| -> Result<Self, GateError> {
            let library = all.iter().filter(|d| d.class() != task.class);
            let out = |d: &Demonstration| task.fold.is_some_and(|fold| place(d) % folds == fold);
            let learned: Vec<_> = library.clone().filter(|d| !out(d)).cloned().collect();
            let judged: Vec<&Demonstration> = match task.fold {
                Some(_) => library.filter(|d| out(d)).collect(),
                None => all.iter().filter(|d| d.class() == task.class).collect(),
            };
            let gate = Gate::learn(&learned, valid, config)?;
            Self::judged(&gate, config, &judged, task.fold.is_none())
        };
        let mut found = Self::default();
        for more in tasks.par_iter().map(one).collect::<Result<Vec<_>, _>>()? {
            found.known.extend(more.known);
            found.novel.extend(more.novel);
            found.nearest.extend(more.nearest);
        }
        Ok(found)
    }

    fn judged(
        gate: &Gate,
        config: &GateConfig,
        movements: &[&Demonstration],
        novel: bool,
    ) -> Result<Self, GateError> {
        let mut found = Self::default();
        for movement in movements {
            let Some(novelty) = gate.judge(movement, config.fraction)? else {
                continue;
            };
            let ratio = novelty.score / novelty.threshold;
            if novel {
                let nearest = gate.classes()[novelty.nearest].clone();
                found.novel.push(ratio);
                found.nearest.push((movement.class().to_owned(), nearest));
            } else {
                found.known.push(ratio);
            }
        }
        Ok(found)
    }

    /// Known ones named unknown.
    #[must_use]
    pub fn false_alarms(&self) -> usize {
        above(&self.known, 1.0)
    }

    /// Novel ones named unknown.
    #[must_use]
    pub fn named_unknown(&self) -> usize {
        above(&self.novel, 1.0)
    }

    /// Novel ones above the threshold that this share of the known exceeds at most, whatever was learnt.
    #[must_use]
    pub fn named_unknown_at(&self, false_alarm_rate: f64) -> usize {
        let mut known = self.known.clone();
        known.sort_by(|one, other| other.total_cmp(one));
        let allowed = (false_alarm_rate * known.len() as f64) as usize;
        let threshold = known.get(allowed).copied();
        above(&self.novel, threshold.unwrap_or(f64::NEG_INFINITY))
    }

    /// Probability that a novel movement scores above a known one (area under the receiver's curve); 0 of none.
    #[must_use]
    pub fn auroc(&self) -> f64 {
        let wins = self.novel.iter().flat_map(|novel| {
            let against = self.known.iter();
            against.map(move |known| match novel.total_cmp(known) {
                std::cmp::Ordering::Greater => 1.0,
                std::cmp::Ordering::Equal => 0.5,
                std::cmp::Ordering::Less => 0.0,
            })
        });
        wins.sum::<f64>() / (self.novel.len() * self.known.len()).max(1) as f64
    }
}

fn above(ratios: &[f64], threshold: f64) -> usize {
    ratios.iter().filter(|ratio| **ratio > threshold).count()
}

#[cfg(test)]
mod tests {
    use super::HeldOut;

    #[test]
    fn counts_and_area_are_the_closed_forms() {
        let held_out = HeldOut {
            known: vec![0.8, 1.0, 1.2, 0.2],
            novel: vec![0.5, 1.0, 3.0],
            nearest: Vec::new(),
        };
        assert_eq!(held_out.false_alarms(), 1);
        assert_eq!(held_out.named_unknown(), 1);
        // 0.5 is above 0.2 alone; 1.0 above 0.8 and 0.2 and ties with 1.0; 3.0 above all four.
        assert!((held_out.auroc() - (1.0 + 2.5 + 4.0) / 12.0).abs() < 1e-12);
        // One of four may exceed it: the threshold is 1.0. Three may: 0.2.
        assert_eq!(held_out.named_unknown_at(0.25), 1);
        assert_eq!(held_out.named_unknown_at(0.75), 3);
        assert_eq!(HeldOut::default().auroc(), 0.0);
    }
}

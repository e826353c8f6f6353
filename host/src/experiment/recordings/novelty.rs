//! Each class left out of the library in turn: is it named unknown, and what is it nearest to?

use std::collections::{BTreeMap, BTreeSet};

use rayon::prelude::*;
use serde::Serialize;
use tonus_shared::promp::Basis;

use super::data::Set;
use crate::demonstration::Demonstration;
use crate::experiment::ExperimentError;
use crate::model::novelty::{Gate, GateConfig};
use crate::model::{Dof, Hyperparameters, Valid};

/// Basis functions; a gate does not look at them.
const FUNCTIONS: usize = 10;

/// A gate on one recording. Movements of the library are held out by trial, those of the class left out were never
/// in it; everything of the gate is fixed on what it was learnt from.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Novelty {
    /// The recording's folder.
    pub name: String,
    /// Movements of classes left out.
    pub novel: usize,
    /// Of them, named unknown.
    pub named_unknown: usize,
    /// Share of them.
    pub named_unknown_share: f64,
    /// Movements of the library judged.
    pub known: usize,
    /// Of them, named unknown.
    pub false_alarms: usize,
    /// Share of them; 2 % were asked for.
    pub false_alarm_share: f64,
    /// Probability that a movement of a class left out scores above one of the library.
    pub auroc: f64,
    /// For each class left out, the skill that most of its movements are nearest to: the substitute.
    pub nearest: Vec<Nearest>,
}

/// The skill to do instead.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Nearest {
    /// The class left out.
    pub class: String,
    /// The skill that most are nearest to.
    pub nearest: String,
    /// How many of them.
    pub movements: usize,
    /// Of so many.
    pub total: usize,
}

/// Scores over their thresholds.
#[derive(Default)]
struct Said {
    known: Vec<f64>,
    novel: Vec<f64>,
    nearest: Vec<(String, String)>,
}

/// One gate's library and what it judges; `class` is the one left out where it is judged.
struct Judged<'a> {
    class: &'a str,
    fold: Option<usize>,
}

pub(super) fn each_class_left_out(set: &Set) -> Result<Novelty, ExperimentError> {
    let all = set.demonstrations();
    let folds = set.plan.novelty_folds;
    let trials: BTreeSet<&str> = all.iter().map(Demonstration::trial).collect();
    let place = |d: &Demonstration| trials.iter().position(|t| *t == d.trial()).unwrap_or(0);
    let dofs = set.plan.dofs.iter().copied().map(Dof::position).collect();
    let valid = Hyperparameters::new(dofs, Basis::gaussian(FUNCTIONS)?).check()?;
    let judged: Vec<Judged<'_>> = (set.classes().into_iter())
        .flat_map(|class| {
            let of_fold = (0..folds).map(Some).chain([None]);
            of_fold.map(move |fold| Judged { class, fold })
        })
        .collect();
    let one = |judged: &Judged<'_>| -> Result<Said, ExperimentError> {
        let library = all.iter().filter(|d| d.class() != judged.class);
        let out = |d: &Demonstration| judged.fold.is_some_and(|fold| place(d) % folds == fold);
        let learned: Vec<_> = library.clone().filter(|d| !out(d)).cloned().collect();
        let tested: Vec<&Demonstration> = match judged.fold {
            Some(_) => library.filter(|d| out(d)).collect(),
            None => all.iter().filter(|d| d.class() == judged.class).collect(),
        };
        judge(&learned, &tested, &valid, judged.fold.is_none())
    };
    let mut said = Said::default();
    for more in judged.par_iter().map(one).collect::<Result<Vec<_>, _>>()? {
        said.known.extend(more.known);
        said.novel.extend(more.novel);
        said.nearest.extend(more.nearest);
    }
    Ok(said.found(set.plan.name))
}

fn judge(
    learned: &[Demonstration],
    tested: &[&Demonstration],
    valid: &Valid,
    novel: bool,
) -> Result<Said, ExperimentError> {
    let config = GateConfig::of(valid.get().dofs.len());
    let gate = Gate::learn(learned, valid, &config)?;
    let mut said = Said::default();
    for movement in tested {
        let Some(novelty) = gate.judge(movement, config.fraction)? else {
            continue;
        };
        let ratio = novelty.score / novelty.threshold;
        if novel {
            said.novel.push(ratio);
            let nearest = gate.classes()[novelty.nearest].clone();
            said.nearest.push((movement.class().to_owned(), nearest));
        } else {
            said.known.push(ratio);
        }
    }
    Ok(said)
}

impl Said {
    fn found(&self, name: &str) -> Novelty {
        let above = |ratios: &[f64]| ratios.iter().filter(|ratio| **ratio > 1.0).count();
        let share = |count: usize, of: usize| count as f64 / of.max(1) as f64;
        let (named_unknown, false_alarms) = (above(&self.novel), above(&self.known));
        Novelty {
            name: name.to_owned(),
            novel: self.novel.len(),
            named_unknown,
            named_unknown_share: share(named_unknown, self.novel.len()),
            known: self.known.len(),
            false_alarms,
            false_alarm_share: share(false_alarms, self.known.len()),
            auroc: self.auroc(),
            nearest: self.nearest(),
        }
    }

    fn auroc(&self) -> f64 {
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

    fn nearest(&self) -> Vec<Nearest> {
        let mut of_class: BTreeMap<&str, BTreeMap<&str, usize>> = BTreeMap::new();
        for (class, nearest) in &self.nearest {
            *of_class
                .entry(class)
                .or_default()
                .entry(nearest)
                .or_default() += 1;
        }
        let most = of_class.into_iter().filter_map(|(class, counts)| {
            let total = counts.values().sum();
            let (nearest, movements) = counts.into_iter().max_by_key(|(_, count)| *count)?;
            Some(Nearest {
                class: class.to_owned(),
                nearest: nearest.to_owned(),
                movements,
                total,
            })
        });
        most.collect()
    }
}

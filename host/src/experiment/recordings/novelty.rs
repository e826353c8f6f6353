//! Each class left out of the library in turn: is it named unknown, and what is it nearest to?

use std::collections::BTreeMap;

use serde::Serialize;
use tonus_shared::promp::Basis;

use super::data::Set;
use crate::experiment::ExperimentError;
use crate::model::novelty::{GateConfig, HeldOut};
use crate::model::{Dof, Hyperparameters};

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

pub(super) fn each_class_left_out(set: &Set) -> Result<Novelty, ExperimentError> {
    let dofs: Vec<_> = set.plan.dofs.iter().copied().map(Dof::position).collect();
    let config = GateConfig::of(dofs.len());
    let valid = Hyperparameters::new(dofs, Basis::gaussian(FUNCTIONS)?).check()?;
    let folds = set.plan.novelty_folds;
    let said = HeldOut::each_class(set.demonstrations(), &valid, &config, folds)?;
    let share = |count: usize, of: usize| count as f64 / of.max(1) as f64;
    let (named_unknown, false_alarms) = (said.named_unknown(), said.false_alarms());
    Ok(Novelty {
        name: set.plan.name.to_owned(),
        novel: said.novel.len(),
        named_unknown,
        named_unknown_share: share(named_unknown, said.novel.len()),
        known: said.known.len(),
        false_alarms,
        false_alarm_share: share(false_alarms, said.known.len()),
        auroc: said.auroc(),
        nearest: substitutes(&said.nearest),
    })
}

/// For each class the one that most of its movements are nearest to.
fn substitutes(pairs: &[(String, String)]) -> Vec<Nearest> {
    let mut of_class: BTreeMap<&str, BTreeMap<&str, usize>> = BTreeMap::new();
    for (class, nearest) in pairs {
        let counts = of_class.entry(class).or_default();
        *counts.entry(nearest).or_default() += 1;
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

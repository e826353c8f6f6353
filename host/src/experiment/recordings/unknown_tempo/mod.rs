//! The same movements where nobody says how long they take and, in a recording that goes on, when they begin.
//!
//! ```text
//! announced (the recording is cut at the start): settings chosen with the duration known, by time
//! stacked (the recording goes on) --> followed (detector, bank of hypotheses) --> moments (what is seen, one after the other)
//! ```

mod announced;
mod followed;
mod moments;
mod stacked;

use serde::Serialize;

pub use followed::Watch;
pub use stacked::{Candidate, InRuns, Tried};

use super::At;
use super::choose::Chosen;
use super::data::Set;
use super::look::floored;
use super::parts::{Fold, Part};
use super::setting::Phase;
use crate::experiment::{ExperimentError, Score};
use stacked::Stack;

/// After which parts of the true movement something is said.
const FRACTIONS: [f64; 3] = [0.3, 0.5, 1.0];
/// Durations of each skill that are followed, or lengths of its path.
const DURATIONS: usize = 7;

/// How a movement's start is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Onset {
    /// Found by the detector in the recording that goes on.
    Detected,
    /// The recording is cut there: it is announced, only the duration is unknown.
    #[default]
    Announced,
}

/// Recognition with the duration unknown.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct UnknownTempo {
    /// How the start is known.
    pub onset: Onset,
    /// After 30, 50, 100 % of the movement, of which the recogniser does not know how much it is.
    pub by_fraction: Vec<At>,
    /// What was decided on each training part for it; nothing where the settings are those with the duration known.
    pub chosen: Vec<InRuns>,
}

/// Whether every movement of a recording that goes on can be learnt from in each way of watching: before minutes of work, not
/// in their midst.
///
/// # Errors
/// The first that cannot.
pub(super) fn learnable(set: &Set) -> Result<(), ExperimentError> {
    for movement in 0..set.demonstrations().len() {
        moments::demonstration(set, movement, Watch::arm(Phase::Path))?;
    }
    Ok(())
}

/// How the movements of a part are followed.
#[derive(Debug)]
pub(super) enum Following {
    /// Of a recording that goes on.
    InRuns(Stack),
    /// Of one that is cut at the start.
    Announced(announced::Following),
}

impl Following {
    /// Decided on the training part alone.
    pub(super) fn of(set: &Set, part: &Part) -> Result<Self, ExperimentError> {
        if set.plan.runs {
            return Ok(Self::InRuns(Stack::of(set, part)?));
        }
        let announced = announced::Following::of(set, &part.training);
        Ok(Self::Announced(announced))
    }

    /// What is said of a fold's movements by models of its others.
    pub(super) fn said(
        &self,
        set: &Set,
        chosen: &Chosen,
        fold: &Fold,
    ) -> Result<Said, ExperimentError> {
        match self {
            Self::InRuns(stack) => stack.said(set, fold),
            Self::Announced(following) => announced::said(set, chosen, following, fold),
        }
    }

    /// What was decided.
    pub(super) fn chosen(&self) -> Option<&InRuns> {
        match self {
            Self::InRuns(stack) => Some(&stack.chosen),
            Self::Announced(_) => None,
        }
    }
}

/// Answers after each of the fractions: log probability of the true class, and whether it is the most probable.
#[derive(Debug)]
pub(super) struct Said {
    onset: Onset,
    answers: [Vec<(f64, bool)>; 3],
}

impl Said {
    const fn none(onset: Onset) -> Self {
        Self {
            onset,
            answers: [const { Vec::new() }; 3],
        }
    }

    /// Takes the posterior of the classes after each of the fractions.
    fn take(&mut self, classes: &[String], posteriors: [Vec<f64>; 3], truth: &str) {
        for (answers, posterior) in self.answers.iter_mut().zip(posteriors) {
            answers.push(answer(classes, &posterior, truth));
        }
    }

    pub(super) fn add(&mut self, other: Self) {
        for (all, more) in self.answers.iter_mut().zip(other.answers) {
            all.extend(more);
        }
    }

    pub(super) fn scores(&self, chosen: Vec<InRuns>) -> UnknownTempo {
        let points = FRACTIONS.iter().zip(&self.answers);
        let point = |(&at, answers): (&f64, &Vec<(f64, bool)>)| At {
            at,
            score: Score::of(answers.iter().copied()),
        };
        UnknownTempo {
            onset: self.onset,
            by_fraction: points.map(point).collect(),
            chosen,
        }
    }
}

fn answer(classes: &[String], posterior: &[f64], truth: &str) -> (f64, bool) {
    let pairs = || classes.iter().zip(posterior);
    let own = pairs().find(|(name, _)| *name == truth);
    let own = own.map_or(f64::NEG_INFINITY, |(_, log)| *log);
    let mut others = pairs().filter(|(name, _)| *name != truth);
    (floored(own), others.all(|(_, other)| *other < own))
}

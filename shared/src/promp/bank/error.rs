//! What a bank refuses.

use thiserror::Error;

use super::super::error::{ConditionError, RowError};

/// A hypothesis or an observation that a bank refused; the bank is as it was before it.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum BankError {
    /// No such skill.
    #[error("skill {skill} was named, the bank has {skills} (from 0)")]
    Skill {
        /// The skill named.
        skill: usize,
        /// How many there are.
        skills: usize,
    },
    /// A duration that no movement has.
    #[error("a hypothesis of {duration_s} s: give a positive finite duration")]
    Duration {
        /// The duration, seconds.
        duration_s: f64,
    },
    /// A time that is NaN or infinite.
    #[error("the time is {time_s} s: give a finite time")]
    Time {
        /// The time, seconds.
        time_s: f64,
    },
    /// A prior that cannot be added to a likelihood.
    #[error("the log prior is {log_prior}: give a finite one")]
    LogPrior {
        /// The log prior of skill and hypothesis together.
        log_prior: f64,
    },
    /// A newcomer that has not explained what the others have.
    #[error(
        "the bank has taken {seen} observations and the newcomer is given {got}: hand over all of them, or reset"
    )]
    Past {
        /// What the bank has taken.
        seen: usize,
        /// What came with the newcomer.
        got: usize,
    },
    /// Nothing to condition.
    #[error("the bank has no hypothesis: add some before observing")]
    NoHypothesis,
    /// A number that conditioning refused.
    #[error(transparent)]
    Condition(#[from] ConditionError),
}

impl From<RowError> for BankError {
    fn from(error: RowError) -> Self {
        Self::Condition(ConditionError::Row(error))
    }
}

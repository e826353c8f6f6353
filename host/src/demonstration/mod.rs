//! Demonstrations: one performance of one skill, as times and values of each DoF.
//!
//! In a file, a demonstration is a contiguous run of rows with one `label` in one `trial`. Times need not
//! be regular, and rows with an empty cell in a chosen column are gaps: they are left out, and the
//! least squares that fits the weights does not need them. Learning by EM takes the rest of such a row too
//! ([`read_with_gaps`]).

mod path;
mod read;

pub use path::PathLength;
pub use read::{Choice, ReadError, read, read_unlabelled, read_with_gaps};

use std::path::{Path, PathBuf};

/// Why times and values are not a demonstration.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum DemonstrationError {
    /// Fewer than two samples: no duration.
    #[error("a demonstration needs at least 2 samples, this has {samples}")]
    TooShort {
        /// How many there are.
        samples: usize,
    },
    /// No DoF.
    #[error("a demonstration needs at least one DoF")]
    NoDof,
    /// A DoF with another number of values than there are times.
    #[error("DoF {dof} has {values} values at {times} times")]
    Length {
        /// The DoF, from 0.
        dof: usize,
        /// Its values.
        values: usize,
        /// The times.
        times: usize,
    },
    /// NaN or infinite.
    #[error("DoF {dof} is {value:?} at sample {sample}: drop the sample")]
    NonFinite {
        /// The DoF, from 0.
        dof: usize,
        /// The sample, from 0.
        sample: usize,
        /// The value.
        value: f64,
    },
    /// Times so far apart that their difference is infinite.
    #[error("the time from its first to its last sample overflows")]
    Span,
    /// A time that does not come after the one before it (or is not a number).
    #[error("time {time_s:?} s of sample {sample} does not come after the one before it")]
    NotIncreasing {
        /// The sample, from 0.
        sample: usize,
        /// Its time.
        time_s: f64,
    },
}

/// One performance of one skill: at least two samples, times strictly increasing, everything finite.
#[derive(Clone, Debug, PartialEq)]
pub struct Demonstration {
    label: String,
    class: String,
    trial: String,
    file: PathBuf,
    t_s: Vec<f64>,
    values: Vec<Vec<f64>>,
    /// Which values were recorded, like `values`; empty if all were.
    present: Vec<Vec<bool>>,
}

impl Demonstration {
    /// `values[dof][sample]`, in each DoF's own unit, at `t_s[sample]` seconds. `file` and `trial` say where
    /// it comes from; they are kept for messages and for leaving trials out.
    ///
    /// # Errors
    /// Fewer than two samples, no DoF, lengths that differ, numbers that are not finite, times that do
    /// not increase.
    pub fn new(
        label: impl Into<String>,
        trial: impl Into<String>,
        file: impl Into<PathBuf>,
        t_s: Vec<f64>,
        values: Vec<Vec<f64>>,
    ) -> Result<Self, DemonstrationError> {
        if t_s.len() < 2 {
            return Err(DemonstrationError::TooShort { samples: t_s.len() });
        }
        if values.is_empty() {
            return Err(DemonstrationError::NoDof);
        }
        let mut previous = f64::NEG_INFINITY;
        for (sample, &time_s) in t_s.iter().enumerate() {
            if !(time_s.is_finite() && time_s > previous) {
                return Err(DemonstrationError::NotIncreasing { sample, time_s });
            }
            previous = time_s;
        }
        if !(previous - t_s[0]).is_finite() {
            return Err(DemonstrationError::Span);
        }
        for (dof, series) in values.iter().enumerate() {
            if series.len() != t_s.len() {
                return Err(DemonstrationError::Length {
                    dof,
                    values: series.len(),
                    times: t_s.len(),
                });
            }
            if let Some(sample) = series.iter().position(|value| !value.is_finite()) {
                let value = series[sample];
                return Err(DemonstrationError::NonFinite { dof, sample, value });
            }
        }
        let label = label.into();
        Ok(Self {
            class: label.clone(),
            label,
            trial: trial.into(),
            file: file.into(),
            t_s,
            values,
            present: Vec::new(),
        })
    }

    /// The same performance of another class.
    #[must_use]
    pub fn with_label(&self, label: impl Into<String>) -> Self {
        let label = label.into();
        Self {
            class: label.clone(),
            label,
            ..self.clone()
        }
    }

    /// A movement of which some values are missing: `None` where nothing was recorded, for a sample or for a whole
    /// DoF. [`Demonstration::values`] then holds what interpolation between the recorded neighbours puts there (zero
    /// in a DoF without any); who may not take that for a recording asks [`Demonstration::present`].
    ///
    /// # Errors
    /// As [`Demonstration::new`].
    pub fn with_gaps(
        label: impl Into<String>,
        trial: impl Into<String>,
        file: impl Into<PathBuf>,
        t_s: Vec<f64>,
        values: &[Vec<Option<f64>>],
    ) -> Result<Self, DemonstrationError> {
        let filled = values.iter().map(|series| filled(&t_s, series)).collect();
        let present = values
            .iter()
            .map(|series| series.iter().map(Option::is_some).collect())
            .collect();
        let complete = values.iter().flatten().all(Option::is_some);
        let whole = Self::new(label, trial, file, t_s, filled)?;
        Ok(Self {
            present: if complete { Vec::new() } else { present },
            ..whole
        })
    }

    /// Whether every value was recorded.
    #[must_use]
    pub const fn is_complete(&self) -> bool {
        self.present.is_empty()
    }

    /// Which samples of a DoF were recorded; `None` if all of them were.
    #[must_use]
    pub fn present(&self, dof: usize) -> Option<&[bool]> {
        self.present.get(dof).map(Vec::as_slice)
    }

    /// Name of the skill.
    #[must_use]
    pub fn label(&self) -> &str {
        &self.label
    }

    /// Name of the class: the label, unless it is one component of a class ([`Demonstration::component`]).
    #[must_use]
    pub fn class(&self) -> &str {
        &self.class
    }

    /// The same movement as the component of its class of this number: its label is `CLASS#NUMBER`.
    #[must_use]
    pub fn component(self, number: usize) -> Self {
        Self {
            label: format!("{}#{number}", self.class),
            ..self
        }
    }

    /// Name of the trial it was performed in.
    #[must_use]
    pub fn trial(&self) -> &str {
        &self.trial
    }

    /// The file it comes from.
    #[must_use]
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Times of the samples, seconds, as recorded (not from zero).
    #[must_use]
    pub fn t_s(&self) -> &[f64] {
        &self.t_s
    }

    /// `values()[dof][sample]`, each DoF in its own unit.
    #[must_use]
    pub fn values(&self) -> &[Vec<f64>] {
        &self.values
    }

    /// Last time less first time, seconds, above zero.
    #[must_use]
    pub fn duration_s(&self) -> f64 {
        self.t_s[self.t_s.len() - 1] - self.t_s[0]
    }

    /// Phase of every sample: 0 at the first, 1 at the last.
    pub fn phases(&self) -> impl Iterator<Item = f64> {
        let (start_s, duration_s) = (self.t_s[0], self.duration_s());
        self.t_s
            .iter()
            .map(move |time_s| (time_s - start_s) / duration_s)
    }

    /// Value of a DoF at a phase, by linear interpolation between the samples on either side of it (the end
    /// sample outside `[0, 1]`); `None` for a DoF that is none.
    #[must_use]
    pub fn value_at(&self, dof: usize, phase: f64) -> Option<f64> {
        let series = self.values.get(dof)?;
        let time_s = self.t_s[0] + phase * self.duration_s();
        let after = self.t_s.partition_point(|&t| t <= time_s);
        if after == 0 {
            return series.first().copied();
        }
        let Some(&next_s) = self.t_s.get(after) else {
            return series.last().copied();
        };
        let share = (time_s - self.t_s[after - 1]) / (next_s - self.t_s[after - 1]);
        Some(series[after - 1] + share * (series[after] - series[after - 1]))
    }
}

/// Gaps by linear interpolation over time, before the first and after the last value by that.
fn filled(t_s: &[f64], series: &[Option<f64>]) -> Vec<f64> {
    let known: Vec<(f64, f64)> = t_s
        .iter()
        .zip(series)
        .filter_map(|(&time_s, value)| value.map(|value| (time_s, value)))
        .collect();
    let at = |(index, value): (usize, &Option<f64>)| {
        let time_s = t_s.get(index).copied().unwrap_or(f64::INFINITY);
        value.unwrap_or_else(|| between(&known, time_s))
    };
    series.iter().enumerate().map(at).collect()
}

fn between(known: &[(f64, f64)], time_s: f64) -> f64 {
    let after = known.partition_point(|&(known_s, _)| known_s <= time_s);
    match (
        after.checked_sub(1).map(|before| known[before]),
        known.get(after),
    ) {
        (Some((early_s, early)), Some(&(late_s, late))) => {
            early + (late - early) * (time_s - early_s) / (late_s - early_s)
        }
        (Some((_, only)), None) => only,
        (None, Some(&(_, only))) => only,
        (None, None) => 0.0,
    }
}

#[cfg(test)]
mod tests;

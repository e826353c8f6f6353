//! The novelty gate: is a movement any skill of the library, and which is nearest?
//!
//! [`tonus_shared::promp::Watch`] judges (small enough for the chip); here the gate is learnt from
//! demonstrations alone. Each is left out in turn (its whole trial, where trials are): what the
//! others find surprising about it is how surprising the known are, and the threshold is the quantile of that. Nothing is
//! assumed of the distribution: chi-square is wrong for ten demonstrations, whose covariance is itself a guess.
//!
//! How much one performance may differ from another ([`GateSettings`]) is chosen so that the gate tells apart what is
//! *in* the library: each demonstration is also judged as if its own class were not there, which is what a
//! movement from outside is like. Of those that do it about equally well the one is taken that compares most locally and
//! is least impressed by single odd moments: outside the library lies more than what the library can show.

mod config;
mod held_out;
mod kernel;
mod leave_out;
mod seen;
mod stream;

pub use config::GateConfig;
pub use held_out::HeldOut;
pub use kernel::GateSettings;
pub use stream::{GateStream, StreamError};

use std::path::PathBuf;

use tonus_shared::promp::{Known, ModelError, Novelty, Watch, WatchError, watch_len};

use self::kernel::Kernels;
use self::leave_out::LeftOut;
use self::seen::Seen;
use super::first_part::FirstPart;
use super::{Dof, NotPositive, Valid};
use crate::demonstration::Demonstration;

/// Why there is no gate, or no answer of it.
#[derive(Debug, thiserror::Error)]
pub enum GateError {
    /// A number of the configuration outside its range.
    #[error("{what} is {value}: give {range}")]
    Config {
        /// Which number.
        what: &'static str,
        /// The number.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// Too few demonstrations to leave one out.
    #[error(
        "class `{class}` has {found} demonstration(s), a gate needs {needed}: record more or exclude it"
    )]
    TooFew {
        /// The class.
        class: String,
        /// How many it has.
        found: usize,
        /// How many are needed.
        needed: usize,
    },
    /// A demonstration with other DoFs than the gate.
    #[error("{}: a demonstration has {got} DoFs, the gate looks at number {dof}", file.display())]
    Dofs {
        /// The file.
        file: PathBuf,
        /// The DoF looked at, from 0.
        dof: usize,
        /// How many it has.
        got: usize,
    },
    /// A value without a logarithm.
    #[error(transparent)]
    NotPositive(#[from] NotPositive),
    /// A DoF that never varies, or values that overflow.
    #[error("DoF `{dof}` does not vary, or by too much: leave it out or change its unit")]
    Scale {
        /// The DoF.
        dof: String,
    },
    /// A factorisation failed.
    #[error("the covariance of class `{class}` is not positive definite: check its demonstrations")]
    Numerical {
        /// The class.
        class: String,
    },
    /// Parts that do not fit together.
    #[error("these parts make no gate")]
    Parts(#[from] ModelError),
    /// A row that was refused.
    #[error(transparent)]
    Watch(#[from] WatchError),
}

/// What a gate consists of, for [`Gate::assemble`]: `J` rows (instants times DoFs, DoFs running faster), `Q` classes,
/// `N` references. Numbers are in each DoF's unit as it enters the model.
#[derive(Clone, Debug, PartialEq)]
pub struct GateParts {
    /// Signals of the model the gate looks at, and their indices in it.
    pub dofs: Vec<(usize, Dof)>,
    /// Phases of the instants, increasing.
    pub phases: Vec<f64>,
    /// Names of the classes, sorted.
    pub classes: Vec<String>,
    /// `Q x J (J + 1) / 2`: lower triangles of the Cholesky factors.
    pub factors: Vec<f64>,
    /// `N x J`, whitened.
    pub references: Vec<f64>,
    /// `N`: class of each reference.
    pub skills: Vec<usize>,
    /// Scale of the surprise, squared standard deviations.
    pub tail: f64,
    /// `J`.
    pub thresholds: Vec<f64>,
    /// Rate that the thresholds were fixed for: the one asked for; of a gate that judges once, if that is more, the
    /// least that so many demonstrations can show.
    pub false_alarm_rate: f64,
}

/// A learnt gate, valid as a whole.
#[derive(Clone, Debug, PartialEq)]
pub struct Gate(GateParts);

impl Gate {
    /// Chooses the settings, then learns with them. All from `demonstrations` alone.
    ///
    /// Cost: for each of the settings tried, as many Cholesky factors of `J x J` as there are trials times classes.
    ///
    /// # Errors
    /// [`GateError`].
    pub fn learn(
        demonstrations: &[Demonstration],
        valid: &Valid,
        config: &GateConfig,
    ) -> Result<Self, GateError> {
        let seen = Seen::of(demonstrations, valid, config)?;
        let mut tried = Vec::new();
        for kernel in GateSettings::tried() {
            let left_out = LeftOut::of(&seen, &kernel)?;
            for settings in kernel.tails() {
                tried.push((left_out.told_apart(settings.tail), settings));
            }
        }
        let settings = GateSettings::chosen(&tried).unwrap_or_default();
        Self::fitted(&seen, &settings, config)
    }

    /// Learns with given settings.
    ///
    /// # Errors
    /// [`GateError`].
    pub fn with_settings(
        demonstrations: &[Demonstration],
        valid: &Valid,
        settings: &GateSettings,
        config: &GateConfig,
    ) -> Result<Self, GateError> {
        settings.check()?;
        let seen = Seen::of(demonstrations, valid, config)?;
        Self::fitted(&seen, settings, config)
    }

    fn fitted(
        seen: &Seen,
        settings: &GateSettings,
        config: &GateConfig,
    ) -> Result<Self, GateError> {
        let left_out = LeftOut::of(seen, settings)?;
        let rate = config.false_alarm_rate;
        let (rate, thresholds) = if config.throughout {
            (rate, left_out.thresholds_throughout(settings.tail, rate))
        } else {
            let rate = rate.max(left_out.least_rate());
            (rate, left_out.thresholds(settings.tail, rate))
        };
        let members: Vec<usize> = (0..seen.rows.nrows()).collect();
        let kernels = Kernels::of(seen, &members, settings)?;
        Self::assemble(GateParts {
            dofs: seen.dofs.clone(),
            phases: seen.phases.clone(),
            classes: seen.classes.clone(),
            factors: kernels.packed(&seen.scale),
            references: kernels.references(),
            skills: kernels.skills(),
            tail: settings.tail,
            thresholds,
            false_alarm_rate: rate,
        })
    }

    /// Checks that the parts fit together.
    ///
    /// # Errors
    /// A list of the wrong length, a number that is not finite, phases that do not increase.
    pub fn assemble(parts: GateParts) -> Result<Self, GateError> {
        let length = |what, expected, got| {
            let wrong = ModelError::Length {
                what,
                expected,
                got,
            };
            if expected == got { Ok(()) } else { Err(wrong) }
        };
        let rows = parts.phases.len().saturating_mul(parts.dofs.len());
        length("the thresholds", rows, parts.thresholds.len())?;
        let gate = Self(parts);
        let known = gate.known();
        length("the classes", known.skill_count(), gate.0.classes.len())?;
        gate.watch()?;
        let increasing = |pair: &[f64]| pair[0] < pair[1];
        let within = |phase: &f64| (0.0..=1.0).contains(phase);
        let phases = &gate.0.phases;
        if !(phases.iter().all(within) && phases.windows(2).all(increasing)) {
            let value = phases.last().copied().unwrap_or_default();
            let range = "increasing phases from 0 to 1";
            return Err(GateError::Config {
                what: "the last phase",
                value,
                range,
            });
        }
        Ok(gate)
    }

    /// What it consists of.
    #[must_use]
    pub const fn parts(&self) -> &GateParts {
        &self.0
    }

    /// Names of the classes that [`Novelty::nearest`] counts.
    #[must_use]
    pub fn classes(&self) -> &[String] {
        &self.0.classes
    }

    /// What the judging kernel takes.
    #[must_use]
    pub fn known(&self) -> Known<'_, f64> {
        let parts = &self.0;
        Known {
            factors: &parts.factors,
            references: &parts.references,
            skills: &parts.skills,
            tail: parts.tail,
            thresholds: &parts.thresholds,
        }
    }

    /// One movement, row after row in the gate's order.
    ///
    /// # Errors
    /// None for a gate that was assembled; the kernel checks again what it borrows.
    pub fn watch(&self) -> Result<Watch<'_, f64, Vec<f64>>, ModelError> {
        let known = self.known();
        let len = watch_len(known.skill_count(), known.rows(), known.skills.len());
        Watch::new(known, vec![0.0; len])
    }

    /// One movement as it comes in.
    ///
    /// # Errors
    /// As [`Gate::watch`].
    pub fn stream(&self) -> Result<GateStream<'_>, ModelError> {
        Ok(GateStream::new(self, self.watch()?))
    }

    /// Judges the first `fraction` of a recorded movement by the instants within it; `None` if there are none. Samples
    /// after `fraction` are not looked at.
    ///
    /// # Errors
    /// A demonstration without one of the gate's DoFs, a value without a logarithm.
    pub fn judge(
        &self,
        demonstration: &Demonstration,
        fraction: f64,
    ) -> Result<Option<Novelty<f64>>, GateError> {
        let mut watch = self.watch()?;
        let part = FirstPart::of(demonstration, fraction);
        let within = |phase: &&f64| **phase <= fraction;
        for &phase in self.0.phases.iter().take_while(within) {
            for &(index, ref dof) in &self.0.dofs {
                let value = part.value(index, phase);
                let value = value.ok_or_else(|| no_dof(demonstration, index))?;
                watch.observe(dof.encode(value)?)?;
            }
        }
        Ok(watch.novelty())
    }
}

fn no_dof(demonstration: &Demonstration, dof: usize) -> GateError {
    GateError::Dofs {
        file: demonstration.file().to_owned(),
        dof,
        got: demonstration.values().len(),
    }
}

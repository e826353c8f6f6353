//! What is decided before learning, and what it is chosen from.

use serde::Serialize;
use tonus_shared::promp::Basis;

use crate::experiment::ExperimentError;
use crate::model::{Dof, Hyperparameters, Predictive, Shrinkage, Valid};

/// In how many ways a class is performed.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Ways {
    /// One.
    One,
    /// From either end: each demonstration teaches its reverse too.
    BothDirections,
}

/// What the phase is.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Phase {
    /// Share of the duration.
    Time,
    /// Share of the path's length, which is as much of an oracle.
    Path,
}

/// What is decided before learning.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Setting {
    /// In how many ways a class is performed.
    pub ways: Ways,
    /// What the phase is. Parts of the movement are parts of it.
    pub phase: Phase,
    /// Basis functions of each DoF.
    pub functions: usize,
    /// Ridge of the fits.
    pub ridge: f64,
    /// Where somebody may stand, metres.
    pub placement_m: f64,
    /// Shares of the pooled and of the diagonal covariance; none: those of greatest leave-one-out likelihood, and
    /// degrees of freedom with them.
    pub shares: Option<(f64, f64)>,
    /// Degrees of freedom with shares that are given; none: a Gaussian.
    pub freedom: Option<f64>,
}

impl Setting {
    /// For these DoFs.
    pub(super) fn valid(&self, dofs: &[&str]) -> Result<Valid, ExperimentError> {
        let dofs = dofs.iter().copied().map(Dof::position).collect();
        let (shrinkage, predictive) = match self.shares {
            Some((pooled, diagonal)) => (
                Shrinkage::Fixed { pooled, diagonal },
                Predictive::Fixed {
                    freedom: self.freedom,
                },
            ),
            None => (Shrinkage::LeaveOneOut, Predictive::LeaveOneOut),
        };
        let given = Hyperparameters {
            ridge: self.ridge,
            placement_m: self.placement_m,
            shrinkage,
            predictive,
            ..Hyperparameters::new(dofs, Basis::gaussian(self.functions)?)
        };
        Ok(given.check()?)
    }
}

/// Which value of each decision.
pub(super) type Choice = [usize; 7];

/// What is chosen from; the first values are what the search starts with.
#[derive(Debug)]
pub(super) struct Grid {
    pub(super) ways: &'static [Ways],
    pub(super) phases: &'static [Phase],
    pub(super) functions: &'static [usize],
    pub(super) ridges: &'static [f64],
    pub(super) placements_m: &'static [f64],
    pub(super) shares: &'static [Option<(f64, f64)>],
    pub(super) freedoms: &'static [Option<f64>],
    /// Noise that the recogniser assumes, metres.
    pub(super) sigmas_m: &'static [f64],
    /// Parts of the movement whose log-losses are added up.
    pub(super) fractions: &'static [f64],
}

impl Grid {
    pub(super) const fn sizes(&self) -> Choice {
        [
            self.ways.len(),
            self.phases.len(),
            self.functions.len(),
            self.ridges.len(),
            self.placements_m.len(),
            self.shares.len(),
            self.freedoms.len(),
        ]
    }

    pub(super) fn setting(&self, choice: &Choice) -> Setting {
        Setting {
            ways: self.ways[choice[0]],
            phase: self.phases[choice[1]],
            functions: self.functions[choice[2]],
            ridge: self.ridges[choice[3]],
            placement_m: self.placements_m[choice[4]],
            shares: self.shares[choice[5]],
            freedom: self.freedoms[choice[6]],
        }
    }
}

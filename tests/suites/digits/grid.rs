//! What is decided before learning.

use std::fmt::{Display, Formatter};

/// In how many ways a digit is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Ways {
    One,
    /// As many as the held-out likelihood wants, up to three.
    Variants,
    /// From either end.
    BothDirections,
}

/// What the phase is.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Phase {
    /// Share of the duration.
    Time,
    /// Share of the path's length.
    Path,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Setting {
    pub(crate) ways: Ways,
    pub(crate) phase: Phase,
    pub(crate) functions: usize,
    pub(crate) placement_m: f64,
    pub(crate) pooled: f64,
    pub(crate) diagonal: f64,
    pub(crate) sigma_m: f64,
}

impl Display for Setting {
    fn fmt(&self, f: &mut Formatter<'_>) -> std::fmt::Result {
        let Self {
            ways,
            phase,
            functions,
            placement_m,
            pooled,
            diagonal,
            sigma_m,
        } = self;
        write!(
            f,
            "{ways:?}, phase by {phase:?}, K {functions}, placement {placement_m} m, a {pooled}, b {diagonal}, \
             sigma {sigma_m} m"
        )
    }
}

/// The values that each decision may take, tried in this order of decisions.
pub(crate) struct Grid {
    ways: Vec<Ways>,
    phases: Vec<Phase>,
    placements_m: Vec<f64>,
    sigmas_m: Vec<f64>,
    shares: Vec<(f64, f64)>,
    functions: Vec<usize>,
}

/// Which value of each decision.
pub(crate) type Choice = [usize; 6];

impl Grid {
    pub(crate) fn setting(&self, choice: &Choice) -> Setting {
        let (pooled, diagonal) = self.shares[choice[4]];
        Setting {
            ways: self.ways[choice[0]],
            phase: self.phases[choice[1]],
            placement_m: self.placements_m[choice[2]],
            sigma_m: self.sigmas_m[choice[3]],
            pooled,
            diagonal,
            functions: self.functions[choice[5]],
        }
    }

    /// How many values each decision may take.
    pub(crate) fn sizes(&self) -> Choice {
        [
            self.ways.len(),
            self.phases.len(),
            self.placements_m.len(),
            self.sigmas_m.len(),
            self.shares.len(),
            self.functions.len(),
        ]
    }
}

pub(crate) fn all() -> Grid {
    Grid {
        ways: vec![Ways::One, Ways::Variants, Ways::BothDirections],
        phases: vec![Phase::Time, Phase::Path],
        placements_m: vec![0.0, 0.03, 0.06, 0.12],
        sigmas_m: vec![0.01, 0.02, 0.03],
        shares: vec![(0.3, 0.1), (0.1, 0.3), (0.6, 0.1), (0.5, 0.3)],
        functions: vec![12, 20],
    }
}

pub(crate) fn by_time() -> Grid {
    Grid {
        phases: vec![Phase::Time],
        ..all()
    }
}

/// One Gaussian for each digit.
pub(crate) fn plain() -> Grid {
    Grid {
        ways: vec![Ways::One],
        ..by_time()
    }
}

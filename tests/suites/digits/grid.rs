//! What is decided before learning.

use std::fmt::{Display, Formatter};

/// In how many ways a digit is drawn.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Ways {
    One,
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

/// What is observed besides the position.
#[derive(Clone, Copy, Debug, PartialEq, Eq, Hash)]
pub(crate) enum Beside {
    Nothing,
    /// The other phase (share of the path after a share of the duration, or the other way round), and the logarithms of
    /// duration and path length.
    PaceAndSize,
}

#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct Setting {
    pub(crate) ways: Ways,
    pub(crate) phase: Phase,
    pub(crate) beside: Beside,
    /// Degrees of freedom of each component's Student-t; a Gaussian without.
    pub(crate) freedom: Option<f64>,
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
            beside,
            freedom,
            functions,
            placement_m,
            pooled,
            diagonal,
            sigma_m,
        } = self;
        write!(
            f,
            "{ways:?}, phase by {phase:?}, beside {beside:?}, freedom {freedom:?}, placement {placement_m} m, \
             sigma {sigma_m} m, a {pooled}, b {diagonal}, K {functions}"
        )
    }
}

/// The values that each decision may take; decisions are tried in this order.
const WAYS: [Ways; 2] = [Ways::One, Ways::BothDirections];
const PHASES: [Phase; 2] = [Phase::Time, Phase::Path];
const BESIDE: [Beside; 2] = [Beside::Nothing, Beside::PaceAndSize];
const FREEDOMS: [Option<f64>; 3] = [Some(17.0), None, Some(5.0)];
const PLACEMENTS_M: [f64; 3] = [0.03, 0.0, 0.06];
const SIGMAS_M: [f64; 3] = [0.03, 0.02, 0.05];
/// Of the pooled covariance, and of the diagonal.
const SHARES: [(f64, f64); 3] = [(0.3, 0.1), (0.1, 0.3), (0.6, 0.1)];
const FUNCTIONS: [usize; 2] = [12, 20];

/// Which value of each decision.
pub(crate) type Choice = [usize; 8];

pub(crate) fn setting(choice: &Choice) -> Setting {
    let (pooled, diagonal) = SHARES[choice[6]];
    Setting {
        ways: WAYS[choice[0]],
        phase: PHASES[choice[1]],
        beside: BESIDE[choice[2]],
        freedom: FREEDOMS[choice[3]],
        placement_m: PLACEMENTS_M[choice[4]],
        sigma_m: SIGMAS_M[choice[5]],
        pooled,
        diagonal,
        functions: FUNCTIONS[choice[7]],
    }
}

/// How many values of each decision may be chosen, the first ones.
pub(crate) const ALL: Choice = [
    WAYS.len(),
    PHASES.len(),
    BESIDE.len(),
    FREEDOMS.len(),
    PLACEMENTS_M.len(),
    SIGMAS_M.len(),
    SHARES.len(),
    FUNCTIONS.len(),
];

/// As the movements are timed, position alone.
pub(crate) const BY_TIME: Choice = {
    let mut sizes = ALL;
    sizes[1] = 1;
    sizes[2] = 1;
    sizes
};

/// One component for each digit.
pub(crate) const PLAIN: Choice = {
    let mut sizes = BY_TIME;
    sizes[0] = 1;
    sizes
};

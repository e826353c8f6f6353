//! How each recording is looked at: its columns, what is chosen from, what is left out.

use super::setting::{Grid, Phase, Ways};

/// One recording.
#[derive(Debug)]
pub(super) struct Plan {
    /// Its folder.
    pub(super) name: &'static str,
    /// Movements that it was published with.
    pub(super) movements: usize,
    /// Columns of positions, metres; the first three are the hand's place.
    pub(super) dofs: &'static [&'static str],
    /// Column that is not zero in rows where the hand is hidden.
    pub(super) occluded: Option<&'static str>,
    /// Observations of each movement.
    pub(super) observations: usize,
    /// Blocks of selection where each movement is left out by itself.
    pub(super) blocks: usize,
    /// Parts that a training part is dealt into for choosing.
    pub(super) inner: usize,
    /// Folds of trials in which a gate's false alarms are counted.
    pub(super) novelty_folds: usize,
    /// Whether the recording goes on between the movements, so that their start can be found.
    pub(super) runs: bool,
    pub(super) grid: Grid,
}

/// Six actions of two people at a shelf.
pub(super) const ACTIONS: Plan = Plan {
    name: "vmci_pick_place_mocap",
    movements: 90,
    dofs: &["x", "y", "z"],
    occluded: None,
    observations: 10,
    blocks: 1,
    inner: 9,
    novelty_folds: 15,
    runs: true,
    grid: Grid {
        ways: &[Ways::One],
        phases: &[Phase::Time],
        functions: &[12, 20],
        ridges: &[1e-1, 1e-3],
        placements_m: &[0.2, 0.1, 0.0],
        shares: &[None],
        freedoms: &[None],
        sigmas_m: &[0.01, 0.02, 0.03, 0.05, 0.1],
        fractions: &[0.3, 0.5, 1.0],
    },
};

/// Ten digits drawn in the air: more than one way to draw each.
pub(super) const DIGITS: Plan = Plan {
    name: "leap_digits_mit",
    movements: 180,
    dofs: &["x", "y", "z"],
    occluded: None,
    observations: 15,
    blocks: 6,
    inner: 5,
    novelty_folds: 3,
    runs: false,
    grid: Grid {
        ways: &[Ways::One, Ways::BothDirections],
        phases: &[Phase::Time, Phase::Path],
        functions: &[12],
        ridges: &[1e-3],
        placements_m: &[0.03],
        shares: &[Some((0.3, 0.1)), Some((0.1, 0.3))],
        freedoms: &[None, Some(5.0)],
        sigmas_m: &[0.03],
        fractions: &[0.3, 1.0],
    },
};

/// Reaches to objects of three depths: middle of index and thumb, and how far they are apart.
pub(super) const REACHES: Plan = Plan {
    name: "kinesis_reach_to_grasp_mit",
    movements: 34,
    dofs: &["x", "y", "z", "aperture_m"],
    occluded: Some("occluded"),
    observations: 10,
    blocks: 6,
    inner: 6,
    novelty_folds: 11,
    runs: false,
    grid: Grid {
        ways: &[Ways::One],
        phases: &[Phase::Time],
        functions: &[8],
        ridges: &[1e-3],
        placements_m: &[0.0],
        shares: &[None],
        freedoms: &[None],
        sigmas_m: &[0.005, 0.01, 0.03, 0.1],
        fractions: &[0.3, 0.5, 1.0],
    },
};

//! The memory of recognition, fixed when it is compiled.

use crate::image::WEARABLE;
use crate::promp::{Hypothesis, bank_len, trajectory_scratch_len};

/// Hypotheses followed at most: eight of each of four skills, more of each if there are fewer skills.
pub const HYPOTHESES: usize = 8 * WEARABLE.skills;

/// Room for every model that fits [`WEARABLE`]: a constant, for a `static` or a task.
#[derive(Debug)]
pub struct Storage {
    pub(super) slots: [Hypothesis<f32>; HYPOTHESES],
    pub(super) numbers: [f32; bank_len(HYPOTHESES, WEARABLE.functions, WEARABLE.rank)],
    pub(super) scratch: [f32; trajectory_scratch_len(WEARABLE.functions, WEARABLE.rank)],
}

impl Storage {
    /// Empty.
    #[must_use]
    pub const fn new() -> Self {
        let nothing = Hypothesis {
            skill: 0,
            duration_s: 0.0,
            onset_s: 0.0,
            log_prior: 0.0,
        };
        Self {
            slots: [nothing; HYPOTHESES],
            numbers: [0.0; _],
            scratch: [0.0; _],
        }
    }
}

impl Default for Storage {
    fn default() -> Self {
        Self::new()
    }
}

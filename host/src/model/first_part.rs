//! A recorded movement as one who watches it sees it: nothing of what comes after.

use crate::demonstration::Demonstration;

/// The samples of a demonstration up to a phase.
pub(super) struct FirstPart<'d> {
    demonstration: &'d Demonstration,
    /// The last of them; the first sample of all is always one of them.
    last: usize,
    last_phase: f64,
}

impl<'d> FirstPart<'d> {
    pub(super) fn of(demonstration: &'d Demonstration, fraction: f64) -> Self {
        let within = demonstration.phases().take_while(|p| *p <= fraction);
        let last = within.enumerate().last();
        let (last, last_phase) = last.unwrap_or((0, 0.0));
        Self {
            demonstration,
            last,
            last_phase,
        }
    }

    /// The phase, or that of the last sample if it is earlier.
    pub(super) fn phase(&self, phase: f64) -> f64 {
        phase.min(self.last_phase)
    }

    /// A DoF's value at [`FirstPart::phase`], by interpolation between the samples on either side; `None` for a
    /// DoF that is none.
    pub(super) fn value(&self, dof: usize, phase: f64) -> Option<f64> {
        if phase < self.last_phase {
            self.demonstration.value_at(dof, phase)
        } else {
            Some(self.demonstration.values().get(dof)?[self.last])
        }
    }
}

//! Other people than the one who demonstrated.

use super::{Model, PartsError};

impl Model {
    /// The model for people who did not demonstrate: every skill's covariance (what was learnt and the placement) grows
    /// by `share` of itself, as if people differ from each other by `share` times the variance that one person's
    /// performances show. One person's demonstrations cannot tell it: state it. 1 is an intraclass correlation of
    /// one half. Adding demonstrations to the model learns it anew, without the share.
    ///
    /// # Errors
    /// [`PartsError::Range`] for a share that is not a finite number from 0.
    pub fn for_others(&self, share: f64) -> Result<Self, PartsError> {
        if !(share.is_finite() && share >= 0.0) {
            let what = "the variance between people, as a share of that within";
            return Err(PartsError::Range { what, value: share });
        }
        let mut parts = self.parts().clone();
        let wider = libm::sqrt(1.0 + share);
        parts.roots.iter_mut().for_each(|root| *root *= wider);
        Self::assemble(parts)
    }
}

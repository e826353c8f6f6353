//! Measures a person: the muscles' levels at rest and at their maximum, co-contraction (eq. 8) and joint stiffness (eq. 7)
//! by known loads; and whether a wearable that was put on again sits as it did.
//!
//! ```text
//! samples --Guide--> rest, maximum, patterns, holds --fit--> l1, l2, Kbar with covariance --> wire::Calibration
//! samples --FitCheck--> pattern of today against that of the calibration --> verdict
//! ```
//!
//! Both are pure state machines in the caller's time: a step begins with the first sample after it was started.
//!
//! # Envelopes in volts
//! A wearable sends envelopes as shares of the maximum under the calibration in use, `(envelope - rest) / (mvc - rest)`, and
//! cuts them off at zero: what is below `rest` is lost. So before the first step a host sends [`Guide::measuring`], a
//! calibration with rest 0 V and maximum 1 mV: then a share **is** the envelope in millivolts, nothing is cut off up to 1 V,
//! and [`volts`] takes it back exactly. When the guide is cancelled the host sends again what was in use. Its stiffness
//! means nothing meanwhile: the robot must be disarmed.
//!
//! # Glossary
//! - **hold**: the hand stays in one place for some seconds at a stated effort, with or without a load.
//! - **group**: the holds of one place and effort; all are compared with the one without a load.
//! - **pattern**: each channel's envelope while the elbow is bent and while it is stretched against a weight.

mod fit;
mod fit_check;
mod guide;
mod levels;
mod measurement;
mod plan;
mod profile;
mod view;

pub use fit::{Fit, FitError, Load, PARAMETERS, fit};
pub use fit_check::{Finding, FitCheck, FitCheckError, Pattern, Verdict};
pub use guide::{Guide, GuideError, Outcome, measures, unknown};
pub use plan::{Hold, Task};
pub use profile::{Profile, ProfileError};
pub use view::{CalibrationResult, Estimate, NameError, Person, StepView};

use tonus_shared::wire::Muscle;

/// One instant, a hundred times a second, as the newest stream packet and the tracker say.
#[derive(Debug, Clone, Copy)]
pub struct Measured<'a> {
    /// Envelope of each channel, V: see [`volts`].
    pub envelope_v: &'a [f64],
    /// Whether each channel's envelope can be believed: no rail, flat line or electrode off.
    pub good: &'a [bool],
    /// The hand, shoulder frame, m; none while it is not seen.
    pub hand_m: Option<[f64; 3]>,
}

/// The envelope, V, that a channel's `share` of the stream stands for under rest and maximum of the calibration in use;
/// none where it was cut off at zero, which says only that it is not above `rest_v`.
#[must_use]
pub fn volts(share: f32, rest_v: f32, mvc_v: f32) -> Option<f64> {
    let [share, rest_v, mvc_v] = [share, rest_v, mvc_v].map(f64::from);
    let cut_off = share <= 0.0 && rest_v > 0.0;
    (share.is_finite() && !cut_off).then_some(rest_v + share * (mvc_v - rest_v))
}

/// A muscle's name, for people.
#[must_use]
pub fn muscle_name(muscle: Muscle) -> &'static str {
    match muscle {
        Muscle::Absent => "absent",
        Muscle::BicepsShort => "biceps short head",
        Muscle::BicepsLong => "biceps long head",
        Muscle::TricepsLateral => "triceps lateral head",
        Muscle::TricepsLong => "triceps long head",
        Muscle::Other => "other",
    }
}

#[cfg(test)]
mod tests;

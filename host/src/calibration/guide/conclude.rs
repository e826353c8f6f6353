//! What a calibration comes to: levels and arm as the wearable keeps them, as people see them, and how sure they are.

use tonus_shared::pipeline::illustrative;
use tonus_shared::wire::{Calibration, MAX_CHANNELS, Muscle};

use super::Guide;
use crate::calibration::PARAMETERS;
use crate::calibration::fit::{Fit, fit};
use crate::calibration::fit_check::Pattern;
use crate::calibration::view::{CalibrationResult, Estimate, Person};

/// With this maximum and no rest a share is the envelope in millivolts.
const MEASURING_MVC_V: f32 = 1e-3;
/// What the parameters are called.
const NAMES: [&str; PARAMETERS] = [
    "the gain l1 of co-contraction",
    "the slope l2 of co-contraction",
    "the shoulder's stiffness in flexion",
    "the shoulder's stiffness sideways",
    "the stiffness of the upper arm's turn",
    "the elbow's stiffness",
];

/// What a finished calibration gives.
#[derive(Debug, Clone)]
pub struct Outcome {
    /// To send to the wearable.
    pub calibration: Calibration,
    /// To show.
    pub result: CalibrationResult,
    /// To keep: what a later [`crate::calibration::FitCheck`] compares with.
    pub pattern: Pattern,
    /// Stiffness with its covariance.
    pub fit: Fit,
}

impl Guide {
    /// Fits the arm to the holds; or why that cannot be.
    pub(super) fn conclude(&self) -> Result<Outcome, String> {
        let fit = fit(&self.segments, &self.loads()?).map_err(|error| error.to_string())?;
        let estimates = fit.estimates();
        let [l1, l2, k0, k1, k2, k3] = estimates;
        let microvolts = |levels: &[Estimate]| -> Vec<Estimate> {
            let scaled = levels.iter().map(|level| Estimate {
                value: 1e6 * level.value,
                std: 1e6 * level.std,
            });
            scaled.collect()
        };
        Ok(Outcome {
            calibration: self.calibration(&estimates),
            result: CalibrationResult {
                rest_uv: microvolts(&self.rest),
                mvc_uv: microvolts(&self.mvc),
                l1,
                l2,
                rest_stiffness_nm_per_rad: [k0, k1, k2, k3],
                residual_mm: 1e3 * fit.residual_m,
                notes: notes(&fit),
            },
            pattern: Pattern::new(&self.rest, &self.flex, &self.extend),
            fit,
        })
    }

    #[allow(clippy::cast_possible_truncation, reason = "the packet carries f32")]
    fn calibration(&self, estimates: &[Estimate; PARAMETERS]) -> Calibration {
        let slots = |levels: &[Estimate]| {
            std::array::from_fn(|slot| levels.get(slot).map_or(0.0, |level| level.value as f32))
        };
        let [l1, l2, k @ ..] = estimates.map(|estimate| estimate.value as f32);
        Calibration {
            revision: self.revision,
            rest_v: slots(&self.rest),
            mvc_v: slots(&self.mvc),
            l1,
            l2,
            rest_stiffness_nm_per_rad: k,
            ..self.base
        }
    }
}

/// Whether a wearable works with levels to measure by: what it says is of nobody then.
#[must_use]
pub fn measures(calibration: &Calibration) -> bool {
    let used = usize::from(calibration.channels).min(MAX_CHANNELS);
    let levels = calibration.rest_v[..used]
        .iter()
        .zip(&calibration.mvc_v[..used]);
    let mut levels = levels.map(|(rest_v, mvc_v)| (rest_v.to_bits(), mvc_v.to_bits()));
    let wanted = (0.0_f32.to_bits(), MEASURING_MVC_V.to_bits());
    calibration.revision == 0 && used > 0 && levels.all(|level| level == wanted)
}

/// Whether a wearable works with levels or an arm that were measured on nobody and are not the illustrative ones either: nobody
/// knows what they are.
#[must_use]
pub fn unknown(calibration: &Calibration) -> bool {
    let illustrative = illustrative([Muscle::Other; 1], 0);
    let used = usize::from(calibration.channels).min(MAX_CHANNELS);
    let as_told =
        |levels: &[f32], told: f32| (levels.iter()).all(|level| level.to_bits() == told.to_bits());
    let levels = as_told(&calibration.rest_v[..used], illustrative.rest_v[0])
        && as_told(&calibration.mvc_v[..used], illustrative.mvc_v[0]);
    let arm = |calibration: &Calibration| {
        let [a, b, c, d] = calibration.rest_stiffness_nm_per_rad;
        let (mass_kg, height_m) = (calibration.body_mass_kg, calibration.body_height_m);
        let all = [
            calibration.l1,
            calibration.l2,
            a,
            b,
            c,
            d,
            mass_kg,
            height_m,
        ];
        all.map(f32::to_bits)
    };
    calibration.revision == 0 && !(levels && arm(calibration) == arm(&illustrative))
}

/// The person on this wearable, with levels to measure by and an illustrative arm.
#[allow(clippy::cast_possible_truncation, reason = "the packet carries f32")]
pub(super) fn base(person: &Person, muscles: &[Muscle], semg_hz: f32) -> Calibration {
    let used =
        |level: f32| std::array::from_fn(|slot| if slot < muscles.len() { level } else { 0.0 });
    Calibration {
        channels: muscles.len() as u8,
        muscles: std::array::from_fn(|slot| muscles.get(slot).copied().unwrap_or_default()),
        mains_hz: person.mains_hz,
        semg_hz,
        rest_v: [0.0; MAX_CHANNELS],
        mvc_v: used(MEASURING_MVC_V),
        body_mass_kg: person.body_mass_kg as f32,
        body_height_m: person.body_height_m as f32,
        ..illustrative([Muscle::Other; 1], 0)
    }
}

fn notes(fit: &Fit) -> Vec<String> {
    let untold = (0..PARAMETERS).filter(|at| !fit.told(*at)).map(|at| {
        format!(
            "The loads do not tell {}: what stands there is mostly what is usual, not what was measured.",
            NAMES[at]
        )
    });
    let mut notes: Vec<String> = untold.collect();
    if !fit.left_out.is_empty() {
        let loads: Vec<String> = fit
            .left_out
            .iter()
            .map(|load| (load + 1).to_string())
            .collect();
        notes.push(format!(
            "Left out because the hand moved otherwise than all others say: load {}.",
            loads.join(", ")
        ));
    }
    notes
}

//! From a calibration packet to what a pipeline is set up with, on one board.

use crate::Real;
use crate::sample::AdcScale;
use crate::semg::chain::{ChainConfig, NotchConfig};
use crate::semg::design::Mains;
use crate::stiffness::{ArmStiffness, CoContraction, ILLUSTRATIVE, ParameterError, Segments};
use crate::wire::{Calibration, MAX_CHANNELS, Muscle};

use super::config::{ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, PipelineConfig, PipelineError};

/// Sharpness of the notch (centre frequency / -3 dB width): 50 Hz are taken out 1.7 Hz wide.
const NOTCH_Q: f64 = 30.0;
/// Envelopes at rest and at maximum contraction over the upper arm, V: **illustrative**, good for seeing that a
/// contraction shows, not for its strength.
const ILLUSTRATIVE_LEVELS_V: (f32, f32) = (10e-6, 500e-6);

/// What a board brings to every calibration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Board {
    /// Random number drawn at start; tells one start from another.
    pub boot_id: u32,
    /// First eight bytes of the hash of the firmware's source; zero when unknown.
    pub firmware_hash: [u8; 8],
    /// Converter.
    pub adc: AdcScale,
    /// Scan rates that the board can do, Hz.
    pub rates_hz: &'static [u32],
}

/// Why a calibration cannot be used on a board. The one in use stands.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// It is for a wearable with another number of channels.
    #[error("calibration of {got} channels, this board has {expected}: calibrate this board")]
    Channels {
        /// Channels of the board.
        expected: usize,
        /// Channels of the calibration.
        got: u8,
    },
    /// The converter cannot do this rate.
    #[error("scan rate {got_hz} Hz, this board can do {offered_hz:?} Hz: choose one of these")]
    Rate {
        /// Rate of the calibration, Hz.
        got_hz: f32,
        /// Rates of the board, Hz.
        offered_hz: &'static [u32],
    },
    /// A frequency that no power line has.
    #[error("mains frequency {got_hz} Hz: give 50 or 60, or none for no notch")]
    Mains {
        /// Frequency of the calibration, Hz.
        got_hz: u8,
    },
    /// The arm's parameters are impossible.
    #[error(transparent)]
    Arm(#[from] ParameterError),
    /// The pipeline cannot work with it.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
}

impl Board {
    /// What a pipeline of `C` channels is set up with. [`super::Pipeline::new`] and
    /// [`super::Pipeline::reconfigure`] then ask whether filters, levels and arm can work.
    ///
    /// # Errors
    /// [`CalibrationError`], all but `Pipeline`.
    pub fn config<const C: usize>(
        &self,
        calibration: &Calibration,
        raw: bool,
    ) -> Result<PipelineConfig<C>, CalibrationError> {
        const { assert!(C >= 1 && C <= MAX_CHANNELS, "1 to 8 channels") }
        if usize::from(calibration.channels) != C {
            return Err(CalibrationError::Channels {
                expected: C,
                got: calibration.channels,
            });
        }
        let rate_hz = self.rate_hz(calibration.semg_hz)?;
        Ok(PipelineConfig {
            boot_id: self.boot_id,
            firmware_hash: self.firmware_hash,
            adc: self.adc,
            chain: ChainConfig {
                notch: notch(calibration.mains_hz)?,
                ..ChainConfig::at_rate(rate_hz)
            },
            channels: core::array::from_fn(|channel| ChannelConfig {
                muscle: calibration.muscles[channel],
                rest_v: calibration.rest_v[channel].widen(),
                mvc_v: calibration.mvc_v[channel].widen(),
            }),
            activation_window_s: calibration.activation_window_s.widen(),
            arm: arm(calibration)?,
            raw,
        })
    }

    fn rate_hz(&self, wanted_hz: f32) -> Result<f64, CalibrationError> {
        let offered = self.rates_hz.iter().copied().map(f64::from);
        offered
            .into_iter()
            .find(|rate_hz| *rate_hz == wanted_hz.widen())
            .ok_or(CalibrationError::Rate {
                got_hz: wanted_hz,
                offered_hz: self.rates_hz,
            })
    }
}

fn notch(mains_hz: Option<u8>) -> Result<Option<NotchConfig>, CalibrationError> {
    let mains = match mains_hz {
        None => return Ok(None),
        Some(50) => Mains::Hz50,
        Some(60) => Mains::Hz60,
        Some(got_hz) => return Err(CalibrationError::Mains { got_hz }),
    };
    Ok(Some(NotchConfig { mains, q: NOTCH_Q }))
}

fn arm(calibration: &Calibration) -> Result<ArmStiffness<f32>, ParameterError> {
    ArmStiffness::new(
        CoContraction::new(calibration.l1, calibration.l2)?,
        calibration.rest_stiffness_nm_per_rad,
        Segments::new(calibration.body_mass_kg, calibration.body_height_m)?,
    )
}

/// The calibration of a board that nobody has calibrated: its muscles and rate, and **illustrative** levels and arm,
/// of no particular person. Its revision is 0.
#[must_use]
pub fn illustrative<const C: usize>(muscles: [Muscle; C], semg_hz: u32) -> Calibration {
    const { assert!(C >= 1 && C <= MAX_CHANNELS, "1 to 8 channels") }
    let used = |level: f32| core::array::from_fn(|slot| if slot < C { level } else { 0.0 });
    let (rest_v, mvc_v) = ILLUSTRATIVE_LEVELS_V;
    Calibration {
        revision: 0,
        channels: C as u8,
        muscles: super::signal::slots(muscles),
        mains_hz: None,
        semg_hz: semg_hz as f32,
        rest_v: used(rest_v),
        mvc_v: used(mvc_v),
        activation_window_s: f32::of(DEFAULT_ACTIVATION_WINDOW_S),
        l1: f32::of(ILLUSTRATIVE.l1),
        l2: f32::of(ILLUSTRATIVE.l2),
        rest_stiffness_nm_per_rad: ILLUSTRATIVE.rest_stiffness_nm_per_rad.map(f32::of),
        body_mass_kg: f32::of(ILLUSTRATIVE.body_mass_kg),
        body_height_m: f32::of(ILLUSTRATIVE.body_height_m),
    }
}

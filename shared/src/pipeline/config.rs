//! What a pipeline is set up with, and why it may be refused.

use crate::Real;
use crate::sample::AdcScale;
use crate::semg::activation::{ActivationError, NormalisationError};
use crate::semg::chain::ChainConfig;
use crate::semg::design::{DesignError, Mains};
use crate::stiffness::{ArmStiffness, PostureError, StiffnessError};
use crate::wire::{Configuration, MAX_CHANNELS, Muscle};

use super::schedule::STREAM_HZ;

/// Activation window when nothing else is wanted, s. Short, because the envelope is smooth already.
pub const DEFAULT_ACTIVATION_WINDOW_S: f64 = 0.025;

/// One channel: where it sits and how strong its person is there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ChannelConfig {
    /// Place of the electrodes. The two heads of biceps and of triceps make the activation (eq. 4); channels on the
    /// same head are averaged, so that eight electrodes do not count double.
    pub muscle: Muscle,
    /// Envelope at rest, V.
    pub rest_v: f64,
    /// Envelope at maximum voluntary contraction, V.
    pub mvc_v: f64,
}

/// Everything that a [`super::Pipeline`] needs to know.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct PipelineConfig<const C: usize> {
    /// Random number drawn at start; tells one start from another.
    pub boot_id: u32,
    /// First eight bytes of the hash of the firmware's source; zero when unknown.
    pub firmware_hash: [u8; 8],
    /// Converter.
    pub adc: AdcScale,
    /// Filters, and the scan rate.
    pub chain: ChainConfig,
    /// Channels, in the order of a scan's counts.
    pub channels: [ChannelConfig; C],
    /// Window of the activation (W of eq. 4), s; rounded to an odd count of scans.
    pub activation_window_s: f64,
    /// The person's arm, identified with this same channel map.
    pub arm: ArmStiffness<f32>,
    /// Whether raw sEMG goes out as well.
    pub raw: bool,
}

/// Why a pipeline was refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum PipelineError {
    /// A filter or the activation window cannot be.
    #[error(transparent)]
    Design(#[from] DesignError),
    /// A channel without rest and contraction levels that make sense.
    #[error("channel {channel}: {source}")]
    Calibration {
        /// Position in the scan, from 0.
        channel: usize,
        /// What is wrong with the levels.
        source: NormalisationError,
    },
    /// A channel whose muscle is `Absent`.
    #[error(
        "channel {channel} is read but its muscle is `Absent`: say `Other` if it sits elsewhere"
    )]
    AbsentMuscle {
        /// Position in the scan, from 0.
        channel: usize,
    },
    /// No channel sits on biceps or triceps.
    #[error(transparent)]
    Activation(#[from] ActivationError),
    /// Raw counts do not fit the packet.
    #[error(
        "raw sEMG carries 24-bit counts, the converter's rails are {min_count} to {max_count}: switch raw off"
    )]
    RawRange {
        /// Lowest count.
        min_count: i32,
        /// Highest count.
        max_count: i32,
    },
    /// The posture assumed without measurements does not exist.
    #[error(transparent)]
    RestingPosture(#[from] PostureError),
    /// The arm has no stiffness in the posture assumed without measurements.
    #[error("with the arm hanging and the elbow at a right angle: {0}")]
    RestingStiffness(#[from] StiffnessError),
    /// The co-contraction curve exceeds what a packet carries.
    #[error("co-contraction reaches {reached}, at most {limit} can be sent: reduce the gain l1")]
    CoContraction {
        /// Its largest value.
        reached: f32,
        /// Limit of the packet.
        limit: f32,
    },
}

impl<const C: usize> PipelineConfig<C> {
    /// The configuration packet, with slots from `C` on absent.
    pub(super) fn packet(&self, chain_delay_us: u32) -> Result<Configuration, PipelineError> {
        let mut muscles = [Muscle::Absent; MAX_CHANNELS];
        for (channel, (slot, config)) in muscles.iter_mut().zip(&self.channels).enumerate() {
            if config.muscle == Muscle::Absent {
                return Err(PipelineError::AbsentMuscle { channel });
            }
            *slot = config.muscle;
        }
        if self.raw {
            check_raw(&self.adc)?;
        }
        Ok(Configuration {
            semg_hz: f32::of(self.chain.rate_hz),
            stream_hz: STREAM_HZ as f32,
            volts_per_count: f32::of(self.adc.volts_per_count()),
            offset_counts: self.adc.offset_counts(),
            chain_delay_us,
            channels: C as u8,
            muscles,
            mains_hz: self.chain.notch.map(|notch| match notch.mains {
                Mains::Hz50 => 50,
                Mains::Hz60 => 60,
            }),
            raw: self.raw,
            firmware_hash: self.firmware_hash,
        })
    }
}

/// Whether a converter's counts fit the raw packet.
pub(super) fn check_raw(adc: &AdcScale) -> Result<(), PipelineError> {
    let (min_count, max_count) = adc.rails();
    if min_count < -(1 << 23) || max_count >= 1 << 23 {
        return Err(PipelineError::RawRange {
            min_count,
            max_count,
        });
    }
    Ok(())
}

/// Whole microseconds of a delay, which is not negative and below an hour.
pub(super) fn microseconds(seconds: f64) -> u32 {
    libm::round(seconds * 1e6) as u32
}

//! The armband as a wearable: its packets through the wearable's own signal path.
//!
//! **Bands at 200 samples a second.** Half of that, 100 Hz, is where the spectrum ends; sEMG has about half of its power
//! below (its median frequency is 60 to 100 Hz). What is left, 20 to 100 Hz, is what the default chain takes: its high-pass
//! at 20 Hz lies below the band, its smoother at 5 Hz far below, and a notch at 50 or 60 Hz exists. Levels differ from a 1 kHz
//! wearable's, and do not matter: envelopes are shares of what the same electrodes gave at rest and at maximum.

use thiserror::Error;
use tonus_shared::pipeline::{Board, CalibrationError, illustrative};
use tonus_shared::sample::{AdcScale, AdcScaleError, Scan};
use tonus_shared::wire::Muscle;

use super::attitude::Attitude;
use super::pace::Pace;
use super::packet::{self, Imu, PacketError};
use super::{IMU, SEMG};
use crate::link::bridge::Bridge;

/// Channels of sEMG.
pub const CHANNELS: usize = 8;
/// Samples of each a second.
pub const RATE_HZ: u32 = 200;
pub(super) const SAMPLE_US: u64 = 1_000_000 / RATE_HZ as u64;
/// **Nominal**: nobody published the converter's step. It cancels against the calibration's levels; with this one the
/// illustrative levels are 1 count at rest and 50 at maximum.
const VOLTS_PER_COUNT: f64 = 10e-6;
/// Where the channels sit with the logo (channel 3 of 0 to 7) over the biceps of the upper arm. Which of two neighbours is
/// which head depends on the arm; eq. 4 takes the mean of both.
pub const MUSCLES: [Muscle; CHANNELS] = [
    Muscle::TricepsLong,
    Muscle::Other,
    Muscle::Other,
    Muscle::BicepsShort,
    Muscle::BicepsLong,
    Muscle::Other,
    Muscle::Other,
    Muscle::TricepsLateral,
];

/// Why the armband cannot serve as a wearable.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum MyoError {
    /// Its scale is none.
    #[error(transparent)]
    Scale(#[from] AdcScaleError),
    /// The signal path does not take its rate or levels.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// A Myo armband on the upper arm.
///
/// Its attitude becomes the upper arm's once a posture that is known has shown how it sits ([`Armband::hangs`]), and enters the
/// posture as the wearable's does. Until then, and on every new link, the posture rests on the hand, or is the assumed one,
/// and the stream's flags say so.
#[derive(Debug)]
pub struct Armband {
    bridge: Bridge<CHANNELS>,
    pace: Pace,
    /// Session time of the newest packet and device time of its newest sample, us.
    newest: Option<(u64, u64)>,
    imu: Option<Imu>,
    attitude: Attitude,
}

impl Armband {
    /// One that nobody has calibrated. `boot_id` tells one start of the program from another.
    ///
    /// # Errors
    /// [`MyoError`]; none in practice.
    pub fn new(boot_id: u32) -> Result<Self, MyoError> {
        let board = Board {
            boot_id,
            firmware_hash: [0; 8],
            adc: AdcScale::new(VOLTS_PER_COUNT, 0, i8::MIN.into(), i8::MAX.into())?,
            rates_hz: &[RATE_HZ],
        };
        Ok(Self {
            bridge: Bridge::new(board, &illustrative(MUSCLES, RATE_HZ))?,
            pace: Pace::default(),
            newest: None,
            imu: None,
            attitude: Attitude::default(),
        })
    }

    /// A link has come up. Whether the armband has meanwhile been taken off, or has chosen another heading, nobody knows.
    pub fn connected(&mut self) {
        self.attitude = Attitude::default();
        self.pace.link();
        self.bridge.connected();
    }

    /// How it lies, once it has told.
    #[must_use]
    pub fn imu(&self) -> Option<Imu> {
        self.imu
    }

    /// At session time `at_us` the person was asked to let the upper arm hang, the elbow bent forward. How the armband sits
    /// is learnt from the first second, of those from one to four seconds later, in which they hold still.
    pub fn hangs(&mut self, at_us: u64) {
        self.attitude.hangs(at_us);
    }

    /// The person was asked for something else.
    pub fn moves(&mut self) {
        self.attitude.moves();
    }

    /// Takes one notification that came at session time `at_us`; frames leave through `send`. Those of other
    /// characteristics are nothing to it.
    ///
    /// # Errors
    /// [`PacketError`]; nothing has changed then.
    pub fn take(
        &mut self,
        characteristic: u128,
        bytes: &[u8],
        at_us: u64,
        mut send: impl FnMut(&[u8]),
    ) -> Result<(), PacketError> {
        if characteristic == IMU {
            let imu = packet::imu(bytes)?;
            self.imu = Some(imu);
            if let Some(xyzw) = self.attitude.take(&imu, at_us) {
                // One before the first scan is refused, and counted by the pipeline.
                let _counted = self.bridge.set_orientation(xyzw, self.device_us(at_us));
            }
            return Ok(());
        }
        let Some(turn) = SEMG.iter().position(|id| *id == characteristic) else {
            return Ok(());
        };
        let samples = packet::semg(bytes)?;
        let first = self.pace.place(turn, at_us);
        for (index, sample) in (first..).zip(samples) {
            let scan = Scan {
                // The pipeline's index wraps.
                index: (index & u64::from(u32::MAX)) as u32,
                acquired_us: index * SAMPLE_US,
                counts: sample.map(i32::from),
            };
            // The pace never goes back, so that every scan is newer than the last.
            let _newer = self.bridge.push_scan(&scan, &mut send);
            self.newest = Some((at_us, scan.acquired_us));
        }
        Ok(())
    }

    /// Does what a frame of the host asks for at session time `at_us`, and answers through `send`.
    pub fn request(&mut self, bytes: &[u8], at_us: u64, send: impl FnMut(&[u8])) {
        self.bridge.request(bytes, self.device_us(at_us), send);
    }

    /// The armband's time now, as far as its newest packet tells: a ping sees nothing of the radio's delay.
    fn device_us(&self, at_us: u64) -> u64 {
        match self.newest {
            Some((came_us, device_us)) => device_us + at_us.saturating_sub(came_us),
            None => at_us,
        }
    }
}

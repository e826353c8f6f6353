//! A made-up wearer for the pipeline's suites: sines as sEMG, every frame sent over the wire.
#![allow(clippy::unwrap_used, reason = "read by tests only")]

use tonus_shared::pipeline::{
    ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Pipeline, PipelineConfig,
};
use tonus_shared::sample::{AdcScale, Scan};
use tonus_shared::semg::chain::ChainConfig;
use tonus_shared::stiffness::ArmStiffness;
use tonus_shared::wire::{Frame, MAX_FRAME_BYTES, Muscle, Packet, Status, Stream, decode};

const VOLTS_PER_COUNT: f64 = 1e-7;
/// Envelope of a sine of amplitude 1 mV: mean of its magnitude.
const MVC_V: f64 = 1e-3 * std::f64::consts::FRAC_2_PI;

/// Up to four heads at this rate, 1 mV at the maximum contraction, an illustrative arm.
///
/// # Panics
/// Never: the scale is valid.
#[must_use]
pub fn config<const C: usize>(rate_hz: f64) -> PipelineConfig<C> {
    use Muscle::{BicepsLong, BicepsShort, TricepsLateral, TricepsLong};
    let places = [BicepsShort, TricepsLateral, BicepsLong, TricepsLong];
    PipelineConfig {
        boot_id: 0xB007,
        firmware_hash: [7; 8],
        adc: AdcScale::new(VOLTS_PER_COUNT, 0, -(1 << 23), (1 << 23) - 1).unwrap(),
        chain: ChainConfig::at_rate(rate_hz),
        channels: std::array::from_fn(|at| ChannelConfig {
            muscle: places[at % 4],
            rest_v: 0.0,
            mvc_v: MVC_V,
        }),
        activation_window_s: DEFAULT_ACTIVATION_WINDOW_S,
        arm: ArmStiffness::illustrative(),
        raw: false,
    }
}

/// Frames that crossed the wire: encoded, decoded, found equal to what the pipeline made, bit for bit.
///
/// # Panics
/// When a frame does not encode, or comes back different.
pub fn take<const C: usize>(pipeline: &mut Pipeline<C>) -> Vec<Frame> {
    let mut frames = Vec::new();
    while let Some(frame) = pipeline.next_frame() {
        let mut buffer = [0; MAX_FRAME_BYTES];
        let length = frame.encode(&mut buffer).unwrap();
        let crossed = decode(&buffer[..length]).unwrap();
        assert_eq!(crossed, frame);
        frames.push(crossed);
    }
    frames
}

/// A wearer: one count per channel by time, at the rate's exact instants.
pub struct Wearer<const C: usize> {
    /// Under test.
    pub pipeline: Pipeline<C>,
    rate_hz: f64,
    /// Of the next scan.
    pub index: u32,
}

impl<const C: usize> Wearer<C> {
    /// # Panics
    /// When the configuration is refused.
    #[must_use]
    pub fn new(config: &PipelineConfig<C>) -> Self {
        Self {
            pipeline: Pipeline::new(config).unwrap(),
            rate_hz: config.chain.rate_hz,
            index: 0,
        }
    }

    /// Device time of a scan.
    #[must_use]
    pub fn time_us(&self, index: u32) -> u64 {
        (f64::from(index) * 1e6 / self.rate_hz) as u64
    }

    /// One scan of a 97 Hz sine of `amplitude_v`, alike on all channels. (At a divisor of the rate the same few points
    /// of the sine would come again and again, and their mean magnitude is not that of the sine.)
    pub fn scan(&mut self, amplitude_v: f64) -> Vec<Frame> {
        let t_s = f64::from(self.index) / self.rate_hz;
        let sine = (2.0 * std::f64::consts::PI * 97.0 * t_s + 0.3).sin();
        self.push([(amplitude_v * sine / VOLTS_PER_COUNT).round() as i32; C])
    }

    /// One scan of these counts, and what comes of it.
    ///
    /// # Panics
    /// When the scan is refused.
    pub fn push(&mut self, counts: [i32; C]) -> Vec<Frame> {
        let scan = Scan {
            index: self.index,
            acquired_us: self.time_us(self.index),
            counts,
        };
        self.index += 1;
        self.pipeline.push_scan(&scan).unwrap();
        take(&mut self.pipeline)
    }

    /// Scans for `seconds`; the stream packets and their device times.
    pub fn run(&mut self, seconds: f64, amplitude_v: f64) -> Vec<(u64, Stream)> {
        let scans = (seconds * self.rate_hz).round() as u32;
        (0..scans)
            .flat_map(|_| streams(&self.scan(amplitude_v)))
            .collect()
    }
}

/// The stream packets among frames, and their device times.
#[must_use]
pub fn streams(frames: &[Frame]) -> Vec<(u64, Stream)> {
    let stream = |frame: &Frame| match &frame.packet {
        Packet::Stream(stream) => Some((frame.header.device_us, *stream)),
        _ => None,
    };
    frames.iter().filter_map(stream).collect()
}

/// The last status among frames.
#[must_use]
pub fn last_status(frames: &[Frame]) -> Option<Status> {
    frames.iter().rev().find_map(|frame| match frame.packet {
        Packet::Status(status) => Some(status),
        _ => None,
    })
}

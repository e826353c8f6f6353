//! From full converter buffers to encoded frames: the shared pipeline, fed with the converter's counts.

use tonus_shared::{
    pipeline::{
        ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Health, Pipeline, PipelineConfig, PipelineError,
    },
    sample::{AdcScale, AdcScaleError, Scan},
    semg::chain::ChainConfig,
    stiffness::ArmStiffness,
    wire::{Frame, Muscle, STREAM_FRAME_BYTES, WireError},
};

use crate::{
    acquisition::{BUFFER_SCANS, Block, CHANNELS, PERIOD_US, RATE_HZ, ScanClock},
    outbox::{EncodedFrame, Outbox},
};

/// Counts of the 12-bit converter.
const COUNTS: i32 = 4096;
/// Its range: 0.6 V internal reference at a gain of one sixth.
const RANGE_V: f64 = 3.6;
/// Gain of the analogue amplifier between electrodes and converter.
const AMPLIFIER_GAIN: f64 = 200.0;
/// What the amplifier gives for 0 V at the electrodes: 1.65 V, half of its supply.
const BIAS_COUNTS: i32 = 1877;

/// Why the signal path could not be set up.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SetupError {
    /// The converter's constants contradict each other.
    #[error(transparent)]
    Scale(#[from] AdcScaleError),
    /// The pipeline refused its configuration.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
}

/// The wearable's signal path, independent of the converter that fills the buffers.
pub struct SignalPath {
    pipeline: Pipeline<CHANNELS>,
    clock: ScanClock,
    lost: u32,
}

impl SignalPath {
    /// A signal path for one electrode pair over the biceps, with **illustrative** levels and arm: good for
    /// seeing that a contraction shows, not for its strength.
    ///
    /// `boot_id` is a random number drawn at start.
    ///
    /// # Errors
    /// [`SetupError`] when a constant of this module is impossible.
    pub fn new(boot_id: u32) -> Result<Self, SetupError> {
        let volts_per_count = RANGE_V / f64::from(COUNTS) / AMPLIFIER_GAIN;
        let pipeline = Pipeline::new(&PipelineConfig {
            boot_id,
            firmware_hash: [0; 8],
            adc: AdcScale::new(volts_per_count, BIAS_COUNTS, 0, COUNTS - 1)?,
            chain: ChainConfig::at_rate(f64::from(RATE_HZ)),
            channels: [ChannelConfig {
                muscle: Muscle::BicepsLong,
                rest_v: 10e-6,
                mvc_v: 500e-6,
            }],
            activation_window_s: DEFAULT_ACTIVATION_WINDOW_S,
            arm: ArmStiffness::illustrative(),
            raw: false,
        })?;
        Ok(Self {
            pipeline,
            clock: ScanClock::new(PERIOD_US, BUFFER_SCANS as u32),
            lost: 0,
        })
    }

    /// Takes one full buffer, seen at device time `seen_us` (microseconds), and leaves what is due in `outbox`.
    ///
    /// **Budget.** One buffer's time, 5 ms: afterwards the converter overwrites the next buffer. That is not
    /// queued for; the pipeline sees the gap and says so in its packets.
    ///
    /// # Errors
    /// [`WireError`] for a frame that could not be encoded; it is dropped, the scans are taken all the same.
    pub fn buffer_full(
        &mut self,
        seen_us: u64,
        buffer: &[[i16; CHANNELS]; BUFFER_SCANS],
        outbox: &Outbox,
    ) -> Result<Block, WireError> {
        let block = self.clock.buffer_full(seen_us);
        if block.lost > 0 {
            self.lost = self.lost.wrapping_add(block.lost);
            self.pipeline.set_health(Health {
                overruns: self.lost,
                ..Health::default()
            });
        }
        let mut sent = Ok(());
        for (number, counts) in (0_u32..).zip(buffer) {
            let scan = Scan {
                index: block.first_index.wrapping_add(number),
                acquired_us: block.first_acquired_us + u64::from(number * PERIOD_US),
                counts: counts.map(i32::from),
            };
            if self.pipeline.push_scan(&scan).is_err() {
                continue; // The pipeline counted it; the status packet tells.
            }
            while let Some(frame) = self.pipeline.next_frame() {
                match encoded(&frame) {
                    Ok(bytes) => outbox.put(frame.packet.kind(), bytes),
                    Err(error) => sent = Err(error),
                }
            }
        }
        sent.map(|()| block)
    }
}

fn encoded(frame: &Frame) -> Result<EncodedFrame, WireError> {
    let mut bytes = [0; STREAM_FRAME_BYTES];
    let length = frame.encode(&mut bytes)?;
    let mut encoded = EncodedFrame::from_array(bytes);
    encoded.truncate(length);
    Ok(encoded)
}

#[cfg(test)]
mod tests;

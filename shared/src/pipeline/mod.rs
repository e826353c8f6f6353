//! Scans in, packets out: the signal path of the wearable, without input or output of its own.
//!
//! Firmware, the simulated wearer and the Myo run this one pipeline:
//!
//! ```text
//! push_scan -> chain -> normalise -> activation -> co-contraction -+-> stiffness -> Stream
//!           \-> quality                                            |
//! set_hand, set_orientation or set_attitude -> posture -------------/
//! next_frame <- Configuration, Stream, Orientation, Status, RawSemg
//! ```
//!
//! Words: a *tick* is one period of the stream (10 ms of device time); a *source* is what a posture
//! rests on (hand, upper arm, both, or neither); *held* means that the last value stands, and a flag says so.

mod arm;
mod blend;
mod calibration;
mod config;
mod heading;
mod input;
mod outbox;
mod schedule;
mod signal;

pub use calibration::{Board, CalibrationError, illustrative};
pub use config::{ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, PipelineConfig, PipelineError};
pub use heading::{HANGING, HeadingError};
pub use input::{Health, InputError};
pub use schedule::STREAM_HZ;
pub use signal::activation_weight;

use crate::sample::{AdcScale, Scan};
use crate::stiffness::ArmStiffness;
use crate::wire::{
    Configuration, Frame, Header, MAX_CHANNELS, MAX_STIFFNESS_N_PER_M, Orientation, Packet, Status,
    Stream, StreamFlags,
};

use arm::{Arm, Source};
use blend::Blend;
use input::{Inputs, Placement, Scans};
use outbox::{Outbox, Timed};
use schedule::Schedule;
use signal::{Design, Signals};

/// The signal path of one wearable with `C` channels, 1 to 8.
///
/// RAM: 2.3 kB per channel and 4 kB besides (a channel's smoother keeps room for its longest window).
#[derive(Debug)]
pub struct Pipeline<const C: usize> {
    boot_id: u32,
    sequence: u32,
    configuration: Configuration,
    adc: AdcScale,
    arm_stiffness: ArmStiffness<f32>,
    describes_before_us: u32,
    scans: Scans,
    inputs: Inputs,
    signals: Signals<C>,
    arm: Arm,
    blend: Blend<(Source, bool)>,
    co_contraction: f32,
    schedule: Schedule,
    outbox: Outbox,
    health: Health,
}

impl<const C: usize> Pipeline<C> {
    /// Designs the filters and checks every calibration value.
    ///
    /// # Errors
    /// [`PipelineError`] names the part that cannot work, with its values.
    pub fn new(config: &PipelineConfig<C>) -> Result<Self, PipelineError> {
        const { assert!(C >= 1 && C <= MAX_CHANNELS, "1 to 8 channels") }
        let design = Design::new(config)?;
        let (arm, resting) = Arm::new(&config.arm)?;
        let chain_delay_us = config::microseconds(design.chain_delay_s());
        Ok(Self {
            boot_id: config.boot_id,
            sequence: 0,
            configuration: config.packet(chain_delay_us)?,
            adc: config.adc,
            arm_stiffness: config.arm,
            describes_before_us: config::microseconds(design.delay_s()),
            scans: Scans::new(config::microseconds(design.memory_s())),
            inputs: Inputs::default(),
            signals: Signals::new(design),
            arm,
            blend: Blend::new(resting),
            co_contraction: 1.0,
            schedule: Schedule::new(config.chain.rate_hz),
            outbox: Outbox::new(config.raw),
            health: Health::default(),
        })
    }

    /// Whether [`Self::reconfigure`] would take it; nothing is kept.
    ///
    /// # Errors
    /// As [`Self::new`].
    pub fn check(config: &PipelineConfig<C>) -> Result<(), PipelineError> {
        let design = Design::new(config)?;
        Arm::new(&config.arm)?;
        config.packet(config::microseconds(design.chain_delay_s()))?;
        Ok(())
    }

    /// Changes over to other filters, levels and arm, and goes on numbering.
    ///
    /// The filters start anew, as after a long gap: until they have settled the activation is held at what was last
    /// believed, and flagged. The stiffness goes over to the new arm's without a step. Counters, device time and
    /// boot id stay (the configuration's boot id is not looked at), and a configuration packet is due.
    ///
    /// # Errors
    /// As [`Self::new`]; nothing has changed then.
    pub fn reconfigure(&mut self, config: &PipelineConfig<C>) -> Result<(), PipelineError> {
        let design = Design::new(config)?;
        let (arm, _) = Arm::new(&config.arm)?;
        self.configuration = config.packet(config::microseconds(design.chain_delay_s()))?;
        self.describes_before_us = config::microseconds(design.delay_s());
        self.scans.restart(config::microseconds(design.memory_s()));
        self.signals.change_over(design);
        self.arm = arm;
        self.arm_stiffness = config.arm;
        self.blend.leave_source();
        self.schedule.set_rate(config.chain.rate_hz);
        self.adc = config.adc;
        self.outbox.set_raw(config.raw);
        self.outbox.configuration = true;
        Ok(())
    }

    /// Whether raw sEMG goes out from now on; a configuration packet that says so is due.
    ///
    /// # Errors
    /// [`PipelineError::RawRange`] when the converter's counts do not fit the packet; nothing has changed then.
    pub fn set_raw(&mut self, raw: bool) -> Result<(), PipelineError> {
        if raw {
            config::check_raw(&self.adc)?;
        }
        self.configuration.raw = raw;
        self.outbox.set_raw(raw);
        self.outbox.configuration = true;
        Ok(())
    }

    /// Takes one scan; afterwards [`Self::next_frame`] gives what is due.
    ///
    /// **Budget.** One sampling period: 500 us at 2 kHz, 32,000 cycles of a Cortex-M4F at 64 MHz. Instructions
    /// counted under QEMU for that core, four channels with a notch: 310 per channel and scan, quality blocks' ends included; a
    /// tick adds one posture and one Cartesian stiffness, 22,000 at `opt-level` 3 and 48,000 at "s", so that
    /// the caller must buffer at least four scans at 2 kHz. That makes 7 or 10 million instructions a
    /// second in all. Cycles and time are unmeasured on a board. Run it below the priority of every hardware
    /// interrupt, and above whatever may compute for longer than those scans.
    ///
    /// **Overrun.** A caller that falls behind skips scans instead of queueing them. The index then jumps: the
    /// missing scans are counted, the stream keeps its 10 ms grid and carries [`StreamFlags::GAP`] until the filters
    /// have forgotten. A gap of over 0.1 s restarts the filters, and the activation is held until they have settled.
    ///
    /// **Start.** The filters start as if the first scan had always been there, so the activation rises from rest
    /// within about four delays of the chain (0.3 s by default), and no flag says so: whoever acts on the stream waits that long
    /// after a new boot id.
    ///
    /// # Errors
    /// [`InputError`] for a scan that is not newer than the last; it is counted and changes nothing.
    pub fn push_scan(&mut self, scan: &Scan<C>) -> Result<(), InputError> {
        let placement = self.scans.place(scan.index, scan.acquired_us);
        let Placement { missed, long_gap } = self.counted(placement)?;
        if long_gap {
            self.signals.restart();
        }
        let settling = self.scans.settling();
        let refused = self.signals.step(&scan.counts, settling);
        self.inputs.refused = self.inputs.refused.wrapping_add(refused);
        self.outbox.raw(scan, missed > 0 || long_gap);
        let due = self.schedule.advance(missed);
        if due.stream {
            let stream = self.stream(scan.acquired_us);
            self.outbox.stream(Timed {
                value: stream,
                device_us: scan.acquired_us,
            });
        }
        self.outbox.configuration |= due.configuration;
        self.outbox.status |= due.status;
        Ok(())
    }

    /// Where the hand is (palm centre in the shoulder frame, m), or that the tracker does not see it; `acquired_us`
    /// is when, on the wearable's clock. A hand older than 0.1 s counts as not seen.
    ///
    /// # Errors
    /// [`InputError`] for values that are not finite, times ahead of the newest scan by more than 0.1 s, and times
    /// not newer than the last; it is counted and changes nothing.
    pub fn set_hand(
        &mut self,
        position_m: Option<[f32; 3]>,
        acquired_us: u64,
    ) -> Result<(), InputError> {
        let set = self
            .inputs
            .hand
            .set(position_m, acquired_us, self.scans.newest_us());
        self.counted(set)
    }

    /// The attitude of the upper arm (unit quaternion x, y, z, w; upper-arm frame to shoulder frame) at device time
    /// `acquired_us`. It goes out as a packet, and counts for 0.1 s.
    ///
    /// # Errors
    /// As [`Self::set_hand`], and for a norm further than 0.001 from one.
    pub fn set_orientation(&mut self, xyzw: [f32; 4], acquired_us: u64) -> Result<(), InputError> {
        let newest_us = self.scans.newest_us();
        let set = input::checked_quaternion(xyzw).and_then(|()| {
            self.inputs
                .orientation
                .set(Some(xyzw), acquired_us, newest_us)
        });
        self.counted(set)?;
        self.outbox.orientation(Timed {
            value: Orientation { xyzw },
            device_us: acquired_us,
        });
        Ok(())
    }

    /// The attitude of the upper arm as [`Self::set_orientation`] takes it, but in a level frame (z up) whose heading nobody
    /// knows. It goes out as a packet, and counts once [`Self::face_forward`] has told where forward is.
    ///
    /// # Errors
    /// As [`Self::set_orientation`].
    pub fn set_attitude(&mut self, xyzw: [f32; 4], acquired_us: u64) -> Result<(), InputError> {
        let newest_us = self.scans.newest_us();
        let set = input::checked_quaternion(xyzw)
            .and_then(|()| self.inputs.heading.set(xyzw, acquired_us, newest_us));
        if let Some(turned) = self.counted(set)? {
            return self.set_orientation(turned, acquired_us);
        }
        self.outbox.orientation(Timed {
            value: Orientation { xyzw },
            device_us: acquired_us,
        });
        Ok(())
    }

    /// The upper arm hangs and the elbow is bent forward: where its x axis points now is forward, from now on. The stiffness
    /// goes over to the new posture without a step.
    ///
    /// # Errors
    /// [`HeadingError`]; what was known stands.
    pub fn face_forward(&mut self) -> Result<(), HeadingError> {
        let now_us = self.scans.newest_us().ok_or(HeadingError::NoAttitude)?;
        self.inputs.heading.face_forward(now_us)?;
        self.blend.leave_source();
        Ok(())
    }

    /// The front end's own lead-off detection, per channel, from now on.
    pub fn set_lead_off(&mut self, lead_off: [bool; C]) {
        self.signals.lead_off = lead_off;
    }

    /// What only the board knows, for the status packets from now on.
    pub fn set_health(&mut self, health: Health) {
        self.health = health;
    }

    /// The next packet due: configuration, stream, orientation, raw counts, status; none when all is out. Take all of
    /// them after each scan: one that still waits when its successor is ready is replaced, never queued. What is
    /// replaced counts as dropped, but for configuration and status, which hold nothing that the next ones do not.
    pub fn next_frame(&mut self) -> Option<Frame> {
        let now_us = self.scans.newest_us()?;
        let (packet, device_us) = if core::mem::take(&mut self.outbox.configuration) {
            (Packet::Configuration(self.configuration), now_us)
        } else if let Some(waiting) = self.outbox.take() {
            waiting
        } else if core::mem::take(&mut self.outbox.status) {
            (Packet::Status(self.status()), now_us)
        } else {
            return None;
        };
        Some(self.number(packet, device_us))
    }

    /// Gives any other packet of this wearable (the reply to a ping, an inference) its header: one sequence
    /// counts all that a sender sends.
    pub fn number(&mut self, packet: Packet, device_us: u64) -> Frame {
        let sequence = self.sequence;
        self.sequence = sequence.wrapping_add(1);
        Frame {
            header: Header {
                boot_id: self.boot_id,
                sequence,
                device_us,
            },
            packet,
        }
    }

    /// The stream packet of this tick.
    fn stream(&mut self, now_us: u64) -> Stream {
        let (activation, activation_held) = self.signals.activation();
        let pose = self.arm.pose(&self.inputs, now_us);
        let computed = self.arm_stiffness.at(activation, &pose.posture).ok();
        if let Some(stiffness) = &computed {
            self.co_contraction = stiffness.co_contraction;
        }
        let diagonal = computed
            .filter(|_| !pose.held)
            .map(|stiffness| <[f32; 3]>::from(stiffness.cartesian.diagonal()))
            .filter(|diagonal| diagonal.iter().all(|k| *k <= MAX_STIFFNESS_N_PER_M));
        let held = diagonal.is_none();
        let stiffness_n_per_m = self.blend.step(diagonal, (pose.source, activation_held));
        let flags = pose
            .flags
            .with(StreamFlags::GAP, self.scans.gap_remembered())
            .with(StreamFlags::STIFFNESS_HELD, held)
            .with(StreamFlags::ACTIVATION_HELD, activation_held)
            .with(StreamFlags::BLENDING, self.blend.under_way());
        Stream {
            describes_before_us: self.describes_before_us,
            envelopes: signal::slots(self.signals.envelopes()),
            activation,
            co_contraction: self.co_contraction,
            stiffness_n_per_m,
            quality: signal::slots(self.signals.quality()),
            channels: self.configuration.channels,
            flags,
        }
    }

    fn status(&mut self) -> Status {
        Status {
            uptime_s: self.scans.uptime_s(),
            battery_mv: self.health.battery_mv,
            reset_reason: self.health.reset_reason,
            overruns: self.health.overruns,
            gaps: self.scans.gaps,
            missed_scans: self.scans.missed,
            refused: self.inputs.refused,
            dropped_packets: self
                .outbox
                .dropped
                .wrapping_add(self.health.dropped_packets),
            quality: signal::slots(self.signals.take_quality_since_status()),
            flags: self.health.flags,
            dropped_hypotheses: self.health.dropped_hypotheses,
            refused_requests: self.health.refused_requests,
            links: self.health.links,
            lost_reports: self.health.lost_reports,
        }
    }

    fn counted<V>(&mut self, result: Result<V, InputError>) -> Result<V, InputError> {
        if result.is_err() {
            self.inputs.refused = self.inputs.refused.wrapping_add(1);
        }
        result
    }
}

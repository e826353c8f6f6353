//! The wearer connected to the host: the wearable's own pipeline, its packets over a link, the hand's position
//! back over another.
//!
//! Every byte goes the way it will go between wearable and host: frames are encoded, carried by a
//! [`SimulatedLink`] and decoded, in both directions; the pipeline is the one that the firmware runs.

use super::emg::{self, ElectrodesError};
use super::muscle::CHANNELS;
use super::person;
use super::tracker::{TrackedHand, TrackerNoise};
use super::wearer::{CALIBRATION_US, Span, Task, Truth, Wearer};
use crate::link::simulated::{LinkConditions, LinkCounters, NotAProbability, SimulatedLink};
use tonus_shared::pipeline::{
    ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Pipeline, PipelineConfig, PipelineError,
};
use tonus_shared::semg::NonFinite;
use tonus_shared::semg::chain::{Chain, ChainConfig, ChainState};
use tonus_shared::semg::design::DesignError;
use tonus_shared::stiffness::ParameterError;
use tonus_shared::wire::{
    self, Frame, HandPosition, Header, MAX_FRAME_BYTES, Muscle, Packet, WireError,
};

/// Places of the electrodes, in the order of the channels.
const MUSCLES: [Muscle; CHANNELS] = [
    Muscle::BicepsShort,
    Muscle::BicepsLong,
    Muscle::TricepsLateral,
    Muscle::TricepsLong,
];
/// The host's own boot id on the way down.
const HOST_BOOT_ID: u32 = 0x484f_5354;

/// What a rig is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RigConfig {
    /// Errors of the hand tracker.
    pub noise: TrackerNoise,
    /// The link from wearable to host.
    pub up: LinkConditions,
    /// The link from host to wearable.
    pub down: LinkConditions,
    /// Seed of electrodes, tracker, links and boot id.
    pub seed: u64,
}

/// A rig that cannot be built.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum RigError {
    /// The simulated electrodes.
    #[error(transparent)]
    Electrodes(#[from] ElectrodesError),
    /// A link's conditions.
    #[error(transparent)]
    Link(#[from] NotAProbability),
    /// The chain that measures the calibration.
    #[error(transparent)]
    Chain(#[from] DesignError),
    /// A calibration signal that is not finite.
    #[error(transparent)]
    Calibration(#[from] NonFinite),
    /// The person's parameters.
    #[error(transparent)]
    Person(#[from] ParameterError),
    /// The pipeline.
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
    /// A packet that does not fit the wire: the pipeline broke its own limits.
    #[error("a packet of the simulated wearable cannot be encoded: {0}")]
    Encode(#[from] WireError),
}

/// One frame as it reached the host.
#[derive(Debug, Clone, PartialEq)]
pub struct Arrival {
    /// When, microseconds.
    pub at_us: u64,
    /// The frame, or why its bytes were refused.
    pub frame: Result<Frame, WireError>,
}

/// What the host sees of one millisecond, and the truth beside it.
#[derive(Debug, Clone)]
pub struct Step {
    /// The present, microseconds.
    pub now_us: u64,
    /// Frames that arrived, in the order they came out of the link: numbered, but not yet sorted or joined.
    pub arrivals: Vec<Arrival>,
    /// The tracker's frame that arrived, if any.
    pub hand: Option<TrackedHand>,
    /// What the pipeline gave into the link, before encoding: for comparison in tests.
    pub sent: Vec<Frame>,
    /// What is true, for scoring alone.
    pub truth: Truth,
}

/// A wearer, their wearable and both links.
#[derive(Debug)]
pub struct Rig {
    wearer: Wearer,
    pipeline: Pipeline<CHANNELS>,
    up: SimulatedLink,
    down: SimulatedLink,
    hands_sent: u32,
}

impl Rig {
    /// Calibrates the wearer (rest, then a maximum contraction, before time zero), then lets them do the tasks.
    ///
    /// # Errors
    /// [`RigError`] says which part cannot be built.
    pub fn new(tasks: &[Task], config: &RigConfig) -> Result<Self, RigError> {
        let wearer = Wearer::new(tasks, config.noise, config.seed)?;
        let pipeline_config = PipelineConfig {
            #[allow(clippy::cast_possible_truncation, reason = "any 32 bits will do")]
            boot_id: (config.seed ^ 0x746f_6e75) as u32,
            firmware_hash: [0; 8],
            adc: wearer.scale(),
            chain: ChainConfig::at_rate(emg::RATE_HZ),
            channels: calibrate(config.seed)?,
            activation_window_s: DEFAULT_ACTIVATION_WINDOW_S,
            arm: person::stiffness()?,
            raw: false,
        };
        Ok(Self {
            wearer,
            pipeline: Pipeline::new(&pipeline_config)?,
            up: SimulatedLink::new(config.up, config.seed)?,
            // The complement: another seed, so that the two ways fail independently.
            down: SimulatedLink::new(config.down, !config.seed)?,
            hands_sent: 0,
        })
    }

    /// The tasks and their times.
    #[must_use]
    pub fn spans(&self) -> &[Span] {
        self.wearer.spans()
    }

    /// What became of the packets: from the wearable, and to it.
    #[must_use]
    pub fn counters(&self) -> (LinkCounters, LinkCounters) {
        (self.up.counters(), self.down.counters())
    }

    /// One millisecond; none when the tasks are done.
    ///
    /// # Errors
    /// [`RigError::Encode`] when the pipeline gives what the wire cannot carry.
    pub fn step(&mut self) -> Result<Option<Step>, RigError> {
        let Some(moment) = self.wearer.next() else {
            return Ok(None);
        };
        let now_us = moment.scan.acquired_us;
        // The wearer's scans are numbered without repeats, so none is refused.
        let _never_refused = self.pipeline.push_scan(&moment.scan);
        if let Some(hand) = moment.hand {
            self.send_hand(&hand, now_us)?;
        }
        while let Some(delivery) = self.down.poll(now_us) {
            // What the wearable refuses (corrupt, late, doubled) it drops; the pipeline counts the rest.
            if let Ok(Frame {
                header,
                packet: Packet::HandPosition(hand),
            }) = wire::decode(&delivery.bytes)
            {
                let _counted_there = self.pipeline.set_hand(hand.position_m, header.device_us);
            }
        }
        let mut sent = Vec::new();
        let mut bytes = [0; MAX_FRAME_BYTES];
        while let Some(frame) = self.pipeline.next_frame() {
            let length = frame.encode(&mut bytes)?;
            self.up.push(&bytes[..length], now_us);
            sent.push(frame);
        }
        let mut arrivals = Vec::new();
        while let Some(delivery) = self.up.poll(now_us) {
            arrivals.push(Arrival {
                at_us: delivery.at_us,
                frame: wire::decode(&delivery.bytes),
            });
        }
        Ok(Some(Step {
            now_us,
            arrivals,
            hand: moment.hand,
            sent,
            truth: moment.truth,
        }))
    }

    fn send_hand(&mut self, hand: &TrackedHand, now_us: u64) -> Result<(), WireError> {
        #[allow(clippy::cast_possible_truncation, reason = "the packet carries f32")]
        let position_m = hand.position_m.map(|x| x as f32);
        let header = Header {
            boot_id: HOST_BOOT_ID,
            sequence: self.hands_sent,
            device_us: hand.exposed_us,
        };
        let packet = Packet::HandPosition(HandPosition {
            position_m: Some(position_m),
        });
        let mut bytes = [0; MAX_FRAME_BYTES];
        let length = wire::encode(&header, &packet, &mut bytes)?;
        self.hands_sent = self.hands_sent.wrapping_add(1);
        self.down.push(&bytes[..length], now_us);
        Ok(())
    }
}

/// Each channel's envelope at rest and at maximum voluntary contraction, as measured on this seed's electrodes:
/// means over the middle halves of both, which leave out the filters' start and the contraction's ramps.
fn calibrate(seed: u64) -> Result<[ChannelConfig; CHANNELS], RigError> {
    let chain = Chain::<f64>::design(&ChainConfig::at_rate(emg::RATE_HZ))?;
    let mut states = [ChainState::new(); CHANNELS];
    let wearer = Wearer::new(&[Task::Rest, Task::Contract], TrackerNoise::NONE, seed)?;
    let scale = wearer.scale();
    let (mut sums, mut counts) = ([[0.0; 2]; CHANNELS], [0.0; 2]);
    for moment in wearer {
        let at_us = moment.scan.acquired_us;
        let part = usize::from(at_us >= CALIBRATION_US);
        let middle =
            (CALIBRATION_US / 4..CALIBRATION_US * 3 / 4).contains(&(at_us % CALIBRATION_US));
        let counted = middle && at_us < 2 * CALIBRATION_US;
        for ((state, count), sum) in states.iter_mut().zip(moment.scan.counts).zip(&mut sums) {
            let envelope = chain.step(state, scale.volts(count))?;
            if counted {
                sum[part] += envelope;
            }
        }
        if counted {
            counts[part] += 1.0;
        }
    }
    Ok(std::array::from_fn(|channel| ChannelConfig {
        muscle: MUSCLES[channel],
        rest_v: sums[channel][0] / counts[0],
        mvc_v: sums[channel][1] / counts[1],
    }))
}

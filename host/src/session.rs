//! The live loop: what arrives from the wearable and the tracker becomes observations of a movement, a
//! recognised skill, and commands to the robot.
//!
//! The session reads no clock, file or radio: everything comes in as an [`Event`] with its time, so that a
//! live run, a replay and a simulation are the same run. An observation enters at the instant it
//! *describes*: the tracker's exposure, the stream's device time less the chain's delay. A command is aged
//! by the newest *scan* behind it.
//!
//! A movement's start and duration are announced by [`Event::Began`], an oracle (a cue, a foot switch), or inferred
//! ([`Session::inferring`]): motion of the hand begins it, and a bank of hypotheses follows it.
//!
//! A session may be given a novelty gate ([`Session::watching`]). A movement that the gate finds in no skill of the library
//! is unknown until it ends: nothing is decided on, and every command says so ([`Quality::Novel`]), on which the robot
//! holds. One of which the gate missed too much to judge is undecided until it ends ([`Quality::Undecided`]), and the robot
//! holds as well.

mod config;
mod error;
mod event;
mod follower;
mod movement;
mod watchman;

pub use config::SessionConfig;
pub use error::SessionError;
pub use event::Event;
pub use movement::Decision;
pub use watchman::NoveltyReport;

use crate::model::novelty::{Gate, StreamError};
use crate::model::recognise::{Prediction, Recogniser};
use crate::model::tempo::TempoRecogniser;
use crate::robot::command::{Command, Quality};
use crate::robot::gate;
use follower::{Follower, Inferred, Reading, Sensor};
use tonus_shared::onset::{OnsetConfig, OnsetDetector};
use tonus_shared::semg::quality::Quality as ChannelQuality;
use tonus_shared::wire::{Frame, Packet, SequenceCounts, SequenceTracker, Stream, StreamFlags};
use watchman::Watchman;

/// Degrees of freedom that the session observes (human) and commands (robot): metres and N/m.
pub const DOFS: [&str; 12] = [
    "human_x", "human_y", "human_z", "human_kx", "human_ky", "human_kz", "robot_x", "robot_y",
    "robot_z", "robot_kx", "robot_ky", "robot_kz",
];
/// First places in [`DOFS`] of the hand's position and stiffness.
const HAND: usize = 0;
const HAND_STIFFNESS: usize = 3;
/// First places in [`DOFS`] of the robot's position and stiffness.
const ROBOT: usize = 6;
const ROBOT_STIFFNESS: usize = 9;
/// A command is void this long after the newest scan behind it, microseconds.
const COMMAND_LIFE_US: u64 = gate::HOLD_AGE_US;

/// One wearer, one model, one robot.
#[derive(Debug)]
pub struct Session<'m> {
    config: SessionConfig,
    follower: Follower<'m>,
    watchman: Option<Watchman<'m>>,
    dofs: [usize; DOFS.len()],
    frames: SequenceTracker,
    newest: Option<Stream>,
    commands: u32,
}

impl<'m> Session<'m> {
    /// A session at rest, to which start and duration of each movement are announced.
    ///
    /// # Errors
    /// [`SessionError::MissingDof`] when the model lacks one of [`DOFS`].
    pub fn new(recogniser: Recogniser<'m>, config: SessionConfig) -> Result<Self, SessionError> {
        let follower = Follower::Announced {
            recogniser: Box::new(recogniser),
            movement: None,
        };
        Self::following(follower, config)
    }

    /// A session at rest that finds start and duration by itself: the hand's motion begins a movement, a bank of hypotheses
    /// follows it, and it is over when most of the posterior says so and the hand rests. Each sensor is
    /// observed every `interval_us`, whatever [`SessionConfig::observations`] is.
    ///
    /// # Errors
    /// As [`Session::new`]; a detector that cannot be.
    pub fn inferring(
        recogniser: TempoRecogniser<'m>,
        onset: &OnsetConfig,
        interval_us: u64,
        config: SessionConfig,
    ) -> Result<Self, SessionError> {
        let detector = OnsetDetector::new(onset)?;
        let inferred = Inferred::new(recogniser, detector, interval_us);
        Self::following(Follower::Inferred(Box::new(inferred)), config)
    }

    fn following(follower: Follower<'m>, config: SessionConfig) -> Result<Self, SessionError> {
        let model = follower.model();
        let mut dofs = [0; DOFS.len()];
        for (slot, name) in dofs.iter_mut().zip(DOFS) {
            *slot = model.dof(name).ok_or_else(|| {
                let present = model.dofs().iter().map(|dof| dof.name.clone()).collect();
                SessionError::MissingDof { name, present }
            })?;
        }
        Ok(Self {
            config,
            follower,
            watchman: None,
            dofs,
            frames: SequenceTracker::new(),
            newest: None,
            commands: 0,
        })
    }

    /// The same session, which holds the robot while a movement is none of the library's. The gate looks at every sample of
    /// the hand, and of its stiffness where [`SessionConfig::use_semg`], not only at those observed.
    ///
    /// # Errors
    /// [`SessionError::ForeignGate`] for a gate of another model, [`SessionError::Unobserved`] for one that needs what
    /// the session does not see.
    pub fn watching(mut self, gate: &'m Gate) -> Result<Self, SessionError> {
        let observed = if self.config.use_semg {
            ROBOT
        } else {
            HAND_STIFFNESS
        };
        let model = self.follower.model();
        self.watchman = Some(Watchman::new(gate, model, &DOFS[..observed])?);
        Ok(self)
    }

    /// Takes what happened at `now_us`; a fresh stream packet gives a command.
    ///
    /// # Errors
    /// [`SessionError::Recognise`] or [`SessionError::Novelty`] when model or gate refuse a number; the session goes on
    /// without it.
    pub fn handle(
        &mut self,
        event: Event<'_>,
        now_us: u64,
    ) -> Result<Option<Command>, SessionError> {
        match event {
            Event::Began { at_us, duration_us } => {
                let begins = self.follower.began(at_us, duration_us);
                self.watch_anew(begins);
                Ok(None)
            }
            Event::Ended => {
                self.follower.ended();
                Ok(None)
            }
            Event::Hand {
                exposed_us,
                position_m,
            } => self.hand(exposed_us, position_m, now_us).map(|()| None),
            Event::Frame(frame) => self.frame(frame, now_us),
        }
    }

    /// Probability of each skill, in the model's order.
    #[must_use]
    pub fn posterior(&self) -> Vec<f64> {
        self.follower.posterior()
    }

    /// Whether a movement is under way.
    #[must_use]
    pub fn under_way(&self) -> bool {
        self.follower.movement().is_some()
    }

    /// What the novelty gate says of the movement under way; `None` at rest, without a gate, and before it has seen its
    /// first instant.
    #[must_use]
    pub fn novelty(&self) -> Option<NoveltyReport<'m>> {
        self.follower.movement()?;
        self.watchman.as_ref()?.report()
    }

    /// Phase of the movement under way at a time; `None` at rest.
    #[must_use]
    pub fn phase(&self, at_us: u64) -> Option<f64> {
        self.follower.phase(at_us)
    }

    /// What the skills, weighted by their posteriors, expect at a time; `None` at rest.
    ///
    /// # Errors
    /// [`SessionError::Recognise`] for what the model cannot foretell.
    pub fn foretell(&mut self, at_us: u64) -> Result<Option<Foretold>, SessionError> {
        let Some(robot) = self.expected(at_us)? else {
            return Ok(None);
        };
        let mut hand = [None; 3];
        for (axis, slot) in hand.iter_mut().enumerate() {
            *slot = self.follower.expected(self.dofs[HAND + axis], at_us)?;
        }
        let [Some(x), Some(y), Some(z)] = hand else {
            return Ok(None);
        };
        let hand = [x, y, z];
        Ok(Some(Foretold { hand, robot }))
    }

    /// Whether the movement under way is none of the library's.
    #[must_use]
    pub fn unknown(&self) -> bool {
        let judged = self.watchman.as_ref().is_some_and(Watchman::unknown);
        judged && self.under_way()
    }

    /// Whether the gate missed so much of the movement under way that it cannot say what that is.
    #[must_use]
    pub fn unjudged(&self) -> bool {
        let missed = self.watchman.as_ref().is_some_and(Watchman::missed);
        missed && self.under_way()
    }

    /// The decision of the movement under way, if there was one; one that becomes unknown has none.
    #[must_use]
    pub fn decision(&self) -> Option<Decision> {
        self.follower.movement()?.decision
    }

    /// The newest stream packet.
    #[must_use]
    pub fn stream(&self) -> Option<&Stream> {
        self.newest.as_ref()
    }

    /// What the sequence numbers say of the link.
    #[must_use]
    pub fn frames(&self) -> SequenceCounts {
        self.frames.counts()
    }

    fn hand(
        &mut self,
        exposed_us: u64,
        position_m: [f64; 3],
        now_us: u64,
    ) -> Result<(), SessionError> {
        let sigma = self.config.position_sigma_m;
        let [x, y, z] = position_m;
        let [at, beside, above] = [0, 1, 2].map(|axis: usize| self.dofs[HAND + axis]);
        let readings = [(at, x, sigma), (beside, y, sigma), (above, z, sigma)];
        let follower = &mut self.follower;
        let begins = follower.watch(exposed_us, position_m)?;
        let news = follower.observe(Sensor::Hand, exposed_us, &readings, &self.config);
        self.watch_anew(begins);
        self.look(exposed_us, &readings)?;
        if news? {
            self.decide(now_us);
        }
        Ok(())
    }

    fn watch_anew(&mut self, begins: bool) {
        if let Some(watchman) = self.watchman.as_mut().filter(|_| begins) {
            watchman.reset();
        }
    }

    /// Shows the novelty gate what a sensor saw. Of what becomes unknown nothing stays decided.
    fn look(&mut self, at_us: u64, readings: &[Reading; 3]) -> Result<(), StreamError> {
        let (Some(watchman), Some(phase)) = (&mut self.watchman, self.follower.phase(at_us)) else {
            return Ok(());
        };
        let looked = watchman.look(phase, readings);
        if let Some(movement) = self.follower.movement_mut().filter(|_| watchman.unknown()) {
            movement.decision = None;
        }
        looked
    }

    fn frame(&mut self, frame: &Frame, now_us: u64) -> Result<Option<Command>, SessionError> {
        let header = frame.header;
        let arrival = self.frames.observe(header.boot_id, header.sequence);
        if !arrival.is_newest() {
            return Ok(None);
        }
        match &frame.packet {
            Packet::Stream(stream) => {
                self.newest = Some(*stream);
                self.stiffness(stream, header.device_us, now_us)?;
                self.command(stream, frame, now_us).map(Some)
            }
            // Shown or answered elsewhere; none of them moves the robot.
            Packet::Configuration(_)
            | Packet::RawSemg(_)
            | Packet::Orientation(_)
            | Packet::HandPosition(_)
            | Packet::Ping(_)
            | Packet::Inference(_)
            | Packet::Status(_)
            | Packet::Control(_)
            | Packet::Calibration(_)
            | Packet::ModelUpload(_)
            | Packet::ModelState(_)
            | Packet::Reply(_)
            | Packet::LastWords(_) => Ok(None),
        }
    }

    fn stiffness(
        &mut self,
        stream: &Stream,
        device_us: u64,
        now_us: u64,
    ) -> Result<(), SessionError> {
        let describes_us = stream.describes_us(device_us);
        if !self.config.use_semg || quality(stream) != Quality::Good {
            return Ok(());
        }
        let values = stream.stiffness_n_per_m.map(f64::from);
        let readings = [0, 1, 2].map(|axis: usize| {
            let sigma = self.config.stiffness_sigma * values[axis];
            (self.dofs[HAND_STIFFNESS + axis], values[axis], sigma)
        });
        let follower = &mut self.follower;
        let news = follower.observe(Sensor::Stiffness, describes_us, &readings, &self.config);
        self.look(describes_us, &readings)?;
        if news? {
            self.decide(now_us);
        }
        Ok(())
    }

    /// What the skills, weighted by their posteriors, expect of the robot now; `None` at rest.
    fn expected(&mut self, now_us: u64) -> Result<Option<[Axis; 3]>, SessionError> {
        let mut all = [None; 3];
        for (axis, slot) in all.iter_mut().enumerate() {
            let [place, firmness] = [ROBOT, ROBOT_STIFFNESS].map(|first| self.dofs[first + axis]);
            let place = self.follower.expected(place, now_us)?;
            let firmness = self.follower.expected(firmness, now_us)?;
            *slot = place.zip(firmness);
        }
        let [Some(x), Some(y), Some(z)] = all else {
            return Ok(None);
        };
        Ok(Some([x, y, z]))
    }

    fn decide(&mut self, now_us: u64) {
        if self.unknown() {
            return;
        }
        let posterior = self.posterior();
        let Some(movement) = self.follower.movement_mut() else {
            return;
        };
        let least = if self.config.use_semg {
            movement.hands.count.min(movement.stiffnesses.count)
        } else {
            movement.hands.count
        };
        if least < self.config.decide_after {
            return;
        }
        let best = posterior
            .iter()
            .enumerate()
            .max_by(|a, b| a.1.total_cmp(b.1));
        let Some((skill, &posterior)) = best.filter(|(_, p)| **p >= self.config.decide_at) else {
            return;
        };
        #[allow(clippy::cast_precision_loss, reason = "movements last seconds")]
        let after_s = now_us.saturating_sub(movement.began_us) as f64 * 1e-6;
        movement.decision.get_or_insert(Decision {
            skill,
            posterior,
            after_s,
        });
    }

    /// Home between movements; in one, what the skills together expect of the robot at this phase. They are
    /// acted on as soon as they agree closely enough, which may be before any of them is decided on: the lifts
    /// differ only once the object is grasped.
    fn command(
        &mut self,
        stream: &Stream,
        frame: &Frame,
        now_us: u64,
    ) -> Result<Command, SessionError> {
        let acquired_us = frame.header.device_us;
        let mut command = Command {
            position_m: self.config.home_m,
            velocity_m_per_s: [0.0; 3],
            stiffness_n_per_m: self.config.home_stiffness_n_per_m,
            damping_ratio: self.config.damping_ratio,
            acquired_us,
            // A wearable may claim any time; the gate refuses one from the future.
            valid_until_us: acquired_us.saturating_add(COMMAND_LIFE_US),
            sequence: self.commands,
            boot_id: frame.header.boot_id,
            quality: quality(stream),
        };
        if let Some(robot) = self.expected(now_us)? {
            let uncertain = (robot.iter()).any(|(place, _)| place.std > self.config.act_within_m);
            if uncertain || self.unjudged() {
                command.quality = command.quality.max(Quality::Undecided);
            }
            if self.unknown() {
                command.quality = command.quality.max(Quality::Novel);
            }
            for (axis, (place, firmness)) in robot.into_iter().enumerate() {
                command.position_m[axis] = place.mean;
                command.velocity_m_per_s[axis] = place.rate;
                command.stiffness_n_per_m[axis] = firmness.mean;
            }
        }
        self.commands = self.commands.wrapping_add(1);
        Ok(command)
    }
}

/// What is expected at one instant, axis by axis.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Foretold {
    /// The hand's place, metres.
    pub hand: [Prediction; 3],
    /// The robot's place, metres, and stiffness, N/m.
    pub robot: [(Prediction, Prediction); 3],
}

/// Place and firmness of the robot on one axis.
type Axis = (Prediction, Prediction);

/// A channel in use that is bad, or a stiffness that is not of this instant, is no ground to move on.
fn quality(stream: &Stream) -> Quality {
    let channels = usize::from(stream.channels).min(stream.quality.len());
    let bad_channel = (stream.quality[..channels].iter()).any(|bits| *bits != ChannelQuality::GOOD);
    let held = stream.flags.contains(StreamFlags::STIFFNESS_HELD)
        || stream.flags.contains(StreamFlags::ACTIVATION_HELD);
    if bad_channel || held {
        Quality::SignalFault
    } else {
        Quality::Good
    }
}

#[cfg(test)]
mod tests;

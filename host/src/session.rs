//! The live loop: what arrives from the wearable and the tracker becomes observations of a movement, a
//! recognised skill, and commands to the robot.
//!
//! The session reads no clock, file or radio: everything comes in as an [`Event`] with its time, so that a
//! live run, a replay and a simulation are the same run. An observation enters at the instant it
//! *describes*: the tracker's exposure, the stream's device time less the chain's delay. A command is aged
//! by the newest *scan* behind it.
//!
//! A movement's start and duration are announced by [`Event::Began`]: an oracle (a cue, a foot switch),
//! until onset and tempo are inferred too.

mod movement;

pub use movement::Decision;

use crate::model::recognise::{Prediction, RecogniseError, Recogniser};
use crate::robot::command::{Command, Quality};
use crate::robot::gate;
use movement::Movement;
use tonus_shared::semg::quality::Quality as ChannelQuality;
use tonus_shared::wire::{Frame, Packet, SequenceCounts, SequenceTracker, Stream, StreamFlags};

/// Degrees of freedom that the session observes (human) and commands (robot): metres and N/m.
pub const DOFS: [&str; 12] = [
    "human_x", "human_y", "human_z", "human_kx", "human_ky", "human_kz", "robot_x", "robot_y",
    "robot_z", "robot_kx", "robot_ky", "robot_kz",
];
/// Places in [`DOFS`] of the hand's position and stiffness.
const HAND: std::ops::Range<usize> = 0..3;
const HAND_STIFFNESS: std::ops::Range<usize> = 3..6;
/// First places in [`DOFS`] of the robot's position and stiffness.
const ROBOT: usize = 6;
const ROBOT_STIFFNESS: usize = 9;
/// A command is void this long after the newest scan behind it, microseconds.
const COMMAND_LIFE_US: u64 = gate::HOLD_AGE_US;

/// How the session observes, decides and commands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SessionConfig {
    /// Observations of each sensor in one movement, one in each of so many equal parts. More is not better: what
    /// a sensor gets wrong at one instant it gets wrong a hundredth of a second later.
    pub observations: u32,
    /// Standard deviation of the tracker's white error, metres.
    pub position_sigma_m: f64,
    /// Standard deviation of a stiffness estimate as a share of it.
    pub stiffness_sigma: f64,
    /// Whether stiffness is observed at all.
    pub use_semg: bool,
    /// Posterior probability at which a skill counts as decided on.
    pub decide_at: f64,
    /// Observations of each sensor before anything is decided.
    pub decide_after: u32,
    /// The robot holds while the standard deviation of where it should be, between and within the skills,
    /// exceeds this on any axis, metres.
    pub act_within_m: f64,
    /// Where the robot waits, its base frame, metres.
    pub home_m: [f64; 3],
    /// How stiff it is while it waits, N/m.
    pub home_stiffness_n_per_m: [f64; 3],
    /// Damping ratio of every command.
    pub damping_ratio: f64,
}

/// Why a session cannot be had from a model.
#[derive(Debug, thiserror::Error)]
pub enum SessionError {
    /// A column is missing.
    #[error("the model has no degree of freedom `{name}`; it has {}", present.join(", "))]
    MissingDof {
        /// Name of [`DOFS`].
        name: &'static str,
        /// What the model has.
        present: Vec<String>,
    },
    /// The model refused an observation or a question.
    #[error(transparent)]
    Recognise(#[from] RecogniseError),
}

/// Everything that can happen to a session.
#[derive(Debug, Clone, Copy)]
pub enum Event<'a> {
    /// A frame of the wearable came through.
    Frame(&'a Frame),
    /// The tracker saw the hand at this place (shoulder frame, metres) at this time.
    Hand {
        /// When the picture was taken, microseconds.
        exposed_us: u64,
        /// Position, metres.
        position_m: [f64; 3],
    },
    /// A movement begins.
    Began {
        /// When, microseconds.
        at_us: u64,
        /// How long it will take, microseconds; not zero.
        duration_us: u64,
    },
    /// The movement is over, the robot goes home.
    Ended,
}

/// One wearer, one model, one robot.
#[derive(Debug)]
pub struct Session<'m> {
    config: SessionConfig,
    recogniser: Recogniser<'m>,
    dofs: [usize; DOFS.len()],
    movement: Option<Movement>,
    frames: SequenceTracker,
    newest: Option<Stream>,
    commands: u32,
}

impl<'m> Session<'m> {
    /// A session at rest.
    ///
    /// # Errors
    /// [`SessionError::MissingDof`] when the model lacks one of [`DOFS`].
    pub fn new(recogniser: Recogniser<'m>, config: SessionConfig) -> Result<Self, SessionError> {
        let model = recogniser.model();
        let mut dofs = [0; DOFS.len()];
        for (slot, name) in dofs.iter_mut().zip(DOFS) {
            *slot = model.dof(name).ok_or_else(|| {
                let present = model.dofs().iter().map(|dof| dof.name.clone()).collect();
                SessionError::MissingDof { name, present }
            })?;
        }
        Ok(Self {
            config,
            recogniser,
            dofs,
            movement: None,
            frames: SequenceTracker::new(),
            newest: None,
            commands: 0,
        })
    }

    /// Takes what happened at `now_us`; a fresh stream packet gives a command.
    ///
    /// # Errors
    /// [`SessionError::Recognise`] when the model refuses a number; the session goes on without it.
    pub fn handle(
        &mut self,
        event: Event<'_>,
        now_us: u64,
    ) -> Result<Option<Command>, SessionError> {
        match event {
            Event::Began { at_us, duration_us } => {
                self.recogniser.reset();
                self.movement = Some(Movement::new(at_us, duration_us));
                Ok(None)
            }
            Event::Ended => {
                self.movement = None;
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
        let log_posterior = self.recogniser.log_posterior();
        log_posterior.into_iter().map(f64::exp).collect()
    }

    /// The decision of the movement under way, if there was one.
    #[must_use]
    pub fn decision(&self) -> Option<Decision> {
        self.movement?.decision
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
        let Some(movement) = &mut self.movement else {
            return Ok(());
        };
        let part = movement.part(exposed_us, self.config.observations);
        if !movement.hands.take(part) {
            return Ok(());
        }
        let phase = movement.phase(exposed_us);
        for (dof, value) in self.dofs[HAND].iter().zip(position_m) {
            let sigma = self.config.position_sigma_m;
            self.recogniser.observe(*dof, phase, value, sigma)?;
        }
        self.decide(now_us);
        Ok(())
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
            | Packet::Status(_) => Ok(None),
        }
    }

    fn stiffness(
        &mut self,
        stream: &Stream,
        device_us: u64,
        now_us: u64,
    ) -> Result<(), SessionError> {
        let describes_us = stream.describes_us(device_us);
        let Some(movement) = &mut self.movement else {
            return Ok(());
        };
        let part = movement.part(describes_us, self.config.observations);
        if !self.config.use_semg
            || quality(stream) != Quality::Good
            || !movement.stiffnesses.take(part)
        {
            return Ok(());
        }
        let phase = movement.phase(describes_us);
        for (dof, value) in self.dofs[HAND_STIFFNESS]
            .iter()
            .zip(stream.stiffness_n_per_m)
        {
            let value = f64::from(value);
            let sigma = self.config.stiffness_sigma * value;
            self.recogniser.observe(*dof, phase, value, sigma)?;
        }
        self.decide(now_us);
        Ok(())
    }

    /// What the skills, weighted by their posteriors, expect of the robot.
    fn expected(&mut self, phase: f64) -> Result<[Axis; 3], SessionError> {
        let weights = self.posterior();
        let mut dof = |name: usize| -> Result<Prediction, SessionError> {
            let skills = 0..weights.len();
            let of_skill = |skill| self.recogniser.predict(skill, self.dofs[name], phase);
            let predictions = skills.map(of_skill).collect::<Result<Vec<_>, _>>()?;
            Ok(mixed(&weights, &predictions))
        };
        let mut axis = |axis| -> Result<Axis, SessionError> {
            Ok((dof(ROBOT + axis)?, dof(ROBOT_STIFFNESS + axis)?))
        };
        Ok([axis(0)?, axis(1)?, axis(2)?])
    }

    fn decide(&mut self, now_us: u64) {
        let posterior = self.posterior();
        let Some(movement) = &mut self.movement else {
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
        if let Some(movement) = self.movement {
            let phase = movement.phase(now_us);
            let duration_s = movement.duration_s();
            let robot = self.expected(phase)?;
            let uncertain = (robot.iter()).any(|(place, _)| place.std > self.config.act_within_m);
            if uncertain {
                command.quality = command.quality.max(Quality::Undecided);
            }
            for (axis, (place, firmness)) in robot.into_iter().enumerate() {
                command.position_m[axis] = place.mean;
                command.velocity_m_per_s[axis] = place.rate / duration_s;
                command.stiffness_n_per_m[axis] = firmness.mean;
            }
        }
        self.commands = self.commands.wrapping_add(1);
        Ok(command)
    }
}

/// Place and firmness of the robot on one axis.
type Axis = (Prediction, Prediction);

/// Moments of the mixture of `predictions` with `weights` that sum to one.
fn mixed(weights: &[f64], predictions: &[Prediction]) -> Prediction {
    let average = |of: fn(&Prediction) -> f64| -> f64 {
        weights
            .iter()
            .zip(predictions)
            .map(|(w, p)| w * of(p))
            .sum()
    };
    let mean = average(|p| p.mean);
    let square = average(|p| p.std * p.std + p.mean * p.mean);
    Prediction {
        mean,
        std: (square - mean * mean).max(0.0).sqrt(),
        rate: average(|p| p.rate),
    }
}

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

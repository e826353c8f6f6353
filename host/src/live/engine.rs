//! The engine: one input after the other.
//!
//! What is learnt while it runs is borrowed by the session that follows it, so the loop is two loops: the outer
//! builds a session for the library of the day, the inner feeds it until there is another library.

use std::sync::Arc;

use tonus_shared::onset::OnsetConfig;
use tonus_shared::wire::Packet;

use super::acts::LearnJob;
use super::calibrating::Calibrating;
use super::config::EngineConfig;
use super::facing::Facing;
use super::follow::{Body, Follow};
use super::input::{HandSeen, Input, LinkEvent, RobotSeen, TrackerEvent};
use super::request::Request;
use super::takes::{Kept, LONGEST_US, Take};
use super::teaching::Teaching;
use super::telling::Moved;
use super::trace::Traces;
use super::view::Message;
use super::wearable::{Heard, Wearable};
use super::world::World;
use crate::clock::ClockError;
use crate::library::Library;
use crate::model::recognise::RecogniseError;
use crate::model::tempo::{TempoConfig, TempoRecogniser};
use crate::robot::command::{Command, Quality};
use crate::robot::limits::ConfigError;
use crate::session::{Event, Session, SessionError};

/// Each sensor is observed so often in a movement, microseconds.
const INTERVAL_US: u64 = 200_000;
/// A robot follows nobody who was not seen for so long, microseconds: more than a passing occlusion.
const SEEN_WITHIN_US: u64 = 300_000;
/// A movement of a hand that was not seen for so long is over, microseconds.
const LOST_AFTER_US: u64 = 1_000_000;
/// Time between two views, microseconds.
const SHOW_EVERY_US: u64 = 40_000;
/// After a view that took long everything else has so many times as long: foretelling at a movement's begin may take longer than
/// the time between two views, and what waits then would never be taken.
const VIEW_SHARE: u64 = 3;

/// Why there is no engine.
#[derive(Debug, thiserror::Error)]
pub enum EngineError {
    /// The clock's configuration.
    #[error(transparent)]
    Clock(#[from] ClockError),
    /// The robot's limits.
    #[error(transparent)]
    Robot(#[from] ConfigError),
    /// A library that no session can follow.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// A library's model.
    #[error(transparent)]
    Model(#[from] RecogniseError),
}

/// Everything that is held from input to input.
#[derive(Debug)]
pub struct Engine {
    pub(super) config: EngineConfig,
    pub(super) now_us: u64,
    pub(super) linked: Option<LinkEvent>,
    pub(super) tracker: Option<TrackerEvent>,
    pub(super) wearable: Wearable,
    /// The newest picture with the hand, shoulder frame.
    pub(super) hand: Option<HandSeen>,
    /// When the newest picture with the hand was taken.
    seen_us: u64,
    /// The same in the robot's base frame, if that was taught.
    pub(super) hand_in_robot_m: Option<[f64; 3]>,
    pub(super) follow: Follow,
    pub(super) calibrating: Calibrating,
    pub(super) facing: Facing,
    pub(super) teaching: Teaching,
    /// Shoulder or robot are elsewhere than before.
    pub(super) reframed: bool,
    pub(super) take: Option<Take>,
    pub(super) kept: Vec<Kept>,
    next_id: u32,
    pub(super) library: Option<Arc<Library>>,
    pub(super) learning: Option<LearnJob>,
    pub(super) learn_problem: Option<String>,
    pub(super) traces: Traces,
    pub(super) history: Vec<Option<String>>,
    pub(super) messages: Vec<Message>,
    /// The next view is due then.
    view_due_us: u64,
    /// When the last view was begun, until the next moment tells how long it took.
    shown_us: Option<u64>,
    pub(super) moved: Moved,
}

/// Why the inner loop ended.
enum Next {
    /// Another library is to be followed.
    Library,
    /// No more inputs.
    End,
}

impl Engine {
    /// At rest, with what was learnt before, if anything.
    ///
    /// # Errors
    /// [`EngineError`].
    pub fn new(
        config: EngineConfig,
        body: Body,
        library: Option<Arc<Library>>,
    ) -> Result<Self, EngineError> {
        Ok(Self {
            wearable: Wearable::new(config.clock, config.boot_id)?,
            follow: Follow::new(config.limits, config.fallback, config.session.home_m, body)?,
            config,
            now_us: 0,
            linked: None,
            tracker: None,
            hand: None,
            seen_us: 0,
            hand_in_robot_m: None,
            calibrating: Calibrating::default(),
            facing: Facing::default(),
            teaching: Teaching::default(),
            reframed: false,
            take: None,
            kept: Vec::new(),
            next_id: 1,
            library,
            learning: None,
            learn_problem: None,
            traces: Traces::default(),
            history: Vec::new(),
            messages: Vec::new(),
            view_due_us: SHOW_EVERY_US,
            shown_us: None,
            moved: Moved::default(),
        })
    }

    /// Takes inputs until there are no more, or a library cannot be followed; the robot is disarmed then, and told so.
    ///
    /// # Errors
    /// A library that cannot be followed.
    pub fn run(&mut self, world: &mut impl World) -> Result<(), EngineError> {
        let outcome = self.sessions(world);
        self.leave(world);
        self.follow.disarm();
        let setpoint = self.follow.gate.tick(self.now_us);
        world.set(self.now_us, &setpoint, self.follow.gate.state());
        outcome
    }

    /// One session after the other.
    fn sessions(&mut self, world: &mut impl World) -> Result<(), EngineError> {
        loop {
            let library = self.library.clone();
            let next = match library.as_deref() {
                None => self.feed(None, world),
                Some(library) => {
                    let view = library.model.view().map_err(RecogniseError::from)?;
                    let bank = TempoRecogniser::new(&library.model, &view, TempoConfig::default())?;
                    let onset = OnsetConfig::default();
                    let told = self.config.session;
                    let session = Session::inferring(bank, &onset, INTERVAL_US, told)?;
                    self.feed(Some(session.watching(&library.gate)?), world)
                }
            };
            if matches!(next, Next::End) {
                return Ok(());
            }
        }
    }

    fn feed(&mut self, mut session: Option<Session<'_>>, world: &mut impl World) -> Next {
        self.moved = Moved::default();
        while let Some((at_us, input)) = world.next() {
            let now_us = at_us.max(self.now_us);
            self.now_us = now_us;
            if let Some(shown_us) = self.shown_us.take() {
                let rest_us = VIEW_SHARE.saturating_mul(now_us - shown_us);
                self.view_due_us = (shown_us + SHOW_EVERY_US).max(now_us.saturating_add(rest_us));
            }
            if let Some(Input::Stalled { since_us }) = input {
                world.took(now_us, &Input::Stalled { since_us });
                // The robot is told of it at the next moment, as any other.
                self.follow.stalled(since_us, now_us);
                continue;
            }
            if self.follow.advance(now_us) {
                world.set(now_us, &self.follow.setpoint(), self.follow.gate.state());
            }
            // Only inputs do anything but move the robot on its grid of milliseconds: a replay has no other moments.
            let changed = input.is_some_and(|input| {
                world.took(now_us, &input);
                let changed = self.take(session.as_mut(), input, world);
                self.routine(session.as_ref(), world);
                changed
            });
            if now_us >= self.view_due_us {
                self.shown_us = Some(now_us);
                let view = self.view(session.as_mut());
                world.show(&view);
            }
            if changed {
                return Next::Library;
            }
        }
        Next::End
    }

    /// One input; whether there is another library, or everything is elsewhere.
    fn take(
        &mut self,
        session: Option<&mut Session<'_>>,
        input: Input,
        world: &mut impl World,
    ) -> bool {
        match input {
            Input::Link(event) => self.link(event),
            Input::Frame(bytes) => self.frame(session, &bytes, world),
            Input::Tracker(event) => self.tracker = Some(event),
            Input::Hand(hand) => self.hand(session, hand, world),
            Input::Robot(robot) => self.robot(&robot),
            Input::Act(act) => {
                self.act(act, world);
                return std::mem::take(&mut self.reframed);
            }
            Input::Learnt(outcome) => return self.learnt(outcome, world),
            // Nothing but the robot's time knows of it.
            Input::Stalled { .. } => {}
        }
        false
    }

    fn link(&mut self, event: LinkEvent) {
        if let LinkEvent::Down { reason } = &event {
            if matches!(self.linked, Some(LinkEvent::Up { .. })) {
                self.tell(true, format!("the wearable's link is lost: {reason}"));
            }
            self.follow.disconnect();
            self.wearable.unlinked();
        }
        self.linked = Some(event);
    }

    fn frame(&mut self, session: Option<&mut Session<'_>>, bytes: &[u8], world: &mut impl World) {
        let now_us = self.now_us;
        let Some(Heard { frame, notice }) = self.wearable.hear(bytes, now_us) else {
            return;
        };
        if let Some(notice) = notice {
            self.noticed(notice);
        }
        let acquired_us = frame.header.device_us;
        match &frame.packet {
            Packet::Stream(stream) => {
                let describes_us = stream.describes_us(acquired_us);
                self.traces.stream(acquired_us, stream);
                self.face(world);
                self.measure(acquired_us, stream);
                let means = self.meaningless().is_none();
                if let Some(take) = self.take.as_mut().filter(|_| means) {
                    let n_per_m = stream.stiffness_n_per_m.map(f64::from);
                    take.stiffness(describes_us, n_per_m);
                }
            }
            Packet::RawSemg(raw) => {
                if let Some(configuration) = self.wearable.configuration {
                    self.traces.raw(acquired_us, raw, &configuration);
                }
            }
            Packet::Reply(reply) => {
                self.faced(reply);
                self.answered(Some(reply), world);
            }
            Packet::Calibration(_) => self.told_calibration(),
            _ => {}
        }
        let Some(session) = session.filter(|_| self.meaningless().is_none()) else {
            return;
        };
        match session.handle(Event::Frame(&frame), now_us) {
            Ok(Some(command)) => {
                let command = self.seen(command, session);
                world.commanded(now_us, &command);
                if self.follow.offer(&command, now_us) {
                    world.accepted(&command);
                }
            }
            Ok(None) => {}
            Err(error) => self.tell(true, error.to_string()),
        }
    }

    /// A command on a hand that is not seen holds the robot; after a while nothing is left of the movement.
    fn seen(&mut self, command: Command, session: &mut Session<'_>) -> Command {
        let since_us = self.now_us.saturating_sub(self.seen_us);
        if since_us <= SEEN_WITHIN_US {
            return command;
        }
        if since_us > LOST_AFTER_US {
            // At rest nothing ends, and nothing can fail.
            let _ended = session.handle(Event::Ended, self.now_us);
        }
        Command {
            quality: command.quality.max(Quality::Undecided),
            ..command
        }
    }

    fn hand(
        &mut self,
        session: Option<&mut Session<'_>>,
        hand: Option<HandSeen>,
        world: &mut impl World,
    ) {
        let now_us = self.now_us;
        let other = self.teaching.other_hand();
        if let Some(hand) = &hand {
            self.touched(hand, world);
        }
        let hand = hand.filter(|_| !other);
        let placed = hand.map(|hand| HandSeen {
            position_m: self.config.shoulder.map_or(hand.position_m, |shoulder| {
                shoulder.point_m(hand.position_m)
            }),
            ..hand
        });
        let (exposed_us, position_m) = match placed {
            Some(hand) => (hand.exposed_us, Some(hand.position_m)),
            None => (now_us, None),
        };
        // That it is gone is told once; its age tells by itself where the packet is lost.
        if position_m.is_some() || self.hand.is_some() {
            let frame = self.wearable.hand(exposed_us, position_m);
            if let Some(frame) = frame {
                world.ask(now_us, Request::Frame(frame));
            }
        }
        self.hand_in_robot_m = hand.and_then(|hand| {
            let transform = self.config.tracker_to_robot.as_ref()?;
            Some(transform.point_m(hand.position_m))
        });
        self.hand = placed;
        let Some(hand) = placed else { return };
        self.seen_us = self.seen_us.max(hand.exposed_us);
        if let Some(take) = &mut self.take {
            take.hand(hand.exposed_us, hand.position_m);
        }
        let event = Event::Hand {
            exposed_us: hand.exposed_us,
            position_m: hand.position_m,
        };
        if let Some(session) = session
            && let Err(error) = session.handle(event, now_us)
        {
            self.tell(true, error.to_string());
        }
    }

    fn robot(&mut self, robot: &RobotSeen) {
        self.follow.told(robot.measured_us, robot.position_m);
        if let Some(take) = &mut self.take {
            take.robot(robot.measured_us, robot.position_m, robot.stiffness_n_per_m);
        }
    }

    /// What is due by itself.
    fn routine(&mut self, session: Option<&Session<'_>>, world: &mut impl World) {
        let now_us = self.now_us;
        for frame in self.wearable.due(self.config.raw, now_us) {
            world.ask(now_us, Request::Frame(frame));
        }
        self.answered(None, world);
        self.touch_is_due(world);
        if let Some(take) = &mut self.take {
            if now_us >= take.began_us() + LONGEST_US {
                take.stop(now_us);
            }
            if take.complete(now_us)
                && let Some(take) = self.take.take()
            {
                let kept = take.finish(self.next_id);
                self.next_id += 1;
                self.kept.push(kept);
            }
        }
        if let Some(session) = session {
            self.remember(session);
        }
    }
}

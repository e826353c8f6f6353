//! The run itself: one millisecond after the other, sessions, gate and robot on what reaches the host.

use super::outside::{Held, OutsideScore};
use super::score::{ActionScore, Following, quantile};
use super::{
    DemoError, INERTIA_KG, Latency, OUTSIDE, PAYLOAD_KG, PERIOD_S, Packets, Report, Snapshot,
};
use crate::robot::command::Command;
use crate::robot::gate::{Cause, Gate, State};
use crate::robot::limits::{Fallback, Limits};
use crate::robot::simulated::SimulatedRobot;
use crate::session::{Decision, Event, NoveltyReport, Session};
use crate::simulate::rig::Step;
use crate::simulate::scripted::{self, HOME_M};
use crate::simulate::skills::Skill;
use crate::simulate::wearer::{Action, Span};
use std::collections::VecDeque;

/// Phase of a lift at which the robot has the object in its hand.
const GRASPED: f64 = 0.5;

/// What a session says of a movement.
struct Seen<'m> {
    posterior: Vec<f64>,
    decision: Option<Decision>,
    novelty: Option<NoveltyReport<'m>>,
    unknown: bool,
}

impl<'m> Seen<'m> {
    fn of(session: &Session<'m>) -> Self {
        Self {
            posterior: session.posterior(),
            decision: session.decision(),
            novelty: session.novelty(),
            unknown: session.unknown(),
        }
    }
}

/// Everything on the host's side of the links, and the scores.
pub(super) struct Stage<'m> {
    session: Session<'m>,
    /// The same session without stiffness, for comparison; it commands nothing.
    positions_only: Session<'m>,
    /// What the two sessions said of the action under way when they last said anything.
    seen: [Option<Seen<'m>>; 2],
    labels: Vec<String>,
    gate: Gate,
    robot: SimulatedRobot,
    /// Actions that have not ended; the first may be under way.
    ahead: VecDeque<Span>,
    under_way: bool,
    following: Following,
    pub(super) packets: Packets,
    latencies_ms: Vec<f64>,
    scores: Vec<ActionScore>,
    /// The robot through the action under way, if that is in no demonstration.
    held: Option<Held>,
    outside: Vec<OutsideScore>,
    /// How many scored actions were lifts, and how many of these positions alone recognised.
    lifts: [usize; 2],
    posterior: Vec<f64>,
    hand_m: [f64; 3],
}

impl<'m> Stage<'m> {
    pub(super) fn new(
        [session, positions_only]: [Session<'m>; 2],
        labels: &[String],
        spans: Vec<Span>,
    ) -> Result<Self, DemoError> {
        Ok(Self {
            posterior: session.posterior(),
            session,
            positions_only,
            labels: labels.to_vec(),
            seen: [None, None],
            gate: Gate::new(Limits::default(), Fallback::default(), HOME_M)?,
            robot: SimulatedRobot::new(INERTIA_KG, HOME_M)?,
            ahead: spans.into(),
            under_way: false,
            following: Following::new(),
            packets: Packets::default(),
            latencies_ms: Vec::new(),
            scores: Vec::new(),
            held: None,
            outside: Vec::new(),
            lifts: [0; 2],
            hand_m: [0.0; 3],
        })
    }

    /// One millisecond: what arrived, what is announced, then the gate and the robot.
    pub(super) fn live(&mut self, step: &Step) -> Result<(), DemoError> {
        let now_us = step.now_us;
        self.announce(now_us)?;
        if let Some(hand) = step.hand {
            self.hand_m = hand.position_m;
            let event = Event::Hand {
                exposed_us: hand.exposed_us,
                position_m: hand.position_m,
            };
            self.session.handle(event, now_us)?;
            self.positions_only.handle(event, now_us)?;
        }
        for arrival in &step.arrivals {
            match &arrival.frame {
                Ok(frame) => {
                    let event = Event::Frame(frame);
                    if let Some(command) = self.session.handle(event, now_us)? {
                        self.offer(&command, now_us);
                    }
                }
                Err(_refused) => self.packets.corrupt += 1,
            }
        }
        for (session, seen) in [&self.session, &self.positions_only]
            .into_iter()
            .zip(&mut self.seen)
        {
            if self.under_way && session.under_way() {
                *seen = Some(Seen::of(session));
            }
        }
        self.move_robot(now_us)
    }

    fn offer(&mut self, command: &Command, now_us: u64) {
        #[allow(clippy::cast_precision_loss, reason = "milliseconds")]
        let age_ms = now_us.saturating_sub(command.acquired_us) as f64 * 1e-3;
        self.latencies_ms.push(age_ms);
        // A refusal leaves the gate with the command before, and its age runs on.
        let _counted_there = self.gate.offer(command, now_us);
        if self.gate.state() == State::Disarmed(Cause::Start) {
            // The simulated person arms once, at the first command that may be followed; after a trip never again.
            let _not_yet = self.gate.arm(self.robot.position_m(), now_us);
        }
    }

    /// Tells the sessions of movements that begin and end, and scores the latter.
    fn announce(&mut self, now_us: u64) -> Result<(), DemoError> {
        let Some(span) = self.ahead.front().copied() else {
            return Ok(());
        };
        if !self.under_way && now_us >= span.start_us {
            self.under_way = true;
            self.seen = [None, None];
            let began = Event::Began {
                at_us: span.start_us,
                duration_us: span.end_us - span.start_us,
            };
            self.session.handle(began, now_us)?;
            self.positions_only.handle(began, now_us)?;
            let performed = span.task.performed();
            if performed.is_some_and(|action| OUTSIDE.contains(&action.skill)) {
                let from_m = self.gate.setpoint().position_m;
                self.held = Some(Held::new(span.start_us, from_m));
            }
        }
        if self.under_way && now_us >= span.end_us {
            if let Some(action) = span.task.performed() {
                self.score(action.skill);
            }
            self.session.handle(Event::Ended, now_us)?;
            self.positions_only.handle(Event::Ended, now_us)?;
            self.under_way = false;
            self.ahead.pop_front();
        }
        Ok(())
    }

    fn score(&mut self, performed: Skill) {
        // A session that follows nothing tells the skills apart as it did before.
        let seen = self.seen[0].take();
        let seen = seen.unwrap_or_else(|| Seen::of(&self.session));
        let novelty = seen.novelty;
        if let Some(held) = self.held.take() {
            self.outside.push(held.score(performed.label(), novelty));
            return;
        }
        let positions = self.seen[1].take();
        let positions = positions.unwrap_or_else(|| Seen::of(&self.positions_only));
        let (best, posterior) = most_likely(&seen.posterior);
        let (without_semg, _) = most_likely(&positions.posterior);
        let label = |skill: usize| self.labels.get(skill).cloned().unwrap_or_default();
        let decision = seen.decision;
        let score = ActionScore {
            performed: performed.label().to_owned(),
            recognised: label(best),
            posterior,
            seconds_to_decision: decision.map(|decision| decision.after_s),
            decided: decision.map(|decision| label(decision.skill)),
            recognised_without_semg: label(without_semg),
            unknown: seen.unknown,
            nearest: novelty.map(|novelty| novelty.nearest.to_owned()),
            distance: novelty.map(|novelty| novelty.distance),
        };
        if Skill::LIFTS.contains(&performed) {
            self.lifts[0] += 1;
            self.lifts[1] += usize::from(score.recognised_without_semg == score.performed);
        }
        self.scores.push(score);
    }

    fn move_robot(&mut self, now_us: u64) -> Result<(), DemoError> {
        let doing = self.doing(now_us);
        let lifting =
            doing.is_some_and(|(action, s)| Skill::LIFTS.contains(&action.skill) && s >= GRASPED);
        self.robot.carry(if lifting { PAYLOAD_KG } else { 0.0 })?;
        let setpoint = self.gate.tick(now_us);
        self.robot.step(&setpoint, [0.0; 3], PERIOD_S);
        if let Some(held) = &mut self.held {
            // No script says what the robot should do.
            held.add(now_us, self.session.unknown(), setpoint.position_m);
        } else if let Some((action, s)) = doing {
            let truth = scripted::robot(&action, s);
            self.following.add(
                (self.robot.position_m(), truth.position_m),
                (setpoint.stiffness_n_per_m, truth.stiffness_n_per_m),
            );
        }
        Ok(())
    }

    /// The action under way and its phase.
    #[allow(clippy::cast_precision_loss, reason = "actions last seconds")]
    fn doing(&self, now_us: u64) -> Option<(Action, f64)> {
        let span = self.ahead.front().filter(|_| self.under_way)?;
        let action = span.task.performed()?;
        let since_us = now_us.saturating_sub(span.start_us) as f64;
        Some((action, since_us / (span.end_us - span.start_us) as f64))
    }

    pub(super) fn snapshot(&mut self, now_us: u64, end_us: u64) -> Snapshot<'_> {
        self.posterior = self.session.posterior();
        Snapshot {
            now_us,
            end_us,
            action: self.doing(now_us).map(|(action, s)| (action.skill, s)),
            labels: &self.labels,
            posterior: &self.posterior,
            novelty: self.session.novelty(),
            stream: self.session.stream(),
            hand_m: self.hand_m,
            setpoint: self.gate.setpoint(),
            robot_m: self.robot.position_m(),
            gate: self.gate.state(),
            packets: self.packets,
            scores: &self.scores,
            outside: &self.outside,
        }
    }

    pub(super) fn report(self, seed: u64) -> Report {
        let [lifts, recognised] = self.lifts;
        #[allow(clippy::cast_precision_loss, reason = "counts of actions")]
        let accuracy_without_semg = (lifts > 0).then(|| recognised as f64 / lifts as f64);
        let correct = self.scores.iter().filter(|a| a.recognised == a.performed);
        let latency = |share| quantile(&self.latencies_ms, share);
        Report {
            seed,
            correct: correct.count(),
            total: self.scores.len(),
            false_alarms: self.scores.iter().filter(|a| a.unknown).count(),
            outside: self.outside,
            accuracy_without_semg,
            stiffness_nrmse: self.following.stiffness_nrmse(),
            robot_rmse_m: self.following.rmse_m(),
            packets: self.packets,
            latency_ms: latency(0.5)
                .zip(latency(0.99))
                .map(|(p50, p99)| Latency { p50, p99 }),
            actions: self.scores,
        }
    }
}

/// Index and value of the largest; zero of an empty list.
fn most_likely(posterior: &[f64]) -> (usize, f64) {
    let best = posterior
        .iter()
        .copied()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(&b.1));
    best.unwrap_or((0, 0.0))
}

//! The gate and the robot behind it, at a thousand steps a second of session time.

use crate::robot::arm::{ArmError, ImpedanceArm};
use crate::robot::command::Command;
use crate::robot::gate::{ArmRefusal, Cause, Gate, State};
use crate::robot::limits::{ConfigError, Fallback, Limits, Setpoint};
use crate::robot::simulated::MassError;

/// The gate's period, microseconds.
const PERIOD_US: u64 = 1_000;
const PERIOD_S: f64 = 1e-3;
/// After a longer stall (a computer that slept) the robot is not simulated through it, microseconds: its time stood still.
const LONGEST_STALL_US: u64 = 60_000_000;
/// A robot elsewhere was not told anything in a stall: making up for it would be a jump. From this on, microseconds, a stall
/// counts as one period of the gate, which knows how long that may be.
const LONGEST_GAP_US: u64 = 5_000;
/// The jump of a robot elsewhere has this bound also in a world that told of no stall, microseconds: above the time between two
/// entries of a recording, whose moments between them are lost.
const LONGEST_UNTOLD_US: u64 = 50_000;
/// A real robot that has not told where it is for so long is nowhere, microseconds.
const TELLS_WITHIN_US: u64 = 500_000;

/// Whether so long between two moments of a running program is a stall: the gate leaves it out, and [`Input::Stalled`] is to
/// tell so.
///
/// [`Input::Stalled`]: super::input::Input::Stalled
#[must_use]
pub fn is_stall(elsewhere: bool, since_us: u64, now_us: u64) -> bool {
    let longest_us = if elsewhere {
        LONGEST_GAP_US
    } else {
        LONGEST_STALL_US
    };
    on_grid(now_us).saturating_sub(on_grid(since_us)) > longest_us
}

/// The last step of the gate that is due by then.
fn on_grid(us: u64) -> u64 {
    us - us % PERIOD_US
}

/// The robot that follows.
#[derive(Debug)]
pub enum Body {
    /// Stepped here.
    Simulated(Box<ImpedanceArm>),
    /// Somewhere else: it tells where it is.
    External,
}

/// Gate and robot.
#[derive(Debug)]
pub(super) struct Follow {
    pub(super) gate: Gate,
    body: Body,
    /// What an external robot told last, and when.
    told: Option<(u64, [f64; 3])>,
    stepped_us: u64,
    pub(super) newest: Option<Command>,
}

impl Follow {
    pub(super) fn new(
        limits: Limits,
        fallback: Fallback,
        home_m: [f64; 3],
        body: Body,
    ) -> Result<Self, ConfigError> {
        Ok(Self {
            gate: Gate::new(limits, fallback, home_m)?,
            body,
            told: None,
            stepped_us: 0,
            newest: None,
        })
    }

    /// Steps up to `now_us`; whether there was a step. Only steps count, not the moments: a replay has fewer of them.
    pub(super) fn advance(&mut self, now_us: u64) -> bool {
        let due_us = on_grid(now_us);
        if due_us <= self.stepped_us {
            return false;
        }
        let longest_us = match self.body {
            Body::Simulated(_) => LONGEST_STALL_US,
            Body::External => LONGEST_UNTOLD_US,
        };
        if due_us - self.stepped_us > longest_us {
            self.stepped_us = due_us - PERIOD_US;
        }
        while self.stepped_us < due_us {
            self.stepped_us += PERIOD_US;
            let elsewhere = matches!(self.body, Body::External);
            if elsewhere && self.position_m(self.stepped_us).is_none() {
                self.gate.lose_robot();
            }
            let setpoint = self.gate.tick(self.stepped_us);
            if let Body::Simulated(robot) = &mut self.body {
                // The gate's set-points are finite; the arm stays where it is under any other.
                let _finite = robot.step(&setpoint, [0.0; 3], PERIOD_S);
            }
        }
        true
    }

    /// Nothing happened from `since_us` to `now_us`: of the steps between only the last is left to do.
    pub(super) fn stalled(&mut self, since_us: u64, now_us: u64) {
        self.advance(since_us.min(now_us));
        let last_us = on_grid(now_us).saturating_sub(PERIOD_US);
        self.stepped_us = self.stepped_us.max(last_us);
    }

    pub(super) fn setpoint(&self) -> Setpoint {
        self.gate.setpoint()
    }

    /// An external robot tells where it is.
    pub(super) fn told(&mut self, at_us: u64, position_m: [f64; 3]) {
        self.told = Some((at_us, position_m));
        if matches!(self.body, Body::External) {
            self.gate.rests_at(position_m);
        }
    }

    /// Where its hand is; none where it does not tell.
    pub(super) fn position_m(&self, now_us: u64) -> Option<[f64; 3]> {
        match &self.body {
            Body::Simulated(robot) => Some(robot.position_m()),
            Body::External => {
                let (at_us, position_m) = self.told?;
                (now_us <= at_us + TELLS_WITHIN_US).then_some(position_m)
            }
        }
    }

    /// Places of the arm's joints, from base to hand.
    pub(super) fn joints_m(&self) -> Vec<[f64; 3]> {
        match &self.body {
            Body::Simulated(robot) => robot.joint_places_m().to_vec(),
            Body::External => Vec::new(),
        }
    }

    /// Takes a command, or not; the gate counts what it refuses.
    pub(super) fn offer(&mut self, command: &Command, now_us: u64) -> bool {
        let taken = self.gate.offer(command, now_us).is_ok();
        if taken {
            self.newest = Some(*command);
        }
        taken
    }

    /// A person arms.
    pub(super) fn arm(&mut self, now_us: u64) -> Result<(), String> {
        let Some(position_m) = self.position_m(now_us) else {
            return Err(
                "the robot does not tell where it is: start its receiver, then arm".to_owned(),
            );
        };
        let armed = self.gate.arm(position_m, now_us);
        armed.map_err(|refusal: ArmRefusal| refusal.to_string())
    }

    pub(super) fn disarm(&mut self) {
        self.gate.disarm();
    }

    pub(super) fn disconnect(&mut self) {
        self.gate.disconnect();
        self.newest = None;
    }

    /// The wearable's times are others from now on.
    pub(super) fn mistime(&mut self) {
        self.gate.mistime();
        self.newest = None;
    }

    /// State and its reason, for people.
    pub(super) fn state(&self) -> (&'static str, &'static str) {
        match self.gate.state() {
            State::Disarmed(cause) => {
                let reason = match cause {
                    Cause::Start => "not armed yet",
                    Cause::Person => "disarmed by a person",
                    Cause::Stale => "the evidence became older than 0.5 s",
                    Cause::Disconnected => "the wearable's link was lost",
                    Cause::OtherBoot => "the wearable restarted",
                    Cause::RobotSilent => "the robot does not tell where it is any more",
                    Cause::Clock => "the wearable's clock is followed anew",
                };
                ("disarmed", reason)
            }
            State::Following => ("following", "evidence is fresh"),
            State::Holding => ("holding", "the evidence ages, is undecided or unknown"),
            State::FallingBack => (
                "falling_back",
                "no followable command: soft where it stands",
            ),
        }
    }
}

/// Why there is no simulated arm.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum BodyError {
    /// Its home.
    #[error(transparent)]
    Home(#[from] ArmError),
    /// What it carries.
    #[error(transparent)]
    Payload(#[from] MassError),
}

/// The simulated arm with its hand at home, and so much in it.
///
/// # Errors
/// [`BodyError`]: a home out of its reach, a mass that is none.
pub fn simulated(home_m: [f64; 3], payload_kg: f64) -> Result<Body, BodyError> {
    let mut arm = ImpedanceArm::at(home_m)?;
    arm.carry(payload_kg)?;
    Ok(Body::Simulated(Box::new(arm)))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::command::Quality;

    const AT_M: [f64; 3] = [0.5, 0.1, 0.4];

    fn external() -> Follow {
        let (limits, fallback) = (Limits::default(), Fallback::default());
        Follow::new(limits, fallback, [0.4, 0.0, 0.45], Body::External).unwrap()
    }

    /// As far and as firm as the limits let it be.
    fn far(now_us: u64, sequence: u32) -> Command {
        Command {
            position_m: [0.9, 0.8, 1.0],
            velocity_m_per_s: [0.0; 3],
            stiffness_n_per_m: [3000.0; 3],
            damping_ratio: 1.0,
            acquired_us: now_us,
            valid_until_us: now_us + 100_000,
            sequence,
            boot_id: 1,
            quality: Quality::Good,
        }
    }

    /// Armed and following for 100 ms, told every millisecond.
    fn following() -> (Follow, u64) {
        let mut follow = external();
        let begin_us = 1_000_000;
        follow.told(begin_us, AT_M);
        follow.advance(begin_us);
        assert!(follow.offer(&far(begin_us, 1), begin_us));
        follow.arm(begin_us).unwrap();
        let mut now_us = begin_us;
        for step in 1..=100 {
            now_us = begin_us + 1_000 * u64::from(step);
            follow.told(now_us, AT_M);
            follow.offer(&far(now_us, 1 + step), now_us);
            follow.advance(now_us);
        }
        assert_eq!(follow.gate.state(), State::Following);
        (follow, now_us)
    }

    #[test]
    fn before_it_is_armed_a_robot_elsewhere_is_to_be_where_it_is() {
        let mut follow = external();
        follow.told(1_000, AT_M);
        follow.advance(2_000);
        assert_eq!(follow.setpoint().position_m, AT_M);
        // Outside the workspace nothing is asked of it.
        follow.told(3_000, [0.0, 0.0, 5.0]);
        follow.advance(4_000);
        assert_eq!(follow.setpoint().position_m, AT_M);
    }

    #[test]
    fn a_stall_is_no_jump() {
        for stall_us in [6_000, 50_000, 350_000, 59_000_000] {
            let (mut follow, mut now_us) = following();
            let before = follow.setpoint();
            assert!(is_stall(true, now_us, now_us + stall_us));
            follow.stalled(now_us, now_us + stall_us);
            now_us += stall_us;
            follow.told(now_us, AT_M);
            follow.offer(&far(now_us, 1_000), now_us);
            follow.advance(now_us);
            let after = follow.setpoint();
            // What ten milliseconds allow: 10 mm at 1 m/s, 30 N/m at 3000 N/m per second.
            let way_m = (0..3).map(|i| (after.position_m[i] - before.position_m[i]).powi(2));
            assert!(way_m.sum::<f64>().sqrt() <= 0.010 + 1e-9, "{stall_us} us");
            for axis in 0..3 {
                let step = after.stiffness_n_per_m[axis] - before.stiffness_n_per_m[axis];
                assert!(step.abs() <= 30.0 + 1e-9, "{stall_us} us: {step} N/m");
            }
        }
    }

    #[test]
    fn a_stall_that_nobody_told_of_is_a_small_jump() {
        let (mut follow, mut now_us) = following();
        let before = follow.setpoint();
        now_us += 350_000;
        follow.told(now_us, AT_M);
        follow.offer(&far(now_us, 1_000), now_us);
        follow.advance(now_us);
        let after = follow.setpoint();
        let way_m = (0..3).map(|i| (after.position_m[i] - before.position_m[i]).powi(2));
        assert!(way_m.sum::<f64>().sqrt() <= 0.010 + 1e-9);
    }

    /// Advanced at every millisecond or in strides, with the same stall: the same in every bit.
    #[test]
    fn the_moments_between_what_happens_change_nothing() {
        let run = |stride_ms: u64| {
            let (mut follow, begin_us) = following();
            let mut after = Vec::new();
            for ms in 1..=700_u64 {
                let now_us = begin_us + 1_000 * ms + 300;
                // The stall, and what came before it that a replay does not know of.
                if ms == 57 {
                    follow.stalled(now_us - 20_000, now_us);
                }
                if (38..57).contains(&ms) {
                    continue;
                }
                if ms % stride_ms == 0 {
                    follow.advance(now_us);
                }
                if ms % 12 == 0 {
                    follow.advance(now_us);
                    follow.offer(&far(now_us, 200 + u32::try_from(ms).unwrap()), now_us);
                    after.push((follow.setpoint(), follow.gate.state()));
                }
            }
            (after, follow.gate.state())
        };
        let every = run(1);
        assert_eq!(every.1, State::Disarmed(Cause::RobotSilent));
        assert_eq!(run(12), every);
        assert_eq!(run(5), every);
    }

    #[test]
    fn a_robot_that_falls_silent_is_disarmed_and_does_not_arm_itself_again() {
        let (mut follow, begin_us) = following();
        for ms in 1..=600_u32 {
            let now_us = begin_us + 1_000 * u64::from(ms);
            follow.offer(&far(now_us, 200 + ms), now_us);
            follow.advance(now_us);
            let armed = !matches!(follow.gate.state(), State::Disarmed(_));
            assert_eq!(armed, ms <= 500, "{ms} ms");
        }
        assert_eq!(follow.gate.state(), State::Disarmed(Cause::RobotSilent));
        follow.told(begin_us + 601_000, AT_M);
        follow.advance(begin_us + 602_000);
        assert_eq!(follow.gate.state(), State::Disarmed(Cause::RobotSilent));
    }
}

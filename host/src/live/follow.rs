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
/// A real robot that has not told where it is for so long is nowhere, microseconds.
const TELLS_WITHIN_US: u64 = 500_000;

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

    /// Steps up to `now_us`; whether there was a step.
    pub(super) fn advance(&mut self, now_us: u64) -> bool {
        let due_us = now_us - now_us % PERIOD_US;
        if due_us <= self.stepped_us {
            return false;
        }
        if due_us - self.stepped_us > LONGEST_STALL_US {
            self.stepped_us = due_us - PERIOD_US;
        }
        while self.stepped_us < due_us {
            self.stepped_us += PERIOD_US;
            let setpoint = self.gate.tick(self.stepped_us);
            if let Body::Simulated(robot) = &mut self.body {
                // The gate's set-points are finite; the arm stays where it is under any other.
                let _finite = robot.step(&setpoint, [0.0; 3], PERIOD_S);
            }
        }
        true
    }

    pub(super) fn setpoint(&self) -> Setpoint {
        self.gate.setpoint()
    }

    /// An external robot tells where it is.
    pub(super) fn told(&mut self, at_us: u64, position_m: [f64; 3]) {
        self.told = Some((at_us, position_m));
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

    /// Takes a command; the gate counts what it refuses.
    pub(super) fn offer(&mut self, command: &Command, now_us: u64) {
        if self.gate.offer(command, now_us).is_ok() {
            self.newest = Some(*command);
        }
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

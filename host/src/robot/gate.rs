//! The one safety gate between a command and a robot: a pure state machine in the caller's time.
//!
//! It is told of commands ([`Gate::offer`]), of what a person does ([`Gate::arm`], [`Gate::disarm`])
//! and of a lost link ([`Gate::disconnect`]), and is asked for a set-point every control period
//! ([`Gate::tick`]). Age is `now - acquired_us` of the newest accepted command.
//!
//! | state | entered when | set-point |
//! |---|---|---|
//! | `Following` | age <= 60 ms, not past `valid_until_us`, quality good | towards the command, within speed, workspace, stiffness and rate limits |
//! | `Holding` | age 60 to 100 ms, or past `valid_until_us`, or quality not good | position, stiffness and damping stay as they are, velocity zero |
//! | `FallingBack` | age over 100 ms, or no followable command for 1 s | position stays, stiffness ramps to the configured fallback |
//! | `Disarmed` | start, age over 500 ms, disconnect, another boot id or clock, a robot that went silent, or a person | as `FallingBack`, and commands change nothing |
//!
//! Every armed state passes to every other as the newest command's age and quality say, so a late
//! packet ends a hold. From `Disarmed` only [`Gate::arm`], a person's act, leads out: packets and
//! reconnections never do. While disarmed the robot keeps a position softly rather than going limp:
//! zero stiffness could drop a load. Before a person armed it for the first time it has no business with the robot at all: a
//! robot that tells where it is is told to be there ([`Gate::rests_at`]).

use super::command::{Command, CommandError, Quality};
use super::limits::{ConfigError, Fallback, Limits, Setpoint};
use thiserror::Error;

/// Up to this age a command is followed, microseconds.
pub const FOLLOW_AGE_US: u64 = 60_000;
/// Up to this age the last set-point is held, microseconds.
pub const HOLD_AGE_US: u64 = 100_000;
/// Beyond this age the robot is disarmed, microseconds.
pub const DISARM_AGE_US: u64 = 500_000;
/// A hold for quality or validity on fresh packets ends in the fallback after this time: the last value
/// must not be kept for ever. Microseconds since the last followable command was acquired.
pub const LONGEST_HOLD_US: u64 = 1_000_000;
/// A command may seem this much younger than `now_us` (residual of the clock fit); beyond, its clock is
/// wrong and it is refused. Microseconds.
pub const CLOCK_TOLERANCE_US: u64 = 5_000;
/// A control period longer than this counts as this long: limits per second must not turn a stall into a jump.
const LONGEST_PERIOD_S: f64 = 0.01;

/// Why the gate is disarmed.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Cause {
    /// Nobody has armed it yet.
    Start,
    /// A person disarmed it.
    Person,
    /// The newest command became older than [`DISARM_AGE_US`].
    Stale,
    /// The link was lost.
    Disconnected,
    /// Commands from another boot of the wearable arrived.
    OtherBoot,
    /// The robot does not tell where it is any more.
    RobotSilent,
    /// The wearable's clock was set, or is followed anew: ages from before mean nothing.
    Clock,
}

/// The gate's state: see the table above.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum State {
    /// Commands change nothing until a person arms.
    Disarmed(Cause),
    /// The set-point moves towards the command.
    Following,
    /// The set-point stays as it is.
    Holding,
    /// The set-point stays in place, its stiffness ramps to the fallback.
    FallingBack,
}

/// Why one command was dropped. The age of the last accepted one runs on.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum Refusal {
    /// Its numbers cannot be used.
    #[error(transparent)]
    Unusable(#[from] CommandError),
    /// A duplicate, or overtaken by a newer one.
    #[error("command {got} is not newer than {newest}")]
    NotNewer {
        /// Its sequence.
        got: u32,
        /// The newest accepted sequence.
        newest: u32,
    },
    /// Acquired before the command it follows.
    #[error("command acquired at {got_us} us, before the accepted one at {newest_us} us")]
    OlderEvidence {
        /// Its `acquired_us`.
        got_us: u64,
        /// `acquired_us` of the newest accepted command.
        newest_us: u64,
    },
    /// Acquired in the future: the clocks disagree.
    #[error(
        "command acquired at {acquired_us} us, but it is only {now_us} us: check the clock fit"
    )]
    FromTheFuture {
        /// Its `acquired_us`.
        acquired_us: u64,
        /// The gate's time.
        now_us: u64,
    },
    /// From another boot of the wearable than the one armed with.
    #[error(
        "command from boot {got:#x}, armed with {armed:#x}: the robot is disarmed, arm it again"
    )]
    OtherBoot {
        /// Its boot id.
        got: u32,
        /// The boot id armed with.
        armed: u32,
    },
}

/// Why a person's wish to arm was not granted.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum ArmRefusal {
    /// No command that could be followed at once.
    #[error("no fresh command of good quality: wait until the wearable streams, then arm")]
    NoFreshCommand,
    /// The robot's measured position is not finite or outside the workspace.
    #[error(
        "the robot's measured position on axis {axis} is {value_m} m, outside the workspace {low_m} to {high_m} m: bring it inside, then arm"
    )]
    OutsideWorkspace {
        /// Axis 0 to 2.
        axis: usize,
        /// Measured position, metres.
        value_m: f64,
        /// Lower limit, metres.
        low_m: f64,
        /// Upper limit, metres.
        high_m: f64,
    },
}

/// The gate. One per robot.
#[derive(Debug, Clone)]
pub struct Gate {
    limits: Limits,
    fallback: Fallback,
    state: State,
    setpoint: Setpoint,
    newest: Option<Command>,
    /// `acquired_us` of the newest command that was followable when it came.
    sound_us: u64,
    now_us: u64,
    /// Time of the last tick: offers in between must not shorten the period.
    ticked_us: u64,
    refused: u64,
}

impl Gate {
    /// A disarmed gate that keeps `start_m` with the fallback's stiffness.
    ///
    /// # Errors
    /// [`ConfigError`] when limits contradict themselves, or the fallback or the start breaks them.
    pub fn new(limits: Limits, fallback: Fallback, start_m: [f64; 3]) -> Result<Self, ConfigError> {
        limits.check(&fallback, &start_m)?;
        Ok(Self {
            limits,
            fallback,
            state: State::Disarmed(Cause::Start),
            setpoint: Setpoint {
                position_m: start_m,
                velocity_m_per_s: [0.0; 3],
                stiffness_n_per_m: fallback.stiffness_n_per_m,
                damping_ratio: fallback.damping_ratio,
            },
            newest: None,
            sound_us: 0,
            now_us: 0,
            ticked_us: 0,
            refused: 0,
        })
    }

    /// The state as of the last call.
    #[must_use]
    pub fn state(&self) -> State {
        self.state
    }

    /// The set-point as of the last tick.
    #[must_use]
    pub fn setpoint(&self) -> Setpoint {
        self.setpoint
    }

    /// How many commands were refused since the start.
    #[must_use]
    pub fn refused(&self) -> u64 {
        self.refused
    }

    /// A person arms the robot, which takes up its measured position `measured_m` (metres).
    ///
    /// # Errors
    /// [`ArmRefusal`] unless a followable command of at most [`FOLLOW_AGE_US`] is at hand and the
    /// robot is inside its workspace. When already armed, nothing changes.
    pub fn arm(&mut self, measured_m: [f64; 3], now_us: u64) -> Result<(), ArmRefusal> {
        self.advance(now_us);
        if !matches!(self.state, State::Disarmed(_)) {
            return Ok(());
        }
        for (axis, value_m) in measured_m.into_iter().enumerate() {
            let (low_m, high_m) = (
                self.limits.workspace_low_m[axis],
                self.limits.workspace_high_m[axis],
            );
            if !(low_m..=high_m).contains(&value_m) {
                return Err(ArmRefusal::OutsideWorkspace {
                    axis,
                    value_m,
                    low_m,
                    high_m,
                });
            }
        }
        match self.newest {
            Some(command) if followable(&command, self.now_us) => {}
            _ => return Err(ArmRefusal::NoFreshCommand),
        }
        self.setpoint.position_m = measured_m;
        self.setpoint.velocity_m_per_s = [0.0; 3];
        self.ticked_us = self.now_us;
        self.state = State::Following;
        Ok(())
    }

    /// Before anybody armed it, a robot that measures itself at `measured_m` (metres) is to be there, not where it was thought
    /// to be; later, and outside the workspace, nothing changes.
    pub fn rests_at(&mut self, measured_m: [f64; 3]) {
        let inside = self.limits.inside(&measured_m) == measured_m;
        if inside && self.state == State::Disarmed(Cause::Start) {
            self.setpoint.position_m = measured_m;
        }
    }

    /// An armed robot does not tell where it is any more: disarm.
    pub fn lose_robot(&mut self) {
        if !matches!(self.state, State::Disarmed(_)) {
            self.trip(Cause::RobotSilent);
        }
    }

    /// Whether a command is at hand that [`Gate::arm`] would take; where the robot is decides too.
    #[must_use]
    pub fn may_arm(&self, now_us: u64) -> bool {
        self.newest
            .is_some_and(|command| followable(&command, now_us))
    }

    /// A person disarms the robot.
    pub fn disarm(&mut self) {
        self.trip(Cause::Person);
    }

    /// The link is gone: disarm and forget its commands. A reconnection does not arm again.
    pub fn disconnect(&mut self) {
        self.trip(Cause::Disconnected);
        self.newest = None;
    }

    /// The times of commands are by another clock from now on: disarm and forget those of before.
    pub fn mistime(&mut self) {
        if !matches!(self.state, State::Disarmed(_)) {
            self.trip(Cause::Clock);
        }
        self.newest = None;
    }

    /// Takes a command that arrived at `now_us`; the next tick acts on it.
    ///
    /// # Errors
    /// [`Refusal`] when the command is dropped. One from another boot also disarms: the wearable
    /// restarted, and only a person knows whether it still sits on the same arm.
    pub fn offer(&mut self, command: &Command, now_us: u64) -> Result<(), Refusal> {
        self.advance(now_us);
        let verdict = self.judge(command);
        if verdict.is_err() {
            self.refused += 1;
        }
        verdict?;
        if followable(command, self.now_us) {
            self.sound_us = command.acquired_us;
        }
        self.newest = Some(*command);
        Ok(())
    }

    fn judge(&mut self, command: &Command) -> Result<(), Refusal> {
        command.check()?;
        if command.acquired_us > self.now_us.saturating_add(CLOCK_TOLERANCE_US) {
            return Err(Refusal::FromTheFuture {
                acquired_us: command.acquired_us,
                now_us: self.now_us,
            });
        }
        let Some(newest) = self.newest else {
            return Ok(());
        };
        if command.boot_id != newest.boot_id {
            if matches!(self.state, State::Disarmed(_)) {
                return Ok(());
            }
            self.trip(Cause::OtherBoot);
            self.newest = None;
            return Err(Refusal::OtherBoot {
                got: command.boot_id,
                armed: newest.boot_id,
            });
        }
        // Half the range counts as newer, so the sequence may wrap.
        let ahead = command.sequence.wrapping_sub(newest.sequence);
        if ahead == 0 || ahead > u32::MAX / 2 {
            return Err(Refusal::NotNewer {
                got: command.sequence,
                newest: newest.sequence,
            });
        }
        if command.acquired_us < newest.acquired_us {
            return Err(Refusal::OlderEvidence {
                got_us: command.acquired_us,
                newest_us: newest.acquired_us,
            });
        }
        Ok(())
    }

    /// One control period: the state by age and quality at `now_us`, and the set-point to send.
    pub fn tick(&mut self, now_us: u64) -> Setpoint {
        self.advance(now_us);
        #[allow(clippy::cast_precision_loss, reason = "clamped to 10 ms")]
        let period_s = ((self.now_us - self.ticked_us) as f64 * 1e-6).min(LONGEST_PERIOD_S);
        self.ticked_us = self.now_us;
        self.update_state();
        match (self.state, self.newest) {
            (State::Following, Some(command)) => self.follow(&command, period_s),
            (State::Holding, _) => self.setpoint.velocity_m_per_s = [0.0; 3],
            _ => self.fall_back(period_s),
        }
        self.setpoint
    }

    /// Time never runs backwards here, so that neither age nor a rate limit can be fooled.
    fn advance(&mut self, now_us: u64) {
        self.now_us = self.now_us.max(now_us);
    }

    fn update_state(&mut self) {
        if matches!(self.state, State::Disarmed(_)) {
            return;
        }
        let Some(command) = self.newest else {
            self.state = State::FallingBack;
            return;
        };
        let age_us = self.now_us.saturating_sub(command.acquired_us);
        if age_us > DISARM_AGE_US {
            self.trip(Cause::Stale);
        } else if age_us > HOLD_AGE_US
            || self.now_us.saturating_sub(self.sound_us) > LONGEST_HOLD_US
        {
            self.state = State::FallingBack;
        } else if followable(&command, self.now_us) {
            self.state = State::Following;
        } else {
            self.state = State::Holding;
        }
    }

    fn trip(&mut self, cause: Cause) {
        // Who was never armed cannot be disarmed: the robot stays its own controller's.
        if self.state != State::Disarmed(Cause::Start) {
            self.state = State::Disarmed(cause);
        }
        self.setpoint.velocity_m_per_s = [0.0; 3];
    }

    fn follow(&mut self, command: &Command, period_s: f64) {
        let limits = self.limits;
        let target_m = limits.inside(&command.position_m);
        let at_m = self.setpoint.position_m;
        let way_m: [f64; 3] = std::array::from_fn(|axis| target_m[axis] - at_m[axis]);
        let share = shortening(&way_m, limits.speed_m_per_s * period_s);
        let next_m: [f64; 3] = std::array::from_fn(|axis| at_m[axis] + way_m[axis] * share);
        self.setpoint.position_m = limits.inside(&next_m);
        let slower = shortening(&command.velocity_m_per_s, limits.speed_m_per_s);
        self.setpoint.velocity_m_per_s = command.velocity_m_per_s.map(|v| v * slower);
        let [low, high] = limits.damping_ratio;
        self.setpoint.damping_ratio = command.damping_ratio.clamp(low, high);
        self.ramp_stiffness(command.stiffness_n_per_m, period_s);
    }

    fn fall_back(&mut self, period_s: f64) {
        self.setpoint.velocity_m_per_s = [0.0; 3];
        self.setpoint.damping_ratio = self.fallback.damping_ratio;
        self.ramp_stiffness(self.fallback.stiffness_n_per_m, period_s);
    }

    fn ramp_stiffness(&mut self, goal_n_per_m: [f64; 3], period_s: f64) {
        let [low, high] = self.limits.stiffness_n_per_m;
        let step = self.limits.stiffness_rate_n_per_m_s * period_s;
        for (stiffness, goal) in self.setpoint.stiffness_n_per_m.iter_mut().zip(goal_n_per_m) {
            *stiffness = (*stiffness + (goal - *stiffness).clamp(-step, step)).clamp(low, high);
        }
    }
}

fn followable(command: &Command, now_us: u64) -> bool {
    now_us.saturating_sub(command.acquired_us) <= FOLLOW_AGE_US
        && now_us < command.valid_until_us
        && command.quality == Quality::Good
}

/// The factor (at most 1) that shortens a vector to `longest`. Finite vectors only.
fn shortening(vector: &[f64; 3], longest: f64) -> f64 {
    let length = vector.iter().fold(0.0_f64, |sum, v| sum.hypot(*v));
    if length > longest {
        longest / length
    } else {
        1.0
    }
}

#[cfg(test)]
mod tests;

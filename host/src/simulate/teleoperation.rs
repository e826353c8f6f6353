//! A person teleoperates the simulated [`Arm`]: the captured hand's position, in the robot's frame, is the desired
//! position of a Cartesian PID controller with inverse kinematics behind it, as in section 3.1 of the paper.
//!
//! ```text
//! e = desired - tool,   v = P e + I * integral of e + D * de/dt        tool's velocity, each axis by itself
//! q' = inverse kinematics(tool + v dt),   every joint within its speed,   tool = forward kinematics(q)
//! ```
//!
//! The controller commands velocities, so away from the joints' limits the tool follows with the transfer function
//! `(D s^2 + P s + I) / ((1 + D) s^2 + P s + I)`: a time constant of about `(1 + D) / P`, 70 ms with the default
//! gains. Gains and arm are our own choice: the paper names neither.

use super::scripted::HOME_M;
use crate::robot::arm::{Arm, ArmError, JOINTS, READY_RAD};

/// Gains of the controller, alike for the three axes, and where the tool starts.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TeleoperationConfig {
    /// P, 1/s; more than 0.
    pub proportional_per_s: f64,
    /// I, 1/s^2; 0 or more.
    pub integral_per_s2: f64,
    /// D, no unit; at least 0 and below 1, where its sampled form stops being stable.
    pub derivative: f64,
    /// Where the tool starts: base frame, metres.
    pub start_m: [f64; 3],
}

impl Default for TeleoperationConfig {
    fn default() -> Self {
        Self {
            proportional_per_s: 15.0,
            integral_per_s2: 0.5,
            derivative: 0.05,
            start_m: HOME_M,
        }
    }
}

/// Why a step of teleoperation was refused; the arm then stays as it was.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum TeleoperationError {
    /// Gains that would not settle.
    #[error(
        "the gains must be finite: proportional above 0, integral 0 or more, derivative from 0 to below 1"
    )]
    Gains,
    /// A desired position that is not a finite number.
    #[error("the desired position {0:?} is not finite: leave out instants without a hand")]
    Desired([f64; 3]),
    /// A time step that is not positive, or too long for the gains.
    #[error(
        "a step of {dt_s} s is not between 0 and {longest_s} s: call more often or lower the gains"
    )]
    Step {
        /// The step asked for, seconds.
        dt_s: f64,
        /// The longest one these gains stand, seconds.
        longest_s: f64,
    },
    /// The arm cannot go there.
    #[error(transparent)]
    Arm(#[from] ArmError),
}

/// The arm under its controller.
#[derive(Debug)]
pub struct Teleoperation {
    arm: Arm,
    config: TeleoperationConfig,
    joints_rad: [f64; JOINTS],
    tool_m: [f64; 3],
    integral_m_s: [f64; 3],
    last_error_m: Option<[f64; 3]>,
}

impl Teleoperation {
    /// The arm at rest with its tool at `config.start_m`.
    ///
    /// # Errors
    /// [`TeleoperationError::Gains`], or [`TeleoperationError::Arm`] where the start is out of reach.
    pub fn new(config: &TeleoperationConfig) -> Result<Self, TeleoperationError> {
        let TeleoperationConfig {
            proportional_per_s,
            integral_per_s2,
            derivative,
            start_m,
        } = *config;
        let finite = proportional_per_s.is_finite() && integral_per_s2.is_finite();
        if !finite
            || proportional_per_s <= 0.0
            || integral_per_s2 < 0.0
            || !(0.0..1.0).contains(&derivative)
        {
            return Err(TeleoperationError::Gains);
        }
        let mut teleoperation = Self {
            arm: Arm::new()?,
            config: *config,
            joints_rad: READY_RAD,
            tool_m: start_m,
            integral_m_s: [0.0; 3],
            last_error_m: None,
        };
        teleoperation.reset(start_m)?;
        Ok(teleoperation)
    }

    /// Puts the arm at rest with its tool at `position_m` (base frame, metres) and forgets what was before: the same
    /// posture, whatever happened.
    ///
    /// # Errors
    /// [`TeleoperationError::Arm`] where the position is out of reach; nothing has changed then.
    pub fn reset(&mut self, position_m: [f64; 3]) -> Result<(), TeleoperationError> {
        self.joints_rad = self.arm.joints_for(position_m, &READY_RAD)?;
        self.tool_m = self.arm.tool_m(&self.joints_rad)?;
        self.integral_m_s = [0.0; 3];
        self.last_error_m = None;
        Ok(())
    }

    /// Follows the desired position (base frame, metres) for `dt_s` seconds and says where the tool is then.
    ///
    /// When a joint would have to move faster than it can, all of them slow down alike, so that the tool stays near
    /// its line, and the integral stands still meanwhile.
    ///
    /// # Errors
    /// [`TeleoperationError::Desired`], [`TeleoperationError::Step`], and [`TeleoperationError::Arm`] where the
    /// controller's next point is out of reach; the arm then stays as it was.
    pub fn step(&mut self, desired_m: [f64; 3], dt_s: f64) -> Result<[f64; 3], TeleoperationError> {
        if !desired_m.iter().all(|x| x.is_finite()) {
            return Err(TeleoperationError::Desired(desired_m));
        }
        // Beyond this the sampled controller overshoots with every step.
        let longest_s = (1.0 - self.config.derivative) / self.config.proportional_per_s;
        if !(dt_s > 0.0 && dt_s <= longest_s) {
            return Err(TeleoperationError::Step { dt_s, longest_s });
        }
        let error_m: [f64; 3] = std::array::from_fn(|axis| desired_m[axis] - self.tool_m[axis]);
        let last_m = self.last_error_m.unwrap_or(error_m);
        let integral_m_s: [f64; 3] =
            std::array::from_fn(|axis| self.integral_m_s[axis] + error_m[axis] * dt_s);
        let next_m = std::array::from_fn(|axis| {
            let velocity = self.config.proportional_per_s * error_m[axis]
                + self.config.integral_per_s2 * integral_m_s[axis]
                + self.config.derivative * (error_m[axis] - last_m[axis]) / dt_s;
            self.tool_m[axis] + velocity * dt_s
        });
        let wanted_rad = self.arm.joints_for(next_m, &self.joints_rad)?;
        let way = self.allowed(&wanted_rad, dt_s);
        // Between two postures within the limits, so within them.
        let joints_rad = std::array::from_fn(|joint| {
            self.joints_rad[joint] + way * (wanted_rad[joint] - self.joints_rad[joint])
        });
        self.tool_m = self.arm.tool_m(&joints_rad)?;
        self.joints_rad = joints_rad;
        self.last_error_m = Some(error_m);
        if way >= 1.0 {
            self.integral_m_s = integral_m_s;
        }
        Ok(self.tool_m)
    }

    /// Where the tool is: base frame, metres.
    #[must_use]
    pub fn tool_m(&self) -> [f64; 3] {
        self.tool_m
    }

    /// The joints' angles from the base on, radians.
    #[must_use]
    pub fn joints_rad(&self) -> [f64; JOINTS] {
        self.joints_rad
    }

    /// Share of the way to `wanted_rad` that every joint can go within `dt_s`.
    fn allowed(&self, wanted_rad: &[f64; JOINTS], dt_s: f64) -> f64 {
        self.arm
            .limits()
            .iter()
            .zip(wanted_rad.iter().zip(&self.joints_rad))
            .map(|(limits, (to, from))| limits.speed_rad_per_s * dt_s / (to - from).abs())
            .fold(1.0, f64::min)
    }
}

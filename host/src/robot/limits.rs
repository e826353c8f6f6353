//! What the robot must keep to, and what the gate sends it.

use thiserror::Error;

/// What the robot's hand must never exceed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Limits {
    /// Smallest and largest stiffness of any axis, N/m.
    pub stiffness_n_per_m: [f64; 2],
    /// Fastest change of any axis' stiffness, N/m per second, both ways.
    pub stiffness_rate_n_per_m_s: f64,
    /// Smallest and largest damping ratio.
    pub damping_ratio: [f64; 2],
    /// Fastest motion of the set-point, and largest velocity passed on, m/s.
    pub speed_m_per_s: f64,
    /// Lower corner of the box that the set-point stays in, robot base frame, metres.
    pub workspace_low_m: [f64; 3],
    /// Upper corner of that box, metres.
    pub workspace_high_m: [f64; 3],
}

impl Default for Limits {
    /// A Franka arm: 10 to 3000 N/m, in a table-top workspace.
    fn default() -> Self {
        Self {
            stiffness_n_per_m: [10.0, 3000.0],
            stiffness_rate_n_per_m_s: 3000.0,
            damping_ratio: [0.5, 1.5],
            speed_m_per_s: 1.0,
            workspace_low_m: [0.1, -0.8, 0.0],
            workspace_high_m: [0.9, 0.8, 1.0],
        }
    }
}

/// How the robot waits when nothing trustworthy tells it what to do: it stays where it is, this firm.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Fallback {
    /// Stiffness of each axis, N/m: firm enough to bear the load, soft enough to be pushed aside.
    pub stiffness_n_per_m: [f64; 3],
    /// Damping ratio.
    pub damping_ratio: f64,
}

impl Default for Fallback {
    fn default() -> Self {
        Self {
            stiffness_n_per_m: [200.0, 200.0, 400.0],
            damping_ratio: 1.0,
        }
    }
}

/// Where the robot is to be and how firmly, from one tick of the gate. Always within [`Limits`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Setpoint {
    /// Position of the hand, metres.
    pub position_m: [f64; 3],
    /// Velocity of the hand, m/s: zero unless following.
    pub velocity_m_per_s: [f64; 3],
    /// Diagonal stiffness, N/m.
    pub stiffness_n_per_m: [f64; 3],
    /// Damping ratio.
    pub damping_ratio: f64,
}

/// A configuration that cannot be kept.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum ConfigError {
    /// A range whose ends are not finite, in order, and (but for the workspace) positive.
    #[error("{what} must be a finite range in increasing order, got {low} to {high}")]
    Range {
        /// Which range.
        what: &'static str,
        /// Its lower end.
        low: f64,
        /// Its upper end.
        high: f64,
    },
    /// A rate or speed that is not positive and finite.
    #[error("{what} must be positive and finite, got {value}")]
    Rate {
        /// Which one.
        what: &'static str,
        /// Its value.
        value: f64,
    },
    /// A fallback or start that the limits forbid.
    #[error("{what} {value} lies outside the limits {low} to {high}: change it or the limits")]
    Outside {
        /// What lies outside.
        what: &'static str,
        /// Its value.
        value: f64,
        /// Lower limit.
        low: f64,
        /// Upper limit.
        high: f64,
    },
}

impl Limits {
    /// Whether the limits make sense and the fallback and the start position (metres) keep them.
    ///
    /// # Errors
    /// [`ConfigError`] names the range or value that does not.
    pub fn check(&self, fallback: &Fallback, start_m: &[f64; 3]) -> Result<(), ConfigError> {
        let positive = [
            ("stiffness limits", self.stiffness_n_per_m),
            ("damping ratio limits", self.damping_ratio),
        ];
        for (what, [low, high]) in positive {
            if !(low > 0.0 && low < high && high.is_finite()) {
                return Err(ConfigError::Range { what, low, high });
            }
        }
        for (&low, &high) in self.workspace_low_m.iter().zip(&self.workspace_high_m) {
            if !(low.is_finite() && low < high && high.is_finite()) {
                return Err(ConfigError::Range {
                    what: "workspace",
                    low,
                    high,
                });
            }
        }
        let rates = [
            ("stiffness rate", self.stiffness_rate_n_per_m_s),
            ("speed", self.speed_m_per_s),
        ];
        for (what, value) in rates {
            if !(value > 0.0 && value.is_finite()) {
                return Err(ConfigError::Rate { what, value });
            }
        }
        let [low, high] = self.stiffness_n_per_m;
        for stiffness in fallback.stiffness_n_per_m {
            check_inside("fallback stiffness", stiffness, low, high)?;
        }
        let [low, high] = self.damping_ratio;
        check_inside("fallback damping ratio", fallback.damping_ratio, low, high)?;
        for (axis, &start_m) in start_m.iter().enumerate() {
            let (low, high) = (self.workspace_low_m[axis], self.workspace_high_m[axis]);
            check_inside("start position", start_m, low, high)?;
        }
        Ok(())
    }

    /// The nearest point of the workspace, metres.
    #[must_use]
    pub fn inside(&self, position_m: &[f64; 3]) -> [f64; 3] {
        std::array::from_fn(|axis| {
            position_m[axis].clamp(self.workspace_low_m[axis], self.workspace_high_m[axis])
        })
    }
}

fn check_inside(what: &'static str, value: f64, low: f64, high: f64) -> Result<(), ConfigError> {
    if (low..=high).contains(&value) {
        Ok(())
    } else {
        Err(ConfigError::Outside {
            what,
            value,
            low,
            high,
        })
    }
}

//! What the host asks of the robot, and how old the evidence for it is.

use thiserror::Error;

/// Whether the signals and the model behind a command can be trusted.
///
/// In order of gravity: the greater of two reasons is the one to report.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord)]
pub enum Quality {
    /// Signals are sound and the motion is one that the model knows.
    Good,
    /// The model does not yet know what to ask of the robot: its uncertainty is too large to act on.
    Undecided,
    /// The novelty gate found the motion outside the model.
    Novel,
    /// A channel is saturated, flat, off the skin, or drowned in hum.
    SignalFault,
}

/// One impedance command: a hand pose, its velocity, and how firmly to keep it (eq. 5).
///
/// Times are microseconds of the clock that the gate's `now_us` is read from: the clock room converts
/// the wearable's times before a command is built.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Command {
    /// Position of the robot's hand in its base frame (x forward, y left, z up), metres.
    pub position_m: [f64; 3],
    /// Velocity of the robot's hand, metres per second.
    pub velocity_m_per_s: [f64; 3],
    /// Diagonal of the Cartesian stiffness, newtons per metre.
    pub stiffness_n_per_m: [f64; 3],
    /// Ratio of the damping to the critical damping of each axis (dimensionless): the robot chooses D
    /// from this, its stiffness and its inertia.
    pub damping_ratio: f64,
    /// The newest scan that went into the command: age is measured from here, never from the (earlier)
    /// time that the filtered value describes.
    pub acquired_us: u64,
    /// From this time on the command is held rather than followed, whatever its age.
    pub valid_until_us: u64,
    /// Increases by at least one from command to command of one boot (wrapping).
    pub sequence: u32,
    /// The wearable's boot that the signals come from.
    pub boot_id: u32,
    /// Trust in the signals and in the model.
    pub quality: Quality,
}

/// Why a command cannot be used, whatever the state of the robot.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum CommandError {
    /// A NaN or an infinity.
    #[error(
        "the command's {field} holds {value}, which is not a finite number: drop the command and look at its source"
    )]
    NotFinite {
        /// Name of the field.
        field: &'static str,
        /// The first value that is not finite.
        value: f64,
    },
    /// A stiffness at or below zero, which no model of log stiffness produces.
    #[error(
        "the command's stiffness is {value_n_per_m} N/m, it must be positive: model log stiffness"
    )]
    NotPositive {
        /// The first stiffness that is not positive, N/m.
        value_n_per_m: f64,
    },
    /// A damping ratio at or below zero: the robot would oscillate for ever.
    #[error("the command's damping ratio is {value}, it must be positive (0.7 to 1 is usual)")]
    NotDamped {
        /// The ratio.
        value: f64,
    },
}

impl Command {
    /// Refuses numbers that no limit can mend.
    ///
    /// # Errors
    /// [`CommandError`] names the field and the value.
    pub fn check(&self) -> Result<(), CommandError> {
        let fields: [(&'static str, &[f64]); 4] = [
            ("position", &self.position_m),
            ("velocity", &self.velocity_m_per_s),
            ("stiffness", &self.stiffness_n_per_m),
            ("damping ratio", std::slice::from_ref(&self.damping_ratio)),
        ];
        for (field, values) in fields {
            if let Some(&value) = values.iter().find(|v| !v.is_finite()) {
                return Err(CommandError::NotFinite { field, value });
            }
        }
        if let Some(&value_n_per_m) = self.stiffness_n_per_m.iter().find(|&&k| k <= 0.0) {
            return Err(CommandError::NotPositive { value_n_per_m });
        }
        if self.damping_ratio <= 0.0 {
            return Err(CommandError::NotDamped {
                value: self.damping_ratio,
            });
        }
        Ok(())
    }
}

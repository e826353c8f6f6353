//! What people see and give: the words of a calibration.

use serde::{Deserialize, Serialize};

/// One step of the calibration.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct StepView {
    /// `rest`, `contract`, `load`, `result`, `fit_flex`, `fit_extend`.
    pub name: String,
    /// Which of how many.
    pub number: u32,
    /// How many.
    pub of: u32,
    /// What to do, for people.
    pub instruction: String,
    /// Whether it is measured now.
    pub measuring: bool,
    /// Share of the measurement that is done.
    pub progress: f64,
    /// Whether it is measured, so that the next one may come.
    pub done: bool,
    /// Why it must be done again.
    pub problem: Option<String>,
}

/// A number and how sure it is.
#[derive(Clone, Copy, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct Estimate {
    /// The number.
    pub value: f64,
    /// Its standard deviation.
    pub std: f64,
}

/// What a calibration found.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
pub struct CalibrationResult {
    /// Envelope of each channel at rest, microvolts.
    pub rest_uv: Vec<Estimate>,
    /// Envelope of each channel at maximum, microvolts.
    pub mvc_uv: Vec<Estimate>,
    /// Gain of eq. 8.
    pub l1: Estimate,
    /// Slope of eq. 8.
    pub l2: Estimate,
    /// Joint stiffness at rest, N m/rad: three of the shoulder, elbow.
    pub rest_stiffness_nm_per_rad: [Estimate; 4],
    /// What the fit leaves, root mean square, millimetres of the hand.
    pub residual_mm: f64,
    /// What the loads do not tell and the prior says instead, for people; empty if all is told.
    pub notes: Vec<String>,
}

/// Whom the calibration is for.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Person {
    /// A name or code, for files.
    pub name: String,
    /// Body mass, kg.
    pub body_mass_kg: f64,
    /// Body height, m.
    pub body_height_m: f64,
    /// Mains frequency where they are, 50 or 60 Hz; none for no notch.
    pub mains_hz: Option<u8>,
}

/// Longest name of a person, bytes: a file's name holds it, whatever it is made of.
const MAX_NAME_BYTES: usize = 64;

/// Why a text names nobody.
#[derive(Clone, Debug, PartialEq, Eq, thiserror::Error)]
#[error("`{}` is no name ({} bytes): give 1 to {MAX_NAME_BYTES} bytes of printable characters", got.escape_debug(), got.len())]
pub struct NameError {
    /// What was given.
    pub got: String,
}

impl Person {
    /// A name as it is kept: without spaces around it.
    ///
    /// # Errors
    /// [`NameError`] for an empty one, a longer one than files carry, or one with control characters.
    pub fn name_of(given: &str) -> Result<String, NameError> {
        let name = given.trim();
        let fine =
            (1..=MAX_NAME_BYTES).contains(&name.len()) && !name.chars().any(char::is_control);
        if fine {
            Ok(name.to_owned())
        } else {
            Err(NameError {
                got: name.to_owned(),
            })
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn names_are_what_files_and_people_can_carry() {
        assert_eq!(Person::name_of(" Zoë, left ").as_deref(), Ok("Zoë, left"));
        // Two bytes each: 32 of them are 64.
        assert!(Person::name_of(&"ë".repeat(32)).is_ok());
        for wrong in [
            "",
            "  ",
            "a\nb",
            "\u{1b}[2J",
            &"ë".repeat(33),
            &"a".repeat(65),
        ] {
            let refused = Person::name_of(wrong).expect_err(wrong).to_string();
            assert!(refused.contains("1 to 64 bytes"), "{refused}");
            assert!(!refused.contains(char::is_control), "{refused}");
        }
    }
}

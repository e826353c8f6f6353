//! A person as measured, to be kept in a file and used again.

use serde::{Deserialize, Serialize};
use tonus_shared::wire::{
    self, Calibration, Header, MAX_CHANNELS, MAX_FRAME_BYTES, Muscle, Packet, WireError,
};

use super::fit_check::Pattern;
use super::guide::Outcome;
use super::view::{CalibrationResult, Person};

/// Version of the file and of what its fields mean.
const SCHEMA_VERSION: u32 = 1;
/// A person as measured.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub struct Profile {
    schema_version: u32,
    /// Whom.
    pub person: Person,
    calibration: Levels,
    /// How the channels look: what a [`super::FitCheck`] compares with.
    pub pattern: Pattern,
    /// What was found, with its uncertainty.
    pub result: CalibrationResult,
}

/// [`Calibration`] without what [`Person`] says; a list has an entry for each channel.
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct Levels {
    revision: u32,
    muscles: Vec<String>,
    semg_hz: f32,
    rest_v: Vec<f32>,
    mvc_v: Vec<f32>,
    activation_window_s: f32,
    l1: f32,
    l2: f32,
    rest_stiffness_nm_per_rad: [f32; 4],
}

/// Why a text is nobody's measurement.
#[derive(Debug, thiserror::Error)]
pub enum ProfileError {
    /// Not JSON, or other fields.
    #[error("no measurement of a person ({0})")]
    Text(#[from] serde_json::Error),
    /// Written by another version.
    #[error("schema version {found}, this program reads {SCHEMA_VERSION}: calibrate again")]
    Version {
        /// The version found.
        found: u32,
    },
    /// No such muscle.
    #[error(
        "muscle `{found}`: give biceps_short, biceps_long, triceps_lateral, triceps_long or other"
    )]
    Muscle {
        /// What stands there.
        found: String,
    },
    /// Lists of different lengths, or of none that a wearable has.
    #[error(
        "{muscles} muscles, {rest} rests and {mvc} maxima: give 1 to {MAX_CHANNELS}, of each as many"
    )]
    Channels {
        /// Muscles given.
        muscles: usize,
        /// Rests given.
        rest: usize,
        /// Maxima given.
        mvc: usize,
    },
    /// Numbers that no calibration has.
    #[error("numbers that no wearable takes: {0}")]
    Numbers(WireError),
}

impl Profile {
    /// What a calibration of `person` gave.
    #[must_use]
    pub fn new(person: &Person, outcome: &Outcome) -> Self {
        let calibration = &outcome.calibration;
        let used = usize::from(calibration.channels).min(MAX_CHANNELS);
        let muscles = calibration.muscles.iter().take(used);
        Self {
            schema_version: SCHEMA_VERSION,
            person: person.clone(),
            calibration: Levels {
                revision: calibration.revision,
                muscles: muscles.map(|muscle| muscle.name().to_owned()).collect(),
                semg_hz: calibration.semg_hz,
                rest_v: calibration.rest_v.iter().take(used).copied().collect(),
                mvc_v: calibration.mvc_v.iter().take(used).copied().collect(),
                activation_window_s: calibration.activation_window_s,
                l1: calibration.l1,
                l2: calibration.l2,
                rest_stiffness_nm_per_rad: calibration.rest_stiffness_nm_per_rad,
            },
            pattern: outcome.pattern.clone(),
            result: outcome.result.clone(),
        }
    }

    /// Out of the text of a file.
    ///
    /// # Errors
    /// [`ProfileError`]; what is read makes a [`Profile::calibration`].
    pub fn parse(text: &str) -> Result<Self, ProfileError> {
        /// The one field that every version has.
        #[derive(Deserialize)]
        struct Versioned {
            schema_version: u32,
        }
        let Versioned { schema_version } = serde_json::from_str(text)?;
        if schema_version != SCHEMA_VERSION {
            return Err(ProfileError::Version {
                found: schema_version,
            });
        }
        let profile: Self = serde_json::from_str(text)?;
        profile.calibration()?;
        Ok(profile)
    }

    /// The text of a file.
    #[must_use]
    pub fn text(&self) -> String {
        // Numbers, texts and lists: nothing that JSON cannot say.
        serde_json::to_string_pretty(self).unwrap_or_default() + "\n"
    }

    /// What the wearable is to work with.
    ///
    /// # Errors
    /// [`ProfileError`].
    #[allow(clippy::cast_possible_truncation, reason = "the packet carries f32")]
    pub fn calibration(&self) -> Result<Calibration, ProfileError> {
        let levels = &self.calibration;
        let count = levels.muscles.len();
        let alike = levels.rest_v.len() == count && levels.mvc_v.len() == count;
        if !(alike && (1..=MAX_CHANNELS).contains(&count)) {
            return Err(ProfileError::Channels {
                muscles: count,
                rest: levels.rest_v.len(),
                mvc: levels.mvc_v.len(),
            });
        }
        let mut muscles = [Muscle::Absent; MAX_CHANNELS];
        for (slot, name) in muscles.iter_mut().zip(&levels.muscles) {
            let known = Muscle::named(name).filter(|muscle| *muscle != Muscle::Absent);
            *slot = known.ok_or_else(|| ProfileError::Muscle {
                found: name.clone(),
            })?;
        }
        let slots = |list: &[f32]| std::array::from_fn(|at| list.get(at).copied().unwrap_or(0.0));
        let calibration = Calibration {
            revision: levels.revision,
            channels: count as u8,
            muscles,
            mains_hz: self.person.mains_hz,
            semg_hz: levels.semg_hz,
            rest_v: slots(&levels.rest_v),
            mvc_v: slots(&levels.mvc_v),
            activation_window_s: levels.activation_window_s,
            l1: levels.l1,
            l2: levels.l2,
            rest_stiffness_nm_per_rad: levels.rest_stiffness_nm_per_rad,
            body_mass_kg: self.person.body_mass_kg as f32,
            body_height_m: self.person.body_height_m as f32,
        };
        // The wire knows what a calibration may be.
        let mut bytes = [0; MAX_FRAME_BYTES];
        let packet = Packet::Calibration(calibration);
        let header = Header {
            boot_id: 0,
            sequence: 0,
            device_us: 0,
        };
        wire::encode(&header, &packet, &mut bytes).map_err(ProfileError::Numbers)?;
        Ok(calibration)
    }
}

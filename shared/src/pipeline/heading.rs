//! Which way a level frame lies that an attitude filter has chosen for itself.
//!
//! Accelerations show the vertical and rates show turns, so that an attitude is known but for its direction about the vertical:
//!
//! ```text
//! upper-arm axes --told--> level frame, z up --turn about z--> shoulder frame, x forward
//! ```
//!
//! One known posture gives the turn: the upper arm hangs and the elbow is bent forward, so that the upper arm's x axis points
//! forward. Until then nothing is known of the direction, and the attitude must not choose a posture. Afterwards the
//! direction drifts with what is left of the gyroscope's bias, some degrees in ten minutes at best.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};

use crate::wire::Refusal;

use super::input::{InputError, Latest};

/// The upper arm hangs if its long axis is so near the vertical: cosine of 30 degrees.
pub const HANGING: f32 = 0.866;

/// Why the present direction was not taken for forward. What was known stands.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum HeadingError {
    /// No attitude came within 0.1 s: there is no sensor, or it settles or has failed.
    #[error("no attitude is known: wait until the attitude sensor tells one")]
    NoAttitude,
    /// Raised, the arm's x axis does not point forward.
    #[error(
        "the upper arm is {tilt_deg} degrees from hanging: let it hang within 30, the elbow bent forward"
    )]
    NotHanging {
        /// Between the upper arm and the vertical, degrees.
        tilt_deg: f32,
    },
}

/// As a request is answered.
impl From<HeadingError> for Refusal {
    fn from(error: HeadingError) -> Self {
        match error {
            HeadingError::NoAttitude => Self::WrongState,
            HeadingError::NotHanging { .. } => Self::OutOfRange,
        }
    }
}

/// The newest attitude as it was told, and the turn once it is known.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Heading {
    told: Latest<4>,
    turn: Option<UnitQuaternion<f32>>,
}

impl Heading {
    /// Takes a checked unit quaternion x, y, z, w (upper arm to level frame); in the shoulder frame, once the turn is known.
    pub(super) fn set(
        &mut self,
        xyzw: [f32; 4],
        acquired_us: u64,
        scan_us: Option<u64>,
    ) -> Result<Option<[f32; 4]>, InputError> {
        self.told.set(Some(xyzw), acquired_us, scan_us)?;
        Ok(self.turn.map(|turn| (turn * rotation(xyzw)).coords.into()))
    }

    /// Takes the direction in which the upper arm's x axis points at device time `now_us` for forward.
    pub(super) fn face_forward(&mut self, now_us: u64) -> Result<(), HeadingError> {
        let told = self.told.recent(now_us).ok_or(HeadingError::NoAttitude)?;
        let told = rotation(told);
        let upright = (told * Vector3::z()).z;
        if upright < HANGING {
            let tilt_deg = libm::acosf(upright.clamp(-1.0, 1.0)).to_degrees();
            return Err(HeadingError::NotHanging { tilt_deg });
        }
        let x = told * Vector3::x();
        let turn_rad = -libm::atan2f(x.y, x.x);
        self.turn = Some(UnitQuaternion::from_axis_angle(
            &Vector3::z_axis(),
            turn_rad,
        ));
        Ok(())
    }
}

fn rotation(xyzw: [f32; 4]) -> UnitQuaternion<f32> {
    UnitQuaternion::from_quaternion(Quaternion::from(xyzw))
}

//! From the armband's attitude to the upper arm's.
//!
//! The armband tells how its own axes lie in a level frame whose heading it chose when it woke. Neither how it sits on
//! the arm nor where that heading points is told by anything; one posture that is known gives both:
//!
//! ```text
//! armband axes --q--> level frame, z up        told, 50 times a second
//! upper-arm axes --mounting--> armband axes    upper arm hanging: heading q mounting = 1
//! level frame --heading--> shoulder frame      the logo then faces forward
//! upper arm = heading q mounting
//! ```
//!
//! The posture is that of the calibration's step in which the elbow is bent against a weight, and of the check's after
//! re-donning: the upper arm hangs, the elbow is bent forward. The logo sits over the biceps ([`super::MUSCLES`]), which then
//! faces forward. By how much it does not, the direction in which a raised arm points is turned about the vertical; its
//! elevation is right all the same. Which way round the armband is worn, or tilted on a tapering arm, is no matter.
//!
//! Axes: z out of the logo, x along the arm either way; at rest the accelerometer shows 1 g upwards (Thalmic Labs' Myo
//! package for Unity: its README, and the mapping of axes in `ThalmicMyo.cs`). Where that does not hold, nothing is taken.

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tonus_shared::pipeline::HANGING;

use super::packet::Imu;

/// Time to take the posture, and until it is left again, after it is asked for, us: as the step leaves and measures.
const TAKEN_US: u64 = 1_000_000;
const LEFT_US: u64 = 4_000_000;
/// So long it must be held still, us.
const STILL_US: u64 = 1_000_000;
/// Still: the acceleration is gravity alone, g; turning, degrees a second.
const GRAVITY_G: std::ops::RangeInclusive<f32> = 0.9..=1.1;
const TURNING_DEG_PER_S: f32 = 15.0;
/// The told attitude must take the measured acceleration to the vertical as well as this (cosine of 15 degrees).
const LEVEL: f32 = 0.966;

/// How the armband sits, once that is known.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Attitude {
    /// When the posture was asked for.
    asked_us: Option<u64>,
    /// Since when it is held.
    still_us: Option<u64>,
    sits: Option<Sits>,
}

#[derive(Clone, Copy, Debug)]
struct Sits {
    heading: UnitQuaternion<f32>,
    mounting: UnitQuaternion<f32>,
}

impl Attitude {
    /// From a second on the upper arm hangs and the elbow is bent forward, for three seconds.
    pub(super) fn hangs(&mut self, at_us: u64) {
        self.asked_us = Some(at_us);
        self.still_us = None;
    }

    /// It does not, whatever was asked for.
    pub(super) fn moves(&mut self) {
        self.asked_us = None;
    }

    /// Of the upper arm in the shoulder frame, unit quaternion x, y, z, w; none before the posture was held.
    pub(super) fn take(&mut self, imu: &Imu, at_us: u64) -> Option<[f32; 4]> {
        let told = UnitQuaternion::from_quaternion(Quaternion::from(imu.xyzw));
        if self.held(imu, &told, at_us) {
            self.asked_us = None;
            self.sits = Some(Sits::hanging(&told));
        }
        let sits = self.sits?;
        let upper_arm = sits.heading * told * sits.mounting;
        Some(upper_arm.coords.into())
    }

    /// Whether the posture has been held still for long enough.
    fn held(&mut self, imu: &Imu, told: &UnitQuaternion<f32>, at_us: u64) -> bool {
        let since = |asked_us| at_us.saturating_sub(asked_us);
        let within =
            (self.asked_us).is_some_and(|asked| (TAKEN_US..=LEFT_US).contains(&since(asked)));
        if !within || !hangs_still(imu, told) {
            self.still_us = None;
            return false;
        }
        at_us.saturating_sub(*self.still_us.get_or_insert(at_us)) >= STILL_US
    }
}

impl Sits {
    /// From what is told while the upper arm hangs.
    fn hanging(told: &UnitQuaternion<f32>) -> Self {
        let logo = told * Vector3::z();
        let heading = UnitQuaternion::from_axis_angle(&Vector3::z_axis(), -logo.y.atan2(logo.x));
        Self {
            heading,
            mounting: (heading * told).inverse(),
        }
    }
}

fn hangs_still(imu: &Imu, told: &UnitQuaternion<f32>) -> bool {
    let acceleration = Vector3::from(imu.acceleration_g);
    let size = acceleration.norm();
    GRAVITY_G.contains(&size)
        && Vector3::from(imu.turning_deg_per_s).norm() <= TURNING_DEG_PER_S
        && acceleration.x.abs() >= HANGING * size
        && (told * acceleration).z >= LEVEL * size
}

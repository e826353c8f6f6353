//! The upper arm's attitude from rates and accelerations, by VQF (Laidig and Seel, Information Fusion 91, 2023).
//!
//! VQF integrates the rates, corrects inclination by the low-passed acceleration (time constant 3 s), and
//! learns the gyroscope's bias, at rest and in motion.
//!
//! ```text
//! sensor axes --mounting--> upper-arm axes --VQF--> level frame, z up
//! ```
//!
//! **Yaw.** Nothing observes the direction about the vertical: it begins with the sensor's at the start and drifts by what is
//! left of the bias, some degrees in ten minutes at best. [`Pipeline::face_forward`] finds it in a known posture, on request of
//! a host. Inclination does not drift.
//!
//! [`Pipeline::face_forward`]: tonus_shared::pipeline::Pipeline::face_forward

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use vqf_rs::VQF;

use super::Motion;

/// A longer gap was not integrated over: the attitude would be a guess.
const GAP_US: u64 = 50_000;
/// After a start or a gap the inclination is that of single accelerations until the filter has averaged some.
const SETTLING_US: u64 = 500_000;
/// How sure the bias is after a gap, rad/s (0.2 °/s): the sensor warmed, but it is the same sensor.
const BIAS_SIGMA_RAD_S: f32 = 3.5e-3;
/// Measurements a second for which the filter is made.
const RATES_HZ: core::ops::RangeInclusive<f32> = 50.0..=1000.0;

/// Why a measurement or a mounting was refused. It changed nothing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AttitudeError {
    /// NaN or infinity.
    #[error("a value is not finite: drop the measurement")]
    NonFinite,
    /// Device time does not go on.
    #[error("device time {acquired_us} us is not after {newest_us} us: the attitude stands")]
    TimeNotNewer {
        /// Time given.
        acquired_us: u64,
        /// Newest so far.
        newest_us: u64,
    },
    /// Not a rotation.
    #[error("mounting quaternion of norm {norm}: give one of norm 1 (x, y, z, w)")]
    NotUnit {
        /// The norm.
        norm: f32,
    },
    /// Too slow for an arm, or no rate.
    #[error("{rate_hz} measurements a second: give 50 to 1000")]
    Rate {
        /// The rate, Hz.
        rate_hz: f32,
    },
}

/// Attitude of the upper arm in a level frame, as [`Pipeline::set_attitude`] takes it.
///
/// [`Pipeline::set_attitude`]: tonus_shared::pipeline::Pipeline::set_attitude
pub struct Attitude {
    filter: VQF,
    rate_hz: f32,
    mounting: UnitQuaternion<f32>,
    newest_us: Option<u64>,
    settled_us: u64,
}

impl Attitude {
    /// `mounting` turns sensor axes into upper-arm axes (unit quaternion x, y, z, w): part of board and strap.
    /// Upper-arm axes: -z from shoulder to elbow, -y the elbow's flexion axis; on a hanging arm x is forward, y left, z up.
    /// `rate_hz` is how often [`Self::push`] will be called, 50 to 1000 Hz.
    ///
    /// # Errors
    /// [`AttitudeError::NonFinite`], [`AttitudeError::NotUnit`], [`AttitudeError::Rate`].
    pub fn new(mounting: [f32; 4], rate_hz: f32) -> Result<Self, AttitudeError> {
        if !RATES_HZ.contains(&rate_hz) {
            return Err(AttitudeError::Rate { rate_hz });
        }
        let mounting = Quaternion::from(mounting);
        let norm = mounting.norm();
        if !norm.is_finite() {
            return Err(AttitudeError::NonFinite);
        }
        if (norm - 1.0).abs() > 1e-3 {
            return Err(AttitudeError::NotUnit { norm });
        }
        Ok(Self {
            filter: filter(rate_hz),
            rate_hz,
            mounting: UnitQuaternion::from_quaternion(mounting),
            newest_us: None,
            settled_us: 0,
        })
    }

    /// Takes a measurement of device time `acquired_us`, and gives the attitude: unit quaternion x, y, z, w, upper-arm
    /// frame to level frame. None while it settles, 0.5 s after the start and after a gap of over 50 ms.
    ///
    /// **Budget.** One measurement period, 4.8 ms at 208 Hz.
    ///
    /// # Errors
    /// [`AttitudeError::NonFinite`], [`AttitudeError::TimeNotNewer`].
    pub fn push(
        &mut self,
        motion: &Motion,
        acquired_us: u64,
    ) -> Result<Option<[f32; 4]>, AttitudeError> {
        let acceleration = self.mounting * Vector3::from(motion.acceleration_m_s2);
        let rate = self.mounting * Vector3::from(motion.rate_rad_s);
        // Squares too: what overflows there is no acceleration.
        if !(acceleration.norm_squared() + rate.norm_squared()).is_finite() {
            return Err(AttitudeError::NonFinite);
        }
        let elapsed_us = match self.newest_us {
            Some(newest_us) if acquired_us <= newest_us => {
                return Err(AttitudeError::TimeNotNewer {
                    acquired_us,
                    newest_us,
                });
            }
            Some(newest_us) => acquired_us - newest_us,
            None => u64::MAX,
        };
        if elapsed_us > GAP_US {
            self.restart(acquired_us);
        } else {
            self.filter
                .update_gyr_with_ts(rate.into(), elapsed_us as f32 * 1e-6);
        }
        self.filter.update_acc(acceleration.into());
        self.newest_us = Some(acquired_us);
        if acquired_us < self.settled_us {
            return Ok(None);
        }
        Ok(Some(self.level().coords.into()))
    }

    /// What the gyroscope shows at rest, rad/s, as far as it was learnt; upper-arm axes.
    #[must_use]
    pub fn bias_rad_s(&self) -> [f32; 3] {
        self.filter.bias_estimate().0
    }

    /// Begins anew with the inclination that the next acceleration shows. The bias, and the direction as far as
    /// it was known, stay.
    fn restart(&mut self, acquired_us: u64) {
        let bias = self.filter.bias_estimate().0;
        let before = self.level();
        let known = self.newest_us.is_some();
        self.filter = filter(self.rate_hz);
        if known {
            self.filter.set_bias_estimate(bias, Some(BIAS_SIGMA_RAD_S));
            let state = self.filter.state_mut();
            let q = before.quaternion();
            state.gyr_quat = vqf_rs::Quaternion(q.w, q.i, q.j, q.k);
        }
        self.settled_us = acquired_us + SETTLING_US;
    }

    /// Upper-arm frame to a frame that is level, with any heading.
    fn level(&self) -> UnitQuaternion<f32> {
        let q = self.filter.quat_6d();
        UnitQuaternion::from_quaternion(Quaternion::new(q.0, q.1, q.2, q.3))
    }
}

/// With the published tuning.
fn filter(rate_hz: f32) -> VQF {
    VQF::new(1.0 / rate_hz, None, None, None)
}

#[cfg(test)]
mod tests;

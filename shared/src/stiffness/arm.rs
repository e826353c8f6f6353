//! Kinematics and gravity of the 4-DoF arm. Frames and joint coordinates: see the [room](super).
//!
//! In the upper-arm frame everything is planar. With elbow angle `t`, forearm direction
//! `f = (sin t, 0, -cos t)` and `u = R^T z` the vertical seen from the upper arm:
//!
//! ```text
//! palm         p = L1 (-z) + L2 f                        J   = R [ a_i x p | p' ]
//! mass moment  m = S1 (-z) + S2 f                        V   = g u.m
//! dV/dq        g u.(a_i x m),   g u.m'                   tau = -dV/dq
//! d2V/dq2      g [ (u.a_i)(a_j.m) + (u.a_j)(a_i.m) ] / 2 - g (u.m) [i = j]     (shoulder block)
//!              g u.(a_i x m'),  g u.m''                                        (elbow column)
//! ```

use nalgebra::{Matrix3x4, Matrix4, Rotation3, Vector3, Vector4};

use super::{PostureError, Segments};
use crate::Real;

/// Standard gravity (ISO 80000-3), m/s^2.
pub const GRAVITY_M_S2: f64 = 9.80665;

/// Largest elbow flexion: 150 degrees, the normal range of motion (AAOS 1965), rad.
pub const ELBOW_MAX_RAD: f64 = 150.0 * core::f64::consts::PI / 180.0;

/// Where the elbow angle of a posture comes from.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum ElbowSource {
    /// The arm triangle, closed by a measured hand position.
    Hand,
    /// An angle that was given, not measured; without a hand position it is an assumption.
    Assumed,
}

/// A configuration of the arm: the upper arm's orientation in the shoulder frame, and the elbow angle.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmPosture<T: Real> {
    pub(super) upper_arm: Rotation3<T>,
    pub(super) elbow_rad: T,
    pub(super) elbow_source: ElbowSource,
}

impl<T: Real> ArmPosture<T> {
    /// From angles, rad: shoulder flexion about -y, then rotation to the left about the new x, then
    /// rotation about the upper arm's long axis, then elbow flexion. All zero is the hanging arm.
    ///
    /// # Errors
    /// [`PostureError::NonFinite`], [`PostureError::ElbowAngle`].
    pub fn from_angles(angles_rad: [T; 4]) -> Result<Self, PostureError> {
        let [flexion, left, axial, elbow] = angles_rad;
        if !(flexion.is_finite() && left.is_finite() && axial.is_finite()) {
            return Err(PostureError::NonFinite);
        }
        let upper_arm = Rotation3::from_axis_angle(&Vector3::y_axis(), -flexion)
            * Rotation3::from_axis_angle(&Vector3::x_axis(), left)
            * Rotation3::from_axis_angle(&Vector3::z_axis(), axial);
        Ok(Self {
            upper_arm,
            elbow_rad: checked_elbow(elbow)?,
            elbow_source: ElbowSource::Assumed,
        })
    }

    /// The upper arm's orientation: upper-arm frame to shoulder frame.
    pub fn upper_arm(&self) -> &Rotation3<T> {
        &self.upper_arm
    }

    /// Elbow flexion, rad; 0 is straight.
    pub fn elbow_rad(&self) -> T {
        self.elbow_rad
    }

    /// Whether the elbow angle was measured or assumed.
    pub fn elbow_source(&self) -> ElbowSource {
        self.elbow_source
    }

    /// The elbow in the shoulder frame, m.
    pub fn elbow_position(&self, segments: &Segments<T>) -> Vector3<T> {
        -self.upper_arm.matrix().column(2) * segments.upper_arm_m()
    }

    /// The palm centre in the shoulder frame, m.
    pub fn hand_position(&self, segments: &Segments<T>) -> Vector3<T> {
        self.upper_arm * self.chain(segments.upper_arm_m(), segments.forearm_m())
    }

    /// `d(hand)/dq`, 3 x 4, m/rad, in the shoulder frame.
    pub fn jacobian(&self, segments: &Segments<T>) -> Matrix3x4<T> {
        let hand = self.chain(segments.upper_arm_m(), segments.forearm_m());
        let [a0, a1, a2] = axes();
        let columns = [
            a0.cross(&hand),
            a1.cross(&hand),
            a2.cross(&hand),
            self.forearm_slope() * segments.forearm_m(),
        ];
        self.upper_arm.matrix() * Matrix3x4::from_columns(&columns)
    }

    /// Gravity's potential energy V, J; zero with the mass at the shoulder's height.
    pub fn potential_energy(&self, segments: &Segments<T>) -> T {
        T::of(GRAVITY_M_S2) * self.vertical().dot(&self.mass_moment(segments))
    }

    /// The torque that gravity exerts on the joints, `-dV/dq`, N m.
    pub fn gravity_torque(&self, segments: &Segments<T>) -> Vector4<T> {
        let moment = self.mass_moment(segments);
        let up = self.vertical() * -T::of(GRAVITY_M_S2);
        let [a0, a1, a2] = axes();
        Vector4::new(
            up.dot(&a0.cross(&moment)),
            up.dot(&a1.cross(&moment)),
            up.dot(&a2.cross(&moment)),
            up.dot(&self.forearm_slope()) * segments.forearm_moment(),
        )
    }

    /// `-G = d2V/dq2`, N m/rad, symmetric: what gravity adds to the joint stiffness. Positive for a hanging
    /// arm (a pendulum), negative for an inverted one.
    pub fn gravity_stiffness(&self, segments: &Segments<T>) -> Matrix4<T> {
        self.curvature(
            &(self.vertical() * T::of(GRAVITY_M_S2)),
            segments.upper_arm_moment(),
            segments.forearm_moment(),
        )
    }

    /// What a constant force on the hand adds to the joint stiffness, N m/rad, symmetric: `-d2(F.hand)/dq2`.
    pub(super) fn force_stiffness(
        &self,
        segments: &Segments<T>,
        force_n: &Vector3<T>,
    ) -> Matrix4<T> {
        let against = self.upper_arm.inverse_transform_vector(&-force_n);
        self.curvature(&against, segments.upper_arm_m(), segments.forearm_m())
    }

    /// Second derivative by q of `up . p`, with p at these lengths along the arm and `up` constant in the shoulder
    /// frame, given in the upper-arm frame.
    fn curvature(&self, up: &Vector3<T>, along_upper_arm: T, along_forearm: T) -> Matrix4<T> {
        let moment = self.chain(along_upper_arm, along_forearm);
        let slope = self.forearm_slope() * along_forearm;
        let curvature = -self.forearm() * along_forearm;
        let axes = axes();
        let half = T::of(0.5);
        let mut stiffness = Matrix4::zeros();
        for (i, a) in axes.iter().enumerate() {
            for (j, b) in axes.iter().enumerate() {
                stiffness[(i, j)] =
                    half * (up.dot(a) * b.dot(&moment) + up.dot(b) * a.dot(&moment));
            }
            stiffness[(i, i)] -= up.dot(&moment);
            let elbow = up.dot(&a.cross(&slope));
            stiffness[(i, 3)] = elbow;
            stiffness[(3, i)] = elbow;
        }
        stiffness[(3, 3)] = up.dot(&curvature);
        stiffness
    }

    /// The vertical, seen from the upper arm.
    fn vertical(&self) -> Vector3<T> {
        self.upper_arm.matrix().row(2).transpose()
    }

    /// The forearm's direction in the upper-arm frame.
    fn forearm(&self) -> Vector3<T> {
        let (sin, cos) = self.elbow_rad.sin_cos();
        Vector3::new(sin, T::zero(), -cos)
    }

    /// Derivative of the forearm's direction by the elbow angle.
    fn forearm_slope(&self) -> Vector3<T> {
        let (sin, cos) = self.elbow_rad.sin_cos();
        Vector3::new(cos, T::zero(), sin)
    }

    /// `along_upper_arm (-z) + along_forearm f`, in the upper-arm frame.
    fn chain(&self, along_upper_arm: T, along_forearm: T) -> Vector3<T> {
        self.forearm() * along_forearm - Vector3::z() * along_upper_arm
    }

    fn mass_moment(&self, segments: &Segments<T>) -> Vector3<T> {
        self.chain(segments.upper_arm_moment(), segments.forearm_moment())
    }
}

/// The shoulder's three joint axes in the upper-arm frame.
fn axes<T: Real>() -> [Vector3<T>; 3] {
    [-Vector3::y(), Vector3::x(), Vector3::z()]
}

/// An elbow angle within 0 to [`ELBOW_MAX_RAD`].
pub(super) fn checked_elbow<T: Real>(elbow_rad: T) -> Result<T, PostureError> {
    if !elbow_rad.is_finite() {
        return Err(PostureError::NonFinite);
    }
    if elbow_rad < T::zero() || elbow_rad > T::of(ELBOW_MAX_RAD) {
        return Err(PostureError::ElbowAngle {
            elbow_rad: elbow_rad.widen(),
            max_rad: ELBOW_MAX_RAD,
        });
    }
    Ok(elbow_rad)
}

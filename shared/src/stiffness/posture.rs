//! The arm's posture from what is measured: the hand's position, and the upper arm's orientation.
//!
//! Shoulder, elbow and hand form a triangle with two known sides. The hand's distance gives the elbow
//! angle, its direction `l` two of the shoulder's rotations, and the swivel about `l` the third:
//!
//! ```text
//! cos t = (d^2 - L1^2 - L2^2) / (2 L1 L2)          elbow flexion t
//! cos b = (d^2 + L1^2 - L2^2) / (2 L1 d)           angle between upper arm and l
//! upper-arm axes, with e the elbow's direction away from l:
//!   x = sin b l - cos b e,   y = l x e,   z = -(cos b l + sin b e)
//! ```
//!
//! which has no singularity at a straight elbow: `e` is then the side to which the elbow would go.

use nalgebra::{Matrix3, Quaternion, Rotation3, UnitQuaternion, Vector3};

use super::arm::checked_elbow;
use super::{ArmPosture, ELBOW_MAX_RAD, ElbowSource, PostureError, Segments};
use crate::Real;

/// Elbow angle to assume when no hand is seen: a right angle, as in handling things on a table.
pub const ASSUMED_ELBOW_RAD: f64 = core::f64::consts::FRAC_PI_2;

/// How far outside its reachable shell a hand may be measured, as a fraction of the straight arm: 7.5 cm
/// on an arm of 63 cm. A tracker's error, a shoulder that moves forward, and lengths estimated from body
/// height add up to several centimetres; such a hand is moved to the nearest reachable distance in its
/// direction. Further out the measurement is refused.
pub const REACH_TOLERANCE: f64 = 0.12;

/// Below this `1 + x.l` (0.8 degrees from straight behind) the swivel's zero is lost to rounding in f32.
const BEHIND: f64 = 1e-4;

impl<T: Real> ArmPosture<T> {
    /// From the hand (palm centre, shoulder frame, m) and the swivel about the line from shoulder to hand
    /// (rad, right-handed).
    ///
    /// Swivel zero has the elbow below a hand held forward; for other directions that is carried along by
    /// the smallest rotation from forward to the hand (hand low: elbow behind; hand high: elbow in front),
    /// which is continuous everywhere but straight behind.
    ///
    /// # Errors
    /// [`PostureError::NonFinite`], [`PostureError::OutOfReach`], [`PostureError::SwivelUndefined`].
    pub fn from_hand_and_swivel(
        segments: &Segments<T>,
        hand: &Vector3<T>,
        swivel_rad: T,
    ) -> Result<Self, PostureError> {
        if !swivel_rad.is_finite() {
            return Err(PostureError::NonFinite);
        }
        let triangle = Triangle::close(segments, hand)?;
        let forward_part = T::one() + triangle.line.x;
        if forward_part < T::of(BEHIND) {
            return Err(PostureError::SwivelUndefined);
        }
        let down = -Vector3::z();
        let turn = Vector3::x().cross(&triangle.line);
        let zero = down + turn.cross(&down) + turn.cross(&turn.cross(&down)) / forward_part;
        let (sin, cos) = swivel_rad.sin_cos();
        let elbow_side = zero * cos + triangle.line.cross(&zero) * sin;
        Ok(triangle.posture(&elbow_side))
    }

    /// From the upper arm's orientation (upper-arm frame to shoulder frame) and the hand (palm centre,
    /// shoulder frame, m).
    ///
    /// Together they say more than four angles can follow. The hand is trusted: the posture reaches it,
    /// and its distance gives the elbow angle. The orientation, whose yaw drifts, only chooses the
    /// swivel: the one that makes the upper arm's rotation nearest to the measured one (largest trace of
    /// `R^T R_measured`).
    ///
    /// # Errors
    /// [`PostureError::NonFinite`], [`PostureError::NotUnit`], [`PostureError::OutOfReach`],
    /// [`PostureError::OrientationDisagrees`].
    pub fn from_hand_and_upper_arm(
        segments: &Segments<T>,
        hand: &Vector3<T>,
        upper_arm: &Quaternion<T>,
    ) -> Result<Self, PostureError> {
        let measured = checked_rotation(upper_arm)?;
        let triangle = Triangle::close(segments, hand)?;
        let line = triangle.line;
        let start_side = perpendicular(&line);
        let start = triangle.posture(&start_side).upper_arm;
        // trace(Rot(line, swivel) M) = line.M line + cosine cos(swivel) + sine sin(swivel)
        let m = start.matrix() * measured.matrix().transpose();
        let fixed = line.dot(&(m * line));
        let cosine = m.trace() - fixed;
        let sine = line.dot(&Vector3::new(
            m[(1, 2)] - m[(2, 1)],
            m[(2, 0)] - m[(0, 2)],
            m[(0, 1)] - m[(1, 0)],
        ));
        let amplitude = cosine.hypot(sine);
        let cos_angle = (fixed + amplitude - T::one()) * T::of(0.5);
        if cos_angle < T::zero() {
            return Err(PostureError::OrientationDisagrees {
                angle_rad: cos_angle.max(-T::one()).acos().widen(),
            });
        }
        // Within 90 degrees the amplitude is not zero: were it, `fixed` would be at least one, M a
        // rotation about the line, and the amplitude two.
        let elbow_side =
            start_side * (cosine / amplitude) + line.cross(&start_side) * (sine / amplitude);
        Ok(triangle.posture(&elbow_side))
    }

    /// From the upper arm's orientation alone and an assumed elbow angle, rad: for when no hand is seen.
    /// The result says so ([`ElbowSource::Assumed`]).
    ///
    /// # Errors
    /// [`PostureError::NonFinite`], [`PostureError::NotUnit`], [`PostureError::ElbowAngle`].
    pub fn from_upper_arm(
        upper_arm: &Quaternion<T>,
        assumed_elbow_rad: T,
    ) -> Result<Self, PostureError> {
        Ok(Self {
            upper_arm: checked_rotation(upper_arm)?,
            elbow_rad: checked_elbow(assumed_elbow_rad)?,
            elbow_source: ElbowSource::Assumed,
        })
    }
}

/// The arm triangle, closed but for its swivel.
struct Triangle<T> {
    /// Unit vector from shoulder to hand.
    line: Vector3<T>,
    elbow_rad: T,
    /// Cosine and sine of the angle between upper arm and line.
    cos_shoulder: T,
    sin_shoulder: T,
}

impl<T: Real> Triangle<T> {
    fn close(segments: &Segments<T>, hand: &Vector3<T>) -> Result<Self, PostureError> {
        let measured_m = hand.norm();
        if !measured_m.is_finite() {
            return Err(PostureError::NonFinite);
        }
        let (upper, fore) = (segments.upper_arm_m(), segments.forearm_m());
        let two = T::of(2.0);
        let squares = upper * upper + fore * fore;
        let farthest = upper + fore;
        let nearest = (squares + two * upper * fore * T::of(ELBOW_MAX_RAD).cos()).sqrt();
        // Bent fully, the hand is still 0.26 arm lengths away, so that the tolerance leaves a direction.
        let tolerance = farthest * T::of(REACH_TOLERANCE);
        if measured_m < nearest - tolerance || measured_m > farthest + tolerance {
            return Err(PostureError::OutOfReach {
                distance_m: measured_m.widen(),
                nearest_m: (nearest - tolerance).widen(),
                farthest_m: (farthest + tolerance).widen(),
            });
        }
        let distance = measured_m.clamp(nearest, farthest);
        let square = distance * distance;
        let cosine_of = |value: T| value.clamp(-T::one(), T::one());
        let elbow_rad = cosine_of((square - squares) / (two * upper * fore)).acos();
        let cos_shoulder =
            cosine_of((square + upper * upper - fore * fore) / (two * upper * distance));
        Ok(Self {
            line: hand / measured_m,
            elbow_rad: elbow_rad.min(T::of(ELBOW_MAX_RAD)),
            cos_shoulder,
            sin_shoulder: (T::one() - cos_shoulder * cos_shoulder).sqrt(),
        })
    }

    /// The posture whose elbow is on `elbow_side`, a unit vector perpendicular to the line.
    fn posture(&self, elbow_side: &Vector3<T>) -> ArmPosture<T> {
        let (cos, sin) = (self.cos_shoulder, self.sin_shoulder);
        let axes = Matrix3::from_columns(&[
            self.line * sin - elbow_side * cos,
            self.line.cross(elbow_side),
            -(self.line * cos + elbow_side * sin),
        ]);
        ArmPosture {
            upper_arm: Rotation3::from_matrix_unchecked(axes),
            elbow_rad: self.elbow_rad,
            elbow_source: ElbowSource::Hand,
        }
    }
}

/// Some unit vector perpendicular to a unit vector.
fn perpendicular<T: Real>(line: &Vector3<T>) -> Vector3<T> {
    let across = if line.x.abs() < T::of(0.7) {
        Vector3::x()
    } else {
        Vector3::y()
    };
    line.cross(&across).normalize()
}

fn checked_rotation<T: Real>(quaternion: &Quaternion<T>) -> Result<Rotation3<T>, PostureError> {
    let norm = quaternion.norm();
    if !norm.is_finite() {
        return Err(PostureError::NonFinite);
    }
    if (norm - T::one()).abs() > T::of(0.1) {
        return Err(PostureError::NotUnit { norm: norm.widen() });
    }
    Ok(UnitQuaternion::from_quaternion(*quaternion).to_rotation_matrix())
}

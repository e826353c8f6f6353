//! How far the hand gives way under a steady force: what a calibration with known loads measures.
//!
//! The muscles hold the arm still in a posture `q0`, against gravity. A force `F` on the hand moves it by `d` joint
//! coordinates to where the springs of eq. 7, gravity and the force are in balance again:
//!
//! ```text
//! K_joint d + T(d) dV/dq(q0 + d) - dV/dq(q0) = T(d) J(q0 + d)^T F
//! ```
//!
//! `T(d)` takes torques about the moved arm's axes back to the coordinates: for the shoulder the transposed right
//! Jacobian of the rotation, so that both sides are slopes of one potential. Written with the rotation vector `d`,
//! `T = I + (1 - cos |d|) / |d|^2 [d] + (|d| - sin |d|) / |d|^3 [d]^2` (Chirikjian 2012, "Stochastic Models, Information
//! Theory, and Lie Groups", vol. 2, 10.86, transposed).
//!
//! For a small force that is `dx = J [K_joint - G]^-1 J^T F` with `-G = d2V/dq2`, the compliance of eq. 6. A load that can
//! be measured bends the elbow by ten degrees and more, where the straight line is wrong by a tenth, so the balance itself
//! is solved, by Newton's method.

use nalgebra::{Cholesky, Matrix4, Rotation3, Vector3, Vector4};

use super::arm::checked_elbow;
use super::{ArmPosture, PostureError, Segments, StiffnessError};
use crate::Real;

/// Newton steps at most: a load of a few newtons takes six.
const MOST_STEPS: usize = 60;
/// The balance is found when a step is this many roundings of one radian.
const ROUNDINGS: f64 = 32.0;

impl<T: Real> ArmPosture<T> {
    /// This posture moved by `by`, rad, along the four joint coordinates (axes as in the [room](super)): the shoulder by
    /// their rotation vector, the elbow by their last.
    ///
    /// # Errors
    /// [`PostureError::NonFinite`], [`PostureError::ElbowAngle`].
    pub fn displaced(&self, by: &Vector4<T>) -> Result<Self, PostureError> {
        if !by.iter().all(|angle| angle.is_finite()) {
            return Err(PostureError::NonFinite);
        }
        let turn = Rotation3::from_scaled_axis(Vector3::new(by[1], -by[0], by[2]));
        Ok(Self {
            upper_arm: self.upper_arm * turn,
            elbow_rad: checked_elbow(self.elbow_rad + by[3])?,
            elbow_source: self.elbow_source,
        })
    }
}

/// How far the hand goes, m, shoulder frame, when `force_n` pulls at an arm that was held still in `posture` by joint
/// springs `joint_stiffness`, N m/rad, each above zero.
///
/// # Errors
/// [`StiffnessError::NonFinite`]; [`StiffnessError::Unstable`] if the springs do not hold the arm, and
/// [`StiffnessError::Yields`] if the force bends the elbow out of its range.
pub fn deflection<T: Real>(
    segments: &Segments<T>,
    posture: &ArmPosture<T>,
    joint_stiffness: &Vector4<T>,
    force_n: &Vector3<T>,
) -> Result<Vector3<T>, StiffnessError> {
    if !joint_stiffness.iter().chain(force_n).all(|x| x.is_finite()) {
        return Err(StiffnessError::NonFinite);
    }
    let unstable = || StiffnessError::Unstable {
        smallest_joint_stiffness: joint_stiffness.min().widen(),
    };
    let held = posture.gravity_torque(segments);
    let close = T::default_epsilon() * T::of(ROUNDINGS);
    let mut moved = Vector4::zeros();
    for _ in 0..MOST_STEPS {
        let there = posture
            .displaced(&moved)
            .map_err(|_| StiffnessError::Yields {
                elbow_rad: (posture.elbow_rad() + moved[3]).widen(),
            })?;
        let torque =
            there.jacobian(segments).transpose() * force_n + there.gravity_torque(segments);
        let missing =
            in_coordinates(&moved, &torque) - held - joint_stiffness.component_mul(&moved);
        let slope = Matrix4::from_diagonal(joint_stiffness)
            + there.gravity_stiffness(segments)
            + there.force_stiffness(segments, force_n);
        let step = Cholesky::new(slope).ok_or_else(unstable)?.solve(&missing);
        moved += step;
        if step.norm() <= close {
            return Ok(there.hand_position(segments) - posture.hand_position(segments));
        }
    }
    Err(unstable())
}

/// `T(moved) torque`: from the moved arm's axes to the joint coordinates.
fn in_coordinates<T: Real>(moved: &Vector4<T>, torque: &Vector4<T>) -> Vector4<T> {
    // The same right-handed axes in another order: q0 is about -y, q1 about x, q2 about z.
    let turn = Vector3::new(moved[1], -moved[0], moved[2]);
    let shoulder = Vector3::new(torque[1], -torque[0], torque[2]);
    let square = turn.norm_squared();
    let (first, second) = if square < T::of(1e-3) {
        // Of the series; what is left out is below 1e-8 and 1e-9.
        (
            T::of(1.0 / 2.0) - square * T::of(1.0 / 24.0) + square * square * T::of(1.0 / 720.0),
            T::of(1.0 / 6.0) - square * T::of(1.0 / 120.0) + square * square * T::of(1.0 / 5040.0),
        )
    } else {
        let angle = square.sqrt();
        (
            (T::one() - angle.cos()) / square,
            (angle - angle.sin()) / (square * angle),
        )
    };
    let across = turn.cross(&shoulder);
    let back = shoulder + across * first + turn.cross(&across) * second;
    Vector4::new(-back.y, back.x, back.z, torque[3])
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::stiffness::{ElbowSource, GRAVITY_M_S2};

    fn segments() -> Segments<f64> {
        Segments::new(75.0, 1.75).unwrap()
    }

    #[test]
    fn a_small_force_meets_the_compliance_of_eq_6() {
        let arm = segments();
        let posture = ArmPosture::from_angles([0.5, 0.3, -0.4, 1.2]).unwrap();
        let stiffness = Vector4::new(13.0, 15.0, 9.0, 12.0);
        let held = Matrix4::from_diagonal(&stiffness) + posture.gravity_stiffness(&arm);
        let jacobian = posture.jacobian(&arm);
        let compliance = jacobian * held.try_inverse().unwrap() * jacobian.transpose();
        for direction in [Vector3::x(), Vector3::y(), Vector3::z()] {
            let force = direction * 1e-4;
            let found = deflection(&arm, &posture, &stiffness, &force).unwrap();
            let expected = compliance * force;
            assert!((found - expected).norm() < 1e-4 * expected.norm());
        }
    }

    /// The balance is where this potential has no slope, by finite differences.
    #[test]
    fn the_balance_is_the_lowest_point_of_one_potential() {
        let arm = segments();
        let posture = ArmPosture::from_angles([0.4, 0.3, -0.2, 1.4]).unwrap();
        let stiffness = Vector4::new(13.0, 15.0, 9.0, 12.0);
        let force = Vector3::new(3.0, 4.0, -3.0);
        let held = posture.gravity_torque(&arm);
        let potential = |moved: &Vector4<f64>| {
            let there = posture.displaced(moved).unwrap();
            let springs = 0.5 * moved.dot(&stiffness.component_mul(moved));
            springs + there.potential_energy(&arm) + held.dot(moved)
                - force.dot(&there.hand_position(&arm))
        };
        // Downhill with the inverse of the springs for a step: slow, and nothing of the code under test.
        let mut moved = Vector4::zeros();
        for _ in 0..400 {
            let slope = Vector4::from_fn(|axis, _| {
                let step = Vector4::ith(axis, 1e-5);
                (potential(&(moved + step)) - potential(&(moved - step))) / 2e-5
            });
            moved -= slope.component_div(&stiffness) * 0.5;
        }
        let there = posture.displaced(&moved).unwrap().hand_position(&arm);
        let expected = there - posture.hand_position(&arm);
        let found = deflection(&arm, &posture, &stiffness, &force).unwrap();
        assert!(expected.norm() > 0.05, "a large one: {expected}");
        assert!((found - expected).norm() < 1e-7, "{found} {expected}");
    }

    /// A planar arm of two links, written out: where the hand comes to rest, all torques vanish.
    #[test]
    fn a_large_force_in_the_arms_plane_leaves_no_torque() {
        let arm = segments();
        let (l1, l2) = (arm.upper_arm_m(), arm.forearm_m());
        let (s1, s2) = (arm.upper_arm_moment(), arm.forearm_moment());
        let (flexion, elbow) = (0.4_f64, 1.5_f64);
        let posture = ArmPosture::from_angles([flexion, 0.0, 0.0, elbow]).unwrap();
        let [k0, k3] = [16.0, 11.0];
        let (fx, fz) = (3.0, -6.0);
        let moved = deflection(
            &arm,
            &posture,
            &Vector4::new(k0, 14.0, 13.0, k3),
            &Vector3::new(fx, 0.0, fz),
        )
        .unwrap();
        let x = l1 * flexion.sin() + l2 * (flexion + elbow).sin() + moved.x;
        let z = -l1 * flexion.cos() - l2 * (flexion + elbow).cos() + moved.z;
        assert!(moved.y.abs() < 1e-12 && moved.norm() > 0.05);
        let t = ((x * x + z * z - l1 * l1 - l2 * l2) / (2.0 * l1 * l2)).acos();
        let a = (x * (l1 + l2 * t.cos()) + z * l2 * t.sin())
            .atan2(x * l2 * t.sin() - z * (l1 + l2 * t.cos()));
        let gravity = |a: f64, t: f64| {
            let fore = GRAVITY_M_S2 * s2 * (a + t).sin();
            [GRAVITY_M_S2 * s1 * a.sin() + fore, fore]
        };
        let (now, before) = (gravity(a, t), gravity(flexion, elbow));
        let pulled = [
            fx * (l1 * a.cos() + l2 * (a + t).cos()) + fz * (l1 * a.sin() + l2 * (a + t).sin()),
            fx * l2 * (a + t).cos() + fz * l2 * (a + t).sin(),
        ];
        let shoulder = k0 * (a - flexion) + now[0] - before[0] - pulled[0];
        let at_elbow = k3 * (t - elbow) + now[1] - before[1] - pulled[1];
        assert!(
            shoulder.abs() < 1e-9 && at_elbow.abs() < 1e-9,
            "{shoulder} {at_elbow}"
        );
    }

    #[test]
    fn single_precision_finds_the_same_balance() {
        let posture = ArmPosture::<f64>::from_angles([0.4, 0.2, 0.1, 1.5]).unwrap();
        let single = ArmPosture::<f32>::from_angles([0.4, 0.2, 0.1, 1.5]).unwrap();
        let wide = deflection(
            &segments(),
            &posture,
            &Vector4::from_element(13.0),
            &Vector3::new(2.0, 3.0, -4.0),
        );
        let narrow = deflection(
            &Segments::new(75.0, 1.75).unwrap(),
            &single,
            &Vector4::from_element(13.0_f32),
            &Vector3::new(2.0, 3.0, -4.0),
        );
        assert!((wide.unwrap() - narrow.unwrap().cast()).norm() < 1e-6);
    }

    #[test]
    fn what_no_spring_holds_is_refused_by_name() {
        let arm = segments();
        let reached = ArmPosture::from_angles([1.2, 0.0, 0.0, 0.1]).unwrap();
        assert_eq!(reached.elbow_source(), ElbowSource::Assumed);
        let down = |f: f64| {
            let force = Vector3::new(0.0, 0.0, -f);
            deflection(&arm, &reached, &Vector4::from_element(14.0), &force)
        };
        assert!(down(0.1).is_ok());
        assert!(matches!(down(8.0), Err(StiffnessError::Yields { .. })));
        assert!(matches!(down(f64::NAN), Err(StiffnessError::NonFinite)));
        let up = ArmPosture::from_angles([3.0, 0.0, 0.0, 0.1]).unwrap();
        let falls = deflection(&arm, &up, &Vector4::from_element(1.0), &Vector3::zeros());
        assert!(matches!(falls, Err(StiffnessError::Unstable { .. })));
    }

    #[test]
    fn displacements_are_turns_about_the_arms_own_axes() {
        let hanging = ArmPosture::<f64>::from_angles([0.0; 4]).unwrap();
        let flexed = hanging
            .displaced(&Vector4::new(0.3, 0.0, 0.0, 0.2))
            .unwrap();
        let expected = ArmPosture::from_angles([0.3, 0.0, 0.0, 0.2]).unwrap();
        let apart = flexed.upper_arm().angle_to(expected.upper_arm());
        assert!(apart < 1e-7 && (flexed.elbow_rad() - 0.2).abs() < 1e-15);
        assert!(
            hanging
                .displaced(&Vector4::new(0.0, 0.0, 0.0, -0.1))
                .is_err()
        );
        assert!(
            hanging
                .displaced(&Vector4::new(f64::NAN, 0.0, 0.0, 0.0))
                .is_err()
        );
    }
}

//! Cartesian stiffness at the hand (eq. 6, corrected).
//!
//! Two forms, both congruences of a positive definite matrix:
//!
//! - **Jacobian form**, `K = (J+)^T [K_joint - G] J+` with the damped pseudo-inverse `J+ = J^T (J J^T +
//!   lambda^2 I)^-1`, `lambda` = [`DAMPING_M_PER_RAD`]. It is the kinematic approximation of the
//!   stiffness of joint springs in series, `(J K^-1 J^T)^-1`, in which the arm's one redundant freedom
//!   relaxes. Undamped it is never softer than those; on this arm, elbow bent 60 to 120 degrees, it is
//!   6 % too stiff in the worst direction (median over postures; p95 11 %), and the damping takes off 1 %
//!   at most.
//! - **Triangle form**, `K = V diag(1 / (v_i^T C v_i + 1/k)) V^T` with `C = J [K_joint - G]^-1 J^T` the
//!   compliance and V the axes of the arm triangle: along shoulder-hand, across it in the triangle's
//!   plane, and normal to that plane (axes as in Ajoudani et al. 2018, "Reduced-complexity representation
//!   of the human arm active endpoint stiffness for supervisory control of remote manipulation"). A
//!   straight arm has no compliance along itself; `k` = [`STRAIGHT_ARM_N_PER_M`] bounds the stiffness
//!   there.
//!
//! Near a straight elbow the Jacobian form fails: undamped it grows as one over the squared sine of the
//! elbow angle, damped it falls to zero at the end. There the triangle form takes over: `w K_jacobian +
//! (1 - w) K_triangle`, with `w` a smooth step of the elbow angle between the two values of
//! [`BLEND_RAD`]. Both forms and `w` are continuous in the posture, so the stiffness never steps, and
//! their convex sum is positive definite wherever one with a share in it is.

use core::f64::consts::PI;

use nalgebra::{Cholesky, Const, Matrix3, Matrix3x4, Matrix4, SMatrix, Vector3, Vector4};

use super::{ArmPosture, Segments, StiffnessError};
use crate::Real;

/// Damping `lambda` of the pseudo-inverse, m/rad.
const DAMPING_M_PER_RAD: f64 = 0.01;

/// Elbow angles between which the blend goes from all triangle form (up to 20 degrees) to all Jacobian form
/// (from 45 degrees), rad. With the illustrative parameters the largest principal stiffness then
/// stays below 2500 N/m on the way, against 2000 N/m along a straight arm.
pub const BLEND_RAD: [f64; 2] = [PI / 9.0, PI / 4.0];

/// Largest stiffness of the triangle form, reached along a straight arm, N/m. An assumption: measured arm
/// stiffness in reaching postures stays well below it.
const STRAIGHT_ARM_N_PER_M: f64 = 2000.0;

/// A matrix counts as positive definite if it still has a Cholesky factor after this fraction of its mean
/// diagonal is taken off its diagonal: far above the rounding of f32, the arm that fails by it is about to fall.
const MARGIN: f64 = 1e-4;

/// The 3 x 3 Cartesian stiffness in the shoulder frame, N/m, symmetric positive definite, of joint springs
/// `joint_stiffness` (N m/rad, four joint axes) and gravity in this posture (eq. 6, corrected).
///
/// With an elbow bent 45 degrees or more this is `(J+)^T [K_joint - G] J+` with a pseudo-inverse damped
/// by 0.01 m/rad: the kinematic approximation of springs in series, `(J K^-1 J^T)^-1`, a few percent
/// stiffer than those. Below 20 degrees it is a congruence form on the axes of the arm triangle, which no
/// straight elbow makes singular and which stays below 2000 N/m; in between a smooth blend of both, so
/// that the stiffness never steps.
///
/// # Errors
/// [`StiffnessError::NonFinite`], [`StiffnessError::Unstable`] if the springs do not hold the arm against
/// gravity, [`StiffnessError::NotPositiveDefinite`].
pub fn cartesian_stiffness<T: Real>(
    segments: &Segments<T>,
    posture: &ArmPosture<T>,
    joint_stiffness: &Vector4<T>,
) -> Result<Matrix3<T>, StiffnessError> {
    if !joint_stiffness.iter().all(|k| k.is_finite()) {
        return Err(StiffnessError::NonFinite);
    }
    let held = Matrix4::from_diagonal(joint_stiffness) + posture.gravity_stiffness(segments);
    let root = checked_cholesky(&held).ok_or_else(|| StiffnessError::Unstable {
        smallest_joint_stiffness: joint_stiffness.min().widen(),
    })?;
    let jacobian = posture.jacobian(segments);
    let compliance = jacobian * root.solve(&jacobian.transpose());
    let weight = jacobian_weight(posture.elbow_rad());
    let blended = jacobian_form(&jacobian, &held)? * weight
        + triangle_form(segments, posture, &compliance) * (T::one() - weight);
    let stiffness = (blended + blended.transpose()) * T::of(0.5);
    match checked_cholesky(&stiffness) {
        Some(_) => Ok(stiffness),
        None => Err(not_positive_definite(&stiffness)),
    }
}

/// `(J+)^T K J+` with the damped pseudo-inverse.
fn jacobian_form<T: Real>(
    jacobian: &Matrix3x4<T>,
    held: &Matrix4<T>,
) -> Result<Matrix3<T>, StiffnessError> {
    let damping = T::of(DAMPING_M_PER_RAD * DAMPING_M_PER_RAD);
    let gram = jacobian * jacobian.transpose() + Matrix3::from_diagonal_element(damping);
    let root = Cholesky::new(gram).ok_or_else(|| not_positive_definite(&gram))?;
    let pseudo_inverse = root.solve(jacobian).transpose();
    Ok(pseudo_inverse.transpose() * held * pseudo_inverse)
}

/// `V diag(1 / (v_i^T C v_i + 1/k)) V^T` on the axes of the arm triangle.
fn triangle_form<T: Real>(
    segments: &Segments<T>,
    posture: &ArmPosture<T>,
    compliance: &Matrix3<T>,
) -> Matrix3<T> {
    // The elbow's range keeps the hand off the shoulder: its distance is at least a quarter of the arm.
    let along = posture.hand_position(segments).normalize();
    let normal = posture.upper_arm().matrix().column(1).into_owned();
    let axes = Matrix3::from_columns(&[along, normal.cross(&along), normal]);
    let floor = T::of(1.0 / STRAIGHT_ARM_N_PER_M);
    let gains = Vector3::from_fn(|i, _| {
        let axis = axes.column(i);
        (axis.dot(&(compliance * axis)) + floor).recip()
    });
    axes * Matrix3::from_diagonal(&gains) * axes.transpose()
}

/// The Jacobian form's share, 0 to 1: a step with continuous slope in the elbow angle.
fn jacobian_weight<T: Real>(elbow_rad: T) -> T {
    let [from, to] = BLEND_RAD;
    let part = (elbow_rad - T::of(from)) / T::of(to - from);
    let part = part.clamp(T::zero(), T::one());
    part * part * (T::of(3.0) - part - part)
}

/// The Cholesky factor of a matrix that is positive definite by [`MARGIN`].
fn checked_cholesky<T: Real, const N: usize>(
    matrix: &SMatrix<T, N, N>,
) -> Option<Cholesky<T, Const<N>>> {
    let mut reduced = *matrix;
    let margin = mean_diagonal(matrix) * T::of(MARGIN);
    for i in 0..N {
        reduced[(i, i)] -= margin;
    }
    // nalgebra's factorisation refuses a pivot that is zero, negative or NaN; infinities give NaN.
    Cholesky::new(reduced)?;
    Cholesky::new(*matrix)
}

fn mean_diagonal<T: Real, const N: usize>(matrix: &SMatrix<T, N, N>) -> T {
    let mut sum = T::zero();
    for i in 0..N {
        sum += matrix[(i, i)];
    }
    sum / T::of(N as f64)
}

fn not_positive_definite<T: Real>(matrix: &Matrix3<T>) -> StiffnessError {
    StiffnessError::NotPositiveDefinite {
        mean_diagonal: mean_diagonal(matrix).widen(),
    }
}

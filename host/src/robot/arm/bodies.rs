//! Dynamics of a chain of revolute joints: where its bodies are, its mass matrix, and the torques of weight and speed.
//!
//! ```text
//! M(q) qdd + h(q, qd) = tau + J^T F            M = sum_k m_k Jv_k^T Jv_k + Jw_k^T I_k Jw_k
//! ```
//!
//! with F the force on the tool. `h` is the recursive Newton-Euler method with no acceleration of the joints and the base
//! accelerated upwards by g (Luh, Walker and Paul 1980). All vectors are in the base frame.

use nalgebra::{Cholesky, Const, Matrix3, Rotation3, SMatrix, SVector, Unit, Vector3};
use tonus_shared::stiffness::GRAVITY_M_S2;

/// One body, with the joint that it turns about: frames as in a URDF whose joints have no `rpy`.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Body {
    /// The joint's place in the frame of the body before, m.
    pub origin_m: Vector3<f64>,
    /// The joint's axis, in both frames.
    pub axis: Unit<Vector3<f64>>,
    /// kg.
    pub mass_kg: f64,
    /// Centre of mass in the body's frame, m.
    pub centre_m: Vector3<f64>,
    /// About the centre of mass, body's axes, kg m^2.
    pub inertia_kg_m2: Matrix3<f64>,
}

/// `N` bodies from base to tool, and a payload: a point mass at the tool.
#[derive(Debug, Clone, PartialEq)]
pub struct Bodies<const N: usize> {
    bodies: [Body; N],
    /// The tool in the last body's frame, m.
    tool_m: Vector3<f64>,
}

/// Where a chain is, and what moves it: computed once for each instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Motion<const N: usize> {
    /// Each joint's place, m.
    pub joints_m: [Vector3<f64>; N],
    /// Each joint's axis.
    axes: [Vector3<f64>; N],
    turns: [Rotation3<f64>; N],
    /// Centre of mass of each body, m.
    centres_m: [Vector3<f64>; N],
    /// The tool, m.
    pub tool_m: Vector3<f64>,
}

impl<const N: usize> Bodies<N> {
    /// A chain from its base on; the tool in the last body's frame, m.
    #[must_use]
    pub fn new(bodies: [Body; N], tool_m: Vector3<f64>) -> Self {
        Self { bodies, tool_m }
    }

    /// Where everything is at these angles, rad.
    #[must_use]
    pub fn at(&self, angles_rad: &SVector<f64, N>) -> Motion<N> {
        let mut motion = Motion {
            joints_m: [Vector3::zeros(); N],
            axes: [Vector3::zeros(); N],
            turns: [Rotation3::identity(); N],
            centres_m: [Vector3::zeros(); N],
            tool_m: Vector3::zeros(),
        };
        let (mut turn, mut place) = (Rotation3::identity(), Vector3::zeros());
        for (at, body) in self.bodies.iter().enumerate() {
            place += turn * body.origin_m;
            motion.axes[at] = turn * body.axis.into_inner();
            turn *= Rotation3::from_axis_angle(&body.axis, angles_rad[at]);
            motion.joints_m[at] = place;
            motion.turns[at] = turn;
            motion.centres_m[at] = place + turn * body.centre_m;
        }
        motion.tool_m = place + turn * self.tool_m;
        motion
    }

    /// The mass matrix, kg m^2, with a payload of `payload_kg` at the tool.
    #[must_use]
    pub fn mass(&self, motion: &Motion<N>, payload_kg: f64) -> SMatrix<f64, N, N> {
        let mut mass = SMatrix::zeros();
        for (at, body) in self.bodies.iter().enumerate() {
            let turn = motion.turns[at].matrix();
            let inertia = turn * body.inertia_kg_m2 * turn.transpose();
            let moves = motion.moves(&motion.centres_m[at], at);
            for row in 0..=at {
                for column in 0..=row {
                    let turning = motion.axes[row].dot(&(inertia * motion.axes[column]));
                    let going = moves.column(row).dot(&moves.column(column));
                    mass[(row, column)] += body.mass_kg * going + turning;
                }
            }
        }
        let tool = motion.tool_moves();
        for row in 0..N {
            for column in 0..=row {
                mass[(row, column)] += payload_kg * tool.column(row).dot(&tool.column(column));
                mass[(column, row)] = mass[(row, column)];
            }
        }
        mass
    }

    /// Torques that weight and speed need, N m: `h(q, qd)`, with a payload of `payload_kg`.
    #[must_use]
    pub fn bias(
        &self,
        motion: &Motion<N>,
        speeds_rad_per_s: &SVector<f64, N>,
        payload_kg: f64,
    ) -> SVector<f64, N> {
        let mut forces = [Vector3::zeros(); N];
        let mut moments = [Vector3::zeros(); N];
        let (mut spin, mut spinning) = (Vector3::zeros(), Vector3::zeros());
        let mut place = Vector3::zeros();
        let mut acceleration = Vector3::z() * GRAVITY_M_S2;
        let pulled = |spin: &Vector3<f64>, spinning: &Vector3<f64>, arm: Vector3<f64>| {
            spinning.cross(&arm) + spin.cross(&spin.cross(&arm))
        };
        for (at, body) in self.bodies.iter().enumerate() {
            acceleration += pulled(&spin, &spinning, motion.joints_m[at] - place);
            place = motion.joints_m[at];
            let turning = motion.axes[at] * speeds_rad_per_s[at];
            spinning += spin.cross(&turning);
            spin += turning;
            let turn = motion.turns[at].matrix();
            let inertia = turn * body.inertia_kg_m2 * turn.transpose();
            let arm = motion.centres_m[at] - place;
            forces[at] = (acceleration + pulled(&spin, &spinning, arm)) * body.mass_kg;
            moments[at] =
                inertia * spinning + spin.cross(&(inertia * spin)) + arm.cross(&forces[at]);
            if at + 1 == N {
                let arm = motion.tool_m - place;
                let load = (acceleration + pulled(&spin, &spinning, arm)) * payload_kg;
                forces[at] += load;
                moments[at] += arm.cross(&load);
            }
        }
        let mut torques = SVector::zeros();
        let (mut force, mut moment) = (Vector3::zeros(), Vector3::zeros());
        let mut beyond = motion.tool_m;
        for at in (0..N).rev() {
            moment += moments[at] + (beyond - motion.joints_m[at]).cross(&force);
            force += forces[at];
            beyond = motion.joints_m[at];
            torques[at] = motion.axes[at].dot(&moment);
        }
        torques
    }

    /// How the tool accelerates while no joint does, m/s^2: what the speeds alone do, `dJ/dt qd`.
    #[must_use]
    pub fn drift(&self, motion: &Motion<N>, speeds_rad_per_s: &SVector<f64, N>) -> Vector3<f64> {
        let (mut spin, mut spinning) = (Vector3::zeros(), Vector3::zeros());
        let mut drift = Vector3::zeros();
        for at in 0..N {
            let turning = motion.axes[at] * speeds_rad_per_s[at];
            spinning += spin.cross(&turning);
            spin += turning;
            let end = motion.joints_m.get(at + 1).unwrap_or(&motion.tool_m);
            let arm = end - motion.joints_m[at];
            drift += spinning.cross(&arm) + spin.cross(&spin.cross(&arm));
        }
        drift
    }

    /// Accelerations of the joints, rad/s^2, under these torques of the drives, N m, and a force on the tool, N; none if the
    /// mass matrix is not positive definite, which bodies with masses never make.
    #[must_use]
    pub fn accelerations(
        &self,
        motion: &Motion<N>,
        speeds_rad_per_s: &SVector<f64, N>,
        torques_nm: &SVector<f64, N>,
        tool_n: &Vector3<f64>,
        payload_kg: f64,
    ) -> Option<SVector<f64, N>> {
        let root: Cholesky<f64, Const<N>> = Cholesky::new(self.mass(motion, payload_kg))?;
        let bias = self.bias(motion, speeds_rad_per_s, payload_kg);
        let pushed = motion.tool_moves().transpose() * tool_n;
        Some(root.solve(&(torques_nm + pushed - bias)))
    }

    /// Energy of height over the base, J.
    #[must_use]
    pub fn height_energy(&self, motion: &Motion<N>, payload_kg: f64) -> f64 {
        let bodies = self.bodies.iter().zip(&motion.centres_m);
        let heights: f64 = bodies.map(|(body, centre)| body.mass_kg * centre.z).sum();
        GRAVITY_M_S2 * (heights + payload_kg * motion.tool_m.z)
    }
}

impl<const N: usize> Motion<N> {
    /// How the tool moves with each joint, 3 x N, m/rad.
    #[must_use]
    pub fn tool_moves(&self) -> SMatrix<f64, 3, N> {
        match N.checked_sub(1) {
            Some(last) => self.moves(&self.tool_m, last),
            None => SMatrix::zeros(),
        }
    }

    /// How a point of body `last` moves with each joint up to it.
    fn moves(&self, point: &Vector3<f64>, last: usize) -> SMatrix<f64, 3, N> {
        let mut moves = SMatrix::<f64, 3, N>::zeros();
        for at in 0..=last {
            let arm = point - self.joints_m[at];
            moves.set_column(at, &self.axes[at].cross(&arm));
        }
        moves
    }
}

#[cfg(test)]
mod tests;

//! The arm as an impedance: the torques that make its hand a spring and a damper, a thousand times a second.
//!
//! ```text
//! tau = J^T (K (x_d - x) + D (v_d - v) - L dJ/dt qd) + h(q, qd) + N^T M (w^2 (q_r - q) - 2 w qd)
//! ```
//!
//! `K` is the set-point's diagonal. `D` has the stated damping ratio in every direction of the hand's own inertia
//! `L = (J M^-1 J^T)^-1`: with `L = Q Q^T` and `K = Q k Q^T`, `D = 2 zeta Q sqrt(k) Q^T` (double diagonalisation,
//! Albu-Schäffer et al. 2003). `h` and `L dJ/dt qd` take off the arm's own weight and speed, not the payload's, which it does
//! not know: so a payload makes the hand sag by weight over stiffness, and less damped. `N` is what the hand does not feel (Khatib 1987): the
//! redundant joints go to their ready posture there. Torques end at what each drive can give, joints at their stops.

use nalgebra::{Cholesky, Matrix3, SMatrix, SVector, SymmetricEigen, Vector3};

use super::super::limits::Setpoint;
use super::super::simulated::MassError;
use super::bodies::{Bodies, Body, Motion};
use super::{Arm, ArmError, DESCRIPTION, JOINTS, JointLimits, READY_RAD};

/// Places that draw the arm: seven joints and the tool.
pub const HAND_PLACES: usize = JOINTS + 1;
/// The control period, s; a longer step is cut into as many.
const PERIOD_S: f64 = 0.001;
/// A stall longer than this is not caught up with, s.
const LONGEST_STEP_S: f64 = 0.1;
/// How fast redundant joints go back to their ready posture, rad/s.
const READY_RATE: f64 = 8.0;
/// So near a stop a joint is pushed off it, rad; at the stop with all that its drive can give.
const MARGIN_RAD: f64 = 0.35;
/// How long a joint would take to cross the angle that its speed is damped like, s.
const STOP_DAMPING_S: f64 = 0.1;
/// Keeps the hand's inertia finite where it cannot move in a direction, 1/kg.
const LEAST_MOBILITY: f64 = 1e-6;

type Joints = SVector<f64, JOINTS>;

/// The simulated arm, holding its hand as firmly as it is told.
#[derive(Debug)]
pub struct ImpedanceArm {
    bodies: Bodies<JOINTS>,
    limits: [JointLimits; JOINTS],
    effort_nm: Joints,
    angles_rad: Joints,
    speeds_rad_per_s: Joints,
    payload_kg: f64,
    motion: Motion<JOINTS>,
}

impl ImpedanceArm {
    /// The arm at rest in its ready posture.
    ///
    /// # Errors
    /// [`ArmError::Description`]; none in practice.
    pub fn new() -> Result<Self, ArmError> {
        Self::in_posture(&READY_RAD)
    }

    /// The arm at rest with its hand at `position_m`, base frame.
    ///
    /// # Errors
    /// [`ArmError::Unreachable`], [`ArmError::NotFinite`].
    pub fn at(position_m: [f64; 3]) -> Result<Self, ArmError> {
        let angles_rad = Arm::new()?.joints_for(position_m, &READY_RAD)?;
        Self::in_posture(&angles_rad)
    }

    fn in_posture(angles_rad: &[f64; JOINTS]) -> Result<Self, ArmError> {
        let (bodies, effort_nm) = described()?;
        let angles_rad = Joints::from(*angles_rad);
        Ok(Self {
            motion: bodies.at(&angles_rad),
            bodies,
            limits: *Arm::new()?.limits(),
            effort_nm,
            angles_rad,
            speeds_rad_per_s: Joints::zeros(),
            payload_kg: 0.0,
        })
    }

    /// Puts a mass into the hand; zero takes it out.
    ///
    /// # Errors
    /// [`MassError::Payload`] when negative or not finite.
    pub fn carry(&mut self, payload_kg: f64) -> Result<(), MassError> {
        if !(payload_kg.is_finite() && payload_kg >= 0.0) {
            return Err(MassError::Payload {
                value_kg: payload_kg,
            });
        }
        self.payload_kg = payload_kg;
        Ok(())
    }

    /// Position of the hand, base frame, m.
    #[must_use]
    pub fn position_m(&self) -> [f64; 3] {
        self.motion.tool_m.into()
    }

    /// Velocity of the hand, m/s.
    #[must_use]
    pub fn velocity_m_per_s(&self) -> [f64; 3] {
        (self.motion.tool_moves() * self.speeds_rad_per_s).into()
    }

    /// Angles of the joints, from the base on, rad.
    #[must_use]
    pub fn angles_rad(&self) -> [f64; JOINTS] {
        self.angles_rad.into()
    }

    /// Places of the joints from the base on, and of the hand, base frame, m.
    #[must_use]
    pub fn joint_places_m(&self) -> [[f64; 3]; HAND_PLACES] {
        std::array::from_fn(|at| match self.motion.joints_m.get(at) {
            Some(joint) => (*joint).into(),
            None => self.position_m(),
        })
    }

    /// Moves on by `period_s` under a set-point of the gate and an outer force on the hand, N.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`] for a force, set-point or period that is no finite number; the arm stays as it is.
    pub fn step(
        &mut self,
        setpoint: &Setpoint,
        force_n: [f64; 3],
        period_s: f64,
    ) -> Result<(), ArmError> {
        let numbers = [
            &setpoint.position_m[..],
            &setpoint.velocity_m_per_s,
            &setpoint.stiffness_n_per_m,
            &force_n,
            &[setpoint.damping_ratio, period_s],
        ];
        if !numbers.iter().copied().flatten().all(|x| x.is_finite()) {
            return Err(ArmError::NotFinite);
        }
        let period_s = period_s.clamp(0.0, LONGEST_STEP_S);
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "1 to 101"
        )]
        let parts = (period_s / PERIOD_S).ceil().max(1.0) as u32;
        for _ in 0..parts {
            self.advance(setpoint, &force_n.into(), period_s / f64::from(parts));
        }
        Ok(())
    }

    /// One period, velocity first.
    fn advance(&mut self, setpoint: &Setpoint, force_n: &Vector3<f64>, period_s: f64) {
        let torques = self.torques(setpoint);
        let accelerations = self.bodies.accelerations(
            &self.motion,
            &self.speeds_rad_per_s,
            &torques,
            force_n,
            self.payload_kg,
        );
        self.speeds_rad_per_s += accelerations.unwrap_or_default() * period_s;
        self.angles_rad += self.speeds_rad_per_s * period_s;
        for (joint, limits) in self.limits.iter().enumerate() {
            let stopped = self.angles_rad[joint].clamp(limits.lower_rad, limits.upper_rad);
            if stopped != self.angles_rad[joint] {
                // A stop swallows the blow.
                self.angles_rad[joint] = stopped;
                self.speeds_rad_per_s[joint] = 0.0;
            }
        }
        self.motion = self.bodies.at(&self.angles_rad);
    }

    /// What the drives give, N m.
    fn torques(&self, setpoint: &Setpoint) -> Joints {
        let (q, speeds) = (&self.angles_rad, &self.speeds_rad_per_s);
        let mass = self.bodies.mass(&self.motion, 0.0);
        let moves = self.motion.tool_moves();
        let weight_and_speed = self.bodies.bias(&self.motion, speeds, 0.0);
        // Bodies with masses: there is always a root.
        let Some(root) = Cholesky::new(mass) else {
            return weight_and_speed;
        };
        let answered: SMatrix<f64, JOINTS, 3> = root.solve(&moves.transpose());
        let mobility = moves * answered + Matrix3::from_diagonal_element(LEAST_MOBILITY);
        let Some(inertia) = Cholesky::new(mobility).map(|root| root.inverse()) else {
            return weight_and_speed;
        };
        let stiffness = Vector3::from(setpoint.stiffness_n_per_m);
        let away = Vector3::from(setpoint.position_m) - self.motion.tool_m;
        let slower = Vector3::from(setpoint.velocity_m_per_s) - moves * speeds;
        let damping = damping(&inertia, &stiffness, setpoint.damping_ratio);
        let drift = inertia * self.bodies.drift(&self.motion, speeds);
        let hand = stiffness.component_mul(&away) + damping * slower - drift;
        let ready = mass
            * ((Joints::from(READY_RAD) - q) * (READY_RATE * READY_RATE)
                - speeds * (2.0 * READY_RATE));
        let unfelt = ready - moves.transpose() * (inertia * (answered.transpose() * ready));
        let torques = moves.transpose() * hand + weight_and_speed + unfelt + self.off_the_stops();
        torques.zip_map(&self.effort_nm, |torque, most| torque.clamp(-most, most))
    }
}

impl ImpedanceArm {
    /// A spring and a damper that keep each joint off its stops, N m: at a stop a joint moves no hand, and the others would be
    /// asked for what they cannot do. Zero where no joint is near one.
    fn off_the_stops(&self) -> Joints {
        let mut torques = Joints::zeros();
        for (joint, limits) in self.limits.iter().enumerate() {
            let (angle, speed) = (self.angles_rad[joint], self.speeds_rad_per_s[joint]);
            let most = self.effort_nm[joint];
            let above = (MARGIN_RAD - (angle - limits.lower_rad)).max(0.0);
            let below = (MARGIN_RAD - (limits.upper_rad - angle)).max(0.0);
            if above > 0.0 || below > 0.0 {
                let spring = most / MARGIN_RAD;
                torques[joint] = spring * (above - below) - spring * STOP_DAMPING_S * speed;
            }
        }
        torques
    }
}

/// `D = 2 zeta Q sqrt(k) Q^T` with `inertia = Q Q^T`, `diag(stiffness) = Q k Q^T`, N s/m.
fn damping(inertia: &Matrix3<f64>, stiffness: &Vector3<f64>, ratio: f64) -> Matrix3<f64> {
    let Some(root) = Cholesky::new(*inertia) else {
        return Matrix3::zeros();
    };
    let half = root.l();
    // L^-1 K L^-T by two triangular solutions.
    let Some(inner) = half.solve_lower_triangular(&Matrix3::from_diagonal(stiffness)) else {
        return Matrix3::zeros();
    };
    let Some(inner) = half.solve_lower_triangular(&inner.transpose()) else {
        return Matrix3::zeros();
    };
    let modes = SymmetricEigen::new(0.5 * (inner + inner.transpose()));
    let directions = half * modes.eigenvectors;
    let rates = modes.eigenvalues.map(|k| 2.0 * ratio * k.max(0.0).sqrt());
    directions * Matrix3::from_diagonal(&rates) * directions.transpose()
}

/// The bodies of the description, and what its drives can give, N m.
fn described() -> Result<(Bodies<JOINTS>, Joints), ArmError> {
    let broken = |what: &dyn std::fmt::Display| ArmError::Description(what.to_string());
    let robot = urdf_rs::read_from_string(DESCRIPTION).map_err(|error| broken(&error))?;
    let mut bodies = Vec::new();
    let mut efforts = Vec::new();
    let mut tool_m = Vector3::zeros();
    for joint in &robot.joints {
        let origin_m = Vector3::from(*joint.origin.xyz);
        if *joint.origin.rpy != [0.0; 3] {
            return Err(broken(&format!("joint {} is turned by rpy", joint.name)));
        }
        if joint.joint_type != urdf_rs::JointType::Revolute {
            tool_m = origin_m;
            continue;
        }
        let link = robot
            .links
            .iter()
            .find(|link| link.name == joint.child.link);
        let link = link.ok_or_else(|| broken(&format!("joint {} moves no link", joint.name)))?;
        let (own, inertia) = (&link.inertial, &link.inertial.inertia);
        bodies.push(Body {
            origin_m,
            axis: nalgebra::Unit::new_normalize(Vector3::from(*joint.axis.xyz)),
            mass_kg: own.mass.value,
            centre_m: Vector3::from(*own.origin.xyz),
            inertia_kg_m2: Matrix3::new(
                inertia.ixx,
                inertia.ixy,
                inertia.ixz, //
                inertia.ixy,
                inertia.iyy,
                inertia.iyz, //
                inertia.ixz,
                inertia.iyz,
                inertia.izz,
            ),
        });
        efforts.push(joint.limit.effort);
    }
    let bodies: [Body; JOINTS] = bodies
        .try_into()
        .map_err(|_| broken(&"not seven revolute joints"))?;
    Ok((
        Bodies::new(bodies, tool_m),
        Joints::from_column_slice(&efforts),
    ))
}

#[cfg(test)]
mod tests;

//! The simulated robot arm: seven joints, read from `arm.urdf` beside this file, by the crate `k`.
//!
//! Base frame: x forward, y left, z up, as of all commands. Only the tool's position counts; its
//! orientation is left free, as the method models translations alone, so four of the seven joints' freedoms are
//! redundant and pull gently towards [`READY_RAD`].

use k::InverseKinematicsSolver;
use k::urdf::link_to_joint_map;

use super::DESCRIPTION;

/// Joints of the arm.
pub const JOINTS: usize = 7;
/// The posture in the middle of the workspace, in front of the base with a bent elbow: radians.
pub const READY_RAD: [f64; JOINTS] = [0.0, 0.0, 0.0, 2.1, 0.0, 0.6, 0.0];

/// Inverse kinematics is done when the tool is this close, metres: far below a hand's trembling.
const CLOSE_M: f64 = 1e-5;
/// Orientation is not asked for, so any angle is close enough.
const ANY_ANGLE_RAD: f64 = 1.0;
/// Newton steps at most: a neighbouring point takes one or two, one across the workspace about ten.
const MOST_STEPS: usize = 60;
/// The redundant freedoms go back to [`READY_RAD`] by this much at each Newton step, radians: so little that the tool,
/// which their straight step moves to second order, stays within [`CLOSE_M`].
const PULL_RAD: f64 = 1e-3;

/// What one joint can do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct JointLimits {
    /// Least angle, radians.
    pub lower_rad: f64,
    /// Largest angle, radians.
    pub upper_rad: f64,
    /// Largest speed, radians a second.
    pub speed_rad_per_s: f64,
}

/// Why the arm cannot do what was asked.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum ArmError {
    /// The description in `arm.urdf` is broken; it is part of the program.
    #[error("the arm's description cannot be used: {0}")]
    Description(String),
    /// A coordinate or an angle is not a finite number.
    #[error("positions and angles of the arm must be finite numbers")]
    NotFinite,
    /// An angle outside its joint's limits.
    #[error(
        "joint {joint} cannot be at {angle_rad} rad: its limits are {lower_rad} to {upper_rad}"
    )]
    OutsideLimits {
        /// Which joint, counted from the base, from 0.
        joint: usize,
        /// The angle asked for, radians.
        angle_rad: f64,
        /// Least angle, radians.
        lower_rad: f64,
        /// Largest angle, radians.
        upper_rad: f64,
    },
    /// No joint angles bring the tool there.
    #[error(
        "the arm cannot bring its tool to {tool_m:?} m (it came within {missed_m} m): give a point within reach"
    )]
    Unreachable {
        /// The point asked for, base frame, metres.
        tool_m: [f64; 3],
        /// How near the last attempt came, metres.
        missed_m: f64,
    },
}

/// The arm's kinematics. Holds no posture: angles come in and go out.
#[derive(Debug)]
pub struct Arm {
    chain: k::SerialChain<f64>,
    solver: k::JacobianIkSolver<f64>,
    limits: [JointLimits; JOINTS],
}

impl Arm {
    /// Reads the description.
    ///
    /// # Errors
    /// [`ArmError::Description`]; none in practice.
    pub fn new() -> Result<Self, ArmError> {
        let broken = |what: &dyn std::fmt::Display| ArmError::Description(what.to_string());
        let robot = urdf_rs::read_from_string(DESCRIPTION).map_err(|error| broken(&error))?;
        let chain = k::Chain::<f64>::from(&robot);
        let parent_of = link_to_joint_map(&robot);
        let tool = parent_of
            .get("tool0")
            .and_then(|joint| chain.find(joint))
            .ok_or_else(|| broken(&"no link tool0"))?;
        let chain = k::SerialChain::from_end(tool);
        let limits: Vec<JointLimits> = robot
            .joints
            .iter()
            .filter(|joint| joint.joint_type == urdf_rs::JointType::Revolute)
            .map(|joint| JointLimits {
                lower_rad: joint.limit.lower,
                upper_rad: joint.limit.upper,
                speed_rad_per_s: joint.limit.velocity,
            })
            .collect();
        let limits: [JointLimits; JOINTS] = limits
            .try_into()
            .map_err(|_| broken(&"not seven revolute joints"))?;
        if chain.dof() != JOINTS {
            return Err(broken(&"the joints are not one chain"));
        }
        let mut solver = k::JacobianIkSolver::new(CLOSE_M, ANY_ANGLE_RAD, 1.0, MOST_STEPS);
        solver.set_nullspace_function(Box::new(|joints_rad| {
            let back = joints_rad.iter().zip(READY_RAD);
            back.map(|(at, ready)| (ready - at).clamp(-PULL_RAD, PULL_RAD))
                .collect()
        }));
        Ok(Self {
            chain,
            solver,
            limits,
        })
    }

    /// What each joint can do, from the base on.
    #[must_use]
    pub fn limits(&self) -> &[JointLimits; JOINTS] {
        &self.limits
    }

    /// Where the tool is at these joint angles: base frame, metres.
    ///
    /// # Errors
    /// [`ArmError::NotFinite`], [`ArmError::OutsideLimits`].
    pub fn tool_m(&mut self, joints_rad: &[f64; JOINTS]) -> Result<[f64; 3], ArmError> {
        self.pose(joints_rad)?;
        self.chain.update_transforms();
        let at = self.chain.end_transform().translation.vector;
        Ok([at.x, at.y, at.z])
    }

    /// Joint angles that bring the tool to `tool_m` (base frame, metres) within 10 um, found from `near_rad` on by
    /// Newton steps with the Jacobian's pseudo-inverse, each clamped to the joints' limits.
    ///
    /// # Errors
    /// [`ArmError::Unreachable`] where the steps do not get there; otherwise as [`Arm::tool_m`].
    pub fn joints_for(
        &mut self,
        tool_m: [f64; 3],
        near_rad: &[f64; JOINTS],
    ) -> Result<[f64; JOINTS], ArmError> {
        if !tool_m.iter().all(|x| x.is_finite()) {
            return Err(ArmError::NotFinite);
        }
        self.pose(near_rad)?;
        let goal = k::Isometry3::translation(tool_m[0], tool_m[1], tool_m[2]);
        let position_alone = k::Constraints {
            rotation_x: false,
            rotation_y: false,
            rotation_z: false,
            ..k::Constraints::default()
        };
        self.solver
            .solve_with_constraints(&self.chain, &goal, &position_alone)
            .map_err(|error| match error {
                k::Error::NotConvergedError { position_diff, .. } => ArmError::Unreachable {
                    tool_m,
                    missed_m: position_diff.norm(),
                },
                other => ArmError::Description(other.to_string()),
            })?;
        let found = self.chain.joint_positions();
        found
            .try_into()
            .map_err(|_| ArmError::Description("not seven joints".to_owned()))
    }

    fn pose(&mut self, joints_rad: &[f64; JOINTS]) -> Result<(), ArmError> {
        for (joint, (&angle_rad, limits)) in joints_rad.iter().zip(&self.limits).enumerate() {
            if !angle_rad.is_finite() {
                return Err(ArmError::NotFinite);
            }
            let (lower_rad, upper_rad) = (limits.lower_rad, limits.upper_rad);
            if !(lower_rad..=upper_rad).contains(&angle_rad) {
                return Err(ArmError::OutsideLimits {
                    joint,
                    angle_rad,
                    lower_rad,
                    upper_rad,
                });
            }
        }
        self.chain
            .set_joint_positions(joints_rad)
            .map_err(|error| ArmError::Description(error.to_string()))
    }
}

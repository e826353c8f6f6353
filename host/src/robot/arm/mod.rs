//! The simulated seven-joint arm: its kinematics, its joint-space dynamics, and the impedance that it follows a set-point
//! with.
//!
//! ```text
//! arm.urdf --> Arm (inverse kinematics)      --> Bodies (mass matrix, bias torques) --> ImpedanceArm (eq. 5, 1 kHz)
//! ```

mod bodies;
mod impedance;
mod kinematics;

pub use bodies::{Bodies, Body, Motion};
pub use impedance::{HAND_PLACES, ImpedanceArm};
pub use kinematics::{Arm, ArmError, JOINTS, JointLimits, READY_RAD};

/// The arm's description.
const DESCRIPTION: &str = include_str!("arm.urdf");

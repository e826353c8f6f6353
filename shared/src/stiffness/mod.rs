//! From muscle activation and arm posture to Cartesian stiffness at the hand (paper, section 2.2).
//!
//! ```text
//! activation e --co_contraction (eq. 8)--> c --eq. 7--> K_joint --cartesian (eq. 6)--> K_cart
//! hand, upper-arm orientation --posture (arm triangle)--> ArmPosture --arm--> J, -G
//! ```
//!
//! # Frames and joint coordinates
//! The **shoulder frame** has its origin at the shoulder's centre, x forward, y left, z up (REP-103), with
//! z along the vertical: the trunk is taken to be upright. The **upper-arm frame** coincides with it when
//! the arm hangs; its -z axis runs from shoulder to elbow and its -y axis is the elbow's flexion axis, so
//! a bent forearm points to the upper arm's +x side.
//!
//! The four joint coordinates `q` are small displacements from the present posture, in radians:
//!
//! | `q` | axis, in the upper-arm frame | positive for a hanging arm |
//! |---|---|---|
//! | 0 | -y | shoulder flexion (elbow forward) |
//! | 1 | +x | elbow to the left (adduction of a right arm) |
//! | 2 | +z, the long axis | forearm to the left (internal rotation of a right arm) |
//! | 3 | -y, through the elbow | elbow flexion; absolute angle 0 when straight |
//!
//! The shoulder is a ball joint: `q[0..3]` is the rotation vector of `R exp([q])`, not three Euler angles.
//! Euler angles would lock at one arm posture, and the stiffness would step there; with the arm's own
//! axes the elbow alone can make the Jacobian singular.
//!
//! # Glossary
//! - **swivel**: the elbow's angle about the line from shoulder to hand; the one freedom that a hand
//!   position leaves to the arm.
//! - **K, G**: joint stiffness, and the derivative of the torques that gravity exerts on the arm,
//!   `G = d(tau)/dq = -d2V/dq2` (both N m/rad).
mod arm;
mod cartesian;
mod co_contraction;
mod deflection;
mod error;
mod person;
mod posture;
mod segments;

pub use arm::{ArmPosture, ELBOW_MAX_RAD, ElbowSource, GRAVITY_M_S2};
pub use cartesian::{BLEND_RAD, cartesian_stiffness};
pub use co_contraction::CoContraction;
pub use deflection::deflection;
pub use error::{ParameterError, PostureError, StiffnessError};
pub use person::{ArmStiffness, ILLUSTRATIVE, Parameters, Stiffness};
pub use posture::{ASSUMED_ELBOW_RAD, REACH_TOLERANCE};
pub use segments::Segments;

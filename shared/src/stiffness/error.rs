//! What can be wrong with a person's parameters, a measured posture, or a stiffness.

use thiserror::Error;

/// A person's parameter that cannot be used; found once, at set-up.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum ParameterError {
    /// Body mass outside 20 to 300 kg, or not finite.
    #[error("body mass is {mass_kg} kg; give one from 20 to 300 kg")]
    BodyMass {
        /// The refused mass, kg.
        mass_kg: f64,
    },
    /// Body height outside 0.8 to 2.5 m, or not finite.
    #[error("body height is {height_m} m; give one from 0.8 to 2.5 m (metres, not centimetres)")]
    BodyHeight {
        /// The refused height, m.
        height_m: f64,
    },
    /// The co-contraction gain l1 of eq. 8 is negative or not finite.
    #[error("co-contraction gain l1 is {l1}; give a finite number that is not negative")]
    CoContractionGain {
        /// The refused gain, dimensionless.
        l1: f64,
    },
    /// The co-contraction slope l2 of eq. 8 is not positive or not finite.
    #[error("co-contraction slope l2 is {l2}; give a finite number above zero")]
    CoContractionSlope {
        /// The refused slope, per unit of activation.
        l2: f64,
    },
    /// A joint stiffness at rest is not in (0, 1000] N m/rad, or not finite.
    #[error(
        "joint stiffness at rest of joint {joint} is {stiffness} N m/rad; give one above 0, at most 1000"
    )]
    JointStiffness {
        /// Joint index, 0 to 3 (three of the shoulder, elbow).
        joint: usize,
        /// The refused stiffness, N m/rad.
        stiffness: f64,
    },
}

/// A measurement from which no arm posture follows.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum PostureError {
    /// An angle or a coordinate is NaN or infinite.
    #[error("the arm measurement has a value that is not finite; drop this sample")]
    NonFinite,
    /// The elbow angle is outside its anatomical range.
    #[error("elbow angle is {elbow_rad} rad; it must lie from 0 (straight) to {max_rad}")]
    ElbowAngle {
        /// The refused angle, rad.
        elbow_rad: f64,
        /// The largest accepted angle, rad.
        max_rad: f64,
    },
    /// The quaternion's norm is further than 0.1 from one.
    #[error("upper-arm quaternion has norm {norm}; send unit quaternions (x, y, z, w)")]
    NotUnit {
        /// The norm found.
        norm: f64,
    },
    /// The hand is further from, or nearer to, the shoulder than the arm allows with its tolerance.
    #[error(
        "hand is {distance_m} m from the shoulder, the arm reaches {nearest_m} to {farthest_m} m; check the shoulder's position and the body height"
    )]
    OutOfReach {
        /// Distance from shoulder to hand, m.
        distance_m: f64,
        /// Smallest accepted distance, tolerance included, m.
        nearest_m: f64,
        /// Largest accepted distance, tolerance included, m.
        farthest_m: f64,
    },
    /// The hand is straight behind the shoulder, the one direction in which the swivel has no zero.
    #[error(
        "hand is straight behind the shoulder, where the swivel angle has no zero; give the upper-arm orientation instead"
    )]
    SwivelUndefined,
    /// The hand needs an upper-arm orientation more than 90 degrees from the measured one.
    #[error(
        "upper-arm orientation is {angle_rad} rad from the nearest that reaches the hand; re-align the orientation sensor"
    )]
    OrientationDisagrees {
        /// Angle between the measured orientation and the nearest that reaches the hand, rad.
        angle_rad: f64,
    },
}

/// No positive definite stiffness at this activation and posture.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum StiffnessError {
    /// The activation, or a joint stiffness, is NaN or infinite.
    #[error("activation or joint stiffness is not finite; drop this sample")]
    NonFinite,
    /// Gravity overcomes the muscles: `K_joint - G` is not positive definite, the arm would fall.
    #[error(
        "joint stiffness down to {smallest_joint_stiffness} N m/rad does not hold this arm against gravity; check body mass, height and joint stiffness"
    )]
    Unstable {
        /// The smallest joint stiffness, N m/rad.
        smallest_joint_stiffness: f64,
    },
    /// A force on the hand bends the elbow out of its range.
    #[error("the force bends the elbow to {elbow_rad} rad, out of its range; use a lighter load")]
    Yields {
        /// The angle that the elbow would take, rad.
        elbow_rad: f64,
    },
    /// The Cartesian stiffness is not positive definite by the stated margin.
    #[error(
        "Cartesian stiffness with mean diagonal {mean_diagonal} N/m is not positive definite; check the joint stiffness values"
    )]
    NotPositiveDefinite {
        /// A third of the trace, N/m.
        mean_diagonal: f64,
    },
}

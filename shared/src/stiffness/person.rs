//! One person's arm: from activation and posture to stiffness.

use nalgebra::{Matrix3, Vector4};

use super::{
    ArmPosture, CoContraction, ParameterError, Segments, StiffnessError, cartesian_stiffness,
};
use crate::Real;

/// The parameters of one person's arm.
///
/// `l1`, `l2` and the joint stiffness at rest are identified per person and electrode placement; nobody's
/// are universal.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct ArmStiffness<T: Real> {
    co_contraction: CoContraction<T>,
    rest_stiffness: Vector4<T>,
    segments: Segments<T>,
}

/// **Illustrative** parameters, of no particular person: 75 kg, 1.75 m, 13 N m/rad about the two axes across the upper
/// arm and 12 about its length and at the elbow when at rest, 20 to 22 when tense. Calibrate before reading absolute
/// numbers off them.
pub const ILLUSTRATIVE: Parameters = Parameters {
    l1: 0.7,
    l2: 1.5,
    rest_stiffness_nm_per_rad: [13.0, 13.0, 12.0, 12.0],
    body_mass_kg: 75.0,
    body_height_m: 1.75,
};

/// The numbers that an [`ArmStiffness`] is made of.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Parameters {
    /// Gain of eq. 8, dimensionless.
    pub l1: f64,
    /// Slope of eq. 8, per unit of activation.
    pub l2: f64,
    /// `Kbar` of eq. 7, the diagonal, N m/rad: three of the shoulder, elbow.
    pub rest_stiffness_nm_per_rad: [f64; 4],
    /// kg.
    pub body_mass_kg: f64,
    /// m.
    pub body_height_m: f64,
}

/// Stiffness of an arm at one instant.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Stiffness<T: Real> {
    /// Co-contraction index `c` (eq. 8), from 1.
    pub co_contraction: T,
    /// Joint stiffness (eq. 7), N m/rad: three of the shoulder, elbow; axes as in the [room](super).
    pub joint: Vector4<T>,
    /// Cartesian stiffness at the hand (eq. 6), 3 x 3 in the shoulder frame, N/m, symmetric positive
    /// definite.
    pub cartesian: Matrix3<T>,
}

impl<T: Real> ArmStiffness<T> {
    /// Holds a person's co-contraction curve, joint stiffness at rest (`Kbar` of eq. 7, the diagonal, N
    /// m/rad, each above 0 and at most 1000) and arm segments.
    ///
    /// # Errors
    /// [`ParameterError::JointStiffness`].
    pub fn new(
        co_contraction: CoContraction<T>,
        rest_stiffness: [T; 4],
        segments: Segments<T>,
    ) -> Result<Self, ParameterError> {
        for (joint, stiffness) in rest_stiffness.into_iter().enumerate() {
            if !(stiffness > T::zero() && stiffness <= T::of(1000.0)) {
                return Err(ParameterError::JointStiffness {
                    joint,
                    stiffness: stiffness.widen(),
                });
            }
        }
        Ok(Self {
            co_contraction,
            rest_stiffness: Vector4::from(rest_stiffness),
            segments,
        })
    }

    /// The arm of [`ILLUSTRATIVE`].
    pub fn illustrative() -> Self {
        Self {
            co_contraction: CoContraction::illustrative(),
            rest_stiffness: Vector4::from(ILLUSTRATIVE.rest_stiffness_nm_per_rad.map(T::of)),
            segments: Segments::illustrative(),
        }
    }

    /// The arm's segments, for building postures.
    pub fn segments(&self) -> &Segments<T> {
        &self.segments
    }

    /// Stiffness at activation `e` (eq. 4) in a posture: eq. 8, then 7, then 6.
    ///
    /// # Errors
    /// [`StiffnessError`]: activation not finite, an arm that falls, a result that is not positive definite.
    pub fn at(
        &self,
        activation: T,
        posture: &ArmPosture<T>,
    ) -> Result<Stiffness<T>, StiffnessError> {
        let co_contraction = self
            .co_contraction
            .index(activation)
            .ok_or(StiffnessError::NonFinite)?;
        let joint = self.rest_stiffness * co_contraction;
        Ok(Stiffness {
            co_contraction,
            joint,
            cartesian: cartesian_stiffness(&self.segments, posture, &joint)?,
        })
    }
}

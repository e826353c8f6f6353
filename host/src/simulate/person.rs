//! The simulated person's arm: what a calibration is to find.

use nalgebra::{UnitQuaternion, Vector3, Vector4};
use tonus_shared::Real;
use tonus_shared::stiffness::{
    ArmPosture, ArmStiffness, CoContraction, ParameterError, Segments, deflection,
};

use super::muscle::CHANNELS;

/// Parameters of eq. 7 and 8: joint stiffness at rest in N m/rad, gain and slope of co-contraction. Chosen, not measured:
/// joints up to five times as stiff as at rest, most of it below half activation.
pub const JOINT_N_M_PER_RAD: [f64; 4] = [13.0, 13.0, 12.0, 12.0];
/// Gain and slope of eq. 8.
pub const CO_CONTRACTION: (f64, f64) = (4.0, 1.0);
/// Body mass.
pub const MASS_KG: f64 = 75.0;
/// Body height.
pub const HEIGHT_M: f64 = 1.75;

/// The arm as springs.
#[derive(Debug, Clone)]
pub struct Arm {
    segments: Segments<f64>,
    co_contraction: CoContraction<f64>,
}

/// The arm as the wearable computes with it.
///
/// # Errors
/// None in practice: the constants are valid.
pub fn stiffness() -> Result<ArmStiffness<f32>, ParameterError> {
    let (gain, slope) = CO_CONTRACTION;
    ArmStiffness::new(
        CoContraction::new(f32::of(gain), f32::of(slope))?,
        JOINT_N_M_PER_RAD.map(f32::of),
        Segments::new(f32::of(MASS_KG), f32::of(HEIGHT_M))?,
    )
}

impl Arm {
    /// The person's.
    ///
    /// # Errors
    /// None in practice: the constants are valid.
    pub fn new() -> Result<Self, ParameterError> {
        let (gain, slope) = CO_CONTRACTION;
        Ok(Self {
            segments: Segments::new(MASS_KG, HEIGHT_M)?,
            co_contraction: CoContraction::new(gain, slope)?,
        })
    }

    /// How the upper arm is turned (upper-arm axes to shoulder frame: x, y, z, w) with the hand at `hand_m` (shoulder frame,
    /// metres); none where the arm cannot be.
    #[must_use]
    pub fn upper_arm_xyzw(&self, hand_m: [f64; 3]) -> Option<[f64; 4]> {
        let hand = Vector3::from(hand_m);
        let posture = ArmPosture::from_hand_and_swivel(&self.segments, &hand, 0.0).ok()?;
        let turned = UnitQuaternion::from_rotation_matrix(posture.upper_arm());
        Some(turned.coords.into())
    }

    /// Where a hand ends that is held at `hand_m` (shoulder frame, metres) while `force_n` pulls at it and every muscle is
    /// tensed to the share `effort` of its maximum. Where the arm cannot be, or gives way altogether, it stays.
    #[must_use]
    pub fn gives_way(&self, hand_m: [f64; 3], force_n: [f64; 3], effort: f64) -> [f64; 3] {
        let hand = Vector3::from(hand_m);
        #[allow(clippy::cast_precision_loss, reason = "four channels")]
        let activation = CHANNELS as f64 * effort;
        let moved = ArmPosture::from_hand_and_swivel(&self.segments, &hand, 0.0)
            .ok()
            .and_then(|posture| {
                let index = self.co_contraction.index(activation)?;
                let springs = Vector4::from(JOINT_N_M_PER_RAD) * index;
                let force = Vector3::from(force_n);
                deflection(&self.segments, &posture, &springs, &force).ok()
            });
        moved.map_or(hand_m, |moved| (hand + moved).into())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_firm_arm_gives_way_less_and_without_a_load_not_at_all() {
        let arm = Arm::new().unwrap();
        let hand_m = [0.32, 0.0, -0.27];
        assert_eq!(arm.gives_way(hand_m, [0.0; 3], 0.3), hand_m);
        let sinks = |effort| hand_m[2] - arm.gives_way(hand_m, [0.0, 0.0, -5.0], effort)[2];
        assert!(sinks(0.1) > sinks(0.3) && sinks(0.3) > sinks(0.6) && sinks(0.6) > 0.005);
        assert_eq!(
            arm.gives_way([9.0, 0.0, 0.0], [0.0, 0.0, -5.0], 0.3),
            [9.0, 0.0, 0.0]
        );
    }
}

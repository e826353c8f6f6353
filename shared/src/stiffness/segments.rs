//! Arm segments by body mass and height.

use super::{ILLUSTRATIVE, ParameterError};
use crate::Real;

/// One segment's share of the body.
struct Share {
    /// Mass, of body mass: Clauser, McConville and Young 1969 (AMRL-TR-69-70).
    mass: f64,
    /// Centre of mass from the proximal end, of the segment's length: the same source.
    centre: f64,
    /// Length, of body height: Drillis and Contini 1966 (NYU TR 1166-03), as in Winter,
    /// "Biomechanics and Motor Control of Human Movement", fig. 4.1.
    length: f64,
}

const UPPER_ARM: Share = Share {
    mass: 0.0263,
    centre: 0.513,
    length: 0.186,
};
const FOREARM: Share = Share {
    mass: 0.0161,
    centre: 0.3896,
    length: 0.146,
};
/// In line with the forearm: the wrist is taken to be straight.
const HAND: Share = Share {
    mass: 0.0065,
    centre: 0.1802,
    length: 0.108,
};
/// Palm centre, which hand trackers report, from the wrist, of the hand's length. An assumption: the
/// knuckles lie at about half of it, the palm's centre half way to them.
const PALM: f64 = 0.25;

/// Lengths of a person's arm, and the first moments of its mass, for which gravity is all that the masses
/// are needed.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Segments<T> {
    upper_arm_m: T,
    forearm_m: T,
    upper_arm_moment: T,
    forearm_moment: T,
}

impl<T: Real> Segments<T> {
    /// The arm of a person of `mass_kg` (20 to 300) and `height_m` (0.8 to 2.5).
    ///
    /// # Errors
    /// [`ParameterError::BodyMass`], [`ParameterError::BodyHeight`].
    pub fn new(mass_kg: T, height_m: T) -> Result<Self, ParameterError> {
        if !(T::of(20.0)..=T::of(300.0)).contains(&mass_kg) {
            return Err(ParameterError::BodyMass {
                mass_kg: mass_kg.widen(),
            });
        }
        if !(T::of(0.8)..=T::of(2.5)).contains(&height_m) {
            return Err(ParameterError::BodyHeight {
                height_m: height_m.widen(),
            });
        }
        Ok(Self::scaled(mass_kg, height_m))
    }

    /// The person of [`ILLUSTRATIVE`].
    pub(super) fn illustrative() -> Self {
        Self::scaled(
            T::of(ILLUSTRATIVE.body_mass_kg),
            T::of(ILLUSTRATIVE.body_height_m),
        )
    }

    fn scaled(mass_kg: T, height_m: T) -> Self {
        let beyond_elbow = FOREARM.mass + HAND.mass;
        let upper_arm = (UPPER_ARM.mass * UPPER_ARM.centre + beyond_elbow) * UPPER_ARM.length;
        let forearm = FOREARM.mass * FOREARM.centre * FOREARM.length
            + HAND.mass * (FOREARM.length + HAND.centre * HAND.length);
        Self {
            upper_arm_m: height_m * T::of(UPPER_ARM.length),
            forearm_m: height_m * T::of(FOREARM.length + PALM * HAND.length),
            upper_arm_moment: mass_kg * height_m * T::of(upper_arm),
            forearm_moment: mass_kg * height_m * T::of(forearm),
        }
    }

    /// Shoulder to elbow, m.
    pub fn upper_arm_m(&self) -> T {
        self.upper_arm_m
    }

    /// Elbow to palm centre, wrist straight, m.
    pub fn forearm_m(&self) -> T {
        self.forearm_m
    }

    /// Mass times distance from the shoulder along the upper arm, kg m: the upper arm's own, and all that
    /// hangs on the elbow.
    pub(super) fn upper_arm_moment(&self) -> T {
        self.upper_arm_moment
    }

    /// Mass times distance from the elbow along the forearm, kg m: forearm and hand.
    pub(super) fn forearm_moment(&self) -> T {
        self.forearm_moment
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_75_kg_person_of_1_75_m_by_hand() {
        let arm = Segments::<f64>::new(75.0, 1.75).unwrap();
        assert!((arm.upper_arm_m() - 0.3255).abs() < 1e-12);
        assert!((arm.forearm_m() - (0.2555 + 0.25 * 0.189)).abs() < 1e-12);
        // Masses 1.9725, 1.2075 and 0.4875 kg; lengths 0.3255, 0.2555 and 0.189 m.
        let upper_arm = 1.9725 * 0.513 * 0.3255 + (1.2075 + 0.4875) * 0.3255;
        let forearm = 1.2075 * 0.3896 * 0.2555 + 0.4875 * (0.2555 + 0.1802 * 0.189);
        assert!((arm.upper_arm_moment() - upper_arm).abs() < 1e-12);
        assert!((arm.forearm_moment() - forearm).abs() < 1e-12);
        assert_eq!(arm, Segments::illustrative());
    }

    #[test]
    fn refuses_bodies_outside_the_stated_ranges() {
        for mass_kg in [19.9, 300.1, f64::NAN, f64::INFINITY, -75.0] {
            assert!(matches!(
                Segments::new(mass_kg, 1.75),
                Err(ParameterError::BodyMass { .. })
            ));
        }
        for height_m in [0.79, 2.51, 175.0, f64::NAN, f64::NEG_INFINITY] {
            assert!(matches!(
                Segments::new(75.0, height_m),
                Err(ParameterError::BodyHeight { .. })
            ));
        }
        assert!(Segments::new(20.0_f32, 0.8).is_ok());
        assert!(Segments::new(300.0_f32, 2.5).is_ok());
    }
}

//! Co-contraction index and joint stiffness (eq. 8 and 7).

use super::{ILLUSTRATIVE, ParameterError};
use crate::Real;

/// Eq. 8: `c = 1 + l1 (1 - exp(-l2 e)) / (1 + exp(-l2 e)) = 1 + l1 tanh(l2 e / 2)`, from 1 to `1 + l1`.
///
/// The parameters belong to one person with one set of electrodes; the calibration identifies them.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct CoContraction<T> {
    l1: T,
    l2: T,
}

impl<T: Real> CoContraction<T> {
    /// Checks and holds the gain `l1` (dimensionless, not negative) and the slope `l2` (per unit of
    /// activation, positive).
    ///
    /// # Errors
    /// [`ParameterError::CoContractionGain`], [`ParameterError::CoContractionSlope`].
    pub fn new(l1: T, l2: T) -> Result<Self, ParameterError> {
        if !l1.is_finite() || l1 < T::zero() {
            return Err(ParameterError::CoContractionGain { l1: l1.widen() });
        }
        if !l2.is_finite() || l2 <= T::zero() {
            return Err(ParameterError::CoContractionSlope { l2: l2.widen() });
        }
        Ok(Self { l1, l2 })
    }

    /// The curve of [`ILLUSTRATIVE`].
    pub(super) fn illustrative() -> Self {
        Self {
            l1: T::of(ILLUSTRATIVE.l1),
            l2: T::of(ILLUSTRATIVE.l2),
        }
    }

    /// The co-contraction index `c` (eq. 8) at activation `e` (eq. 4), or `None` if `e` is not finite.
    ///
    /// A negative activation, which subtracting the rest level leaves now and then, counts as rest: `c =
    /// 1`.
    pub fn index(&self, activation: T) -> Option<T> {
        if !activation.is_finite() {
            return None;
        }
        let activation = activation.max(T::zero());
        // Halved first: l2 * e may overflow to infinity, whose tanh is 1 as it should be.
        Some(T::one() + self.l1 * (T::of(0.5) * self.l2 * activation).tanh())
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn agrees_with_the_exponential_form_in_print() {
        let co = CoContraction::new(0.8, 2.5).unwrap();
        for step in 0..100 {
            let e = f64::from(step) * 0.04;
            let decay = libm::exp(-2.5 * e);
            let printed = 1.0 + 0.8 * (1.0 - decay) / (1.0 + decay);
            assert!((co.index(e).unwrap() - printed).abs() < 1e-14);
        }
    }

    #[test]
    fn stays_between_one_and_one_plus_l1() {
        let co = CoContraction::<f32>::new(0.5, 1.0).unwrap();
        assert_eq!(co.index(0.0), Some(1.0));
        assert_eq!(co.index(-3.0), Some(1.0));
        assert_eq!(co.index(f32::MAX), Some(1.5));
        assert_eq!(co.index(f32::NAN), None);
        assert_eq!(co.index(f32::INFINITY), None);
        let steep = CoContraction::<f32>::new(0.5, f32::MAX).unwrap();
        assert_eq!(steep.index(f32::MAX), Some(1.5));
    }

    #[test]
    fn refuses_parameters_that_are_not_an_increasing_bounded_curve() {
        assert_eq!(
            CoContraction::new(-0.1, 1.0),
            Err(ParameterError::CoContractionGain { l1: -0.1 })
        );
        assert_eq!(
            CoContraction::new(0.1, 0.0),
            Err(ParameterError::CoContractionSlope { l2: 0.0 })
        );
        for bad in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            assert!(CoContraction::new(bad, 1.0).is_err());
            assert!(CoContraction::new(1.0, bad).is_err());
        }
        assert_eq!(CoContraction::new(0.0, 1.0).unwrap().index(2.0), Some(1.0));
    }
}

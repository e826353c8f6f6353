//! The scalar: `f32` on the chip, `f64` on the host, nothing else.

/// Not below zero (and zero for NaN): what `max` gives, without the call that it is on the chip.
#[inline(always)]
pub(crate) fn not_negative<T: Real>(value: T) -> T {
    if value > T::zero() { value } else { T::zero() }
}

/// A real number that the maths of this crate is written in.
///
/// Elementary functions come from nalgebra's `RealField`, built with `libm-force`: chip and host run
/// the same software `exp`, `ln`, `sin`, so an `f32` result does not depend on which of them it ran on.
pub trait Real: nalgebra::RealField + Copy {
    /// Logarithm of the distance from one to the next larger value.
    const LOG_EPSILON: f64;
    /// The nearest value to an `f64` literal or design constant.
    fn of(value: f64) -> Self;
    /// The nearest value to a whole number. No `f64` on the way: the chip computes those in software.
    fn whole(value: i32) -> Self;
    /// The same value as an `f64` (exact).
    fn widen(self) -> f64;
}

impl Real for f32 {
    const LOG_EPSILON: f64 = -23.0 * core::f64::consts::LN_2;
    #[allow(
        clippy::cast_possible_truncation,
        reason = "rounding to nearest is the contract"
    )]
    fn of(value: f64) -> Self {
        value as f32
    }
    #[allow(
        clippy::cast_precision_loss,
        reason = "rounding to nearest is the contract"
    )]
    fn whole(value: i32) -> Self {
        value as f32
    }
    fn widen(self) -> f64 {
        f64::from(self)
    }
}

impl Real for f64 {
    const LOG_EPSILON: f64 = -52.0 * core::f64::consts::LN_2;
    fn of(value: f64) -> Self {
        value
    }
    fn whole(value: i32) -> Self {
        f64::from(value)
    }
    fn widen(self) -> f64 {
        self
    }
}

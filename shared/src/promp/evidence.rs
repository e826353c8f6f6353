//! What the observations of a belief amount to: the numbers ahead of its vectors, and the Gaussian's and
//! the Student-t's density in terms of them.

use crate::Real;

/// Degrees of freedom `nu` of the skill, zero for a Gaussian.
pub(super) const FREEDOM: usize = 0;
/// The largest prior standard deviation of a latent coordinate.
pub(super) const SPREAD: usize = 1;
/// Log-likelihood under the skill: the Gaussian's, or the Student-t's density, which is asked for far more often than it
/// changes.
pub(super) const LOG_LIKELIHOOD: usize = 2;
/// Squared Mahalanobis distance, `m^2`.
pub(super) const MAHALANOBIS: usize = 3;
/// Log-determinant of the observations' covariance.
const LOG_DETERMINANT: usize = 4;
/// How many there were, `k`.
pub(super) const COUNT: usize = 5;
/// What no coordinate of the mean exceeds.
const REACH: usize = 6;
/// Of the prepared update: `e sqrt(alpha)`, observed less predicted in standard deviations ...
pub(super) const RESIDUAL: usize = 7;
/// ... the logarithm of `alpha`, one over the variance of `e` ...
const LOG_ALPHA: usize = 8;
/// ... and `alpha R`, the noise's share in that variance.
pub(super) const NOISE_SHARE: usize = 9;
/// All of them.
pub(super) const HEADER: usize = 10;

/// `ln(2 pi)`.
const LN_TWO_PI: f64 = 1.837_877_066_409_345_5;

/// From here on four terms of Stirling's series are as good as an `f64` (3e-14).
const STIRLING_FROM: f64 = 15.0;

/// Adds the prepared update to what the observations amount to.
pub(super) fn accumulate<T: Real>(header: &mut [T]) {
    let (residual, log_alpha) = (header[RESIDUAL], header[LOG_ALPHA]);
    let distance = residual * residual;
    header[MAHALANOBIS] += distance;
    header[LOG_DETERMINANT] -= log_alpha;
    header[COUNT] += T::one();
    header[REACH] += header[SPREAD] * residual.abs();
    if header[FREEDOM] > T::zero() {
        header[LOG_LIKELIHOOD] = log_density(header);
    } else {
        header[LOG_LIKELIHOOD] -= T::of(0.5) * (distance - log_alpha + T::of(LN_TWO_PI));
    }
}

/// Whether the scalar will hold everything after the prepared update: twice the log-likelihood, so that a log
/// prior can be added; `m^2`, and the share of it that a Student-t's density takes (of a Gaussian, `m^2 / -2`);
/// and every coordinate of the mean, none of which moves by more than its standard deviation times the
/// residual's `e sqrt(alpha)`.
pub(super) fn bounded<T: Real>(header: &[T]) -> bool {
    let (residual, log_alpha) = (header[RESIDUAL], header[LOG_ALPHA]);
    let distance = header[MAHALANOBIS] + residual * residual;
    let determinant = header[LOG_DETERMINANT] - log_alpha;
    let volume = (header[COUNT] + T::one()) * T::of(LN_TWO_PI) + determinant;
    let reach = header[REACH] + header[SPREAD] * residual.abs();
    let share = distance / (header[FREEDOM] - T::of(2.0));
    (distance + volume).is_finite() && (reach + reach).is_finite() && share.is_finite()
}

/// Joint log density of the observations under the Student-t with the Gaussian's mean and covariance,
/// whose scale matrix is that covariance times `(nu - 2) / nu`. With `nu = 2 a`, `k = 2 h`:
///
/// ```text
/// ln G(a + h) - ln G(a) - h ln(a - 1) - (k ln 2 pi + ln det) / 2 - (a + h) ln(1 + m^2 / (nu - 2))
/// ```
fn log_density<T: Real>(header: &[T]) -> T {
    let (freedom, count) = (header[FREEDOM], header[COUNT]);
    let half = T::of(0.5);
    let (a, h) = (half * freedom, half * count);
    let spread = header[MAHALANOBIS] / (freedom - T::of(2.0));
    let volume = count * T::of(LN_TWO_PI) + header[LOG_DETERMINANT];
    log_normaliser(a, h) - half * volume - (a + h) * spread.ln_1p()
}

/// What the observations did to the Student-t's covariance of everything else: `(nu - 2 + m^2) / (nu - 2 + k)`
/// times the Gaussian's. Observations further out than the covariance promised say that it was too small,
/// nearer ones that it was too large.
pub(super) fn inflation<T: Real>(header: &[T]) -> T {
    let excess = header[FREEDOM] - T::of(2.0);
    (excess + header[MAHALANOBIS]) / (excess + header[COUNT])
}

/// `ln G(a + h) - ln G(a) - h ln(a - 1)`, which tends to zero as `a` grows. The difference of two
/// log-gammas is taken term by term in Stirling's series (Abramowitz and Stegun 6.1.40), so that
/// nothing of the size of a log-gamma is ever rounded; small `a` is first lifted by
/// `G(x + 1) = x G(x)`.
fn log_normaliser<T: Real>(a: T, h: T) -> T {
    let half = T::of(0.5);
    let mut sum = T::zero();
    let mut low = a;
    while low < T::of(STIRLING_FROM) {
        sum -= (h / low).ln_1p();
        low += T::one();
    }
    let high = low + h;
    let growth = h * (high / (a - T::one())).ln();
    sum + growth + ((low - half) * (h / low).ln_1p() - h) + (remainder(high) - remainder(low))
}

/// `1/(12 x) - 1/(360 x^3) + 1/(1260 x^5) - 1/(1680 x^7)`; what follows is below `1/(1188 x^9)`.
fn remainder<T: Real>(x: T) -> T {
    let inverse = T::one() / x;
    let square = inverse * inverse;
    [-1.0 / 1680.0, 1.0 / 1260.0, -1.0 / 360.0, 1.0 / 12.0]
        .into_iter()
        .fold(T::zero(), |sum, term| sum * square + T::of(term))
        * inverse
}

//! Basis functions of phase and their exact derivatives.

use core::f64::consts::LN_2;

use super::error::{BasisError, RowError};
use crate::Real;

/// The least Gaussian width, phase squared: a standard deviation of a thousandth of the movement
/// is finer than any basis that demonstrations can fill, and its inverse is safe in `f32`.
const MIN_WIDTH: f64 = 1e-6;

/// How far outside `[0, 1]` a phase still counts as the end itself. `t / duration` rounded in `f32`
/// may exceed one by a few of its 1.2e-7 steps; a velocity at the very end must keep its slope.
const END_SLACK: f64 = 1e-6;

/// Exponent, relative to the nearest centre's and to the scalar's rounding, below which a Gaussian is zero: a
/// four-thousandth of a rounding. Of thirty functions of the default width it leaves at most eleven in `f64` and
/// eight in `f32`.
const NEGLIGIBLE: f64 = -12.0 * LN_2;

/// The family of basis functions, with its parameter.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Family {
    /// Normalised Gaussians at centres `linspace(0, 1, K)`:
    /// `b_k = exp(-(s - c_k)^2 / (2 width))`, `psi_k = b_k / sum_j b_j`. For strokes.
    Gaussian {
        /// `h` of eq. 1, phase squared.
        width: f64,
    },
    /// `1, sin(2 pi s), cos(2 pi s), sin(4 pi s), cos(4 pi s), ...` For periodic skills.
    Fourier,
    /// Bernstein polynomials of degree `K - 1` (a Bezier curve whose control points are the weights).
    Bernstein,
}

/// `K` basis functions `psi(s)` of phase (eq. 1).
///
/// A phase outside `[0, 1]` is a movement that has not begun or is over: Gaussian and Bernstein bases
/// hold the value of the nearer end and have zero derivative there (the derivative of what they hold;
/// within 1e-6 of the end, which is rounding, the end's own slope). Fourier bases go round: any
/// phase is taken modulo one. A phase that is NaN or infinite is refused.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Basis {
    family: Family,
    count: usize,
}

impl Basis {
    /// A basis of `count` functions.
    ///
    /// # Errors
    /// `count` zero, even for Fourier, or a Gaussian width below 1e-6 or not finite.
    pub fn new(family: Family, count: usize) -> Result<Self, BasisError> {
        if count == 0 {
            return Err(BasisError::Empty);
        }
        match family {
            Family::Gaussian { width } if !(width.is_finite() && width >= MIN_WIDTH) => {
                Err(BasisError::Width {
                    min: MIN_WIDTH,
                    width,
                })
            }
            Family::Fourier if count.is_multiple_of(2) => Err(BasisError::EvenFourier { count }),
            _ => Ok(Self { family, count }),
        }
    }

    /// Normalised Gaussians with `h = -1 / (8 K^2 ln 0.7)`: an unnormalised function has fallen to 0.7
    /// at a distance `1 / (2 K)` from its centre.
    ///
    /// # Errors
    /// `count` zero, or so large (above 590) that the width falls below 1e-6.
    pub fn gaussian(count: usize) -> Result<Self, BasisError> {
        let functions = count.max(1) as f64;
        let width = -1.0 / (8.0 * functions * functions * libm::log(0.7));
        Self::new(Family::Gaussian { width }, count)
    }

    /// A constant and `(count - 1) / 2` harmonics.
    ///
    /// # Errors
    /// `count` zero or even.
    pub fn fourier(count: usize) -> Result<Self, BasisError> {
        Self::new(Family::Fourier, count)
    }

    /// Bernstein polynomials of degree `count - 1`.
    ///
    /// # Errors
    /// `count` zero.
    pub fn bernstein(count: usize) -> Result<Self, BasisError> {
        Self::new(Family::Bernstein, count)
    }

    /// The number of functions, `K`.
    #[must_use]
    pub const fn count(&self) -> usize {
        self.count
    }

    /// The family and its parameter.
    #[must_use]
    pub const fn family(&self) -> Family {
        self.family
    }

    /// Whether the functions sum to one at every phase.
    pub(super) const fn sums_to_one(&self) -> bool {
        !matches!(self.family, Family::Fourier)
    }

    /// Writes `psi(phase)` to `out` (`K` long). Cost: `K` exponentials (Gaussian), `K - 1` sines and
    /// cosines (Fourier), `K^2` multiply-adds (Bernstein).
    ///
    /// # Errors
    /// Phase not finite, `out` not `K` long.
    pub fn values<T: Real>(&self, phase: T, out: &mut [T]) -> Result<(), RowError> {
        self.check(phase, out)?;
        match self.family {
            Family::Gaussian { width } => {
                gaussian(ended(phase), T::of(width), out);
            }
            Family::Fourier => fourier(phase, out),
            Family::Bernstein => bernstein(ended(phase), out),
        }
        Ok(())
    }

    /// Writes `psi'(phase)`, per unit of phase, to `out` (`K` long). Divide by the movement's duration
    /// for a derivative in time. Cost as for [`Basis::values`].
    ///
    /// # Errors
    /// Phase not finite, `out` not `K` long.
    pub fn derivatives<T: Real>(&self, phase: T, out: &mut [T]) -> Result<(), RowError> {
        self.check(phase, out)?;
        let slack = T::of(END_SLACK);
        let held = phase < -slack || phase > T::one() + slack;
        match self.family {
            Family::Fourier => fourier_derivative(phase, out),
            _ if held => out.fill(T::zero()),
            Family::Gaussian { width } => gaussian_derivative(ended(phase), T::of(width), out),
            Family::Bernstein => bernstein_derivative(ended(phase), out),
        }
        Ok(())
    }

    fn check<T: Real>(&self, phase: T, out: &[T]) -> Result<(), RowError> {
        if !phase.is_finite() {
            return Err(RowError::Phase {
                phase: phase.widen(),
            });
        }
        if out.len() != self.count {
            return Err(RowError::Buffer {
                what: "basis",
                expected: self.count,
                got: out.len(),
            });
        }
        Ok(())
    }
}

fn ended<T: Real>(phase: T) -> T {
    phase.clamp(T::zero(), T::one())
}

/// Where a phase lies among `linspace(0, 1, count)`, in units of the distance between centres.
struct Grid<T> {
    /// Distance between centres, phase.
    spacing: T,
    /// The phase less the nearest centre, in spacings: at most a half.
    offset: T,
    /// The first centre less the nearest one, in spacings: whole, so counting up from it is exact.
    first: T,
}

impl<T: Real> Grid<T> {
    fn new(phase: T, count: usize) -> Self {
        let intervals = T::of(count.saturating_sub(1) as f64);
        let position = phase * intervals;
        let nearest = position.round();
        Self {
            spacing: T::one() / intervals.max(T::one()),
            offset: position - nearest,
            first: -nearest,
        }
    }

    /// `(c_k - c_nearest) / spacing` for `k` from 0 on.
    fn steps(&self) -> impl Iterator<Item = T> {
        core::iter::successors(Some(self.first), |step| Some(*step + T::one()))
    }
}

/// Exponents are taken relative to that of the nearest centre, in factored form: with centre `i` steps
/// and the phase `x` steps from it, `i (2 x - i) spacing^2 / (2 h)`. The largest is 0, so the sum is at
/// least one and narrow functions cannot all underflow between two centres.
fn gaussian<T: Real>(phase: T, width: T, out: &mut [T]) -> Grid<T> {
    let grid = Grid::new(phase, out.len());
    let scale = T::of(0.5) * grid.spacing * grid.spacing / width;
    let twice = grid.offset + grid.offset;
    let negligible = T::of(NEGLIGIBLE + T::LOG_EPSILON);
    let mut sum = T::zero();
    for (psi, step) in out.iter_mut().zip(grid.steps()) {
        let exponent = step * (twice - step) * scale;
        *psi = if exponent > negligible {
            exponent.exp()
        } else {
            T::zero()
        };
        sum += *psi;
    }
    for psi in out {
        *psi /= sum;
    }
    grid
}

/// `psi_k' = psi_k (c_k - sum_j psi_j c_j) / h`: the common `-s / h` of every log-derivative cancels.
fn gaussian_derivative<T: Real>(phase: T, width: T, out: &mut [T]) {
    let grid = gaussian(phase, width, out);
    let mean = out
        .iter()
        .zip(grid.steps())
        .fold(T::zero(), |sum, (psi, step)| sum + *psi * step);
    let scale = grid.spacing / width;
    for (psi, step) in out.iter_mut().zip(grid.steps()) {
        *psi *= (step - mean) * scale;
    }
}

/// Calls `write(harmonic, angle, pair)` for each pair, the angle within half a turn of zero.
fn harmonics<T: Real>(phase: T, out: &mut [T], write: impl Fn(T, T, &mut [T])) {
    let turn = phase - phase.round();
    let mut harmonic = T::one();
    for pair in out.chunks_exact_mut(2) {
        let turns = harmonic * turn;
        write(harmonic, T::two_pi() * (turns - turns.round()), pair);
        harmonic += T::one();
    }
}

fn fourier<T: Real>(phase: T, out: &mut [T]) {
    if let Some((constant, pairs)) = out.split_first_mut() {
        *constant = T::one();
        harmonics(phase, pairs, |_, angle, pair| {
            let (sin, cos) = angle.sin_cos();
            pair.copy_from_slice(&[sin, cos]);
        });
    }
}

fn fourier_derivative<T: Real>(phase: T, out: &mut [T]) {
    if let Some((constant, pairs)) = out.split_first_mut() {
        *constant = T::zero();
        harmonics(phase, pairs, |harmonic, angle, pair| {
            let (sin, cos) = angle.sin_cos();
            let rate = T::two_pi() * harmonic;
            pair.copy_from_slice(&[rate * cos, -rate * sin]);
        });
    }
}

/// The triangle `B_{k,n} = (1 - s) B_{k,n-1} + s B_{k-1,n-1}` in place: sums of non-negative products.
fn bernstein<T: Real>(phase: T, out: &mut [T]) {
    let rest = T::one() - phase;
    out.fill(T::zero());
    if let Some(first) = out.first_mut() {
        *first = T::one();
    }
    for degree in 1..out.len() {
        for k in (1..=degree).rev() {
            out[k] = rest * out[k] + phase * out[k - 1];
        }
        out[0] *= rest;
    }
}

/// `B_{k,n}' = n (B_{k-1,n-1} - B_{k,n-1})`, `n = K - 1`.
fn bernstein_derivative<T: Real>(phase: T, out: &mut [T]) {
    let degree = out.len() - 1;
    out[degree] = T::zero();
    bernstein(phase, &mut out[..degree]);
    let scale = T::of(degree as f64);
    for k in (1..=degree).rev() {
        out[k] = scale * (out[k - 1] - out[k]);
    }
    out[0] *= -scale;
}

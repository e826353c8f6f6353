//! Points that stand for a Gaussian prior over duration or onset.

use crate::Real;

/// How far the grid reaches, standard deviations.
const REACH: f64 = 2.5;

/// Points evenly spaced over ±2.5 standard deviations of a Gaussian, weighted by its density.
#[derive(Clone, Copy, Debug)]
pub struct Grid {
    count: usize,
}

impl Grid {
    /// A grid of so many points; a single one is the middle.
    #[must_use]
    pub const fn new(count: usize) -> Self {
        Self { count }
    }

    /// Distance between two points, standard deviations; of a single one, what it stands for.
    #[must_use]
    pub fn step<T: Real>(self) -> T {
        T::of(2.0 * REACH / (self.count.max(2) - 1) as f64)
    }

    /// Each point, in standard deviations, and the logarithm of its share.
    pub fn points<T: Real>(self) -> impl Iterator<Item = (T, T)> {
        let at = move |index: usize| {
            if self.count == 1 {
                T::zero()
            } else {
                T::of(index as f64) * self.step() - T::of(REACH)
            }
        };
        let log_density = |point: T| -T::of(0.5) * point * point;
        let total =
            (0..self.count).fold(T::zero(), |sum, index| sum + log_density(at(index)).exp());
        (0..self.count).map(move |index| (at(index), log_density(at(index)) - total.ln()))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_grid_is_a_gaussian_cut_off() {
        let moment = |power: i32| -> f64 {
            let points = Grid::new(41).points::<f64>();
            points
                .map(|(z, w)| {
                    nalgebra::ComplexField::powi(z, power) * nalgebra::ComplexField::exp(w)
                })
                .sum()
        };
        assert!((moment(0) - 1.0).abs() < 1e-12 && moment(1).abs() < 1e-12);
        // Variance of a Gaussian cut off at 2.5: 1 - 2 * 2.5 * phi(2.5) / (2 Phi(2.5) - 1) = 0.9112.
        assert!((moment(2) - 0.9112).abs() < 0.02, "{}", moment(2));
        let mut one = Grid::new(1).points::<f64>();
        assert_eq!((one.next(), one.next()), (Some((0.0, 0.0)), None));
        let mut two = Grid::new(2).points::<f32>().map(|(z, _)| z);
        assert_eq!((two.next(), two.next()), (Some(-2.5), Some(2.5)));
    }
}

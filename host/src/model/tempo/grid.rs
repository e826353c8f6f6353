//! Priors over duration and onset, and the points that stand for them.

use super::Durations;

/// How far the grid reaches, standard deviations.
const REACH: f64 = 2.5;

/// A log-normal over duration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(super) struct LogNormal {
    log_mean: f64,
    /// Standard deviation of the logarithm.
    pub(super) log_std: f64,
}

impl LogNormal {
    /// Of the same mean and standard deviation as the demonstrations' durations, widened by `more` in the logarithm.
    pub(super) fn new(durations: &Durations, more: f64) -> Self {
        let share = durations.std_s / durations.mean_s;
        let variance = libm::log1p(share * share);
        Self {
            log_mean: libm::log(durations.mean_s) - 0.5 * variance,
            log_std: libm::sqrt(variance + more * more),
        }
    }

    /// The duration so many standard deviations from the median, seconds.
    pub(super) fn at(&self, deviations: f64) -> f64 {
        libm::exp(self.log_mean + deviations * self.log_std)
    }
}

/// Points evenly spaced over ±[`REACH`] standard deviations of a Gaussian, weighted by its density.
#[derive(Clone, Copy, Debug)]
pub(super) struct Grid {
    count: usize,
}

impl Grid {
    pub(super) const fn new(count: usize) -> Self {
        Self { count }
    }

    /// Distance between two points, standard deviations; of a single one, what it stands for.
    pub(super) fn step(self) -> f64 {
        2.0 * REACH / (self.count.max(2) - 1) as f64
    }

    /// Each point and the logarithm of its share.
    pub(super) fn points(self) -> impl Iterator<Item = (f64, f64)> {
        let at = move |index: usize| {
            if self.count == 1 {
                0.0
            } else {
                -REACH + self.step() * index as f64
            }
        };
        let log_density = |point: f64| -0.5 * point * point;
        let total: f64 = (0..self.count)
            .map(|index| libm::exp(log_density(at(index))))
            .sum();
        (0..self.count).map(move |index| (at(index), log_density(at(index)) - libm::log(total)))
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn a_log_normal_has_the_moments_it_was_given() {
        let durations = Durations {
            mean_s: 1.6,
            std_s: 0.4,
            min_s: 1.0,
            max_s: 2.4,
        };
        let prior = LogNormal::new(&durations, 0.0);
        // Moments of a log-normal: exp(m + v / 2) and that times sqrt(exp(v) - 1).
        let variance = prior.log_std * prior.log_std;
        let mean = (prior.log_mean + 0.5 * variance).exp();
        assert!((mean - 1.6).abs() < 1e-12);
        assert!((mean * variance.exp_m1().sqrt() - 0.4).abs() < 1e-12);
        let wider = LogNormal::new(&durations, 0.3);
        assert!((wider.log_std.powi(2) - variance - 0.09).abs() < 1e-12);
        assert!((wider.at(0.0) - prior.at(0.0)).abs() < 1e-12);
    }

    #[test]
    fn a_grid_is_a_gaussian_cut_off() {
        let points: Vec<_> = Grid::new(41).points().collect();
        let moment =
            |power: i32| -> f64 { points.iter().map(|(z, w)| z.powi(power) * w.exp()).sum() };
        assert!((moment(0) - 1.0).abs() < 1e-12 && moment(1).abs() < 1e-12);
        // Variance of a Gaussian cut off at 2.5: 1 - 2 * 2.5 * phi(2.5) / (2 Phi(2.5) - 1) = 0.9112.
        assert!((moment(2) - 0.9112).abs() < 0.02, "{}", moment(2));
        assert_eq!(Grid::new(1).points().collect::<Vec<_>>(), [(0.0, 0.0)]);
        let ends: Vec<f64> = Grid::new(2).points().map(|(z, _)| z).collect();
        assert_eq!(ends, [-2.5, 2.5]);
    }
}

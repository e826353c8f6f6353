//! Priors over duration and onset, and the points that stand for them.

use crate::model::Durations;

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
    /// One for each skill: the mean of its demonstrations' durations, of which there are `counts`, and the spread that all
    /// skills show together, widened by the uncertainty of the mean and by `more` in the logarithm.
    ///
    /// A standard deviation of six durations is off by a third, and where two skills begin alike the one whose own came
    /// out larger would win every movement faster or slower than shown. Movements of one kind vary in proportion to
    /// their duration, so that one logarithmic spread, of all degrees of freedom, serves.
    pub(super) fn each(durations: &[Durations], counts: &[u32], more: f64) -> Vec<Self> {
        let variances = durations.iter().map(log_variance);
        let freedoms = counts.iter().map(|n| f64::from(n.saturating_sub(1)));
        let (sum, freedom) = variances
            .zip(freedoms)
            .fold((0.0, 0.0), |(sum, total), (variance, freedom)| {
                (sum + freedom * variance, total + freedom)
            });
        let pooled = if freedom > 0.0 { sum / freedom } else { 0.0 };
        let of_skill = |(durations, n): (&Durations, &u32)| Self {
            log_mean: libm::log(durations.mean_s) - 0.5 * log_variance(durations),
            log_std: libm::sqrt(pooled * (1.0 + 1.0 / f64::from(*n)) + more * more),
        };
        durations.iter().zip(counts).map(of_skill).collect()
    }

    /// The duration so many standard deviations from the median, seconds.
    pub(super) fn at(&self, deviations: f64) -> f64 {
        libm::exp(self.log_mean + deviations * self.log_std)
    }
}

/// Of the log-normal that has the mean and standard deviation of these durations.
fn log_variance(durations: &Durations) -> f64 {
    let share = durations.std_s / durations.mean_s;
    libm::log1p(share * share)
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

    fn lasting(mean_s: f64, std_s: f64) -> Durations {
        Durations {
            mean_s,
            std_s,
            min_s: 0.5 * mean_s,
            max_s: 2.0 * mean_s,
        }
    }

    #[test]
    fn a_log_normal_has_the_moments_it_was_given() {
        // So many demonstrations that their mean is known.
        let of = |more| LogNormal::each(&[lasting(1.6, 0.4)], &[u32::MAX], more)[0];
        let prior = of(0.0);
        // Moments of a log-normal: exp(m + v / 2) and that times sqrt(exp(v) - 1).
        let variance = prior.log_std * prior.log_std;
        let mean = (prior.log_mean + 0.5 * variance).exp();
        assert!((mean - 1.6).abs() < 1e-9);
        assert!((mean * variance.exp_m1().sqrt() - 0.4).abs() < 1e-9);
        let wider = of(0.3);
        assert!((wider.log_std.powi(2) - variance - 0.09).abs() < 1e-12);
        assert!((wider.at(0.0) - prior.at(0.0)).abs() < 1e-12);
    }

    #[test]
    fn skills_share_their_spread_by_degrees_of_freedom() {
        let skills = [lasting(1.0, 0.1), lasting(2.0, 0.6), lasting(1.5, 0.0)];
        let priors = LogNormal::each(&skills, &[3, 9, 1], 0.0);
        // Log-variances ln(1 + 0.01) and ln(1 + 0.09) of 2 and 8 degrees of freedom; the third has none.
        let pooled = (2.0 * 1.01_f64.ln() + 8.0 * 1.09_f64.ln()) / 10.0;
        for (prior, n) in priors.iter().zip([3.0, 9.0, 1.0]) {
            let expected = pooled * (1.0 + 1.0 / n);
            assert!(
                (prior.log_std.powi(2) - expected).abs() < 1e-12,
                "{prior:?}"
            );
        }
        // Medians stay the skills' own.
        assert!((priors[0].at(0.0) - 1.0 / 1.01_f64.sqrt()).abs() < 1e-12);
        assert!((priors[1].at(0.0) - 2.0 / 1.09_f64.sqrt()).abs() < 1e-12);
        let once = LogNormal::each(&[lasting(1.5, 0.0)], &[1], 0.2)[0];
        assert!((once.log_std - 0.2).abs() < 1e-12 && (once.at(0.0) - 1.5).abs() < 1e-12);
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

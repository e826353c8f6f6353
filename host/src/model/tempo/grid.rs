//! Priors over duration.

use super::Durations;

/// A log-normal over duration.
#[derive(Clone, Copy, Debug, PartialEq)]
pub(crate) struct LogNormal {
    /// Mean of the logarithm of seconds.
    pub(crate) log_mean: f64,
    /// Standard deviation of the logarithm.
    pub(crate) log_std: f64,
}

impl LogNormal {
    /// Of the same mean and standard deviation as the demonstrations' durations, widened by `more` in the logarithm.
    pub(crate) fn new(durations: &Durations, more: f64) -> Self {
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
}

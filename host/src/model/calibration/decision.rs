//! Early decisions: when the posterior first exceeds a confidence, and how often it is wrong then.

use super::{CalibrationError, check_log_posterior, most_likely};

/// The first time that a class was probable enough.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Decision {
    /// Time of the observation that decided it, in the time of the stream, seconds.
    pub time_s: f64,
    /// How many observations that took, at least 1.
    pub observations: usize,
    /// The class.
    pub class: usize,
}

/// Looks at the log posterior after each observation, in order, and decides at the first whose most
/// probable class has at least the probability `confidence`. `None` if none has. Reads no more of the stream than the
/// decision needs and keeps none of it.
///
/// # Errors
/// A confidence that is no probability above 0 and below 1, a time that is not finite, a posterior that is none.
pub fn decide<P: AsRef<[f64]>>(
    stream: impl IntoIterator<Item = (f64, P)>,
    confidence: f64,
) -> Result<Option<Decision>, CalibrationError> {
    if !(confidence > 0.0 && confidence < 1.0) {
        return Err(CalibrationError::Confidence { confidence });
    }
    let needed = libm::log(confidence);
    for (index, (time_s, log_posterior)) in stream.into_iter().enumerate() {
        if !time_s.is_finite() {
            return Err(CalibrationError::Time { time_s });
        }
        let log_posterior = log_posterior.as_ref();
        check_log_posterior(log_posterior)?;
        let (class, log_probability) = most_likely(log_posterior);
        if log_probability >= needed {
            return Ok(Some(Decision {
                time_s,
                observations: index + 1,
                class,
            }));
        }
    }
    Ok(None)
}

/// Decisions of many movements, added up.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Early {
    /// Movements.
    pub total: usize,
    /// Those that were decided.
    pub decided: usize,
    /// Those that were decided wrongly.
    pub wrong: usize,
    /// Median time to decision of the decided, seconds (the lower of the middle two); `None` if none was decided.
    pub median_time_s: Option<f64>,
}

impl Early {
    /// From each movement's decision and its true class. Times must count from each movement's start.
    #[must_use]
    pub fn of(decisions: &[(Option<Decision>, usize)]) -> Self {
        let made = decisions
            .iter()
            .filter_map(|(made, truth)| Some(((*made)?, *truth)));
        let mut times_s: Vec<f64> = made.clone().map(|(made, _)| made.time_s).collect();
        times_s.sort_by(f64::total_cmp);
        Self {
            total: decisions.len(),
            decided: times_s.len(),
            wrong: made.filter(|(made, truth)| made.class != *truth).count(),
            median_time_s: (times_s.len().checked_sub(1)).map(|last| times_s[last / 2]),
        }
    }

    /// Share of the decided that are wrong, `None` if none was decided. At a confidence `c` of calibrated posteriors it is
    /// at most about `1 - c`.
    #[must_use]
    pub fn error_rate(&self) -> Option<f64> {
        (self.decided > 0).then(|| self.wrong as f64 / self.decided as f64)
    }
}

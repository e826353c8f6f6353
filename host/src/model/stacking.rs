//! Several recognisers that err differently, as one: a mixture of what they answer.
//!
//! Choosing one of many settings by held-out log-loss throws away those that are nearly as good and wrong
//! elsewhere. Stacking keeps them: the shares of a mixture of their posteriors, of least log-loss on forecasts of
//! demonstrations that none of them had learnt from. Without a prior its log-loss there is never above that of the best of
//! them alone; but few forecasts of one person leave shares at zero that another person would need, and then a mixture is
//! as over-confident as its heaviest member. A prior keeps everybody a little.
//!
//! Sources: Wolpert 1992 (stacked generalization); Yao, Vehtari, Simpson and Gelman 2018 (stacking of predictive
//! distributions by the logarithmic score). The objective, a Dirichlet prior included, is concave; EM climbs it.

/// Laplace's rule: each recogniser counts as if one more forecast spoke for it alone.
pub const LAPLACE: f64 = 1.0;

/// Rounds of EM at most.
const ROUNDS: usize = 2000;
/// Nats in total (over all forecasts) within which the shares are taken as converged.
const TOLERANCE: f64 = 1e-6;
/// Shares below this are none.
const NEGLIGIBLE: f64 = 1e-3;

/// Recognisers that cannot be stacked.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum StackError {
    /// Nobody to ask, or nothing forecast.
    #[error("nothing to stack: give at least one recogniser and one forecast of each")]
    None,
    /// Not as many as the first recogniser's, or the shares.
    #[error("recogniser {recogniser} has {got} numbers where there must be {expected}")]
    Length {
        /// The recogniser, from 0.
        recogniser: usize,
        /// How many it has.
        got: usize,
        /// How many the others have.
        expected: usize,
    },
    /// No log probability.
    #[error(
        "recogniser {recogniser} gives log probability {value}: give one from minus infinity to 0"
    )]
    Probability {
        /// The recogniser, from 0.
        recogniser: usize,
        /// What it gave.
        value: f64,
    },
    /// A prior that is none.
    #[error("a prior of {prior} forecasts: give a finite number from 0")]
    Prior {
        /// What was given.
        prior: f64,
    },
    /// What no recogniser holds possible.
    #[error(
        "every recogniser gives forecast {forecast} probability zero: leave it out or mend them"
    )]
    Impossible {
        /// The forecast, from 0.
        forecast: usize,
    },
}

/// Shares of least log-loss: `log_probabilities[recogniser][forecast]` is what each recogniser gave the true class of each
/// demonstration, which it had not learnt from; `prior` is how many forecasts each recogniser has for itself beforehand (0:
/// least log-loss alone, [`LAPLACE`]). The shares are from 0 and sum to 1; those below 1e-3 are dropped.
///
/// # Errors
/// [`StackError`].
pub fn shares(log_probabilities: &[Vec<f64>], prior: f64) -> Result<Vec<f64>, StackError> {
    let forecasts = check(log_probabilities)?;
    if !(prior.is_finite() && prior >= 0.0) {
        return Err(StackError::Prior { prior });
    }
    let recognisers = log_probabilities.len();
    // Relative to the best of each forecast: no exponential is lost.
    let relative = (0..forecasts).map(|forecast| {
        let logs = log_probabilities.iter().map(|of| of[forecast]);
        let best = logs.clone().fold(f64::NEG_INFINITY, f64::max);
        if best == f64::NEG_INFINITY {
            return Err(StackError::Impossible { forecast });
        }
        Ok(logs.map(|log| libm::exp(log - best)).collect::<Vec<f64>>())
    });
    let relative = relative.collect::<Result<Vec<_>, _>>()?;
    let mut shares = vec![1.0 / recognisers as f64; recognisers];
    let all = forecasts as f64 + prior * recognisers as f64;
    let mut last = f64::NEG_INFINITY;
    for _ in 0..ROUNDS {
        let mut next = vec![prior / all; recognisers];
        // An empty prior leaves shares at zero, whose logarithm would not count.
        let log = |share: &f64| if prior > 0.0 { libm::log(*share) } else { 0.0 };
        let mut score = prior * shares.iter().map(log).sum::<f64>();
        for likelihoods in &relative {
            let mixed: f64 = shares.iter().zip(likelihoods).map(|(w, p)| w * p).sum();
            score += libm::log(mixed);
            for ((sum, share), likelihood) in next.iter_mut().zip(&shares).zip(likelihoods) {
                *sum += share * likelihood / mixed / all;
            }
        }
        shares = next;
        if score - last < TOLERANCE {
            break;
        }
        last = score;
    }
    shares
        .iter_mut()
        .filter(|share| **share < NEGLIGIBLE)
        .for_each(|share| *share = 0.0);
    let total: f64 = shares.iter().sum();
    Ok(shares.iter().map(|share| share / total).collect())
}

/// The mixture of log posteriors, one for each share, over the same classes: `log sum_r share_r p_r`.
///
/// # Errors
/// [`StackError`].
pub fn mixed(shares: &[f64], log_posteriors: &[Vec<f64>]) -> Result<Vec<f64>, StackError> {
    let classes = check(log_posteriors)?;
    if shares.len() != log_posteriors.len() {
        return Err(StackError::Length {
            recogniser: shares.len().min(log_posteriors.len()),
            got: shares.len(),
            expected: log_posteriors.len(),
        });
    }
    let of_class = |class: usize| {
        let terms = shares.iter().zip(log_posteriors);
        let terms = terms.map(|(share, of)| libm::log(*share) + of[class]);
        let largest = terms.clone().fold(f64::NEG_INFINITY, f64::max);
        if largest == f64::NEG_INFINITY {
            return largest;
        }
        largest + libm::log(terms.map(|term| libm::exp(term - largest)).sum())
    };
    Ok((0..classes).map(of_class).collect())
}

/// Numbers of each.
fn check(logs: &[Vec<f64>]) -> Result<usize, StackError> {
    let expected = logs.first().map_or(0, Vec::len);
    if expected == 0 {
        return Err(StackError::None);
    }
    for (recogniser, of) in logs.iter().enumerate() {
        if of.len() != expected {
            return Err(StackError::Length {
                recogniser,
                got: of.len(),
                expected,
            });
        }
        // A normalised posterior may exceed zero by rounding.
        let wrong = of.iter().find(|log| log.is_nan() || **log > 1e-9);
        if let Some(&value) = wrong {
            return Err(StackError::Probability { recogniser, value });
        }
    }
    Ok(expected)
}

#[cfg(test)]
mod tests {
    use super::{LAPLACE, StackError, mixed, shares};

    fn logs(probabilities: &[f64]) -> Vec<f64> {
        probabilities.iter().map(|p| p.ln()).collect()
    }

    #[test]
    fn shares_of_two_that_err_elsewhere_are_the_closed_form() {
        // One is right about three forecasts of four and impossible about the fourth, the other the other way round:
        // w^3 (1 - w) is greatest at 3/4.
        let one = vec![0.0, 0.0, 0.0, f64::NEG_INFINITY];
        let other = vec![f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0];
        let found = shares(&[one, other], 0.0).unwrap();
        assert!((found[0] - 0.75).abs() < 1e-6, "{found:?}");
        assert!((found.iter().sum::<f64>() - 1.0).abs() < 1e-12);
    }

    #[test]
    fn a_prior_adds_its_forecasts_to_each() {
        // As above, with one more for each: w^4 (1 - w)^2 is greatest at 4/6.
        let one = vec![0.0, 0.0, 0.0, f64::NEG_INFINITY];
        let other = vec![f64::NEG_INFINITY, f64::NEG_INFINITY, f64::NEG_INFINITY, 0.0];
        let found = shares(&[one, other], LAPLACE).unwrap();
        assert!((found[0] - 4.0 / 6.0).abs() < 1e-6, "{found:?}");
        // Who can never be told from the other shares alike, however many forecasts there are.
        let same = vec![-0.5; 40];
        assert_eq!(shares(&[same.clone(), same], LAPLACE).unwrap(), [0.5, 0.5]);
    }

    #[test]
    fn who_is_never_better_has_no_share() {
        let better = logs(&[0.9, 0.8, 0.7]);
        let worse = logs(&[0.5, 0.4, 0.6]);
        assert_eq!(shares(&[worse, better], 0.0).unwrap(), [0.0, 1.0]);
    }

    #[test]
    fn at_the_optimum_no_share_gains_by_growing() {
        // Karush-Kuhn-Tucker: the mean of p_r / mixture is 1 where the share is above zero, at most 1 elsewhere.
        let all = [
            logs(&[0.9, 0.2, 0.6, 0.3, 0.5]),
            logs(&[0.1, 0.7, 0.5, 0.4, 0.5]),
            logs(&[0.3, 0.3, 0.1, 0.9, 0.2]),
            logs(&[0.2, 0.2, 0.1, 0.6, 0.1]),
        ];
        let found = shares(&all, 0.0).unwrap();
        let gain = |of: &[f64]| -> f64 {
            let ratios = (0..5).map(|i| {
                let mixed: f64 = found.iter().zip(&all).map(|(w, p)| w * p[i].exp()).sum();
                of[i].exp() / mixed
            });
            ratios.sum::<f64>() / 5.0
        };
        for (share, of) in found.iter().zip(&all) {
            let gain = gain(of);
            assert!(gain < 1.0 + 2e-3, "{found:?} {gain}");
            assert!(*share == 0.0 || gain > 1.0 - 2e-3, "{found:?} {gain}");
        }
        assert_eq!(found[3], 0.0);
    }

    #[test]
    fn a_mixture_is_the_weighted_mean_of_probabilities() {
        let two = [logs(&[0.8, 0.2]), vec![f64::NEG_INFINITY, 0.0]];
        let of = mixed(&[0.25, 0.75], &two).unwrap();
        assert!((of[0].exp() - 0.2).abs() < 1e-12 && (of[1].exp() - 0.8).abs() < 1e-12);
        let sure = mixed(&[0.0, 1.0], &two).unwrap();
        assert_eq!(sure[0], f64::NEG_INFINITY);
    }

    #[test]
    fn what_cannot_be_stacked_is_refused() {
        assert_eq!(shares(&[], 0.0), Err(StackError::None));
        assert_eq!(shares(&[vec![]], 0.0), Err(StackError::None));
        let uneven = shares(&[vec![-1.0, -1.0], vec![-1.0]], 0.0);
        assert!(matches!(
            uneven,
            Err(StackError::Length { recogniser: 1, .. })
        ));
        let nan = shares(&[vec![f64::NAN]], 0.0);
        assert!(matches!(nan, Err(StackError::Probability { .. })));
        let never = shares(&[vec![-1.0, f64::NEG_INFINITY]], 0.0);
        assert_eq!(never, Err(StackError::Impossible { forecast: 1 }));
        assert!(mixed(&[1.0], &[vec![-1.0], vec![-1.0]]).is_err());
        for prior in [-1.0, f64::NAN, f64::INFINITY] {
            let refused = shares(&[vec![-1.0]], prior);
            assert!(matches!(refused, Err(StackError::Prior { .. })));
        }
    }
}

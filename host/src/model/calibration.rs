//! Whether a probability means what it says: of all answers given with 80 %, are 80 % right?
//!
//! [`Reliability`] compares confidence with accuracy, [`log_loss`] and [`brier`] score whole distributions, and a
//! [`Temperature`] mends a recogniser that is too sure (or not sure enough) of itself. A temperature is fitted to
//! forecasts of demonstrations that the model had not learnt from, and never to those it is judged on; where they are few,
//! [`Tempering`] averages over those that are still possible.
//!
//! Sources: Guo, Pleiss, Sun and Weinberger 2017 (temperature, expected calibration error); Nguyen and O'Connor 2015
//! (bins of equal count); Brier 1950.

mod decision;
mod tempering;

pub use decision::{Decision, Early, decide};
pub use tempering::Tempering;

/// A forecast that is none.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum CalibrationError {
    /// Nothing to judge by.
    #[error("no forecasts: leave demonstrations out and forecast those")]
    None,
    /// The truth is no class of the forecast.
    #[error("the true class is number {truth} of a forecast over {classes}")]
    Truth {
        /// The class, from 0.
        truth: usize,
        /// How many there are.
        classes: usize,
    },
    /// No log probability.
    #[error("the log probability of class {class} is {value}: give one from minus infinity to 0")]
    Probability {
        /// The class, from 0.
        class: usize,
        /// What was given.
        value: f64,
    },
    /// Probabilities that do not sum to one.
    #[error("the probabilities sum to {sum}: normalise them")]
    Sum {
        /// Their sum.
        sum: f64,
    },
    /// No bins.
    #[error("a reliability diagram needs at least one bin")]
    NoBins,
    /// A confidence that no probability exceeds or any does.
    #[error("the confidence is {confidence}: give a probability above 0 and below 1")]
    Confidence {
        /// What was given.
        confidence: f64,
    },
    /// A time that is no number.
    #[error("an observation's time is {time_s} s: give a finite time")]
    Time {
        /// What was given.
        time_s: f64,
    },
}

/// How far the probabilities may sum from one: the rounding of exponentials of a log-sum-exp.
const SUM_TOLERANCE: f64 = 1e-6;

/// A posterior over classes, and the class that it turned out to be.
#[derive(Clone, Debug, PartialEq)]
pub struct Forecast {
    log_posterior: Vec<f64>,
    truth: usize,
}

impl Forecast {
    /// `log_posterior`: natural logarithm of each class's probability.
    ///
    /// # Errors
    /// A truth that is no class, a number that is no log probability, probabilities that do not sum to one.
    pub fn new(log_posterior: Vec<f64>, truth: usize) -> Result<Self, CalibrationError> {
        let classes = log_posterior.len();
        if truth >= classes {
            return Err(CalibrationError::Truth { truth, classes });
        }
        check_log_posterior(&log_posterior)?;
        Ok(Self {
            log_posterior,
            truth,
        })
    }

    /// Log probability of each class.
    #[must_use]
    pub fn log_posterior(&self) -> &[f64] {
        &self.log_posterior
    }

    /// The class that it was.
    #[must_use]
    pub const fn truth(&self) -> usize {
        self.truth
    }

    /// The most probable class (the first of equals) and its probability.
    #[must_use]
    pub fn answer(&self) -> (usize, f64) {
        let (class, log_probability) = most_likely(&self.log_posterior);
        (class, libm::exp(log_probability))
    }
}

fn check_log_posterior(log_posterior: &[f64]) -> Result<(), CalibrationError> {
    let above = |value: f64| value.is_nan() || value > SUM_TOLERANCE;
    if let Some(class) = log_posterior.iter().position(|&value| above(value)) {
        let value = log_posterior[class];
        return Err(CalibrationError::Probability { class, value });
    }
    let sum: f64 = log_posterior.iter().map(|&value| libm::exp(value)).sum();
    if (sum - 1.0).abs() > SUM_TOLERANCE {
        return Err(CalibrationError::Sum { sum });
    }
    Ok(())
}

/// Index and value of the largest, the first of equals; `(0, -inf)` of none.
fn most_likely(log_posterior: &[f64]) -> (usize, f64) {
    let start = (0, f64::NEG_INFINITY);
    let pairs = log_posterior.iter().copied().enumerate();
    pairs.fold(
        start,
        |best, next| if next.1 > best.1 { next } else { best },
    )
}

/// Mean of minus the log probability of the truth, nats; infinite where a truth was said to be impossible.
///
/// # Errors
/// No forecasts.
pub fn log_loss(forecasts: &[Forecast]) -> Result<f64, CalibrationError> {
    mean(forecasts, |forecast| {
        -forecast.log_posterior[forecast.truth]
    })
}

/// Mean over forecasts of `sum_c (p_c - [c is the truth])^2`, from 0 to 2.
///
/// # Errors
/// No forecasts.
pub fn brier(forecasts: &[Forecast]) -> Result<f64, CalibrationError> {
    mean(forecasts, |forecast| {
        let classes = forecast.log_posterior.iter().enumerate();
        let errors = classes.map(|(class, &log_probability)| {
            let happened = f64::from(u8::from(class == forecast.truth));
            libm::exp(log_probability) - happened
        });
        errors.map(|error| error * error).sum()
    })
}

fn mean(forecasts: &[Forecast], of: impl Fn(&Forecast) -> f64) -> Result<f64, CalibrationError> {
    if forecasts.is_empty() {
        return Err(CalibrationError::None);
    }
    let sum: f64 = forecasts.iter().map(of).sum();
    Ok(sum / forecasts.len() as f64)
}

/// Answers of about the same confidence.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize)]
pub struct Bin {
    /// How many, at least 1.
    pub count: usize,
    /// Mean probability that they were given with.
    pub confidence: f64,
    /// Share of them that were right.
    pub accuracy: f64,
}

/// A reliability diagram: confidence against accuracy of the most probable class, in adaptive bins.
#[derive(Clone, Debug, PartialEq)]
pub struct Reliability {
    bins: Vec<Bin>,
}

impl Reliability {
    /// Sorts the answers by confidence into `bins` of equal count (as equal as whole numbers allow). Equal
    /// confidences share a bin, so that the diagram does not depend on the order of the forecasts; many equal ones
    /// make fewer bins.
    ///
    /// # Errors
    /// No forecasts, no bins.
    pub fn of(forecasts: &[Forecast], bins: usize) -> Result<Self, CalibrationError> {
        if bins == 0 {
            return Err(CalibrationError::NoBins);
        }
        if forecasts.is_empty() {
            return Err(CalibrationError::None);
        }
        let answer = |forecast: &Forecast| {
            let (class, confidence) = forecast.answer();
            (confidence, class == forecast.truth)
        };
        let mut answers: Vec<(f64, bool)> = forecasts.iter().map(answer).collect();
        answers.sort_by(|one, other| one.0.total_cmp(&other.0));
        let mut made = Vec::with_capacity(bins);
        let mut start = 0;
        for bin in 1..=bins {
            let mut end = (answers.len() * bin).div_ceil(bins).max(start);
            while end > start && end < answers.len() && answers[end].0 <= answers[end - 1].0 {
                end += 1;
            }
            if end > start {
                made.push(Bin::of(&answers[start..end]));
            }
            start = end;
        }
        Ok(Self { bins: made })
    }

    /// [`Reliability::of`] with the cube root of the number of forecasts, rounded up: the rate at which bias (wide
    /// bins) and noise (few answers in each) balance in a histogram.
    ///
    /// # Errors
    /// No forecasts.
    pub fn adaptive(forecasts: &[Forecast]) -> Result<Self, CalibrationError> {
        let root = libm::ceil(libm::cbrt(forecasts.len() as f64));
        Self::of(forecasts, (root as usize).max(1))
    }

    /// The bins, least confident first.
    #[must_use]
    pub fn bins(&self) -> &[Bin] {
        &self.bins
    }

    /// Expected calibration error: the mean over all answers of how far their bin's accuracy is from its confidence,
    /// from 0 to 1. Chance alone makes it positive ([`Reliability::by_chance`]).
    #[must_use]
    pub fn expected_calibration_error(&self) -> f64 {
        self.mean(|bin| (bin.accuracy - bin.confidence).abs())
    }

    /// About what [`Reliability::expected_calibration_error`] is on average where every confidence is
    /// right: `sqrt(2 c (1 - c) / (pi n))` for a bin of `n` answers of confidence `c`, the mean distance of a Gaussian
    /// of the binomial's variance.
    #[must_use]
    pub fn by_chance(&self) -> f64 {
        self.mean(|bin| {
            let variance = bin.confidence * (1.0 - bin.confidence) / bin.count as f64;
            libm::sqrt(2.0 * variance.max(0.0) / core::f64::consts::PI)
        })
    }

    fn mean(&self, of: impl Fn(&Bin) -> f64) -> f64 {
        let answers: usize = self.bins.iter().map(|bin| bin.count).sum();
        let sum: f64 = self.bins.iter().map(|bin| bin.count as f64 * of(bin)).sum();
        sum / answers as f64
    }
}

impl Bin {
    fn of(answers: &[(f64, bool)]) -> Self {
        let count = answers.len();
        let right = answers.iter().filter(|(_, right)| *right).count();
        let confidence: f64 = answers.iter().map(|(confidence, _)| confidence).sum();
        Self {
            count,
            confidence: confidence / count as f64,
            accuracy: right as f64 / count as f64,
        }
    }
}

/// Least and greatest inverse temperature: beyond these a posterior is flat, or an argmax.
const INVERSE_RANGE: (f64, f64) = (1e-3, 10.0);
/// Halvings of [`INVERSE_RANGE`]: to the last bit.
const HALVINGS: usize = 60;
/// How far from one an inverse temperature is before anything was seen: standard deviation of the prior. Without it, a
/// handful of forecasts that are all right would ask for certainty.
const INVERSE_STD: f64 = 0.5;

/// A temperature `T`: `p_c` becomes `p_c^(1/T)`, normalised. Above one a posterior is less sure than before. The
/// order of the classes stays.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Temperature(f64);

impl Temperature {
    /// Leaves posteriors as they are.
    pub const ONE: Self = Self(1.0);

    /// The temperature of greatest posterior probability given `forecasts` of what the model had not learnt from:
    /// `b = 1 / T` minimises
    ///
    /// ```text
    /// sum_i (ln sum_c exp(b l_ic) - b l_i,truth) + (b - 1)^2 / (2 s^2),   s = 0.5
    /// ```
    ///
    /// which is convex in `b`; its derivative is bisected within `[0.001, 10]`.
    ///
    /// # Errors
    /// No forecasts.
    pub fn fit(forecasts: &[Forecast]) -> Result<Self, CalibrationError> {
        if forecasts.is_empty() {
            return Err(CalibrationError::None);
        }
        let (mut least, mut greatest) = INVERSE_RANGE;
        for _ in 0..HALVINGS {
            let inverse = 0.5 * (least + greatest);
            let slope: f64 = forecasts.iter().map(|f| slope(f, inverse)).sum();
            if slope + (inverse - 1.0) / (INVERSE_STD * INVERSE_STD) > 0.0 {
                greatest = inverse;
            } else {
                least = inverse;
            }
        }
        Ok(Self(2.0 / (least + greatest)))
    }

    /// `T`.
    #[must_use]
    pub const fn get(self) -> f64 {
        self.0
    }

    /// Log posterior at this temperature, normalised by log-sum-exp.
    #[must_use]
    pub fn soften(self, log_posterior: &[f64]) -> Vec<f64> {
        let scaled: Vec<f64> = log_posterior.iter().map(|l| l / self.0).collect();
        let (_, largest) = most_likely(&scaled);
        let sum: f64 = scaled.iter().map(|l| libm::exp(l - largest)).sum();
        let total = largest + libm::log(sum);
        scaled.iter().map(|l| l - total).collect()
    }

    /// The same forecast at this temperature.
    #[must_use]
    pub fn softened(self, forecast: &Forecast) -> Forecast {
        Forecast {
            log_posterior: self.soften(&forecast.log_posterior),
            truth: forecast.truth,
        }
    }
}

/// Derivative of a forecast's loss by the inverse temperature: the mean log probability under the
/// softened posterior less that of the truth.
fn slope(forecast: &Forecast, inverse: f64) -> f64 {
    let softened = Temperature(1.0 / inverse).soften(&forecast.log_posterior);
    let pairs = softened.iter().zip(&forecast.log_posterior);
    // A class of probability zero has no part in the mean.
    let possible = pairs.filter(|(s, _)| **s > f64::NEG_INFINITY);
    let mean: f64 = possible.map(|(s, l)| libm::exp(*s) * l).sum();
    mean - forecast.log_posterior[forecast.truth]
}

#[cfg(test)]
mod tests;

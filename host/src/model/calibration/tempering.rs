//! A temperature that few forecasts leave uncertain: averaged over, instead of the best one taken.

use super::{CalibrationError, Forecast, INVERSE_RANGE, INVERSE_STD, Temperature, most_likely};

/// Inverse temperatures that are averaged over, equal ratios from the least to the greatest: the mean over them is within
/// 3e-5 of the integral for 10 to 1000 forecasts.
const NODES: u32 = 120;
/// Those less probable are passed over.
const NEGLIGIBLE: f64 = 1e-6;

/// What a posterior becomes at a temperature of which forecasts say this much and no more:
///
/// ```text
/// p'_c = sum_k P(b_k | forecasts) p_c^(b_k) / sum_d p_d^(b_k)
/// P(b | forecasts) ~ exp(-(b - 1)^2 / (2 s^2)) prod_i p_i,truth^b / sum_c p_ic^b,   s = 0.5
/// ```
///
/// [`Temperature::fit`] is the mode of the same posterior over `b = 1 / T`, and as sure as if the temperature were known. The
/// mean over what is still possible is less sure the fewer the forecasts, and of least expected log-loss if the prior
/// holds. The most probable class stays: every temperature keeps the order.
#[derive(Clone, Debug, PartialEq)]
pub struct Tempering(Vec<(Temperature, f64)>);

impl Tempering {
    /// What `forecasts` of what the model had not learnt from say. One whose truth was held impossible is as impossible at
    /// every temperature, and says nothing of them.
    ///
    /// # Errors
    /// No forecasts.
    pub fn fit(forecasts: &[Forecast]) -> Result<Self, CalibrationError> {
        if forecasts.is_empty() {
            return Err(CalibrationError::None);
        }
        let possible = |f: &&Forecast| f.log_posterior[f.truth] > f64::NEG_INFINITY;
        let (least, greatest) = INVERSE_RANGE;
        let ratio = libm::log(greatest / least) / f64::from(NODES - 1);
        let log_probable = |node: u32| {
            let inverse = least * libm::exp(ratio * f64::from(node));
            let temperature = Temperature(1.0 / inverse);
            let own = |f: &Forecast| temperature.soften(&f.log_posterior)[f.truth];
            let off = (inverse - 1.0) / INVERSE_STD;
            let truths: f64 = forecasts.iter().filter(possible).map(own).sum();
            // Nodes are as far apart as they are large.
            (temperature, truths - 0.5 * off * off + libm::log(inverse))
        };
        let mut all: Vec<(Temperature, f64)> = (0..NODES).map(log_probable).collect();
        let logs: Vec<f64> = all.iter().map(|(_, log)| *log).collect();
        let (_, largest) = most_likely(&logs);
        for (_, share) in &mut all {
            *share = libm::exp(*share - largest);
        }
        all.retain(|(_, share)| *share > NEGLIGIBLE);
        let total: f64 = all.iter().map(|(_, share)| share).sum();
        for (_, share) in &mut all {
            *share /= total;
        }
        Ok(Self(all))
    }

    /// One over the mean inverse temperature.
    #[must_use]
    pub fn temperature(&self) -> f64 {
        1.0 / self.0.iter().map(|(t, share)| share / t.0).sum::<f64>()
    }

    /// Log posterior, averaged over the temperatures.
    #[must_use]
    pub fn soften(&self, log_posterior: &[f64]) -> Vec<f64> {
        let mut sums = vec![0.0; log_posterior.len()];
        for (temperature, share) in &self.0 {
            for (sum, log) in sums.iter_mut().zip(temperature.soften(log_posterior)) {
                *sum += share * libm::exp(log);
            }
        }
        sums.into_iter().map(libm::log).collect()
    }

    /// The same forecast.
    #[must_use]
    pub fn softened(&self, forecast: &Forecast) -> Forecast {
        Forecast {
            log_posterior: self.soften(&forecast.log_posterior),
            truth: forecast.truth,
        }
    }
}

//! A Gaussian over a few numbers: its density where some of them are seen, and what they tell about the others.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::BaselineError;

/// Of a covariance, whatever its size.
type Factor = Cholesky<f64, nalgebra::Dyn>;

/// `ln(2 pi)`.
const LN_TWO_PI: f64 = 1.837_877_066_409_345_5;

/// Mean and covariance.
#[derive(Debug, Clone, PartialEq)]
pub struct Gaussian {
    /// `n`.
    pub mean: DVector<f64>,
    /// `n x n`.
    pub covariance: DMatrix<f64>,
}

/// Some of the numbers as seen: which, their values, the variances of their noise.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Seen {
    /// Indices into the Gaussian.
    pub which: Vec<usize>,
    /// One value for each.
    pub values: Vec<f64>,
    /// One variance for each.
    pub noise: Vec<f64>,
}

impl Seen {
    /// All numbers, without noise.
    pub fn all(values: impl IntoIterator<Item = f64>) -> Self {
        let values: Vec<f64> = values.into_iter().collect();
        Self {
            which: (0..values.len()).collect(),
            noise: vec![0.0; values.len()],
            values,
        }
    }
}

impl Gaussian {
    /// Weighted mean and covariance of the rows of `points`, `floor` added to each variance.
    #[must_use]
    pub fn weighted(points: &DMatrix<f64>, weights: &[f64], floor: f64) -> Self {
        let width = points.ncols();
        let total: f64 = weights.iter().sum::<f64>().max(f64::MIN_POSITIVE);
        let shares = DVector::from_iterator(weights.len(), weights.iter().map(|w| w / total));
        let mean = points.tr_mul(&shares);
        let mut scaled = points.clone();
        for (mut row, share) in scaled.row_iter_mut().zip(shares.iter()) {
            row -= mean.transpose();
            row *= libm::sqrt(*share);
        }
        let covariance = scaled.tr_mul(&scaled) + DMatrix::identity(width, width) * floor;
        Self { mean, covariance }
    }

    /// Log density of what is seen, nats; zero where nothing is.
    ///
    /// # Errors
    /// A covariance that is not positive definite.
    pub fn log_density(&self, seen: &Seen) -> Result<f64, BaselineError> {
        let (factor, error) = self.innovation(seen)?;
        let Some(factor) = factor else {
            return Ok(0.0);
        };
        let half_log_determinant: f64 = factor
            .l_dirty()
            .diagonal()
            .iter()
            .map(|d| libm::log(*d))
            .sum();
        let square = error.dot(&factor.solve(&error));
        Ok(-0.5 * (square + error.len() as f64 * LN_TWO_PI) - half_log_determinant)
    }

    /// Log density of every row of `points`, all numbers seen without noise. Factors the covariance once.
    ///
    /// # Errors
    /// As [`Gaussian::log_density`].
    pub fn log_densities(&self, points: &DMatrix<f64>) -> Result<Vec<f64>, BaselineError> {
        let factor = Cholesky::new(self.covariance.clone())
            .ok_or(BaselineError::Numerical("factorisation of a covariance"))?;
        let lower = factor.l();
        let mut apart = points.transpose();
        for mut column in apart.column_iter_mut() {
            column -= &self.mean;
        }
        if !lower.solve_lower_triangular_mut(&mut apart) {
            return Err(BaselineError::Numerical("factorisation of a covariance"));
        }
        let half_log_determinant: f64 = lower.diagonal().iter().map(|d| libm::log(*d)).sum();
        let constant = -0.5 * self.mean.len() as f64 * LN_TWO_PI - half_log_determinant;
        let one = |column: nalgebra::DVectorView<'_, f64>| constant - 0.5 * column.norm_squared();
        Ok(apart.column_iter().map(one).collect())
    }

    /// All the numbers, given what is seen: `mu + C_ao S^-1 (y - mu_o)`, `C - C_ao S^-1 C_oa`, `S = C_oo + R`.
    ///
    /// # Errors
    /// As [`Gaussian::log_density`].
    pub fn given(&self, seen: &Seen) -> Result<Self, BaselineError> {
        let (factor, error) = self.innovation(seen)?;
        let Some(factor) = factor else {
            return Ok(self.clone());
        };
        let across = self.covariance.select_columns(&seen.which);
        Ok(Self {
            mean: &self.mean + &across * factor.solve(&error),
            covariance: &self.covariance - &across * factor.solve(&across.transpose()),
        })
    }

    fn innovation(&self, seen: &Seen) -> Result<(Option<Factor>, DVector<f64>), BaselineError> {
        let count = seen.which.len();
        let error = DVector::from_fn(count, |i, _| seen.values[i] - self.mean[seen.which[i]]);
        if count == 0 {
            return Ok((None, error));
        }
        let mut covariance = self
            .covariance
            .select_rows(&seen.which)
            .select_columns(&seen.which);
        for (i, noise) in seen.noise.iter().enumerate() {
            covariance[(i, i)] += noise;
        }
        let factor = Cholesky::new(covariance)
            .ok_or(BaselineError::Numerical("factorisation of a covariance"))?;
        Ok((Some(factor), error))
    }
}

/// Mean and covariance of a mixture of Gaussians, weights given by their logarithms.
pub(super) fn matched(parts: &[(f64, Gaussian)]) -> Option<Gaussian> {
    let width = parts.first()?.1.mean.len();
    let logs: Vec<f64> = parts.iter().map(|(log, _)| *log).collect();
    let shares = super::normalised(&logs);
    let mut mean = DVector::zeros(width);
    for (share, (_, part)) in shares.iter().zip(parts) {
        mean += &part.mean * libm::exp(*share);
    }
    let mut covariance = DMatrix::zeros(width, width);
    for (share, (_, part)) in shares.iter().zip(parts) {
        let apart = &part.mean - &mean;
        covariance += (&part.covariance + &apart * apart.transpose()) * libm::exp(*share);
    }
    Some(Gaussian { mean, covariance })
}

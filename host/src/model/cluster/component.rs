//! A mixture of Gaussians over points.

use nalgebra::{Cholesky, DMatrix, DVector};

use super::ClusterError;

/// One Gaussian and its share.
#[derive(Clone, Debug)]
pub(super) struct Component {
    pub(super) log_weight: f64,
    /// `p`.
    pub(super) mean: DVector<f64>,
    /// `p x p`.
    pub(super) covariance: DMatrix<f64>,
}

impl Component {
    pub(super) fn factor(&self) -> Result<Cholesky<f64, nalgebra::Dyn>, ClusterError> {
        factor(&self.covariance)
    }

    /// Logarithm of the share times the density of each column of `points`.
    pub(super) fn log_joint(&self, points: &DMatrix<f64>) -> Result<Vec<f64>, ClusterError> {
        let factor = self.factor()?;
        let l = factor.l_dirty();
        let mut centred = points.clone();
        for mut column in centred.column_iter_mut() {
            column -= &self.mean;
        }
        if !l.solve_lower_triangular_mut(&mut centred) {
            return Err(ClusterError::Numerical(
                "solution for a component's distance",
            ));
        }
        let dimensions = points.nrows() as f64;
        let constant = self.log_weight
            - 0.5 * dimensions * libm::log(core::f64::consts::TAU)
            - 0.5 * log_determinant(&factor);
        let squares = centred.column_iter().map(|column| column.norm_squared());
        Ok(squares.map(|square| constant - 0.5 * square).collect())
    }
}

pub(super) fn factor(
    covariance: &DMatrix<f64>,
) -> Result<Cholesky<f64, nalgebra::Dyn>, ClusterError> {
    Cholesky::new(covariance.clone())
        .ok_or(ClusterError::Numerical("factorisation of a covariance"))
}

pub(super) fn log_determinant(factor: &Cholesky<f64, nalgebra::Dyn>) -> f64 {
    let diagonal = factor.l_dirty().diagonal();
    2.0 * diagonal.iter().map(|value| libm::log(*value)).sum::<f64>()
}

/// `N x Q`: logarithm of share times density.
pub(super) fn log_joint(
    mixture: &[Component],
    points: &DMatrix<f64>,
) -> Result<DMatrix<f64>, ClusterError> {
    let mut joint = DMatrix::zeros(points.ncols(), mixture.len());
    for (mut column, component) in joint.column_iter_mut().zip(mixture) {
        column.copy_from_slice(&component.log_joint(points)?);
    }
    Ok(joint)
}

/// Log density of each point under the whole mixture, from the joint's rows.
pub(super) fn log_density(joint: &DMatrix<f64>) -> Vec<f64> {
    joint
        .row_iter()
        .map(|row| log_sum_exp(row.iter().copied()))
        .collect()
}

pub(super) fn log_sum_exp(values: impl Iterator<Item = f64> + Clone) -> f64 {
    let greatest = values.clone().fold(f64::NEG_INFINITY, f64::max);
    if greatest == f64::NEG_INFINITY {
        return greatest;
    }
    greatest + libm::log(values.map(|value| libm::exp(value - greatest)).sum())
}

/// Bhattacharyya distance of two Gaussians, nats: `m^T C^-1 m / 8 + log(|C| / sqrt(|C_1| |C_2|)) / 2`, `C` the mean of
/// the covariances and `m` the difference of the means. Zero for the same Gaussian.
pub(super) fn distance(one: &Component, other: &Component) -> Result<f64, ClusterError> {
    let both = factor(&((&one.covariance + &other.covariance) * 0.5))?;
    let apart = &one.mean - &other.mean;
    let solved = both
        .l_dirty()
        .solve_lower_triangular(&apart)
        .ok_or(ClusterError::Numerical(
            "solution for a component's distance",
        ))?;
    let own = log_determinant(&one.factor()?) + log_determinant(&other.factor()?);
    Ok(solved.norm_squared() / 8.0 + 0.5 * (log_determinant(&both) - 0.5 * own))
}

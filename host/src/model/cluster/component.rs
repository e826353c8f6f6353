//! A mixture of Student-t components over points.

use core::f64::consts::{PI, TAU};

use nalgebra::{Cholesky, DMatrix, DVector};

use super::ClusterError;
use crate::model::fitted::log_sum_exp;

/// One component and its share.
#[derive(Clone, Debug)]
pub(super) struct Component {
    pub(super) log_weight: f64,
    /// `p`.
    pub(super) mean: DVector<f64>,
    /// `p x p`.
    pub(super) covariance: DMatrix<f64>,
    /// Points that the mean was taken over.
    pub(super) points: f64,
    /// Points that the covariance was taken over, the prior's among them.
    pub(super) spread_over: f64,
    /// Those less the means that they were taken about.
    pub(super) freedom: f64,
    /// Degrees of freedom of its tails: a Student-t of which `covariance` is the scale; infinite for a Gaussian.
    pub(super) tails: f64,
}

impl Component {
    pub(super) fn factor(&self) -> Result<Cholesky<f64, nalgebra::Dyn>, ClusterError> {
        factor(&self.covariance)
    }

    /// Squared Mahalanobis distance of each column of `points`, and the covariance's log determinant.
    fn distances(&self, points: &DMatrix<f64>) -> Result<(Vec<f64>, f64), ClusterError> {
        let factor = self.factor()?;
        let mut centred = points.clone();
        for mut column in centred.column_iter_mut() {
            column -= &self.mean;
        }
        if !factor.l_dirty().solve_lower_triangular_mut(&mut centred) {
            return Err(ClusterError::Numerical(
                "solution for a component's distance",
            ));
        }
        let squares = centred.column_iter().map(|column| column.norm_squared());
        Ok((squares.collect(), log_determinant(&factor)))
    }

    /// Logarithm of the share times the density of each column of `points`.
    fn log_joint(&self, points: &DMatrix<f64>) -> Result<Vec<f64>, ClusterError> {
        let (squares, log_determinant) = self.distances(points)?;
        let p = points.nrows() as f64;
        if self.tails.is_infinite() {
            let constant = self.log_weight - 0.5 * (p * libm::log(TAU) + log_determinant);
            return Ok(squares
                .into_iter()
                .map(|square| constant - 0.5 * square)
                .collect());
        }
        let of = student(p, self.tails, 1.0, log_determinant);
        Ok(squares
            .into_iter()
            .map(|square| self.log_weight + of(square))
            .collect())
    }

    /// How much each column of `points` counts in mean and covariance: less where it is far out, one for a Gaussian.
    ///
    /// Source: Peel and McLachlan, Robust mixture modelling using the t distribution, 2000.
    pub(super) fn trust(&self, points: &DMatrix<f64>) -> Result<Vec<f64>, ClusterError> {
        if self.tails.is_infinite() {
            return Ok(vec![1.0; points.ncols()]);
        }
        let p = points.nrows() as f64;
        let (squares, _) = self.distances(points)?;
        let of = |square: f64| (self.tails + p) / (self.tails + square);
        Ok(squares.into_iter().map(of).collect())
    }

    /// The same for points that were not there when the component was fitted: mean and covariance `C = S / n` of few
    /// points are uncertain, and a new point is Student-t about the mean, with `f - p + 1` degrees of freedom (`f` those
    /// of the scatter `S`; at least one) and the scale `S (1 + 1 / m) / (f - p + 1)`, `m` the points of the mean.
    ///
    /// Source: Gelman et al., Bayesian Data Analysis, 3rd ed., section 3.6.
    fn log_predictive(&self, points: &DMatrix<f64>) -> Result<Vec<f64>, ClusterError> {
        let (squares, log_determinant) = self.distances(points)?;
        let p = points.nrows() as f64;
        let freedom = (self.freedom - p + 1.0).max(1.0);
        let wider = self.spread_over * (1.0 + 1.0 / self.points) / freedom;
        let of = student(p, freedom.min(self.tails), wider, log_determinant);
        Ok(squares
            .into_iter()
            .map(|square| self.log_weight + of(square))
            .collect())
    }
}

/// Log density of a Student-t in `p` dimensions over the squared distance in the metric of a matrix with this log
/// determinant, `wider` times which is the scale.
fn student(p: f64, freedom: f64, wider: f64, log_determinant: f64) -> impl Fn(f64) -> f64 {
    let constant = libm::lgamma(0.5 * (freedom + p))
        - libm::lgamma(0.5 * freedom)
        - 0.5 * (p * libm::log(freedom * PI * wider) + log_determinant);
    move |square| constant - 0.5 * (freedom + p) * libm::log1p(square / (wider * freedom))
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

/// Log density of points that the mixture was not fitted to, each together with the component it most likely belongs to.
/// Halves of one kind of movement overlap and gain nothing by it, as they would in the density of the point alone.
///
/// Source: Biernacki, Celeux and Govaert, Assessing a mixture model for clustering with the integrated completed
/// likelihood, 2000; here on points held out instead of with a penalty.
pub(super) fn log_completed(
    mixture: &[Component],
    points: &DMatrix<f64>,
) -> Result<Vec<f64>, ClusterError> {
    let mut joint = DMatrix::zeros(points.ncols(), mixture.len());
    for (mut column, component) in joint.column_iter_mut().zip(mixture) {
        column.copy_from_slice(&component.log_predictive(points)?);
    }
    Ok(joint.row_iter().map(|row| row.max()).collect())
}

/// Log density of each point under the whole mixture, from the joint's rows.
pub(super) fn log_density(joint: &DMatrix<f64>) -> Vec<f64> {
    joint
        .row_iter()
        .map(|row| log_sum_exp(&row.iter().copied().collect::<Vec<_>>()))
        .collect()
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

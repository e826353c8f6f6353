//! A person's stiffness from known loads: how far the hand gave way under forces, at several efforts and places.
//!
//! Six parameters, `l1`, `l2` of eq. 8 and the four `Kbar` of eq. 7, each as its logarithm so that it stays positive:
//!
//! ```text
//! moved_i = deflection(posture_i, c(e_i) Kbar, force_i) + noise_i - noise_g        c(e) = 1 + l1 tanh(l2 e / 2)
//! ```
//!
//! where `noise_g` belongs to the unloaded hold `g` that several loads are compared with; residuals are whitened for it.
//! The noise's variance is found with the parameters. Priors are log-normal and weak: medians of
//! [`ILLUSTRATIVE`](tonus_shared::stiffness::ILLUSTRATIVE), and a factor of two (`Kbar`) or e (`l1`, `l2`) either way for
//! one standard deviation. Damped Gauss-Newton steps (Levenberg 1944) find the most probable parameters; the curvature
//! there gives their covariance (Laplace), and Student's t its quantiles, because the noise is estimated too.

mod solve;

use nalgebra::{SMatrix, SVector, Vector3, Vector4};
use statrs::distribution::{ContinuousCDF, FisherSnedecor, StudentsT};
use tonus_shared::stiffness::{ArmPosture, CoContraction, ILLUSTRATIVE, Segments, deflection};

use super::Estimate;

/// Parameters: `l1`, `l2`, `Kbar` of three shoulder axes and the elbow.
pub const PARAMETERS: usize = 6;
/// Standard deviations of the priors' logarithms: a factor of e, and a factor of two.
const PRIOR_STD: [f64; PARAMETERS] = [1.0, 1.0, LN_2, LN_2, LN_2, LN_2];
const LN_2: f64 = std::f64::consts::LN_2;
/// A parameter whose logarithm is known no better than this share of its prior is the prior's, not the loads'.
const TOLD: f64 = 0.5;
/// A load that fits worse than this probability allows is left out: the hand moved for another reason.
const OUTLIER_PROBABILITY: f64 = 1e-5;
/// Loads that are tried without: an outlier is among those with the largest residuals.
const SUSPECTS: usize = 3;
/// At most one load in so many is left out.
const LEFT_OUT_ONE_IN: usize = 5;

pub(super) type Log = SVector<f64, PARAMETERS>;
type Square = SMatrix<f64, PARAMETERS, PARAMETERS>;

/// One load on the hand.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Load {
    /// The arm without it.
    pub posture: ArmPosture<f64>,
    /// The unloaded hold that `moved_m` is counted from: loads of one group share its error.
    pub group: usize,
    /// The force, shoulder frame, N.
    pub force_n: Vector3<f64>,
    /// Activation under it (eq. 4).
    pub activation: f64,
    /// How far the hand went, m.
    pub moved_m: Vector3<f64>,
}

/// Why loads give no parameters.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum FitError {
    /// Fewer numbers than parameters.
    #[error("{got} loads were measured, at least {least} are needed: measure the others")]
    TooFew {
        /// Loads given.
        got: usize,
        /// Loads needed.
        least: usize,
    },
    /// No parameters explain any of it.
    #[error(
        "no stiffness explains how the hand moved: check forces, body mass and height, and where the shoulder is, then measure again"
    )]
    NoFit,
}

/// The parameters and how sure they are.
#[derive(Debug, Clone, PartialEq)]
pub struct Fit {
    log: Log,
    covariance: Square,
    /// Standard deviation of one hold's place on one axis, m.
    pub residual_m: f64,
    /// Numbers measured beyond the parameters.
    pub freedom: usize,
    /// Loads that did not fit the others and were left out, by their places.
    pub left_out: Vec<usize>,
}

/// Fits the six parameters to the loads.
///
/// # Errors
/// [`FitError`].
pub fn fit(segments: &Segments<f64>, loads: &[Load]) -> Result<Fit, FitError> {
    let least = PARAMETERS / 3 + 2;
    if loads.len() < least {
        return Err(FitError::TooFew {
            got: loads.len(),
            least,
        });
    }
    let mut kept: Vec<usize> = (0..loads.len()).collect();
    let mut left_out = Vec::new();
    loop {
        let chosen: Vec<Load> = kept.iter().map(|at| loads[*at]).collect();
        let found = solve::most_probable(segments, &chosen)?;
        let may = left_out.len() < loads.len() / LEFT_OUT_ONE_IN && kept.len() > least;
        match outlier(segments, &chosen, &found).filter(|_| may) {
            Some(place) => left_out.push(kept.remove(place)),
            None => {
                left_out.sort_unstable();
                return Ok(Fit {
                    log: found.log,
                    covariance: found.covariance,
                    residual_m: found.variance.sqrt(),
                    freedom: 3 * chosen.len() - PARAMETERS,
                    left_out,
                });
            }
        }
    }
}

/// The load without which the rest fits so much better that chance does not explain it (F test of three numbers more).
fn outlier(segments: &Segments<f64>, loads: &[Load], all: &solve::Found) -> Option<usize> {
    let freedom = (3 * loads.len()).checked_sub(3 + PARAMETERS)? as f64;
    let distribution = FisherSnedecor::new(3.0, freedom).ok()?;
    // Bonferroni: the worst of so many.
    let limit = distribution.inverse_cdf(1.0 - OUTLIER_PROBABILITY / loads.len() as f64);
    let whole = all.squares;
    let without = |place: usize| {
        let mut others = loads.to_vec();
        others.remove(place);
        let rest = solve::descend(segments, &others, all.log, all.variance)?;
        let rest = rest.squares;
        (rest > 0.0).then(|| (place, (whole - rest) / 3.0 / (rest / freedom)))
    };
    let worst = (all.worst.iter().take(SUSPECTS).copied())
        .filter_map(without)
        .max_by(|a, b| a.1.total_cmp(&b.1))?;
    // Differences of rounding size are none.
    (worst.1 > limit && whole > 1e-16).then_some(worst.0)
}

impl Fit {
    /// Each parameter with its standard deviation: `l1`, `l2`, `Kbar` in N m/rad.
    #[must_use]
    pub fn estimates(&self) -> [Estimate; PARAMETERS] {
        std::array::from_fn(|at| {
            let value = self.log[at].exp();
            let std = value * self.covariance[(at, at)].sqrt();
            Estimate { value, std }
        })
    }

    /// The interval that holds a parameter with this probability: quantiles of Student's t in its logarithm.
    ///
    /// # Panics
    /// Never: `at` below [`PARAMETERS`] is asked for as an array is.
    #[must_use]
    pub fn interval(&self, at: usize, probability: f64) -> [f64; 2] {
        // At least one degree of freedom: `fit` asks for more loads than that.
        let freedom = self.freedom.max(1) as f64;
        let quantile = StudentsT::new(0.0, 1.0, freedom)
            .map_or(f64::INFINITY, |t| t.inverse_cdf(0.5 + 0.5 * probability));
        let half = quantile * self.covariance[(at, at)].sqrt();
        [(self.log[at] - half).exp(), (self.log[at] + half).exp()]
    }

    /// Whether the loads tell a parameter; otherwise it is mostly its prior.
    #[must_use]
    pub fn told(&self, at: usize) -> bool {
        self.covariance[(at, at)].sqrt() < TOLD * PRIOR_STD[at]
    }
}

/// The priors' medians, logarithms.
fn prior() -> Log {
    let [k0, k1, k2, k3] = ILLUSTRATIVE.rest_stiffness_nm_per_rad;
    Log::from([ILLUSTRATIVE.l1, ILLUSTRATIVE.l2, k0, k1, k2, k3]).map(f64::ln)
}

/// What the parameters expect of a load; none where the arm would fall.
fn expected(segments: &Segments<f64>, load: &Load, log: &Log) -> Option<Vector3<f64>> {
    let value = log.map(f64::exp);
    let curve = CoContraction::new(value[0], value[1]).ok()?;
    let rest = Vector4::new(value[2], value[3], value[4], value[5]);
    let joints = rest * curve.index(load.activation)?;
    deflection(segments, &load.posture, &joints, &load.force_n).ok()
}

#[cfg(test)]
mod tests;

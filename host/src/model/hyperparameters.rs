//! What is decided before learning, and checked before it is used.

use std::collections::BTreeSet;

use tonus_shared::promp::Basis;

use super::Dof;

/// How strongly each skill's covariance `C_q` is drawn towards what the skills share:
/// `C_q <- (1 - a - b) C_q + a k_q C_pool + b D_pool`, inside the subspace of the within-class deviations.
///
/// - `C_pool` is the pooled within-class covariance, and `k_q = tr C_q / tr C_pool` scales it to the skill's own
///   size: how much a skill varies is known from far fewer demonstrations than how it varies.
/// - `D_pool` is the diagonal of `C_pool` **over basis weights**, projected onto the subspace. (In the principal
///   coordinates of the pooled scatter `C_pool` is diagonal already and its diagonal would add nothing.) It is what is
///   left of `C_pool` when no two moments of the movement and no two DoFs are believed to be correlated, it has full
///   rank in the subspace, and it is the same for all skills: the floor under a skill of few demonstrations.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Shrinkage {
    /// `a` and `b` of greatest leave-one-out likelihood.
    LeaveOneOut,
    /// These.
    Fixed {
        /// `a`, from 0.
        pooled: f64,
        /// `b`, from 0; `a + b` at most 1.
        diagonal: f64,
    },
}

/// What a skill expects of a performance it has not seen, beyond the estimated mean and covariance.
#[derive(Clone, Copy, Debug, PartialEq, serde::Serialize, serde::Deserialize)]
#[serde(tag = "kind", rename_all = "snake_case", deny_unknown_fields)]
pub enum Predictive {
    /// The Gaussian of the estimates, as if they were the truth.
    PlugIn,
    /// A Student-t of the same covariance, widened by the uncertainty of a mean of `n` demonstrations (`1 + 1 / n`).
    Fixed {
        /// Its degrees of freedom, above 2; `None` is a Gaussian.
        freedom: Option<f64>,
    },
    /// The same, the degrees of freedom (one number for all skills, or a Gaussian) those of greatest leave-one-out
    /// likelihood, together with the shrinkage where that is chosen.
    LeaveOneOut,
}

/// What is decided before learning. Fields are public; [`Hyperparameters::check`] makes them usable.
#[derive(Clone, Debug, PartialEq)]
pub struct Hyperparameters {
    /// The signals, in the order of a demonstration's values.
    pub dofs: Vec<Dof>,
    /// The basis, the same for every DoF.
    pub basis: Basis,
    /// Penalty on the squared distances of the drawn trajectory from straight lines between the samples, at two phases
    /// for each basis function, against the squared errors summed over the samples; DoFs scaled to unit variance. Above
    /// zero: in a gap, or with fewer samples than basis functions, it alone decides between the weights that
    /// fit, and chooses those that go straight on.
    pub ridge: f64,
    /// Shrinkage of each skill's covariance.
    pub shrinkage: Shrinkage,
    /// What a skill expects of new performances.
    pub predictive: Predictive,
    /// Standard deviation, metres, of where somebody may stand: a constant offset of each position, independent
    /// between them, that the demonstrations do not show. Zero if the new performances are placed like the
    /// demonstrations.
    pub placement_m: f64,
}

impl Hyperparameters {
    /// Ridge 1e-3, shrinkage and degrees of freedom by leave-one-out, no placement.
    #[must_use]
    pub const fn new(dofs: Vec<Dof>, basis: Basis) -> Self {
        Self {
            dofs,
            basis,
            ridge: 1e-3,
            shrinkage: Shrinkage::LeaveOneOut,
            predictive: Predictive::LeaveOneOut,
            placement_m: 0.0,
        }
    }

    /// Checks every field.
    ///
    /// # Errors
    /// No DoF, two of one name, a number outside its range.
    pub fn check(self) -> Result<Valid, HyperparametersError> {
        if self.dofs.is_empty() {
            return Err(HyperparametersError::NoDof);
        }
        let mut seen = BTreeSet::new();
        if let Some(twice) = self.dofs.iter().find(|dof| !seen.insert(&dof.name)) {
            return Err(HyperparametersError::SameName {
                name: twice.name.clone(),
            });
        }
        if !(self.ridge.is_finite() && self.ridge >= MIN_RIDGE) {
            return Err(HyperparametersError::Ridge { ridge: self.ridge });
        }
        if !(self.placement_m.is_finite() && self.placement_m >= 0.0) {
            return Err(HyperparametersError::Placement {
                placement_m: self.placement_m,
            });
        }
        if let Shrinkage::Fixed { pooled, diagonal } = self.shrinkage {
            // Half a unit in the last place of one: 0.7 + 0.3 must do.
            let within =
                pooled >= 0.0 && diagonal >= 0.0 && pooled + diagonal <= 1.0 + f64::EPSILON;
            if !within {
                return Err(HyperparametersError::Shrinkage { pooled, diagonal });
            }
        }
        if let Predictive::Fixed {
            freedom: Some(freedom),
        } = self.predictive
            && !(freedom.is_finite() && freedom > 2.0)
        {
            return Err(HyperparametersError::Freedom { freedom });
        }
        Ok(Valid(self))
    }
}

/// Below this the normal equations of a basis with idle functions are singular in `f64`.
const MIN_RIDGE: f64 = 1e-12;

/// [`Hyperparameters`] that have been checked.
#[derive(Clone, Debug, PartialEq)]
pub struct Valid(Hyperparameters);

impl Valid {
    /// What was checked.
    #[must_use]
    pub const fn get(&self) -> &Hyperparameters {
        &self.0
    }
}

/// Hyperparameters that cannot be used.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum HyperparametersError {
    /// No DoF.
    #[error("a model needs at least one DoF")]
    NoDof,
    /// One name twice.
    #[error("DoF `{name}` is named twice")]
    SameName {
        /// The name.
        name: String,
    },
    /// A ridge that is not a positive number.
    #[error("the ridge is {ridge}: give a finite number of at least {MIN_RIDGE:e}")]
    Ridge {
        /// The ridge.
        ridge: f64,
    },
    /// A placement that is no length.
    #[error("the placement's standard deviation is {placement_m} m: give a finite number from 0")]
    Placement {
        /// The placement.
        placement_m: f64,
    },
    /// Degrees of freedom without a covariance.
    #[error("{freedom} degrees of freedom: give a finite number above 2, or none for a Gaussian")]
    Freedom {
        /// The degrees of freedom.
        freedom: f64,
    },
    /// Shares below zero or above one together.
    #[error("the shrinkage {pooled} + {diagonal} is not two shares from 0 and at most 1 together")]
    Shrinkage {
        /// Share of the pooled covariance.
        pooled: f64,
        /// Share of the diagonal.
        diagonal: f64,
    },
}

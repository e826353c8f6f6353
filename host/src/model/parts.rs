//! The numbers a learnt model consists of, and what they must be to make one.

use std::collections::BTreeMap;

use tonus_shared::promp::{Basis, ModelError};

use super::{Dof, Fitted, Predictive, Shrinkage};

/// How long the demonstrations of a skill took, seconds.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Durations {
    /// Mean.
    pub mean_s: f64,
    /// Standard deviation (of the sample, `n - 1`).
    pub std_s: f64,
    /// Shortest.
    pub min_s: f64,
    /// Longest.
    pub max_s: f64,
}

/// How a model was learnt.
#[derive(Clone, Copy, Debug, PartialEq, Eq, serde::Serialize, serde::Deserialize)]
#[serde(rename_all = "snake_case")]
pub enum Learner {
    /// By least squares of each demonstration: it keeps the fits and can be extended.
    LeastSquares,
    /// By EM over trajectories: it keeps nothing of the demonstrations and must be refitted from all recordings.
    Em,
}

/// What a model consists of, for [`Model::assemble`]. `Q` skills, `D` DoFs, `K` basis functions, rank `r`; matrices
/// row-major, weights DoF-major, in each DoF's unit as it enters the model (the logarithm's for a logarithm).
#[derive(Clone, Debug, PartialEq)]
pub struct Parts {
    /// `D` signals.
    pub dofs: Vec<Dof>,
    /// `K` functions.
    pub basis: Basis,
    /// `Q` names, sorted.
    pub labels: Vec<String>,
    /// `Q` names of the classes that the skills are components of; of an ordinary model, the labels.
    pub classes: Vec<String>,
    /// `Q` numbers of demonstrations; the prior probabilities are their shares.
    pub counts: Vec<u32>,
    /// `Q` durations.
    pub durations: Vec<Durations>,
    /// `D` standard deviations of the data, that the DoFs were scaled by.
    pub scale: Vec<f64>,
    /// `r`.
    pub rank: usize,
    /// `D K x r`, with the scales folded in.
    pub loading: Vec<f64>,
    /// `Q x D K`.
    pub weight_means: Vec<f64>,
    /// `Q x r x r`: square roots of the skills' latent covariances.
    pub roots: Vec<f64>,
    /// `D`: variance that basis and loading leave.
    pub residual_variance: Vec<f64>,
    /// `Q` degrees of freedom of each skill's predictive Student-t, above 2; `None` is a Gaussian.
    pub freedom: Vec<Option<f64>>,
    /// How it was learnt.
    pub learner: Learner,
    /// What is kept of each demonstration, in the order they came; empty if the learner keeps nothing.
    pub demonstrations: Vec<Fitted>,
    /// Ridge it was learnt with.
    pub ridge: f64,
    /// Placement it was learnt with, metres.
    pub placement_m: f64,
    /// How the degrees of freedom were decided on.
    pub predictive: Predictive,
    /// How the shares were decided on.
    pub shrinkage: Shrinkage,
    /// Share `a` of the pooled covariance.
    pub pooled_share: f64,
    /// Share `b` of the diagonal.
    pub diagonal_share: f64,
}

/// Parts that make no model.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PartsError {
    /// A list of the wrong length.
    #[error("{what} has {got} entries where {expected} are needed")]
    Length {
        /// Which list.
        what: &'static str,
        /// Its length by the shape.
        expected: usize,
        /// Its length.
        got: usize,
    },
    /// Labels out of order, or one twice.
    #[error("the labels are not sorted, or `{label}` is there twice")]
    Labels {
        /// The label that does not come after the one before it.
        label: String,
    },
    /// Two DoFs of one name.
    #[error("DoF `{name}` is there twice")]
    Dofs {
        /// The name.
        name: String,
    },
    /// A skill of no demonstrations.
    #[error("skill `{label}` has no demonstrations")]
    NoCount {
        /// The skill.
        label: String,
    },
    /// Stored demonstrations that are not those the skills count.
    #[error("skill `{label}` counts {expected} demonstrations, and {got} are kept")]
    Kept {
        /// The skill.
        label: String,
        /// What it counts.
        expected: usize,
        /// What is kept.
        got: usize,
    },
    /// A stored demonstration of a skill, or of a class, that the model has not.
    #[error("a demonstration of `{label}` is kept, which the model has not")]
    Stray {
        /// Its label.
        label: String,
    },
    /// A number outside its range.
    #[error("{what} is {value}: out of range")]
    Range {
        /// Which number.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// Inference does not take it.
    #[error(transparent)]
    Model(#[from] ModelError),
}

impl Parts {
    /// Checks lengths, names and ranges; the matrices are for inference to check.
    pub(super) fn check(&self) -> Result<(), PartsError> {
        let (skills, dofs) = (self.labels.len(), self.dofs.len());
        same("the counts", skills, self.counts.len())?;
        same("the durations", skills, self.durations.len())?;
        same("the classes", skills, self.classes.len())?;
        same("the degrees of freedom", skills, self.freedom.len())?;
        same("the scales", dofs, self.scale.len())?;
        if let Some(pair) = self.labels.windows(2).find(|pair| pair[0] >= pair[1]) {
            let label = pair[1].clone();
            return Err(PartsError::Labels { label });
        }
        for (index, dof) in self.dofs.iter().enumerate() {
            let mut before = self.dofs[..index].iter();
            if before.any(|other| other.name == dof.name) {
                let name = dof.name.clone();
                return Err(PartsError::Dofs { name });
            }
        }
        if let Some(skill) = self.counts.iter().position(|&count| count == 0) {
            let label = self.labels[skill].clone();
            return Err(PartsError::NoCount { label });
        }
        self.check_ranges()?;
        self.check_kept()
    }

    fn check_ranges(&self) -> Result<(), PartsError> {
        for &scale in &self.scale {
            range("a scale", scale, scale > 0.0)?;
        }
        for d in &self.durations {
            range("a shortest duration", d.min_s, d.min_s > 0.0)?;
            range("a mean duration", d.mean_s, d.mean_s > 0.0)?;
            range("a longest duration", d.max_s, d.max_s >= d.min_s)?;
            range("a duration's deviation", d.std_s, d.std_s >= 0.0)?;
        }
        for &freedom in self.freedom.iter().flatten() {
            range("a number of degrees of freedom", freedom, freedom > 2.0)?;
        }
        range("the ridge", self.ridge, self.ridge > 0.0)?;
        range("the placement", self.placement_m, self.placement_m >= 0.0)?;
        for share in [self.pooled_share, self.diagonal_share] {
            range("a share", share, (0.0..=1.0).contains(&share))?;
        }
        Ok(())
    }

    /// The stored demonstrations are those that the skills count, or there are none.
    fn check_kept(&self) -> Result<(), PartsError> {
        if self.learner == Learner::Em {
            return same("the demonstrations kept", 0, self.demonstrations.len());
        }
        let dofs = self.dofs.len();
        let mut kept: BTreeMap<&str, usize> = BTreeMap::new();
        for one in &self.demonstrations {
            *kept.entry(&one.label).or_default() += 1;
            let width = dofs.saturating_mul(self.basis.count());
            same("the weights of a demonstration", width, one.weights.len())?;
            same("what they leave", dofs, one.residual_squares.len())?;
            same("the means of a demonstration", dofs, one.means.len())?;
            same("the squares of a demonstration", dofs, one.squares.len())?;
            for &value in one.weights.iter().chain(&one.means) {
                range("a number of a demonstration", value, true)?;
            }
            for &value in one.squares.iter().chain(&one.residual_squares) {
                range("a sum of squares", value, value >= 0.0)?;
            }
            let samples = f64::from(one.samples);
            range("a number of samples", samples, one.samples >= 2)?;
            range("a duration", one.duration_s, one.duration_s > 0.0)?;
            let skill = self.labels.iter().position(|label| *label == one.label);
            if skill.is_none_or(|skill| self.classes[skill] != one.class) {
                let label = one.label.clone();
                return Err(PartsError::Stray { label });
            }
        }
        for (label, &count) in self.labels.iter().zip(&self.counts) {
            let (expected, got) = (count as usize, kept.get(label.as_str()).copied());
            let got = got.unwrap_or(0);
            if got != expected {
                let label = label.clone();
                return Err(PartsError::Kept {
                    label,
                    expected,
                    got,
                });
            }
        }
        Ok(())
    }
}

/// A list of the length it should have.
pub(super) const fn same(
    what: &'static str,
    expected: usize,
    got: usize,
) -> Result<(), PartsError> {
    if expected == got {
        Ok(())
    } else {
        Err(PartsError::Length {
            what,
            expected,
            got,
        })
    }
}

fn range(what: &'static str, value: f64, within: bool) -> Result<(), PartsError> {
    if value.is_finite() && within {
        Ok(())
    } else {
        Err(PartsError::Range { what, value })
    }
}

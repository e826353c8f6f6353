//! A learnt model: numbers that have been checked, and the views on them that inference takes.

use tonus_shared::promp::{
    Basis, Latent, Mixture, ModelError, Observation, Order, Row, RowError, Skill, Trajectory,
    mixture_len,
};

use super::{Dof, NotPositive};

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
    /// Ridge it was learnt with.
    pub ridge: f64,
    /// Placement it was learnt with, metres.
    pub placement_m: f64,
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

/// A learnt model, valid as a whole: what [`super::learn()`] gives and a model file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Model(Parts);

impl Model {
    /// Checks every length and number.
    ///
    /// # Errors
    /// What does not fit together, or what inference would refuse.
    pub fn assemble(parts: Parts) -> Result<Self, PartsError> {
        let (skills, dofs) = (parts.labels.len(), parts.dofs.len());
        let same = |what, expected, got| {
            if expected == got {
                Ok(())
            } else {
                Err(PartsError::Length {
                    what,
                    expected,
                    got,
                })
            }
        };
        same("the counts", skills, parts.counts.len())?;
        same("the durations", skills, parts.durations.len())?;
        same("the scales", dofs, parts.scale.len())?;
        if let Some(pair) = parts.labels.windows(2).find(|pair| pair[0] >= pair[1]) {
            let label = pair[1].clone();
            return Err(PartsError::Labels { label });
        }
        for (index, dof) in parts.dofs.iter().enumerate() {
            if parts.dofs[..index]
                .iter()
                .any(|other| other.name == dof.name)
            {
                let name = dof.name.clone();
                return Err(PartsError::Dofs { name });
            }
        }
        if let Some(skill) = parts.counts.iter().position(|&count| count == 0) {
            let label = parts.labels[skill].clone();
            return Err(PartsError::NoCount { label });
        }
        check_ranges(&parts)?;
        let model = Self(parts);
        // Lengths of the matrices, and every number in them.
        let widths = model.widths()?;
        same(
            "the weight means",
            skills.saturating_mul(widths.mean),
            model.0.weight_means.len(),
        )?;
        same(
            "the roots",
            skills.saturating_mul(widths.root),
            model.0.roots.len(),
        )?;
        model.view()?.mixture()?;
        Ok(model)
    }

    /// What it consists of.
    #[must_use]
    pub const fn parts(&self) -> &Parts {
        &self.0
    }

    /// The signals.
    #[must_use]
    pub fn dofs(&self) -> &[Dof] {
        &self.0.dofs
    }

    /// Names of the skills, sorted; every index of a skill is into these.
    #[must_use]
    pub fn labels(&self) -> &[String] {
        &self.0.labels
    }

    /// How long the demonstrations of each skill took.
    #[must_use]
    pub fn durations(&self) -> &[Durations] {
        &self.0.durations
    }

    /// Index of a signal by its name.
    #[must_use]
    pub fn dof(&self, name: &str) -> Option<usize> {
        self.0.dofs.iter().position(|dof| dof.name == name)
    }

    /// Index of a skill by its name.
    #[must_use]
    pub fn skill(&self, label: &str) -> Option<usize> {
        self.0.labels.iter().position(|name| name == label)
    }

    /// A position observed at a phase: `value` and the `std` of its noise in the unit of the signal number `dof`.
    /// `None` for a signal that is none.
    ///
    /// # Errors
    /// A value without a logarithm.
    pub fn observation(
        &self,
        dof: usize,
        phase: f64,
        value: f64,
        std: f64,
    ) -> Option<Result<Observation<f64>, NotPositive>> {
        let signal = self.0.dofs.get(dof)?;
        let encoded = signal.encode(value);
        Some(encoded.and_then(|encoded| {
            Ok(Observation {
                row: Row {
                    dof,
                    order: Order::Position,
                    phase,
                },
                value: encoded,
                variance: signal.encode_variance(value, std)?,
            })
        }))
    }

    /// Mean and standard deviation, in the DoF's unit, that a trajectory of this model has at a phase. `scratch` is
    /// [`trajectory_scratch_len`](tonus_shared::promp::trajectory_scratch_len) long.
    ///
    /// # Errors
    /// A DoF that there is not, a phase that is not finite, scratch too short.
    pub fn expected(
        &self,
        trajectory: &Trajectory<'_, f64>,
        dof: usize,
        phase: f64,
        scratch: &mut [f64],
    ) -> Result<(f64, f64), RowError> {
        let dofs = self.0.dofs.len();
        let signal = (self.0.dofs.get(dof)).ok_or(RowError::Dof { dof, dofs })?;
        let moments = trajectory.moments(&Row::position(dof, phase), scratch)?;
        Ok(signal.decode(moments.mean, moments.variance))
    }

    /// The latent space and the skills, as inference takes them.
    ///
    /// # Errors
    /// None for a model that was assembled; the kernels check again what they borrow.
    pub fn view(&self) -> Result<View<'_>, ModelError> {
        let parts = &self.0;
        let latent = Latent::new(parts.basis, parts.dofs.len(), parts.rank, &parts.loading)?;
        let widths = self.widths()?;
        let means = parts.weight_means.chunks_exact(widths.mean);
        let roots = parts.roots.chunks_exact(widths.root);
        let total: f64 = parts.counts.iter().map(|&count| f64::from(count)).sum();
        let skills = means.zip(roots).zip(&parts.counts);
        let skills = skills.map(|((mean, root), &count)| {
            let log_prior = libm::log(f64::from(count) / total);
            Skill::new(
                &latent,
                mean,
                Some(root),
                &parts.residual_variance,
                log_prior,
            )
        });
        let skills = skills.collect::<Result<Vec<_>, _>>()?;
        Ok(View { latent, skills })
    }

    /// Lengths of one skill's mean and root.
    fn widths(&self) -> Result<Widths, ModelError> {
        let (dofs, basis, rank) = (self.0.dofs.len(), self.0.basis.count(), self.0.rank);
        let too_large = ModelError::TooLarge { dofs, basis, rank };
        let (Some(mean), Some(root)) = (dofs.checked_mul(basis), rank.checked_mul(rank)) else {
            return Err(too_large);
        };
        if mean == 0 || root == 0 {
            return Err(ModelError::Empty {
                what: "DoF and latent dimension",
            });
        }
        Ok(Widths { mean, root })
    }
}

struct Widths {
    mean: usize,
    root: usize,
}

fn check_ranges(parts: &Parts) -> Result<(), PartsError> {
    let check = |what, value: f64, within: bool| {
        if value.is_finite() && within {
            Ok(())
        } else {
            Err(PartsError::Range { what, value })
        }
    };
    for &scale in &parts.scale {
        check("a scale", scale, scale > 0.0)?;
    }
    for d in &parts.durations {
        check("a shortest duration", d.min_s, d.min_s > 0.0)?;
        check("a mean duration", d.mean_s, d.mean_s > 0.0)?;
        check("a longest duration", d.max_s, d.max_s >= d.min_s)?;
        check("a duration's deviation", d.std_s, d.std_s >= 0.0)?;
    }
    check("the ridge", parts.ridge, parts.ridge > 0.0)?;
    check("the placement", parts.placement_m, parts.placement_m >= 0.0)?;
    for share in [parts.pooled_share, parts.diagonal_share] {
        check("a share", share, (0.0..=1.0).contains(&share))?;
    }
    Ok(())
}

/// A model as inference takes it.
#[derive(Clone, Debug)]
pub struct View<'m> {
    /// The latent space that all skills share.
    pub latent: Latent<'m, f64>,
    /// The skills, in the order of [`Model::labels`].
    pub skills: Vec<Skill<'m, f64>>,
}

impl View<'_> {
    /// All skills at their priors, ready to observe.
    ///
    /// # Errors
    /// A model without skills.
    pub fn mixture(&self) -> Result<Mixture<'_, f64, Vec<f64>>, ModelError> {
        let (basis, rank) = (self.latent.basis().count(), self.latent.rank());
        let storage = vec![0.0; mixture_len(self.skills.len(), basis, rank)];
        Mixture::new(self.latent, &self.skills, storage)
    }
}

//! A learnt model: numbers that have been checked, and the views on them that inference takes.

use std::collections::BTreeSet;

use tonus_shared::promp::{
    Latent, Mixture, ModelError, Observation, Order, Row, RowError, Skill, Trajectory, directions,
    mixture_len, own_loading, root_len, triangular_root,
};

use super::parts::same;
use super::{Dof, Durations, Hyperparameters, NotPositive, Parts, PartsError};

/// A learnt model, valid as a whole: what [`super::learn()`] gives and a model file holds.
#[derive(Clone, Debug, PartialEq)]
pub struct Model {
    parts: Parts,
    /// `Q x r (r + 1) / 2`: the roots as inference takes them.
    triangles: Vec<f64>,
    /// Of each skill that varies in few directions, its loading of them.
    loadings: Vec<Option<Directions>>,
}

/// The directions of one skill.
#[derive(Clone, Debug, PartialEq)]
struct Directions {
    count: usize,
    /// `D K x count`.
    loading: Vec<f64>,
}

/// A skill is kept in its own directions where these are at most so many parts, numerator and denominator, of the latent
/// dimensions: up to there its smaller updates save more than rows of its own cost.
const FEW: (usize, usize) = (4, 5);

impl Model {
    /// Checks every length and number.
    ///
    /// # Errors
    /// What does not fit together, or what inference would refuse.
    pub fn assemble(parts: Parts) -> Result<Self, PartsError> {
        parts.check()?;
        let skills = parts.labels.len();
        let mut model = Self {
            parts,
            triangles: Vec::new(),
            loadings: Vec::new(),
        };
        // Lengths of the matrices, and every number in them.
        let widths = model.widths()?;
        let of_skills = |width: usize| skills.saturating_mul(width);
        let means = model.parts.weight_means.len();
        same("the weight means", of_skills(widths.mean), means)?;
        let roots = model.parts.roots.len();
        same("the roots", of_skills(widths.root), roots)?;
        model.triangles = triangles(&model.parts, &widths)?;
        model.loadings = loadings(&model.parts, &model.triangles)?;
        model.view()?.mixture()?;
        Ok(model)
    }

    /// What it consists of.
    #[must_use]
    pub const fn parts(&self) -> &Parts {
        &self.parts
    }

    /// The signals.
    #[must_use]
    pub fn dofs(&self) -> &[Dof] {
        &self.parts.dofs
    }

    /// Names of the skills, sorted; every index of a skill is into these.
    #[must_use]
    pub fn labels(&self) -> &[String] {
        &self.parts.labels
    }

    /// Names of the classes, sorted, each once; every index of a class is into these.
    #[must_use]
    pub fn classes(&self) -> Vec<&str> {
        let all: BTreeSet<&str> = self.parts.classes.iter().map(String::as_str).collect();
        all.into_iter().collect()
    }

    /// Index of the class that a skill is a component of; `None` for a skill that is none.
    #[must_use]
    pub fn class_of(&self, skill: usize) -> Option<usize> {
        let class = self.parts.classes.get(skill)?;
        self.classes().iter().position(|name| name == class)
    }

    /// Log posterior of each class from that of each skill: the sum over the class's components, in the log domain.
    #[must_use]
    pub fn class_log_posterior(&self, skills: &[f64]) -> Vec<f64> {
        let of_class = |class: &str| {
            let members = self.parts.classes.iter().zip(skills);
            let members = members.filter(|(name, _)| *name == class);
            let logs: Vec<f64> = members.map(|(_, log)| *log).collect();
            log_sum_exp(&logs)
        };
        self.classes().into_iter().map(of_class).collect()
    }

    /// What was decided before it was learnt.
    #[must_use]
    pub fn hyperparameters(&self) -> Hyperparameters {
        Hyperparameters {
            ridge: self.parts.ridge,
            shrinkage: self.parts.shrinkage,
            predictive: self.parts.predictive,
            placement_m: self.parts.placement_m,
            ..Hyperparameters::new(self.parts.dofs.clone(), self.parts.basis)
        }
    }

    /// How long the demonstrations of each skill took.
    #[must_use]
    pub fn durations(&self) -> &[Durations] {
        &self.parts.durations
    }

    /// Index of a signal by its name.
    #[must_use]
    pub fn dof(&self, name: &str) -> Option<usize> {
        self.parts.dofs.iter().position(|dof| dof.name == name)
    }

    /// Index of a skill by its name.
    #[must_use]
    pub fn skill(&self, label: &str) -> Option<usize> {
        self.parts.labels.iter().position(|name| name == label)
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
        let signal = self.parts.dofs.get(dof)?;
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
        let dofs = self.parts.dofs.len();
        let signal = (self.parts.dofs.get(dof)).ok_or(RowError::Dof { dof, dofs })?;
        let moments = trajectory.moments(&Row::position(dof, phase), scratch)?;
        Ok(signal.decode(moments.mean, moments.variance))
    }

    /// The latent space and the skills, as inference takes them.
    ///
    /// # Errors
    /// None for a model that was assembled; the kernels check again what they borrow.
    pub fn view(&self) -> Result<View<'_>, ModelError> {
        let parts = &self.parts;
        let latent = Latent::new(parts.basis, parts.dofs.len(), parts.rank, &parts.loading)?;
        let widths = self.widths()?;
        let means = parts.weight_means.chunks_exact(widths.mean);
        let roots = self.triangles.chunks_exact(root_len(parts.rank));
        let total: f64 = parts.counts.iter().map(|&count| f64::from(count)).sum();
        let numbers = parts.counts.iter().zip(&parts.freedom).zip(&self.loadings);
        let skills = means.zip(roots).zip(numbers);
        let skills = skills.map(|((mean, root), ((&count, &freedom), own))| {
            let log_prior = libm::log(f64::from(count) / total);
            let residual = &parts.residual_variance;
            let mut skill = Skill::new(&latent, mean, Some(root), residual, log_prior)?;
            if let Some(own) = own {
                skill = skill.with_loading(&latent, own.count, &own.loading)?;
            }
            match freedom {
                Some(freedom) => skill.with_freedom(freedom),
                None => Ok(skill),
            }
        });
        let skills = skills.collect::<Result<Vec<_>, _>>()?;
        Ok(View { latent, skills })
    }

    /// Lengths of one skill's mean and root.
    fn widths(&self) -> Result<Widths, ModelError> {
        let (dofs, basis, rank) = (
            self.parts.dofs.len(),
            self.parts.basis.count(),
            self.parts.rank,
        );
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

/// `log sum exp` without overflow; minus infinity of none.
pub(super) fn log_sum_exp(logs: &[f64]) -> f64 {
    let most = logs.iter().copied().fold(f64::NEG_INFINITY, f64::max);
    if most.is_infinite() {
        return most;
    }
    let rest: f64 = logs.iter().map(|log| libm::exp(log - most)).sum();
    most + libm::log(rest)
}

/// Every skill's root as a packed triangle.
fn triangles(parts: &Parts, widths: &Widths) -> Result<Vec<f64>, ModelError> {
    let mut roots = parts.roots.clone();
    let packed = root_len(parts.rank);
    let mut triangles = vec![0.0; parts.labels.len() * packed];
    let each = triangles.chunks_exact_mut(packed);
    for (root, triangle) in roots.chunks_exact_mut(widths.root).zip(each) {
        triangular_root(parts.rank, root, triangle)?;
    }
    Ok(triangles)
}

/// The own loading of every skill that varies in few directions.
fn loadings(parts: &Parts, triangles: &[f64]) -> Result<Vec<Option<Directions>>, ModelError> {
    let latent = Latent::new(parts.basis, parts.dofs.len(), parts.rank, &parts.loading)?;
    let each = triangles.chunks_exact(root_len(parts.rank)).map(|root| {
        let count = directions(root, parts.rank);
        if count == 0 || FEW.1 * count > FEW.0 * parts.rank {
            return Ok(None);
        }
        let mut loading = vec![0.0; latent.weights() * count];
        own_loading(&latent, root, count, &mut loading)?;
        Ok(Some(Directions { count, loading }))
    });
    each.collect()
}

struct Widths {
    mean: usize,
    root: usize,
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

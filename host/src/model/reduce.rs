//! A model of fewer DoFs and lower rank, in `f64`: what is exported for the chip, before it is rounded to `f32`.
//!
//! The subspace kept is the one in which the drawn trajectories of all skills together vary most, each DoF in units of
//! its scale: the left singular vectors of `[sqrt(p_q) Psi L S_q]` over all skills, with `Psi` the basis at even phases.
//! What is cut off goes to the noise of each skill's DoFs. It is no white noise: `n` observations of a movement see
//! `n_eff = (tr G)^2 / tr G^2` independent values of it, `G` their covariance, so that its mean variance goes there
//! `n / n_eff`-fold (a smooth residual of few directions would otherwise be averaged away by many observations).

use nalgebra::{DMatrix, DVector};
use tonus_shared::promp::{Basis, Latent, ModelError, RowError, Skill};

use super::weights::design;
use super::{Model, View};

/// Phases for each basis function at which trajectories are compared.
const PHASES_PER_FUNCTION: usize = 3;
/// Directions with less than this share of the first one's deviation are rounding.
const RANK_TOLERANCE: f64 = 1e-9;
/// Residuals with less than this share of a DoF's variance are rounding.
const NO_RESIDUAL: f64 = 1e-18;

/// Why a model cannot be made smaller so.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ReduceError {
    /// A DoF that the model has not, or one twice.
    #[error("DoF number {dof} is asked for twice, or the model ({dofs} DoFs) has none such")]
    Dof {
        /// The number, from 0.
        dof: usize,
        /// How many the model has.
        dofs: usize,
    },
    /// Nothing asked for.
    #[error("{what} is 0: ask for at least one")]
    Nothing {
        /// What.
        what: &'static str,
    },
    /// A factorisation that failed.
    #[error("the singular values of the trajectories could not be found")]
    Factorisation,
    /// A basis that inference refuses.
    #[error(transparent)]
    Row(#[from] RowError),
    /// Numbers that inference refuses.
    #[error(transparent)]
    Model(#[from] ModelError),
}

/// One skill over the smaller space.
#[derive(Clone, Debug, PartialEq)]
struct ReducedSkill {
    weight_mean: Vec<f64>,
    /// Packed triangle.
    root: Vec<f64>,
    residual_variance: Vec<f64>,
    log_prior: f64,
    freedom: Option<f64>,
}

/// A model of some DoFs of another, at a lower rank.
#[derive(Clone, Debug, PartialEq)]
pub struct Reduced {
    dofs: Vec<usize>,
    basis: Basis,
    rank: usize,
    loading: Vec<f64>,
    skills: Vec<ReducedSkill>,
    kept: f64,
}

impl Reduced {
    /// `model` with these of its DoFs in this order, at `rank` or the rank that is left if that is less. A movement is
    /// going to be observed at `instants` instants. With every DoF and direction it is the same distribution.
    ///
    /// # Errors
    /// [`ReduceError`].
    pub fn of(
        model: &Model,
        dofs: &[usize],
        rank: usize,
        instants: usize,
    ) -> Result<Self, ReduceError> {
        for (what, count) in [("DoFs", dofs.len()), ("rank", rank), ("instants", instants)] {
            if count == 0 {
                return Err(ReduceError::Nothing { what });
            }
        }
        let all = model.dofs().len();
        for (index, &dof) in dofs.iter().enumerate() {
            if dof >= all || dofs[..index].contains(&dof) {
                return Err(ReduceError::Dof { dof, dofs: all });
            }
        }
        let full = Full::new(model, dofs);
        let space = Space::of(&full, rank)?;
        let seen = design(&full.basis, even(instants))?;
        let view = model.view()?;
        let skills = view.skills.iter().zip(&full.roots);
        let skills = skills.map(|(skill, root)| full.skill(&space, &seen, skill, root));
        Ok(Self {
            dofs: dofs.to_vec(),
            basis: full.basis,
            rank: space.weights.ncols(),
            loading: full.raw(&space.weights),
            skills: skills.collect(),
            kept: space.kept,
        })
    }

    /// Which DoFs of the model it has.
    #[must_use]
    pub fn dofs(&self) -> &[usize] {
        &self.dofs
    }

    /// Share of the trajectories' variance within the skills that the directions kept explain; DoFs in units of
    /// their scale.
    #[must_use]
    pub const fn kept(&self) -> f64 {
        self.kept
    }

    /// As inference takes it.
    ///
    /// # Errors
    /// None for what was reduced; the kernels check again what they borrow.
    pub fn view(&self) -> Result<View<'_>, ModelError> {
        let latent = Latent::new(self.basis, self.dofs.len(), self.rank, &self.loading)?;
        let mut skills = Vec::with_capacity(self.skills.len());
        for one in &self.skills {
            let (root, residual) = (Some(one.root.as_slice()), &one.residual_variance);
            let skill = Skill::new(&latent, &one.weight_mean, root, residual, one.log_prior)?;
            skills.push(match one.freedom {
                Some(freedom) => skill.with_freedom(freedom)?,
                None => skill,
            });
        }
        Ok(View { latent, skills })
    }
}

/// The DoFs asked for, at full rank; loadings in units of the DoFs' scales.
struct Full {
    basis: Basis,
    dofs: Vec<usize>,
    scale: Vec<f64>,
    /// `D K x r0`.
    loading: DMatrix<f64>,
    /// `r0 x r0` of each skill.
    roots: Vec<DMatrix<f64>>,
    shares: Vec<f64>,
}

impl Full {
    fn new(model: &Model, dofs: &[usize]) -> Self {
        let parts = model.parts();
        let (count, rank) = (parts.basis.count(), parts.rank);
        let scale: Vec<f64> = dofs.iter().map(|&dof| parts.scale[dof]).collect();
        let loading = DMatrix::from_fn(dofs.len() * count, rank, |row, column| {
            let (dof, function) = (row / count, row % count);
            parts.loading[(dofs[dof] * count + function) * rank + column] / scale[dof]
        });
        let roots = parts.roots.chunks_exact(rank * rank);
        let total: f64 = parts.counts.iter().map(|&n| f64::from(n)).sum();
        Self {
            basis: parts.basis,
            dofs: dofs.to_vec(),
            scale,
            loading,
            roots: roots
                .map(|root| DMatrix::from_row_slice(rank, rank, root))
                .collect(),
            shares: parts.counts.iter().map(|&n| f64::from(n) / total).collect(),
        }
    }

    fn count(&self) -> usize {
        self.basis.count()
    }

    /// `Psi` times something with a row for each weight, DoF by DoF.
    fn drawn(&self, psi: &DMatrix<f64>, weights: &DMatrix<f64>) -> DMatrix<f64> {
        let samples = psi.nrows();
        let mut out = DMatrix::zeros(samples * self.dofs.len(), weights.ncols());
        for dof in 0..self.dofs.len() {
            let block = psi * weights.rows(dof * self.count(), self.count());
            out.rows_mut(dof * samples, samples).copy_from(&block);
        }
        out
    }

    /// Row-major, in the DoFs' units.
    fn raw(&self, weights: &DMatrix<f64>) -> Vec<f64> {
        let rows = weights.row_iter().enumerate();
        let raw = rows.flat_map(|(row, line)| {
            let scale = self.scale[row / self.count()];
            line.iter().map(|v| v * scale).collect::<Vec<_>>()
        });
        raw.collect()
    }

    fn skill(
        &self,
        space: &Space,
        seen: &DMatrix<f64>,
        skill: &Skill<'_, f64>,
        root: &DMatrix<f64>,
    ) -> ReducedSkill {
        let inside = &space.coordinates * root;
        let outside = &self.loading * root - &space.weights * &inside;
        let count = self.count();
        let of_dof = |(place, &dof): (usize, &usize)| {
            let residual = seen * outside.rows(place * count, count);
            let scale = self.scale[place];
            skill.residual_variance()[dof] + scale * scale * returned(&residual)
        };
        let mean = skill.weight_mean();
        let means = self.dofs.iter();
        ReducedSkill {
            weight_mean: means
                .flat_map(|dof| mean[dof * count..(dof + 1) * count].to_vec())
                .collect(),
            root: packed(&inside),
            residual_variance: self.dofs.iter().enumerate().map(of_dof).collect(),
            log_prior: skill.log_prior(),
            freedom: skill.freedom(),
        }
    }
}

/// The directions kept.
struct Space {
    /// `D K x r`: weights that draw each of them.
    weights: DMatrix<f64>,
    /// `r x r0`: where a latent of the full model lies along them.
    coordinates: DMatrix<f64>,
    kept: f64,
}

impl Space {
    fn of(full: &Full, rank: usize) -> Result<Self, ReduceError> {
        let psi = design(&full.basis, even(PHASES_PER_FUNCTION * full.count()))?;
        let latent = full.loading.ncols();
        let mut stacked = DMatrix::zeros(latent, latent * full.roots.len());
        for (skill, (root, share)) in full.roots.iter().zip(&full.shares).enumerate() {
            let columns = root * share.sqrt();
            stacked
                .columns_mut(skill * latent, latent)
                .copy_from(&columns);
        }
        let drawn = full.drawn(&psi, &full.loading);
        let factor = (&drawn * &stacked).svd(true, true);
        let (Some(u), Some(v_t)) = (&factor.u, &factor.v_t) else {
            return Err(ReduceError::Factorisation);
        };
        // Largest first.
        let sizes = &factor.singular_values;
        let above = sizes
            .iter()
            .filter(|size| **size > RANK_TOLERANCE * sizes[0]);
        let rank = rank.min(above.count()).min(latent);
        if rank == 0 {
            return Err(ReduceError::Nothing {
                what: "the variance of these DoFs",
            });
        }
        let inverse = DVector::from_iterator(rank, sizes.iter().take(rank).map(|size| 1.0 / size));
        let back = v_t.rows(0, rank).transpose() * DMatrix::from_diagonal(&inverse);
        let square = |count: usize| -> f64 { sizes.iter().take(count).map(|s| s * s).sum() };
        Ok(Self {
            weights: &full.loading * (&stacked * back),
            coordinates: u.columns(0, rank).tr_mul(&drawn),
            kept: square(rank) / square(sizes.len()),
        })
    }
}

/// Mean variance of what the rows of a residual's root show, times how many observations share one value of it.
fn returned(residual: &DMatrix<f64>) -> f64 {
    let trace = residual.norm_squared();
    let count = residual.nrows() as f64;
    if trace <= NO_RESIDUAL * count {
        return 0.0;
    }
    // tr G^2 of G = A A^T is the squared norm of A^T A.
    let square = residual.tr_mul(residual).norm_squared();
    let independent = trace * trace / square;
    (trace / count) * (count / independent)
}

/// Lower triangle of the same covariance, by columns: `M = (Q R)^T = R^T Q^T`.
fn packed(root: &DMatrix<f64>) -> Vec<f64> {
    let upper = root.transpose().qr().r();
    let rank = upper.ncols();
    let column = |column: usize| (column..rank).map(move |row| (column, row));
    (0..rank)
        .flat_map(column)
        .map(|(column, row)| upper[(column, row)])
        .collect()
}

/// `count` phases from 0 to 1.
fn even(count: usize) -> impl Iterator<Item = f64> {
    let last = count.saturating_sub(1).max(1) as f64;
    (0..count).map(move |i| i as f64 / last)
}

//! Weights of every demonstration by least squares, completed where it says nothing.

use nalgebra::{Cholesky, DMatrix, DVector};

use crate::demonstration::Demonstration;
use crate::model::fits::{Groups, Member, check_dofs, encode, moments, scale_of};
use crate::model::weights::design;
use crate::model::{Hyperparameters, LearnError};

/// Phases and gaps that some demonstrations share.
pub(super) struct Design {
    phases: Vec<f64>,
    /// One where a value was recorded, else zero: `T x D`.
    recorded: DMatrix<f64>,
    /// `T x K`.
    pub(super) basis: DMatrix<f64>,
    /// `P_d^T P_d` over what was recorded of each DoF, each different one once.
    normals: Vec<DMatrix<f64>>,
    /// Which of them is that of a DoF.
    normal_of: Vec<usize>,
    /// Values recorded of each DoF.
    pub(super) counts: Vec<usize>,
}

impl Design {
    fn new(
        phases: Vec<f64>,
        recorded: DMatrix<f64>,
        given: &Hyperparameters,
    ) -> Result<Self, LearnError> {
        let basis = design(&given.basis, phases.iter().copied())?;
        let mut normals = Vec::new();
        let mut normal_of: Vec<usize> = Vec::new();
        for (dof, mask) in recorded.column_iter().enumerate() {
            let before = (0..dof).find(|&other| recorded.column(other) == mask);
            let known = before.map(|other| normal_of[other]);
            normal_of.push(known.unwrap_or(normals.len()));
            if known.is_none() {
                let mut kept = basis.clone();
                for (mut row, one) in kept.row_iter_mut().zip(mask.iter()) {
                    row *= *one;
                }
                normals.push(kept.transpose() * &kept);
            }
        }
        let counts = recorded.column_iter().map(|mask| mask.sum() as usize);
        Ok(Self {
            counts: counts.collect(),
            phases,
            recorded,
            basis,
            normals,
            normal_of,
        })
    }

    /// `P_d^T P_d`.
    pub(super) fn normal(&self, dof: usize) -> &DMatrix<f64> {
        &self.normals[self.normal_of[dof]]
    }

    /// What these weights (`K x D`) leave of the values recorded, zero where none was.
    pub(super) fn left(&self, series: &DMatrix<f64>, weights: &DMatrix<f64>) -> DMatrix<f64> {
        (series - &self.basis * weights).component_mul(&self.recorded)
    }
}

/// The demonstrations as EM takes them, every DoF in units of its scale.
pub(super) struct Completed {
    pub(super) groups: Groups,
    pub(super) scale: Vec<f64>,
    pub(super) designs: Vec<Design>,
    /// Design of each demonstration.
    pub(super) design: Vec<usize>,
    /// Values of each demonstration, `T x D`, zero where none was recorded.
    pub(super) series: Vec<DMatrix<f64>>,
    /// Weights of each demonstration, `D K`.
    pub(super) weights: Vec<DVector<f64>>,
}

impl Completed {
    pub(super) fn of(
        demonstrations: &[Demonstration],
        given: &Hyperparameters,
    ) -> Result<Self, LearnError> {
        let mut designs: Vec<Design> = Vec::new();
        let mut design = Vec::with_capacity(demonstrations.len());
        let mut series = Vec::with_capacity(demonstrations.len());
        for demonstration in demonstrations {
            check_dofs(demonstration, &given.dofs)?;
            let values = encode(demonstration, &given.dofs)?;
            let recorded = recorded(demonstration);
            let phases: Vec<f64> = demonstration.phases().collect();
            let same = |known: &Design| known.phases == phases && known.recorded == recorded;
            design.push(designs.iter().position(same).unwrap_or(designs.len()));
            if design.last() == Some(&designs.len()) {
                designs.push(Design::new(phases, recorded, given)?);
            }
            series.push(values);
        }
        let members: Vec<_> = demonstrations.iter().map(Member::of).collect();
        let groups = Groups::of(&members)?;
        let mut scale = Vec::with_capacity(given.dofs.len());
        for (dof, signal) in given.dofs.iter().enumerate() {
            let of_dof = series.iter().zip(&design).flat_map(|(values, &design)| {
                let recorded = designs[design].recorded.column(dof);
                let pairs = values.column(dof).into_iter().zip(recorded);
                pairs
                    .filter(|(_, one)| **one > 0.0)
                    .map(|(value, _)| *value)
                    .collect::<Vec<_>>()
            });
            let of_dof: Vec<f64> = of_dof.collect();
            // A DoF that is nowhere is named with its skill, below.
            let (mean, squares) = moments(of_dof.iter());
            let count = of_dof.len() as f64;
            scale.push(if of_dof.is_empty() {
                1.0
            } else {
                scale_of(mean, squares / count, signal)?
            });
        }
        for values in &mut series {
            for (mut column, scale) in values.column_iter_mut().zip(&scale) {
                column /= *scale;
            }
        }
        let mut completed = Self {
            groups,
            scale,
            designs,
            design,
            series,
            weights: Vec::new(),
        };
        completed.weights = completed.complete(given)?;
        Ok(completed)
    }

    /// Ridge least squares towards the skill's mean, itself a ridge least squares fit to all of its samples: where a
    /// demonstration says nothing, the mean stands.
    fn complete(&self, given: &Hyperparameters) -> Result<Vec<DVector<f64>>, LearnError> {
        let (dofs, functions) = (given.dofs.len(), given.basis.count());
        let factor = |mut normal: DMatrix<f64>| {
            for k in 0..functions {
                normal[(k, k)] += given.ridge;
            }
            Cholesky::new(normal).ok_or(LearnError::Numerical("least squares fit of the weights"))
        };
        let mut means = Vec::with_capacity(self.groups.labels.len());
        for (skill, label) in self.groups.labels.iter().enumerate() {
            let mut mean = DMatrix::zeros(functions, dofs);
            let mut normals = vec![DMatrix::zeros(functions, functions); dofs];
            let mut seen = vec![0; dofs];
            for (n, values) in self.of_skill(skill) {
                let design = &self.designs[self.design[n]];
                mean += design.basis.transpose() * values;
                for dof in 0..dofs {
                    normals[dof] += design.normal(dof);
                    seen[dof] += design.counts[dof];
                }
            }
            if let Some(dof) = seen.iter().position(|&count| count == 0) {
                let (label, dof) = (label.clone(), given.dofs[dof].name.clone());
                return Err(LearnError::NeverSeen { label, dof });
            }
            for (mut column, normal) in mean.column_iter_mut().zip(normals) {
                factor(normal)?.solve_mut(&mut column);
            }
            means.push(mean);
        }
        let factors = self.designs.iter().map(|design| {
            let of_dofs = design.normals.iter().map(|normal| factor(normal.clone()));
            of_dofs.collect::<Result<Vec<_>, _>>()
        });
        let factors = factors.collect::<Result<Vec<_>, _>>()?;
        let complete = |(n, values): (usize, &DMatrix<f64>)| {
            let (at, mean) = (self.design[n], &means[self.groups.skill[n]]);
            let design = &self.designs[at];
            let mut weights = design.basis.transpose() * design.left(values, mean);
            for (dof, mut column) in weights.column_iter_mut().enumerate() {
                factors[at][design.normal_of[dof]].solve_mut(&mut column);
            }
            DVector::from_column_slice((weights + mean).as_slice())
        };
        Ok(self.series.iter().enumerate().map(complete).collect())
    }

    fn of_skill(&self, skill: usize) -> impl Iterator<Item = (usize, &DMatrix<f64>)> {
        let all = self.series.iter().enumerate();
        all.filter(move |(n, _)| self.groups.skill[*n] == skill)
    }
}

/// One where a value was recorded, else zero: `T x D`.
fn recorded(demonstration: &Demonstration) -> DMatrix<f64> {
    let (samples, dofs) = (demonstration.t_s().len(), demonstration.values().len());
    DMatrix::from_fn(samples, dofs, |sample, dof| {
        let present = demonstration.present(dof);
        f64::from(u8::from(present.is_none_or(|present| present[sample])))
    })
}

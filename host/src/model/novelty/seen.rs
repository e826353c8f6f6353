//! Demonstrations as a gate sees them: numbers at its instants.

use std::collections::BTreeMap;

use nalgebra::DMatrix;

use super::{GateConfig, GateError, no_dof};
use crate::demonstration::Demonstration;
use crate::model::first_part::FirstPart;
use crate::model::{Dof, Valid};

/// Leaving one out must leave a spread.
const LEAST_PER_CLASS: usize = 3;

/// All demonstrations at the gate's instants.
pub(super) struct Seen {
    pub(super) dofs: Vec<(usize, Dof)>,
    pub(super) phases: Vec<f64>,
    /// Standard deviation of each DoF over all demonstrations and instants, as it enters the model.
    pub(super) scale: Vec<f64>,
    pub(super) classes: Vec<String>,
    /// `N x J`, scaled.
    pub(super) rows: DMatrix<f64>,
    /// Class of each demonstration.
    pub(super) class: Vec<usize>,
    /// What is left out with each demonstration.
    pub(super) group: Vec<usize>,
}

impl Seen {
    pub(super) fn of(
        demonstrations: &[Demonstration],
        valid: &Valid,
        config: &GateConfig,
    ) -> Result<Self, GateError> {
        let all = &valid.get().dofs;
        config.check(all.len())?;
        let dofs: Vec<_> = config.dofs.iter().map(|&d| (d, all[d].clone())).collect();
        let phases = config.phases();
        let mut classes = BTreeMap::<&str, usize>::new();
        for demonstration in demonstrations {
            *classes.entry(demonstration.class()).or_default() += 1;
        }
        if let Some((class, &found)) = classes.iter().find(|(_, n)| **n < LEAST_PER_CLASS) {
            return Err(GateError::TooFew {
                class: (*class).to_owned(),
                found,
                needed: LEAST_PER_CLASS,
            });
        }
        let names: Vec<&str> = classes.into_keys().collect();
        let index = |name: &str| names.iter().position(|n| *n == name).unwrap_or_default();
        let class: Vec<usize> = demonstrations.iter().map(|d| index(d.class())).collect();
        let mut values = Vec::with_capacity(demonstrations.len() * phases.len() * dofs.len());
        for demonstration in demonstrations {
            let part = FirstPart::of(demonstration, config.fraction);
            for &phase in &phases {
                for &(index, ref dof) in &dofs {
                    let value = part.value(index, phase);
                    let value = value.ok_or_else(|| no_dof(demonstration, index))?;
                    values.push(dof.encode(value)?);
                }
            }
        }
        let width = phases.len() * dofs.len();
        let mut rows = DMatrix::from_row_slice(demonstrations.len(), width, &values);
        let scale = scales(&mut rows, &dofs)?;
        Ok(Self {
            group: groups(demonstrations, &class, names.len()),
            classes: names.into_iter().map(str::to_owned).collect(),
            dofs,
            phases,
            scale,
            rows,
            class,
        })
    }
}

/// Scales the columns of each DoF to unit variance; their standard deviations.
fn scales(rows: &mut DMatrix<f64>, dofs: &[(usize, Dof)]) -> Result<Vec<f64>, GateError> {
    let mut scale = Vec::with_capacity(dofs.len());
    for (offset, (_, dof)) in dofs.iter().enumerate() {
        let columns = (offset..rows.ncols()).step_by(dofs.len());
        let block = rows.select_columns(&columns.clone().collect::<Vec<_>>());
        let std = libm::sqrt(block.variance());
        if !(std.is_finite() && std > f64::EPSILON * block.amax()) {
            let dof = dof.name.clone();
            return Err(GateError::Scale { dof });
        }
        for column in columns {
            rows.column_mut(column).unscale_mut(std);
        }
        scale.push(std);
    }
    Ok(scale)
}

/// Trials, where every class has enough of them: performances of one trial are alike. Else each by itself.
fn groups(demonstrations: &[Demonstration], class: &[usize], classes: usize) -> Vec<usize> {
    let mut trials: Vec<&str> = demonstrations.iter().map(Demonstration::trial).collect();
    trials.sort_unstable();
    trials.dedup();
    let of = |d: &Demonstration| trials.iter().position(|t| *t == d.trial()).unwrap_or(0);
    let group: Vec<usize> = demonstrations.iter().map(of).collect();
    let enough = |q: usize| {
        let members = class.iter().zip(&group).filter(|(c, _)| **c == q);
        let mut of_class: Vec<usize> = members.map(|(_, g)| *g).collect();
        of_class.sort_unstable();
        let largest = of_class.chunk_by(|a, b| a == b).map(<[_]>::len).max();
        // Whichever trial is left out, two demonstrations must be left.
        of_class.len() >= largest.unwrap_or(0) + LEAST_PER_CLASS - 1
    };
    if (0..classes).all(enough) {
        group
    } else {
        (0..demonstrations.len()).collect()
    }
}

//! Other methods on the same split and observations.

use std::collections::BTreeMap;

use rayon::prelude::*;
use serde::Serialize;

use super::choose::Chosen;
use super::data::Set;
use super::parts::Part;
use super::setting::{Phase, Setting, Ways};
use crate::baseline::{Protocol, Row, compare};
use crate::experiment::look::{Look, STIFFNESS_SIGMA};
use crate::experiment::{Config, ExperimentError};

/// How well a method recognises whole movements.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Other {
    /// The method.
    pub method: &'static str,
    /// Where it comes from.
    pub source: &'static str,
    /// Share recognised; none of a method that recognises nothing.
    pub accuracy: Option<f64>,
    /// Mean of minus the log probability given to the right class, nats; none of a method without probabilities.
    pub log_loss: Option<f64>,
}

/// Each part's movements by what is learnt from its training part, by time and one way for each class; basis, ridge,
/// shrinkage, placement and noise of the setting that weighs most there.
pub(super) fn compared(
    set: &Set,
    parts: &[Part],
    chosen: &[Chosen],
    config: &Config,
) -> Result<Vec<Other>, ExperimentError> {
    let jobs: Vec<_> = parts.iter().zip(chosen).collect();
    let one = |(part, chosen): &(&Part, &Chosen)| -> Result<(f64, Vec<Row>), ExperimentError> {
        let some = |indices: &[usize]| -> Vec<_> {
            indices
                .iter()
                .map(|&i| set.demonstrations()[i].clone())
                .collect()
        };
        let setting = Setting {
            ways: Ways::One,
            phase: Phase::Time,
            ..chosen.heaviest().setting
        };
        let protocol = Protocol {
            valid: setting.valid(set.plan.dofs)?,
            observed: (0..set.plan.dofs.len()).collect(),
            phases: Look::spaced(set.plan.observations, 1.0, false).phases,
            sigma_m: chosen.heaviest().sigma_m,
            sigma_share: STIFFNESS_SIGMA,
            noise_m: 0.0,
            seed: config.seed,
            roles: None,
        };
        let rows = compare(&some(&part.training), &some(&part.tested), &protocol)?;
        Ok((part.tested.len() as f64, rows))
    };
    let tables = jobs.par_iter().map(one).collect::<Result<Vec<_>, _>>()?;
    Ok(together(&tables))
}

/// Rows of all parts, each part as heavy as it has movements. What needs a robot or sEMG is left out.
fn together(tables: &[(f64, Vec<Row>)]) -> Vec<Other> {
    let mut order = Vec::new();
    let mut sums: BTreeMap<&str, (f64, Option<f64>, Option<f64>)> = BTreeMap::new();
    let add = |sum: Option<f64>, weight: f64, value: Option<f64>| Some(sum? + weight * value?);
    for (weight, rows) in tables {
        for row in rows {
            let sum = sums.entry(row.method).or_insert_with(|| {
                order.push((row.method, row.source));
                (0.0, Some(0.0), Some(0.0))
            });
            sum.0 += weight;
            sum.1 = add(sum.1, *weight, row.accuracy);
            sum.2 = add(sum.2, *weight, row.log_loss);
        }
    }
    let told = |method: &str| !(method.contains("sEMG") || method.starts_with("DMP"));
    let others = order.into_iter().filter(|(method, _)| told(method));
    let other = |(method, source): (&'static str, &'static str)| {
        let (weight, accuracy, log_loss) = sums.get(method).copied().unwrap_or_default();
        Other {
            method,
            source,
            accuracy: accuracy.map(|sum| sum / weight),
            log_loss: log_loss.map(|sum| sum / weight),
        }
    };
    others.map(other).collect()
}

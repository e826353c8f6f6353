//! The nearest demonstration by dynamic time warping of what was observed.
//!
//! Sakoe and Chiba (1978, *Dynamic programming algorithm optimization for spoken word recognition*), all DoFs in one
//! warp, each in units of its standard deviation. The label and the movement of the nearest demonstration are the
//! answer: there is no probability, no interval, and nothing between two demonstrations.

use super::aligned::Aligned;
use super::{Answer, BaselineError, Observed, Path};
use crate::demonstration::Demonstration;
use crate::model::Dof;

/// All demonstrations, remembered.
#[derive(Debug, Clone)]
pub struct Nearest {
    aligned: Aligned,
    train: Vec<Demonstration>,
}

impl Nearest {
    /// Remembers.
    ///
    /// # Errors
    /// No demonstrations, or some of other DoFs.
    pub fn learn(train: &[Demonstration], dofs: &[Dof]) -> Result<Self, BaselineError> {
        Ok(Self {
            aligned: Aligned::new(train, dofs)?,
            train: train.to_vec(),
        })
    }

    /// The nearest demonstration's label and movement.
    ///
    /// # Errors
    /// An observation without a logarithm.
    pub fn answer(&self, observed: &Observed, phases: &[f64]) -> Result<Answer, BaselineError> {
        let asked = self.sequence(observed)?;
        let mut best: Option<(usize, f64)> = None;
        for (index, demonstration) in self.train.iter().enumerate() {
            let mut same = observed.clone();
            for (series, &dof) in same.values.iter_mut().zip(&observed.dofs) {
                for (value, &phase) in series.iter_mut().zip(&observed.phases) {
                    *value = demonstration.value_at(dof, phase).unwrap_or(*value);
                }
            }
            let distance = time_warped(&asked, &self.sequence(&same)?);
            if best.is_none_or(|(_, least)| distance < least) {
                best = Some((index, distance));
            }
        }
        let Some((nearest, _)) = best else {
            return Err(BaselineError::None("learn from"));
        };
        let path = |dof: usize| {
            let value = |&phase: &f64| self.train[nearest].value_at(dof, phase);
            let mean: Option<Vec<f64>> = phases.iter().map(value).collect();
            mean.map(|mean| Path {
                mean,
                interval_95: None,
            })
        };
        Ok(Answer {
            log_posterior: None,
            recognised: Some(self.aligned.label[nearest]),
            paths: (0..self.aligned.dofs().len()).map(path).collect(),
        })
    }

    fn sequence(&self, observed: &Observed) -> Result<Vec<Vec<f64>>, BaselineError> {
        let seen = self.aligned.standardised(observed)?;
        Ok(seen.into_iter().map(|instant| instant.values).collect())
    }
}

/// Distance of two sequences of points: the root of the least sum of squared distances over all warps that step by at
/// most one in each (no window).
#[must_use]
pub fn time_warped(one: &[Vec<f64>], other: &[Vec<f64>]) -> f64 {
    let mut above = vec![f64::INFINITY; other.len() + 1];
    above[0] = 0.0;
    for point in one {
        let mut row = vec![f64::INFINITY; other.len() + 1];
        for (j, against) in other.iter().enumerate() {
            let square: f64 = point
                .iter()
                .zip(against)
                .map(|(a, b)| (a - b) * (a - b))
                .sum();
            row[j + 1] = square + above[j].min(above[j + 1]).min(row[j]);
        }
        above = row;
    }
    libm::sqrt(above[other.len()])
}

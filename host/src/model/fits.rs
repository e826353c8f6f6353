//! What is kept of each demonstration: enough to learn again without the recording.

use std::collections::BTreeMap;

use nalgebra::{DMatrix, DVector};

use super::weights::Design;
use super::{Dof, Durations, Hyperparameters, LearnError};
use crate::demonstration::Demonstration;

/// A DoF that varies by less than this share of its size does not vary.
const CONSTANT: f64 = 1e-12;
/// Fewer demonstrations of a skill have no deviation from their mean.
const LEAST_PER_SKILL: usize = 2;
/// Leaving one out must leave a pooled covariance.
const LEAST_FREEDOM: usize = 2;

/// What is kept of one demonstration. `D` DoFs, `K` basis functions; every number in each DoF's unit as it enters the
/// model (the logarithm's for a logarithm), not scaled. The ridge acts on DoFs scaled to unit variance, but the
/// weights of one DoF are linear in its values: they are the same times the scale, whatever the scale is.
#[derive(Clone, Debug, PartialEq)]
pub struct Fitted {
    /// Name of the skill, or of the component of a class, that it taught.
    pub label: String,
    /// Name of the class.
    pub class: String,
    /// How long it took, seconds.
    pub duration_s: f64,
    /// Its samples.
    pub samples: u32,
    /// `D K`, DoF-major, by regularised least squares.
    pub weights: Vec<f64>,
    /// `D` sums of squares of what the weights leave.
    pub residual_squares: Vec<f64>,
    /// `D` means of the samples.
    pub means: Vec<f64>,
    /// `D` sums of squares of the samples' distances from their mean.
    pub squares: Vec<f64>,
}

/// Fits every demonstration.
pub(super) fn fit_all(
    demonstrations: &[Demonstration],
    given: &Hyperparameters,
) -> Result<Vec<Fitted>, LearnError> {
    let mut design: Option<Design> = None;
    let mut fits = Vec::with_capacity(demonstrations.len());
    for demonstration in demonstrations {
        check_dofs(demonstration, &given.dofs)?;
        if !demonstration.is_complete() {
            return Err(LearnError::Gaps {
                file: demonstration.file().to_owned(),
                label: demonstration.label().to_owned(),
            });
        }
        let series = encode(demonstration, &given.dofs)?;
        let phases: Vec<f64> = demonstration.phases().collect();
        // Demonstrations of one rate and length have one factor.
        let known = design.take().filter(|known| known.is_at(&phases));
        let known = match known {
            Some(known) => known,
            None => Design::new(&given.basis, phases, given.ridge)?,
        };
        let fit = known.fit(&series);
        design = Some(known);
        let of_dof = series.column_iter().map(|column| moments(column.iter()));
        let (means, squares) = of_dof.unzip();
        fits.push(Fitted {
            label: demonstration.label().to_owned(),
            class: demonstration.class().to_owned(),
            duration_s: demonstration.duration_s(),
            samples: u32::try_from(series.nrows()).unwrap_or(u32::MAX),
            weights: fit.weights.as_slice().to_vec(),
            residual_squares: fit.residual_squares,
            means,
            squares,
        });
    }
    Ok(fits)
}

/// Refuses a demonstration of more or fewer DoFs.
pub(super) fn check_dofs(demonstration: &Demonstration, dofs: &[Dof]) -> Result<(), LearnError> {
    let (expected, got) = (dofs.len(), demonstration.values().len());
    if expected == got {
        return Ok(());
    }
    Err(LearnError::Dofs {
        file: demonstration.file().to_owned(),
        label: demonstration.label().to_owned(),
        expected,
        got,
    })
}

/// Values as they enter the model, a column per DoF; zero where none was recorded.
pub(super) fn encode(
    demonstration: &Demonstration,
    dofs: &[Dof],
) -> Result<DMatrix<f64>, LearnError> {
    let samples = demonstration.t_s().len();
    let mut encoded = DMatrix::zeros(samples, dofs.len());
    for (index, (values, dof)) in demonstration.values().iter().zip(dofs).enumerate() {
        let present = demonstration.present(index);
        for (sample, &value) in values.iter().enumerate() {
            if present.is_some_and(|present| !present[sample]) {
                continue;
            }
            let refused = |reason| LearnError::NotPositive {
                file: demonstration.file().to_owned(),
                label: demonstration.label().to_owned(),
                time_s: demonstration.t_s()[sample],
                reason,
            };
            encoded[(sample, index)] = dof.encode(value).map_err(refused)?;
        }
    }
    Ok(encoded)
}

/// Mean, and sum of squared distances from it.
pub(super) fn moments<'v>(values: impl ExactSizeIterator<Item = &'v f64> + Clone) -> (f64, f64) {
    let n = values.len() as f64;
    let mean = values.clone().sum::<f64>() / n;
    let squares = values.map(|value| (value - mean) * (value - mean));
    (mean, squares.sum::<f64>())
}

/// Standard deviation of each DoF over all samples of all demonstrations.
pub(super) fn scales(fits: &[Fitted], dofs: &[Dof]) -> Result<Vec<f64>, LearnError> {
    let total: f64 = fits.iter().map(|fit| f64::from(fit.samples)).sum();
    let one = |(index, dof): (usize, &Dof)| {
        let share = |fit: &Fitted| f64::from(fit.samples) / total;
        let value: f64 = fits.iter().map(|fit| share(fit) * fit.means[index]).sum();
        // Within the demonstrations, and between them.
        let variance = fits.iter().map(|fit| {
            let off = fit.means[index] - value;
            fit.squares[index] / total + share(fit) * off * off
        });
        scale_of(value, variance.sum(), dof)
    };
    dofs.iter().enumerate().map(one).collect()
}

/// Standard deviation of a DoF from mean and variance of all its samples.
pub(super) fn scale_of(mean: f64, variance: f64, dof: &Dof) -> Result<f64, LearnError> {
    let (name, scale) = (dof.name.clone(), libm::sqrt(variance));
    if !variance.is_finite() {
        return Err(LearnError::TooLarge { dof: name });
    }
    if scale > CONSTANT * mean.abs() {
        Ok(scale)
    } else {
        Err(LearnError::Constant {
            dof: name,
            value: mean,
        })
    }
}

/// Weights of every demonstration, scaled.
pub(super) fn scaled(fits: &[Fitted], scale: &[f64], functions: usize) -> Vec<DVector<f64>> {
    let one = |fit: &Fitted| {
        let weights = fit.weights.iter().enumerate();
        let weights = weights.map(|(row, weight)| weight / scale[row / functions]);
        DVector::from_iterator(fit.weights.len(), weights)
    };
    fits.iter().map(one).collect()
}

/// Mean over the demonstrations of the mean square that their weights leave, per DoF, scaled.
pub(super) fn residual_variance(fits: &[Fitted], scale: &[f64]) -> DVector<f64> {
    DVector::from_fn(scale.len(), |dof, _| {
        let left = fits
            .iter()
            .map(|fit| fit.residual_squares[dof] / f64::from(fit.samples));
        left.sum::<f64>() / fits.len() as f64 / (scale[dof] * scale[dof])
    })
}

/// Which demonstration is of which skill.
pub(super) struct Groups {
    /// Sorted.
    pub(super) labels: Vec<String>,
    /// Class of each label.
    pub(super) classes: Vec<String>,
    /// Demonstrations of each label.
    pub(super) counts: Vec<usize>,
    /// Skill of each demonstration.
    pub(super) skill: Vec<usize>,
    /// How long those of each label took.
    pub(super) durations: Vec<Durations>,
}

/// Of whom a demonstration is one.
pub(super) struct Member<'d> {
    label: &'d str,
    class: &'d str,
    duration_s: f64,
}

impl<'d> Member<'d> {
    pub(super) fn of(demonstration: &'d Demonstration) -> Self {
        Self {
            label: demonstration.label(),
            class: demonstration.class(),
            duration_s: demonstration.duration_s(),
        }
    }

    pub(super) fn of_fit(fit: &'d Fitted) -> Self {
        Self {
            label: &fit.label,
            class: &fit.class,
            duration_s: fit.duration_s,
        }
    }
}

impl Groups {
    pub(super) fn of(all: &[Member<'_>]) -> Result<Self, LearnError> {
        let mut members: BTreeMap<&str, Vec<&Member<'_>>> = BTreeMap::new();
        for one in all {
            members.entry(one.label).or_default().push(one);
        }
        if members.is_empty() {
            return Err(LearnError::None);
        }
        // A lone skill has only its own deviations.
        let alone = LEAST_FREEDOM + 1;
        let needed = if members.len() == 1 {
            alone
        } else {
            LEAST_PER_SKILL
        };
        for (label, of_label) in &members {
            if of_label.len() < needed {
                return Err(LearnError::TooFew {
                    label: (*label).to_owned(),
                    found: of_label.len(),
                    needed,
                });
            }
            let class = of_label[0].class;
            if let Some(other) = of_label.iter().find(|one| one.class != class) {
                return Err(LearnError::Classes {
                    label: (*label).to_owned(),
                    classes: [class, other.class].map(str::to_owned),
                });
            }
        }
        let index: BTreeMap<&str, usize> = members.keys().copied().zip(0..).collect();
        Ok(Self {
            labels: members.keys().map(|&label| label.to_owned()).collect(),
            classes: members.values().map(|m| m[0].class.to_owned()).collect(),
            counts: members.values().map(Vec::len).collect(),
            skill: all.iter().map(|one| index[one.label]).collect(),
            durations: members.values().map(|m| durations(m)).collect(),
        })
    }
}

fn durations(members: &[&Member<'_>]) -> Durations {
    let seconds: Vec<f64> = members.iter().map(|one| one.duration_s).collect();
    let (mean_s, squares) = moments(seconds.iter());
    Durations {
        mean_s,
        std_s: libm::sqrt(squares / (seconds.len() - 1) as f64),
        min_s: seconds.iter().copied().fold(f64::INFINITY, f64::min),
        max_s: seconds.iter().copied().fold(0.0, f64::max),
    }
}

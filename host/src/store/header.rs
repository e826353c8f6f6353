//! The readable header of a model file.

use serde::{Deserialize, Serialize};
use tonus_shared::promp::{Basis, BasisError, Family};

use super::tensors::Numbers;
use super::{ContentError, SCHEMA_VERSION};
use crate::model::novelty::{Gate, GateError, GateParts};
use crate::model::{Dof, Durations, Fitted, Learner, Parts, Predictive, Shrinkage};

/// Everything of a model but its matrices.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct Header {
    schema_version: u32,
    /// Name and version of the program that wrote the file.
    written_by: String,
    pub(super) dofs: Vec<Dof>,
    basis: BasisHeader,
    pub(super) rank: usize,
    pub(super) labels: Vec<String>,
    classes: Vec<String>,
    counts: Vec<u32>,
    durations: Vec<DurationsHeader>,
    /// `null` for a Gaussian.
    degrees_of_freedom: Vec<Option<f64>>,
    predictive: Predictive,
    learner: Learner,
    pub(super) demonstrations: Vec<DemonstrationHeader>,
    ridge: f64,
    placement_m: f64,
    shrinkage: ShrinkageHeader,
    /// Of a model that is ready to be followed.
    #[serde(default, skip_serializing_if = "Option::is_none")]
    pub(super) gate: Option<GateHeader>,
}

/// Everything of a novelty gate but its matrices.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct GateHeader {
    /// DoFs of the model that it looks at, from 0.
    dofs: Vec<usize>,
    /// Of the instants that it looks at.
    phases: Vec<f64>,
    pub(super) classes: Vec<String>,
    /// Class of each reference, from 0.
    pub(super) references: Vec<usize>,
    tail: f64,
    false_alarm_rate: f64,
}

impl GateHeader {
    fn of(parts: &GateParts) -> Self {
        Self {
            dofs: parts.dofs.iter().map(|(index, _)| *index).collect(),
            phases: parts.phases.clone(),
            classes: parts.classes.clone(),
            references: parts.skills.clone(),
            tail: parts.tail,
            false_alarm_rate: parts.false_alarm_rate,
        }
    }

    /// Instants times DoFs.
    pub(super) fn rows(&self) -> usize {
        self.phases.len().saturating_mul(self.dofs.len())
    }

    /// The gate, with the numbers of the tensors. `dofs`: the model's.
    fn gate(self, dofs: &[Dof], numbers: &mut Numbers) -> Result<Gate, ContentError> {
        let looked_at = self.dofs.into_iter().map(|index| {
            let dof = dofs.get(index).cloned();
            dof.map(|dof| (index, dof)).ok_or(GateError::Config {
                what: "the greatest DoF",
                value: index as f64,
                range: "one of the model's",
            })
        });
        Ok(Gate::assemble(GateParts {
            dofs: looked_at.collect::<Result<_, _>>()?,
            phases: self.phases,
            classes: self.classes,
            factors: numbers.take("gate_factor"),
            references: numbers.take("gate_reference"),
            skills: self.references,
            tail: self.tail,
            thresholds: numbers.take("gate_threshold"),
            false_alarm_rate: self.false_alarm_rate,
        })?)
    }
}

#[derive(Serialize, Deserialize)]
#[serde(tag = "family", rename_all = "lowercase", deny_unknown_fields)]
enum BasisHeader {
    Gaussian { functions: usize, width: f64 },
    Fourier { functions: usize },
    Bernstein { functions: usize },
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct DurationsHeader {
    mean_s: f64,
    std_s: f64,
    min_s: f64,
    max_s: f64,
}

#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
struct ShrinkageHeader {
    pooled: f64,
    diagonal: f64,
    /// Whether the shares were chosen by leave-one-out likelihood, and are chosen again with more demonstrations.
    chosen: bool,
}

/// A demonstration that is kept.
#[derive(Serialize, Deserialize)]
#[serde(deny_unknown_fields)]
pub(super) struct DemonstrationHeader {
    label: String,
    class: String,
    duration_s: f64,
    samples: u32,
}

/// The one field that every version has.
#[derive(Deserialize)]
struct Versioned {
    schema_version: u32,
}

impl Header {
    pub(super) fn of(parts: &Parts, gate: Option<&Gate>) -> Self {
        let functions = parts.basis.count();
        let kept = parts.demonstrations.iter();
        let kept = kept.map(|one| DemonstrationHeader {
            label: one.label.clone(),
            class: one.class.clone(),
            duration_s: one.duration_s,
            samples: one.samples,
        });
        let durations = parts.durations.iter().map(|d| DurationsHeader {
            mean_s: d.mean_s,
            std_s: d.std_s,
            min_s: d.min_s,
            max_s: d.max_s,
        });
        Self {
            schema_version: SCHEMA_VERSION,
            written_by: concat!("tonus ", env!("CARGO_PKG_VERSION")).to_owned(),
            dofs: parts.dofs.clone(),
            basis: match parts.basis.family() {
                Family::Gaussian { width } => BasisHeader::Gaussian { functions, width },
                Family::Fourier => BasisHeader::Fourier { functions },
                Family::Bernstein => BasisHeader::Bernstein { functions },
            },
            rank: parts.rank,
            labels: parts.labels.clone(),
            classes: parts.classes.clone(),
            counts: parts.counts.clone(),
            durations: durations.collect(),
            degrees_of_freedom: parts.freedom.clone(),
            predictive: parts.predictive,
            learner: parts.learner,
            demonstrations: kept.collect(),
            ridge: parts.ridge,
            placement_m: parts.placement_m,
            shrinkage: ShrinkageHeader {
                pooled: parts.pooled_share,
                diagonal: parts.diagonal_share,
                chosen: parts.shrinkage == Shrinkage::LeaveOneOut,
            },
            gate: gate.map(|gate| GateHeader::of(gate.parts())),
        }
    }

    /// The version first, so that another one is named as such and not by the fields it lacks.
    pub(super) fn parse(text: &str) -> Result<Self, ContentError> {
        let Versioned { schema_version } =
            serde_json::from_str(text).map_err(ContentError::Header)?;
        if schema_version != SCHEMA_VERSION {
            return Err(ContentError::Version {
                found: schema_version,
            });
        }
        serde_json::from_str(text).map_err(ContentError::Header)
    }

    pub(super) fn basis(&self) -> Result<Basis, BasisError> {
        match self.basis {
            BasisHeader::Gaussian { functions, width } => {
                Basis::new(Family::Gaussian { width }, functions)
            }
            BasisHeader::Fourier { functions } => Basis::fourier(functions),
            BasisHeader::Bernstein { functions } => Basis::bernstein(functions),
        }
    }

    /// The gate, if there is one, with the numbers of the tensors.
    ///
    /// # Errors
    /// Parts that make no gate.
    pub(super) fn gate(&mut self, numbers: &mut Numbers) -> Result<Option<Gate>, ContentError> {
        let gate = self.gate.take();
        gate.map(|gate| gate.gate(&self.dofs, numbers)).transpose()
    }

    /// The parts, with the numbers of the tensors.
    pub(super) fn parts(self, basis: Basis, mut numbers: Numbers) -> Parts {
        let durations = self.durations.into_iter().map(|d| Durations {
            mean_s: d.mean_s,
            std_s: d.std_s,
            min_s: d.min_s,
            max_s: d.max_s,
        });
        let dofs = self.dofs.len();
        // The shapes were checked: as many rows as demonstrations.
        let rows = |list: &[f64], width: usize| -> Vec<Vec<f64>> {
            let rows = list.chunks_exact(width.max(1));
            rows.map(<[f64]>::to_vec).collect()
        };
        let weights = rows(
            &numbers.take("demonstration_weight"),
            dofs.saturating_mul(basis.count()),
        );
        let moments = rows(&numbers.take("demonstration_mean"), dofs)
            .into_iter()
            .zip(rows(&numbers.take("demonstration_square"), dofs));
        let numbered = weights
            .into_iter()
            .zip(rows(&numbers.take("demonstration_residual"), dofs))
            .zip(moments);
        let kept = self.demonstrations.into_iter().zip(numbered);
        let kept = kept.map(
            |(one, ((weights, residual_squares), (means, squares)))| Fitted {
                label: one.label,
                class: one.class,
                duration_s: one.duration_s,
                samples: one.samples,
                weights,
                residual_squares,
                means,
                squares,
            },
        );
        let ShrinkageHeader {
            pooled,
            diagonal,
            chosen,
        } = self.shrinkage;
        Parts {
            dofs: self.dofs,
            basis,
            labels: self.labels,
            classes: self.classes,
            counts: self.counts,
            durations: durations.collect(),
            freedom: self.degrees_of_freedom,
            predictive: self.predictive,
            learner: self.learner,
            demonstrations: kept.collect(),
            scale: numbers.take("scale"),
            rank: self.rank,
            loading: numbers.take("loading"),
            weight_means: numbers.take("weight_mean"),
            roots: numbers.take("root"),
            residual_variance: numbers.take("residual_variance"),
            ridge: self.ridge,
            placement_m: self.placement_m,
            shrinkage: if chosen {
                Shrinkage::LeaveOneOut
            } else {
                Shrinkage::Fixed { pooled, diagonal }
            },
            pooled_share: pooled,
            diagonal_share: diagonal,
        }
    }
}

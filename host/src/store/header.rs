//! The readable header of a model file.

use serde::{Deserialize, Serialize};
use tonus_shared::promp::{Basis, BasisError, Family};

use super::{ContentError, SCHEMA_VERSION};
use crate::model::{Dof, Durations, Parts};

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
    counts: Vec<u32>,
    durations: Vec<DurationsHeader>,
    ridge: f64,
    placement_m: f64,
    shrinkage: ShrinkageHeader,
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
}

/// The one field that every version has.
#[derive(Deserialize)]
struct Versioned {
    schema_version: u32,
}

impl Header {
    pub(super) fn of(parts: &Parts) -> Self {
        let functions = parts.basis.count();
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
            counts: parts.counts.clone(),
            durations: durations.collect(),
            ridge: parts.ridge,
            placement_m: parts.placement_m,
            shrinkage: ShrinkageHeader {
                pooled: parts.pooled_share,
                diagonal: parts.diagonal_share,
            },
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

    /// The parts, with empty matrices.
    pub(super) fn parts(self, basis: Basis) -> Parts {
        let durations = self.durations.into_iter().map(|d| Durations {
            mean_s: d.mean_s,
            std_s: d.std_s,
            min_s: d.min_s,
            max_s: d.max_s,
        });
        Parts {
            dofs: self.dofs,
            basis,
            labels: self.labels,
            counts: self.counts,
            durations: durations.collect(),
            scale: Vec::new(),
            rank: self.rank,
            loading: Vec::new(),
            weight_means: Vec::new(),
            roots: Vec::new(),
            residual_variance: Vec::new(),
            ridge: self.ridge,
            placement_m: self.placement_m,
            pooled_share: self.shrinkage.pooled,
            diagonal_share: self.shrinkage.diagonal,
        }
    }
}

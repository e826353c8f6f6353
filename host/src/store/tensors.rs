//! The tensors of a model file: names, shapes, bytes.

use std::borrow::Cow;
use std::collections::BTreeMap;

use safetensors::tensor::{Dtype, SafeTensors, View};

use super::ContentError;
use super::header::Header;
use crate::model::novelty::Gate;
use crate::model::{Fitted, Parts};

/// Shapes of the tensors of numbers by name, which is the order of the checksum. `functions`: of the basis.
pub(super) fn shapes(header: &Header, functions: usize) -> BTreeMap<&'static str, Vec<usize>> {
    let (kept, dofs) = (header.demonstrations.len(), header.dofs.len());
    let (skills, rank) = (header.labels.len(), header.rank);
    let mut shapes = BTreeMap::from([
        ("demonstration_mean", vec![kept, dofs]),
        ("demonstration_residual", vec![kept, dofs]),
        ("demonstration_square", vec![kept, dofs]),
        ("demonstration_weight", vec![kept, dofs, functions]),
        ("loading", vec![dofs, functions, rank]),
        ("residual_variance", vec![dofs]),
        ("root", vec![skills, rank, rank]),
        ("scale", vec![dofs]),
        ("weight_mean", vec![skills, dofs, functions]),
    ]);
    if let Some(gate) = &header.gate {
        let rows = gate.rows();
        // Saturates where a header lies; no tensor has such a shape.
        let triangle = rows.saturating_mul(rows.saturating_add(1)) / 2;
        shapes.insert("gate_factor", vec![gate.classes.len(), triangle]);
        shapes.insert("gate_reference", vec![gate.references.len(), rows]);
        shapes.insert("gate_threshold", vec![rows]);
    }
    shapes
}

/// The numbers of the tensors.
pub(super) struct Numbers(BTreeMap<&'static str, Vec<f64>>);

impl Numbers {
    pub(super) fn of(parts: &Parts, gate: Option<&Gate>) -> Self {
        let all = |list: fn(&Fitted) -> &[f64]| {
            let lists = parts.demonstrations.iter().map(list);
            lists.collect::<Vec<_>>().concat()
        };
        let mut numbers = BTreeMap::from([
            ("demonstration_mean", all(|one| &one.means)),
            ("demonstration_residual", all(|one| &one.residual_squares)),
            ("demonstration_square", all(|one| &one.squares)),
            ("demonstration_weight", all(|one| &one.weights)),
            ("loading", parts.loading.clone()),
            ("residual_variance", parts.residual_variance.clone()),
            ("root", parts.roots.clone()),
            ("scale", parts.scale.clone()),
            ("weight_mean", parts.weight_means.clone()),
        ]);
        if let Some(gate) = gate {
            let gate = gate.parts();
            numbers.insert("gate_factor", gate.factors.clone());
            numbers.insert("gate_reference", gate.references.clone());
            numbers.insert("gate_threshold", gate.thresholds.clone());
        }
        Self(numbers)
    }

    /// Of tensors in the order of [`shapes`].
    pub(super) fn read<'a>(raw: impl Iterator<Item = (&'static str, &'a [u8])>) -> Self {
        Self(raw.map(|(name, raw)| (name, numbers(raw))).collect())
    }

    /// A tensor's numbers, once; none of one that is not there.
    pub(super) fn take(&mut self, name: &str) -> Vec<f64> {
        self.0.remove(name).unwrap_or_default()
    }
}

pub(super) struct Tensor {
    dtype: Dtype,
    shape: Vec<usize>,
    data: Vec<u8>,
}

impl Tensor {
    pub(super) fn of(shape: Vec<usize>, numbers: &[f64]) -> Self {
        Self {
            dtype: Dtype::F64,
            shape,
            data: numbers.iter().flat_map(|v| v.to_le_bytes()).collect(),
        }
    }

    pub(super) fn of_checksum(checksum: u32) -> Self {
        Self {
            dtype: Dtype::U32,
            shape: vec![1],
            data: checksum.to_le_bytes().to_vec(),
        }
    }

    pub(super) fn bytes(&self) -> &[u8] {
        &self.data
    }
}

impl View for Tensor {
    fn dtype(&self) -> Dtype {
        self.dtype
    }
    fn shape(&self) -> &[usize] {
        &self.shape
    }
    fn data(&self) -> Cow<'_, [u8]> {
        Cow::Borrowed(&self.data)
    }
    fn data_len(&self) -> usize {
        self.data.len()
    }
}

/// Bytes of a tensor of this type and shape.
pub(super) fn data<'a>(
    tensors: &SafeTensors<'a>,
    name: &'static str,
    dtype: Dtype,
    expected: Vec<usize>,
) -> Result<&'a [u8], ContentError> {
    let tensor = tensors
        .tensor(name)
        .map_err(|_| ContentError::Missing { name })?;
    if tensor.dtype() == dtype && tensor.shape() == expected {
        return Ok(tensor.data());
    }
    Err(ContentError::Shape {
        name,
        dtype: format!("{:?}", tensor.dtype()),
        found: tensor.shape().to_vec(),
        wanted: if dtype == Dtype::F64 { "F64" } else { "U32" },
        expected,
    })
}

/// The `f64`s of these bytes.
fn numbers(raw: &[u8]) -> Vec<f64> {
    let (eights, _) = raw.as_chunks::<8>();
    let eights = eights.iter();
    eights.map(|eight| f64::from_le_bytes(*eight)).collect()
}

pub(super) fn checksum<'a>(header: &str, tensors: impl Iterator<Item = &'a [u8]>) -> u32 {
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    digest.update(header.as_bytes());
    for tensor in tensors {
        digest.update(tensor);
    }
    digest.finalize()
}

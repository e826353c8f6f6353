//! The tensors of a model file: names, shapes, bytes.

use std::borrow::Cow;

use safetensors::tensor::{Dtype, SafeTensors, View};

use super::ContentError;
use super::header::Header;
use crate::model::{Fitted, Parts};

/// How many tensors of numbers there are.
const COUNT: usize = 9;

/// Shapes of the tensors of numbers.
pub(super) struct Shapes {
    demonstrations: usize,
    skills: usize,
    dofs: usize,
    functions: usize,
    rank: usize,
}

impl Shapes {
    pub(super) const fn of_parts(parts: &Parts) -> Self {
        Self {
            demonstrations: parts.demonstrations.len(),
            skills: parts.labels.len(),
            dofs: parts.dofs.len(),
            functions: parts.basis.count(),
            rank: parts.rank,
        }
    }

    pub(super) const fn of_header(header: &Header, functions: usize) -> Self {
        Self {
            demonstrations: header.demonstrations.len(),
            skills: header.labels.len(),
            dofs: header.dofs.len(),
            functions,
            rank: header.rank,
        }
    }

    /// By name, in the order of the checksum and of [`Numbers::named`].
    pub(super) fn named(&self) -> [(&'static str, Vec<usize>); COUNT] {
        let Self {
            demonstrations,
            skills,
            dofs,
            functions,
            rank,
        } = *self;
        [
            ("demonstration_mean", vec![demonstrations, dofs]),
            ("demonstration_residual", vec![demonstrations, dofs]),
            ("demonstration_square", vec![demonstrations, dofs]),
            (
                "demonstration_weight",
                vec![demonstrations, dofs, functions],
            ),
            ("loading", vec![dofs, functions, rank]),
            ("residual_variance", vec![dofs]),
            ("root", vec![skills, rank, rank]),
            ("scale", vec![dofs]),
            ("weight_mean", vec![skills, dofs, functions]),
        ]
    }
}

/// The numbers of the tensors.
pub(super) struct Numbers {
    pub(super) means: Vec<f64>,
    pub(super) residuals: Vec<f64>,
    pub(super) squares: Vec<f64>,
    pub(super) weights: Vec<f64>,
    pub(super) loading: Vec<f64>,
    pub(super) residual_variance: Vec<f64>,
    pub(super) roots: Vec<f64>,
    pub(super) scale: Vec<f64>,
    pub(super) weight_means: Vec<f64>,
}

impl Numbers {
    pub(super) fn of(parts: &Parts) -> Self {
        let all = |list: fn(&Fitted) -> &[f64]| {
            let lists = parts.demonstrations.iter().map(list);
            lists.collect::<Vec<_>>().concat()
        };
        Self {
            means: all(|one| &one.means),
            residuals: all(|one| &one.residual_squares),
            squares: all(|one| &one.squares),
            weights: all(|one| &one.weights),
            loading: parts.loading.clone(),
            residual_variance: parts.residual_variance.clone(),
            roots: parts.roots.clone(),
            scale: parts.scale.clone(),
            weight_means: parts.weight_means.clone(),
        }
    }

    /// In the order of [`Shapes::named`].
    pub(super) fn named(&self) -> [&[f64]; COUNT] {
        [
            &self.means,
            &self.residuals,
            &self.squares,
            &self.weights,
            &self.loading,
            &self.residual_variance,
            &self.roots,
            &self.scale,
            &self.weight_means,
        ]
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
pub(super) fn numbers(raw: &[u8]) -> Vec<f64> {
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

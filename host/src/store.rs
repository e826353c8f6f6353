//! Model files: safetensors with a readable header.
//!
//! One metadata entry, `tonus`, is a JSON text with names, units, transforms, basis, labels, counts, durations and
//! hyperparameters; the tensors are little-endian `float64`. In Python:
//!
//! ```python
//! tensors = safetensors.numpy.load_file("skills.safetensors")
//! header = json.loads(safetensors.safe_open("skills.safetensors", "numpy").metadata()["tonus"])
//! ```
//!
//! | tensor | shape | |
//! |---|---|---|
//! | `weight_mean` | `Q x D x K` | mean weights of each skill |
//! | `loading` | `D x K x r` | directions of the latent space |
//! | `root` | `Q x r x r` | square root of each skill's latent covariance |
//! | `residual_variance` | `D` | what basis and loading leave |
//! | `scale` | `D` | standard deviations of the data |
//! | `crc32` | `1`, `uint32` | CRC-32 (zlib's) of the header text and the other tensors' bytes, by name |
//!
//! A file is written whole under another name and then renamed. Reading checks the size before anything is
//! allocated, the checksum, every shape and every number.

mod header;

use std::borrow::Cow;
use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors, View};

use crate::model::{Model, Parts, PartsError};
use header::Header;

/// Version of the header and the tensors' meaning, in `schema_version`.
pub const SCHEMA_VERSION: u32 = 1;
/// Larger files are refused before they are read, bytes. A model of 12 DoFs, 30 functions, rank 147 has 0.7 MB.
pub const MAX_BYTES: u64 = 64 * 1024 * 1024;
/// The metadata entry.
const ENTRY: &str = "tonus";
/// Tensor of the checksum.
const CHECKSUM: &str = "crc32";

/// Why a model file cannot be read or written.
#[derive(Debug, thiserror::Error)]
pub enum StoreError {
    /// The file cannot be opened, read or written.
    #[error("{}: cannot be {action}", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What was tried.
        action: &'static str,
        /// What the system said.
        source: std::io::Error,
    },
    /// Too large to be a model.
    #[error("{}: larger than the {MAX_BYTES} bytes a model file may have", file.display())]
    TooLarge {
        /// The file.
        file: PathBuf,
    },
    /// What it holds is no model.
    #[error("{}: {reason}", file.display())]
    Content {
        /// The file.
        file: PathBuf,
        /// Why not.
        reason: Box<ContentError>,
    },
}

/// Why bytes are no model.
#[derive(Debug, thiserror::Error)]
pub enum ContentError {
    /// Not safetensors, or cut short.
    #[error("not a whole safetensors file ({0})")]
    Format(SafeTensorError),
    /// Safetensors of something else.
    #[error("a safetensors file, but not a model: it has no `{ENTRY}` entry in its header")]
    NoModel,
    /// Written by another version.
    #[error("schema version {found}, this program reads {SCHEMA_VERSION}: train the model again")]
    Version {
        /// The version in the file.
        found: u32,
    },
    /// The header is not what this version writes.
    #[error("its header cannot be read ({0})")]
    Header(serde_json::Error),
    /// A tensor is missing.
    #[error("it has no tensor `{name}`")]
    Missing {
        /// The tensor.
        name: &'static str,
    },
    /// A tensor of the wrong type or shape.
    #[error("tensor `{name}` is {dtype} {found:?}, not {wanted} {expected:?}")]
    Shape {
        /// The tensor.
        name: &'static str,
        /// Its element type.
        dtype: String,
        /// Its shape.
        found: Vec<usize>,
        /// The element type it should have.
        wanted: &'static str,
        /// The shape it should have.
        expected: Vec<usize>,
    },
    /// The bytes are not those that were written.
    #[error("damaged: its checksum is {found:08x}, its content's {expected:08x}")]
    Checksum {
        /// In the file.
        found: u32,
        /// Of the content.
        expected: u32,
    },
    /// A basis that cannot be.
    #[error(transparent)]
    Basis(#[from] tonus_shared::promp::BasisError),
    /// Numbers that make no model.
    #[error(transparent)]
    Parts(#[from] PartsError),
}

/// Writes a model file, replacing what was there only once the new one is whole.
///
/// # Errors
/// [`StoreError::Io`], and [`StoreError::Content`] for a model that safetensors cannot hold.
pub fn save(model: &Model, path: &Path) -> Result<(), StoreError> {
    let bytes = to_bytes(model).map_err(|reason| StoreError::Content {
        file: path.to_owned(),
        reason: Box::new(reason),
    })?;
    crate::atomic::write(path, &bytes).map_err(|source| StoreError::Io {
        file: path.to_owned(),
        action: "written",
        source,
    })
}

/// Reads a model file.
///
/// # Errors
/// [`StoreError`]; no content makes it panic or allocate more than [`MAX_BYTES`] for the file.
pub fn load(path: &Path) -> Result<Model, StoreError> {
    let failed = |source| StoreError::Io {
        file: path.to_owned(),
        action: "read",
        source,
    };
    let too_large = || StoreError::TooLarge {
        file: path.to_owned(),
    };
    let file = std::fs::File::open(path).map_err(failed)?;
    if file.metadata().map_err(failed)?.len() > MAX_BYTES {
        return Err(too_large());
    }
    let mut bytes = Vec::new();
    // A pipe has no length: one byte more than allowed tells that there was more.
    let mut limited = file.take(MAX_BYTES + 1);
    limited.read_to_end(&mut bytes).map_err(failed)?;
    if bytes.len() as u64 > MAX_BYTES {
        return Err(too_large());
    }
    from_bytes(&bytes).map_err(|reason| StoreError::Content {
        file: path.to_owned(),
        reason: Box::new(reason),
    })
}

/// The bytes of a model file. The same model gives the same bytes.
///
/// # Errors
/// A header larger than safetensors allows.
pub fn to_bytes(model: &Model) -> Result<Vec<u8>, ContentError> {
    let parts = model.parts();
    let header = serde_json::to_string(&Header::of(parts)).map_err(ContentError::Header)?;
    let shapes = Shapes::of(
        parts.labels.len(),
        parts.dofs.len(),
        parts.basis.count(),
        parts.rank,
    );
    let numbers = |list: &[f64]| {
        list.iter()
            .flat_map(|v| v.to_le_bytes())
            .collect::<Vec<u8>>()
    };
    let mut tensors: Vec<(&str, Tensor)> = shapes
        .named()
        .map(|(name, shape)| {
            let list = match name {
                "loading" => &parts.loading,
                "residual_variance" => &parts.residual_variance,
                "root" => &parts.roots,
                "scale" => &parts.scale,
                _ => &parts.weight_means,
            };
            (name, Tensor::new(Dtype::F64, shape, numbers(list)))
        })
        .into();
    let checksum = checksum(
        &header,
        tensors.iter().map(|(_, tensor)| tensor.data.as_slice()),
    );
    let checksum = checksum.to_le_bytes().to_vec();
    tensors.push((CHECKSUM, Tensor::new(Dtype::U32, vec![1], checksum)));
    let entry = HashMap::from([(ENTRY.to_owned(), header)]);
    safetensors::serialize(tensors, Some(entry)).map_err(ContentError::Format)
}

/// A model out of the bytes of a file.
///
/// # Errors
/// [`ContentError`]; no bytes make it panic.
pub fn from_bytes(bytes: &[u8]) -> Result<Model, ContentError> {
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(ContentError::Format)?;
    let entries = metadata.metadata().as_ref();
    let text = entries
        .and_then(|map| map.get(ENTRY))
        .ok_or(ContentError::NoModel)?;
    let header = Header::parse(text)?;
    let tensors = SafeTensors::deserialize(bytes).map_err(ContentError::Format)?;
    let basis = header.basis()?;
    let (skills, dofs) = (header.labels.len(), header.dofs.len());
    let shapes = Shapes::of(skills, dofs, basis.count(), header.rank);
    let [loading, residual, root, scale, mean] = shapes.named();
    let take = |(name, shape)| data(&tensors, name, Dtype::F64, shape);
    let raw = [
        take(loading)?,
        take(residual)?,
        take(root)?,
        take(scale)?,
        take(mean)?,
    ];
    let found = data(&tensors, CHECKSUM, Dtype::U32, vec![1])?;
    let found = found
        .iter()
        .rev()
        .fold(0, |sum, &byte| sum << 8 | u32::from(byte));
    let expected = checksum(text, raw.into_iter());
    if found != expected {
        return Err(ContentError::Checksum { found, expected });
    }
    let numbers = |raw: &[u8]| -> Vec<f64> {
        let (eights, _) = raw.as_chunks::<8>();
        eights
            .iter()
            .map(|eight| f64::from_le_bytes(*eight))
            .collect()
    };
    let [loading, residual_variance, roots, scale, weight_means] = raw.map(numbers);
    let parts = Parts {
        loading,
        residual_variance,
        roots,
        scale,
        weight_means,
        ..header.parts(basis)
    };
    Ok(Model::assemble(parts)?)
}

/// Shapes of the tensors of numbers.
struct Shapes {
    skills: usize,
    dofs: usize,
    functions: usize,
    rank: usize,
}

impl Shapes {
    const fn of(skills: usize, dofs: usize, functions: usize, rank: usize) -> Self {
        Self {
            skills,
            dofs,
            functions,
            rank,
        }
    }

    /// By name, in the order of the checksum.
    fn named(&self) -> [(&'static str, Vec<usize>); 5] {
        let Self {
            skills,
            dofs,
            functions,
            rank,
        } = *self;
        [
            ("loading", vec![dofs, functions, rank]),
            ("residual_variance", vec![dofs]),
            ("root", vec![skills, rank, rank]),
            ("scale", vec![dofs]),
            ("weight_mean", vec![skills, dofs, functions]),
        ]
    }
}

struct Tensor {
    dtype: Dtype,
    shape: Vec<usize>,
    data: Vec<u8>,
}

impl Tensor {
    const fn new(dtype: Dtype, shape: Vec<usize>, data: Vec<u8>) -> Self {
        Self { dtype, shape, data }
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
fn data<'a>(
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

fn checksum<'a>(header: &str, tensors: impl Iterator<Item = &'a [u8]>) -> u32 {
    let crc = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);
    let mut digest = crc.digest();
    digest.update(header.as_bytes());
    for tensor in tensors {
        digest.update(tensor);
    }
    digest.finalize()
}

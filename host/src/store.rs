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
//! | `demonstration_weight` | `N x D x K` | weights of each demonstration kept |
//! | `demonstration_residual` | `N x D` | sum of squares that they leave |
//! | `demonstration_mean` | `N x D` | mean of its samples |
//! | `demonstration_square` | `N x D` | sum of squares of their distances from it |
//! | `gate_factor` | `C x J (J + 1) / 2` | Cholesky factors of the novelty gate's classes, if there is a gate |
//! | `gate_reference` | `M x J` | demonstrations that it compares with, whitened |
//! | `gate_threshold` | `J` | what is unknown scores more |
//! | `crc32` | `1`, `uint32` | CRC-32 (zlib's) of the header text and the other tensors' bytes, by name |
//!
//! A file is written whole under another name and then renamed. Reading checks the size before anything is
//! allocated, the checksum, every shape and every number.

mod header;
mod tensors;

use std::collections::HashMap;
use std::io::Read;
use std::path::{Path, PathBuf};

use safetensors::tensor::{Dtype, SafeTensorError, SafeTensors};

use crate::model::novelty::{Gate, GateError};
use crate::model::{Model, PartsError};
use header::Header;
use tensors::{Numbers, Tensor, checksum, data, shapes};

/// Version of the header and the tensors' meaning, in `schema_version`.
pub const SCHEMA_VERSION: u32 = 2;
/// Larger files are refused before they are read, bytes. A model of 150 demonstrations of 12 DoFs, 30 functions,
/// has 1.2 MB.
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
    /// Numbers that make no novelty gate.
    #[error(transparent)]
    Gate(#[from] GateError),
}

/// Writes a model file, with the gate of one that is ready to be followed, replacing what was there only once the new one is
/// whole.
///
/// # Errors
/// [`StoreError::Io`], and [`StoreError::Content`] for a model that safetensors cannot hold.
pub fn save(model: &Model, gate: Option<&Gate>, path: &Path) -> Result<(), StoreError> {
    let bytes = to_bytes(model, gate).map_err(|reason| StoreError::Content {
        file: path.to_owned(),
        reason: Box::new(reason),
    })?;
    crate::atomic::write(path, &bytes).map_err(|source| StoreError::Io {
        file: path.to_owned(),
        action: "written",
        source,
    })
}

/// Reads a model file; its gate is read and checked with it.
///
/// # Errors
/// [`StoreError`]; no content makes it panic or allocate more than [`MAX_BYTES`] for the file.
pub fn load(path: &Path) -> Result<Model, StoreError> {
    load_gated(path).map(|(model, _)| model)
}

/// Reads a model file, and its gate if it has one.
///
/// # Errors
/// As [`load`].
pub fn load_gated(path: &Path) -> Result<(Model, Option<Gate>), StoreError> {
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

/// The bytes of a model file. The same model and gate give the same bytes.
///
/// # Errors
/// A header larger than safetensors allows.
pub fn to_bytes(model: &Model, gate: Option<&Gate>) -> Result<Vec<u8>, ContentError> {
    let parts = model.parts();
    let header = Header::of(parts, gate);
    let mut numbers = Numbers::of(parts, gate);
    let shapes = shapes(&header, parts.basis.count());
    let mut tensors: Vec<(&str, Tensor)> = shapes
        .into_iter()
        .map(|(name, shape)| (name, Tensor::of(shape, &numbers.take(name))))
        .collect();
    let header = serde_json::to_string(&header).map_err(ContentError::Header)?;
    let checksum = checksum(&header, tensors.iter().map(|(_, tensor)| tensor.bytes()));
    tensors.push((CHECKSUM, Tensor::of_checksum(checksum)));
    let entry = HashMap::from([(ENTRY.to_owned(), header)]);
    safetensors::serialize(tensors, Some(entry)).map_err(ContentError::Format)
}

/// A model out of the bytes of a file, and its gate if it has one.
///
/// # Errors
/// [`ContentError`]; no bytes make it panic.
pub fn from_bytes(bytes: &[u8]) -> Result<(Model, Option<Gate>), ContentError> {
    let (_, metadata) = SafeTensors::read_metadata(bytes).map_err(ContentError::Format)?;
    let entries = metadata.metadata().as_ref();
    let text = entries
        .and_then(|map| map.get(ENTRY))
        .ok_or(ContentError::NoModel)?;
    let mut header = Header::parse(text)?;
    let tensors = SafeTensors::deserialize(bytes).map_err(ContentError::Format)?;
    let basis = header.basis()?;
    let raw = shapes(&header, basis.count()).into_iter();
    let raw = raw.map(|(name, shape)| Ok((name, data(&tensors, name, Dtype::F64, shape)?)));
    let raw = raw.collect::<Result<Vec<_>, ContentError>>()?;
    let found = data(&tensors, CHECKSUM, Dtype::U32, vec![1])?;
    let found = found
        .iter()
        .rev()
        .fold(0, |sum, &byte| sum << 8 | u32::from(byte));
    let expected = checksum(text, raw.iter().map(|(_, raw)| *raw));
    if found != expected {
        return Err(ContentError::Checksum { found, expected });
    }
    let mut numbers = Numbers::read(raw.into_iter());
    let gate = header.gate(&mut numbers)?;
    Ok((Model::assemble(header.parts(basis, numbers))?, gate))
}

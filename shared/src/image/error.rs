//! What makes no image.

use thiserror::Error;

use crate::onset::OnsetError;
use crate::promp::{BasisError, ModelError};

/// Bytes that are no model, or a model that makes no image.
#[derive(Clone, Copy, Debug, PartialEq, Error)]
pub enum ImageError {
    /// The bytes do not lie where numbers can be read.
    #[error(
        "the image begins at an address that is no multiple of 4: keep it at the start of a page"
    )]
    Alignment,
    /// Other bytes.
    #[error("the image begins with {got:#010x}, not with {expected:#010x}: it is no model")]
    Magic {
        /// What an image begins with.
        expected: u32,
        /// What these bytes begin with.
        got: u32,
    },
    /// Another version of the format.
    #[error("the image is of version {got}, this build reads {expected}: export the model again")]
    Version {
        /// The version of this build.
        expected: u32,
        /// The version found.
        got: u32,
    },
    /// Not as long as it says, or as its sizes say.
    #[error("the image has {got} bytes where its sizes need {expected}")]
    Length {
        /// Bytes needed.
        expected: usize,
        /// Bytes there are.
        got: usize,
    },
    /// Larger than what there is room for.
    #[error("the model's {what} are {got}, there is room for {most}: export it smaller")]
    Capacity {
        /// Which size.
        what: &'static str,
        /// The most that fits.
        most: usize,
        /// The size of the model.
        got: usize,
    },
    /// Descriptions of DoFs that are not as many as the model has.
    #[error("{got} DoFs are described where the model has {expected}")]
    Dofs {
        /// What the model has.
        expected: usize,
        /// What is described.
        got: usize,
    },
    /// Bytes that changed.
    #[error("the image's CRC-32 is {got:#010x}, its bytes give {expected:#010x}: send it again")]
    Crc {
        /// What the bytes give.
        expected: u32,
        /// What is written at the end.
        got: u32,
    },
    /// A code without a meaning.
    #[error("{what} {index} is {got}: no such code")]
    Code {
        /// Which field.
        what: &'static str,
        /// Of which DoF or skill.
        index: usize,
        /// The code.
        got: u8,
    },
    /// A number outside its range.
    #[error("{what} is {value}: give {low} to {high}")]
    Range {
        /// Which number.
        what: &'static str,
        /// The number.
        value: f32,
        /// The least it may be.
        low: f32,
        /// The most it may be.
        high: f32,
    },
    /// A label that is empty, too long, no UTF-8, or has something behind its end.
    #[error("the label of skill {skill} is not 1 to 16 bytes of UTF-8 without zeros, then zeros")]
    Label {
        /// The skill.
        skill: usize,
    },
    /// Labels out of order, or one twice.
    #[error("the label of skill {skill} does not come after the one before it")]
    LabelOrder {
        /// The skill.
        skill: usize,
    },
    /// A role that no DoF has, or two have.
    #[error("{got} DoFs are the human's {what} along axis {axis}: one is needed")]
    Role {
        /// Position or stiffness.
        what: &'static str,
        /// 0 to 2.
        axis: u8,
        /// How many there are.
        got: usize,
    },
    /// A role whose values do not enter so.
    #[error(
        "DoF {dof} enters with the wrong transform: positions as they are, stiffnesses as logarithms"
    )]
    Transform {
        /// The DoF.
        dof: usize,
    },
    /// The buffer to write to is too short.
    #[error("the image needs {needed} bytes, the buffer has {got}")]
    Buffer {
        /// Bytes needed.
        needed: usize,
        /// Bytes there are.
        got: usize,
    },
    /// A basis that cannot be.
    #[error(transparent)]
    Basis(#[from] BasisError),
    /// Tables that inference refuses.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// An onset detector that cannot be.
    #[error(transparent)]
    Onset(#[from] OnsetError),
}

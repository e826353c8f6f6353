//! What the wearable and the host both run: from one scan of surface electromyography (sEMG) to
//! envelopes, arm stiffness, packets, and exact inference in a mixture of Probabilistic Movement
//! Primitives (ProMPs).
//!
//! The crate knows no board, no file, no clock and no radio, allocates nothing, and is written once
//! for `f32` (chip) and `f64` (host). Data flows one way through its rooms:
//!
//! ```text
//! sample -> semg -> stiffness -> pipeline -> wire        promp (model, conditioning) -> image -> recognition
//! ```
#![no_std]

pub mod gatt;
pub mod image;
pub mod onset;
pub mod pipeline;
pub mod promp;
mod real;
pub mod recognition;
pub mod sample;
pub mod semg;
pub mod stiffness;
pub mod wire;

pub use real::Real;

//! Devices that give inputs: each runs in a thread of its own until the program ends.

mod choice;
pub mod replay;
pub mod simulated;

pub use choice::{LinkChoice, NoLink};

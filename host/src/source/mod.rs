//! Devices that give inputs: each runs in a thread of its own until the program ends.

pub mod lsl;
pub mod simulated;

//! Devices beside the chip.

pub mod ads129x;
pub mod lsm6dso;

//! How bytes reach the host.

pub mod serial;
pub mod simulated;

//! How bytes reach the host.

pub mod bridge;
pub mod lsl;
pub mod serial;
pub mod simulated;

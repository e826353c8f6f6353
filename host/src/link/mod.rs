//! How bytes reach the host.

pub mod simulated;

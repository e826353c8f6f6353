//! How bytes reach the host.

pub mod ble;
pub mod bridge;
pub mod lsl;
pub mod myo;
pub mod serial;
pub mod simulated;
pub mod upload;

//! The model as the chip keeps it, and recognition as the chip does it: bytes, numbers, movements.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "test suite"
)]

mod bytes;
mod movements;
mod numbers;
mod simulated;

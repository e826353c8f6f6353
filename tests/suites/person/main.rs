//! A person's calibration from beginning to end: 200 simulated people of known parameters, and real forearms whose armband
//! is turned.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    missing_docs,
    reason = "test suite"
)]

mod coverage;
mod turned;

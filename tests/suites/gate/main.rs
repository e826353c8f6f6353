//! The robot's safety gate: properties, and ten million steps of every fault at once.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    missing_docs,
    reason = "test suite"
)]

mod faults;
mod link;
mod oracle;
mod properties;

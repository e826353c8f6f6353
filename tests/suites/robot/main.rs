//! Robots: the documented receiver of set-points, run as a person would, and the simulated arm's speed.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    missing_docs,
    reason = "test suite"
)]

mod anywhere;
mod receiver;
mod speed;

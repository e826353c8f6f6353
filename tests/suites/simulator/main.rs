//! The simulator is honest before it is used: how hard it is, and how like real muscles.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    reason = "test suite: a helper that cannot go on fails its test"
)]

mod amplitude;
mod chain;
mod difficulty;

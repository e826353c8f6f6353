//! The simulator is honest before it is used: how hard it is, and how like real muscles.
#![allow(missing_docs, reason = "test suite")]

mod amplitude;
mod difficulty;

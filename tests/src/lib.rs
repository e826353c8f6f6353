//! Where the suites find reference values and real recordings, and how they read them.

mod demos;
pub mod frames;
pub mod motion;
mod program;
mod roots;
pub mod wearer;
pub mod work;

pub use demos::demos;
pub use program::{leapc_stand, program};
pub use roots::{covariance_diagonal, triangle};
use std::path::PathBuf;

/// The folder with `data` and `reference` beside the project, or what `TONUS_DATA` names.
///
/// Tests that need a recording call this and fail with the message it gives when there is none: a
/// skipped recording is never a silent pass.
///
/// # Panics
/// When the folder does not exist.
#[must_use]
pub fn recordings() -> PathBuf {
    let path = std::env::var_os("TONUS_DATA").map_or_else(
        || PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../../shared/data"),
        PathBuf::from,
    );
    assert!(
        path.is_dir(),
        "recordings not found at {}: set TONUS_DATA to the folder that holds them",
        path.display()
    );
    path
}

/// Settings of a property test: this many cases, the same ones at every run. `tests/full` asks for more of
/// them by `PROPTEST_CASES`.
#[must_use]
pub fn seeded(cases: u32) -> proptest::test_runner::Config {
    let asked = std::env::var("PROPTEST_CASES").ok();
    proptest::test_runner::Config {
        cases: asked.and_then(|text| text.parse().ok()).unwrap_or(cases),
        failure_persistence: None,
        rng_seed: proptest::test_runner::RngSeed::Fixed(20_260_101),
        ..Default::default()
    }
}

/// The folder with the reference values, beside the recordings.
///
/// # Panics
/// When the folder does not exist.
#[must_use]
pub fn reference() -> PathBuf {
    let path = recordings().join("../reference");
    assert!(
        path.is_dir(),
        "reference values not found at {}",
        path.display()
    );
    path
}

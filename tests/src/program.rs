//! What the project builds beside the suites, for those that use it as a person or a program would.

use std::env::consts::{DLL_PREFIX, DLL_SUFFIX, EXE_SUFFIX};
use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// Path of the `tonus` program itself, built in the profile that the running test was built in.
///
/// # Panics
/// When it does not build.
pub fn program() -> PathBuf {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    let build = || built(&["--package", "tonus", "--bin", "tonus"]);
    let directory = PROGRAM.get_or_init(build);
    directory.join(format!("tonus{EXE_SUFFIX}"))
}

/// Path of the library that stands in for LeapC, likewise.
///
/// # Panics
/// When it does not build.
pub fn leapc_stand() -> PathBuf {
    static STAND: OnceLock<PathBuf> = OnceLock::new();
    let directory = STAND.get_or_init(|| built(&["--package", "tonus-leapc-stand"]));
    directory.join(format!("{DLL_PREFIX}leapc_stand{DLL_SUFFIX}"))
}

/// Builds it, and gives the directory where it lies then.
fn built(what: &[&str]) -> PathBuf {
    // .../target/<profile>/deps/<suite>-<hash>
    let suite = std::env::current_exe().expect("a running test has a path");
    let profile = suite.ancestors().nth(2).expect("cargo runs tests in deps/");
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo
        .args(["build", "--quiet", "--locked"])
        .args(what)
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    if profile.ends_with("release") {
        cargo.arg("--release");
    }
    let status = cargo.status().expect("cargo runs");
    assert!(status.success(), "{what:?} does not build");
    profile.to_owned()
}

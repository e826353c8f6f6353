//! The `tonus` program itself, for suites that use it as a person would.

use std::path::PathBuf;
use std::process::Command;
use std::sync::OnceLock;

/// Path of the program, built in the profile that the running test was built in.
///
/// # Panics
/// When it does not build.
pub fn program() -> PathBuf {
    static PROGRAM: OnceLock<PathBuf> = OnceLock::new();
    PROGRAM.get_or_init(build).clone()
}

fn build() -> PathBuf {
    // .../target/<profile>/deps/<suite>-<hash>
    let suite = std::env::current_exe().expect("a running test has a path");
    let profile = suite.ancestors().nth(2).expect("cargo runs tests in deps/");
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    cargo
        .args([
            "build",
            "--quiet",
            "--locked",
            "--package",
            "tonus",
            "--bin",
            "tonus",
        ])
        .current_dir(env!("CARGO_MANIFEST_DIR"));
    if profile.ends_with("release") {
        cargo.arg("--release");
    }
    let status = cargo.status().expect("cargo runs");
    assert!(status.success(), "the program does not build");
    profile.join(format!("tonus{}", std::env::consts::EXE_SUFFIX))
}

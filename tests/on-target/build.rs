//! Hands the wearable's memory map to the linker: the emulated board has flash and RAM at the same places, and more.

use std::{env, error::Error, fs, path::PathBuf};

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed=../../memory.x");
    println!("cargo::rerun-if-env-changed=TONUS_VECTORS");
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    if env::var_os("TONUS_VECTORS").is_none() {
        return Err("TONUS_VECTORS is not set: build by tests/on-target/run".into());
    }
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let manifest = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    fs::copy(manifest.join("../../memory.x"), out.join("memory.x"))?;
    println!("cargo::rustc-link-search={}", out.display());
    for argument in ["--nmagic", "-Tlink.x"] {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
    Ok(())
}

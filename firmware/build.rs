//! Hands the board's memory map to the linker; a build for the host needs nothing from here.

use std::{env, error::Error, fs, path::PathBuf};

/// Feature of a board as cargo spells it in the environment, and the board's memory map.
const BOARDS: [(&str, &str); 2] = [
    ("CARGO_FEATURE_DK_ADS129X", "../memory.x"),
    ("CARGO_FEATURE_XIAO_ANALOG", "memory-xiao.x"),
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    for (_, map) in BOARDS {
        println!("cargo::rerun-if-changed={map}");
    }
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let mut chosen = BOARDS
        .iter()
        .filter(|(feature, _)| env::var_os(feature).is_some());
    // None or both: the library's `compile_error!` says so in better words.
    let (Some((_, map)), None) = (chosen.next(), chosen.next()) else {
        return Ok(());
    };
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let manifest = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    fs::copy(manifest.join(map), out.join("memory.x"))?;
    println!("cargo::rustc-link-search={}", out.display());
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
    Ok(())
}

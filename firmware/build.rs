//! Hands the board's memory map to the linker; a build for the host needs nothing from here.

use std::{env, error::Error, fs, path::PathBuf};

/// The memory map, of the DK where a board does not say otherwise.
const MAP: &str = "../memory.x";
/// Feature of a board as cargo spells it in the environment, and what the linker reads before [`MAP`].
const BOARDS: [(&str, Option<&str>); 2] = [
    ("CARGO_FEATURE_DK_ADS129X", None),
    ("CARGO_FEATURE_XIAO_ANALOG", Some("memory-xiao.x")),
];

fn main() -> Result<(), Box<dyn Error>> {
    println!("cargo::rerun-if-changed=build.rs");
    println!("cargo::rerun-if-changed={MAP}");
    for script in BOARDS.iter().filter_map(|(_, script)| *script) {
        println!("cargo::rerun-if-changed={script}");
    }
    if env::var("CARGO_CFG_TARGET_OS")? != "none" {
        return Ok(());
    }
    let mut chosen = BOARDS
        .iter()
        .filter(|(feature, _)| env::var_os(feature).is_some());
    // None or both: the library's `compile_error!` says so in better words.
    let (Some((_, script)), None) = (chosen.next(), chosen.next()) else {
        return Ok(());
    };
    let out = PathBuf::from(env::var("OUT_DIR")?);
    let manifest = PathBuf::from(env::var("CARGO_MANIFEST_DIR")?);
    fs::copy(manifest.join(MAP), out.join("memory.x"))?;
    println!("cargo::rustc-link-search={}", out.display());
    if let Some(script) = script {
        let script = manifest.join(script);
        println!("cargo::rustc-link-arg-bins=-T{}", script.display());
    }
    for argument in ["--nmagic", "-Tlink.x", "-Tdefmt.x"] {
        println!("cargo::rustc-link-arg-bins={argument}");
    }
    Ok(())
}

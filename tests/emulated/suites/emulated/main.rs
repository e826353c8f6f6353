//! The wired image of the DK, executed: what leaves its serial port against what the host computes.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "test suite"
)]

mod bare;
mod damaged;
mod faults;
mod guest;
mod receiving;
mod recording;
mod streaming;

// The outbox of the wearable locks by it.
use critical_section as _;

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use tonus_emulated::world::{Converter, World};
use tonus_emulated::{Image, Machine, Stop};
use tonus_shared::wire::{Frame, cobs::Unframer, decode};

/// AIN0, by the number that PSELP has for it.
const AIN0: u32 = 1;

/// The image, built from this tree once.
fn image() -> Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE
        .get_or_init(|| Image::read(std::fs::read(built()).unwrap()).unwrap())
        .clone()
}

/// Builds the image as `cargo firmware-wired` does and gives its path.
fn built() -> std::path::PathBuf {
    let root = Path::new(env!("CARGO_MANIFEST_DIR")).join("../..");
    let mut cargo = Command::new(std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into()));
    let status = cargo
        .args(["firmware-wired", "--quiet"])
        .current_dir(&root)
        .status()
        .unwrap();
    assert!(status.success(), "the wired image does not build");
    let target =
        std::env::var_os("CARGO_TARGET_DIR").map_or_else(|| root.join("target"), Into::into);
    target.join("thumbv7em-none-eabihf/firmware/tonus-firmware")
}

/// A wearer whose biceps gives these counts, over and over.
fn wearer(counts: Vec<i16>) -> World {
    World {
        seed: 20_260_101,
        converter: Converter::with_signals(vec![(AIN0, counts)]),
        ..World::default()
    }
}

/// A machine that has run for this long, in microseconds, without a fault or a reset.
fn ran(world: World, us: u64) -> Machine {
    let mut machine = Machine::new(image(), world).unwrap();
    assert_eq!(
        machine.run_until(us),
        Ok(Stop::Time),
        "log: {:#?}",
        machine.log()
    );
    machine
}

/// What the chip sent so far: every frame with the time, in microseconds, at which its block was complete. Nothing
/// else may be on the line.
fn frames(machine: &Machine) -> Vec<(u64, Frame)> {
    frames_since(machine, 0)
}

/// The same from a time on, at which no frame was on the line or the chip was reset.
fn frames_since(machine: &Machine, from_us: u64) -> Vec<(u64, Frame)> {
    let mut unframer: Unframer = Unframer::new();
    let mut frames = Vec::new();
    let sent = machine.world().unwrap().serial.sent.iter();
    for (cycle, byte) in sent.filter(|(cycle, _)| *cycle >= from_us * 64) {
        if let Some(bytes) = unframer.push(*byte).unwrap() {
            frames.push((cycle / 64, decode(bytes).unwrap()));
        }
    }
    frames
}

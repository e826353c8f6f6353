//! The wired image of the DK, executed: what leaves its serial port against what the host computes.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "test suite"
)]

// The outbox of the wearable locks by it.
use critical_section as _;

use std::path::Path;
use std::process::Command;
use std::sync::OnceLock;

use tonus_emulated::device::{
    ads129x::{Ads129x, Wires},
    lsm6dso::Lsm6dso,
};
use tonus_emulated::world::World;
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

/// How the DK's board file wires the ADS1294: SCLK P0.27, DIN P0.26, DOUT P0.04, CS P0.28, DRDY P0.29, START P0.30, RESET P0.31.
const CONVERTER: Wires = Wires {
    bus: [27, 26, 4],
    select: 28,
    ready: 29,
    start: Some(30),
    reset: Some(31),
};
/// SCL P0.25, SDA P1.08; SA0 is pulled up.
const SENSOR: ([u32; 2], u8) = ([25, 40], 0x6b);

/// A wearer whose four channels give these counts, over and over.
fn wearer(counts: Vec<Vec<i32>>) -> World {
    World {
        seed: 20_260_101,
        ads: Some(Ads129x::new(CONVERTER, counts)),
        imu: Some(Lsm6dso::new(SENSOR.1, SENSOR.0)),
        ..World::default()
    }
}

#[test]
fn smoke() {
    let mut machine = Machine::new(image(), wearer(vec![vec![100, -100]; 4])).unwrap();
    let stop = machine.run_until(4_000_000);
    println!("{stop:?} {:#?}", machine.log());
    let mut kinds = std::collections::BTreeMap::new();
    for (at, frame) in frames(&machine) {
        *kinds.entry(format!("{}", frame.packet.kind())).or_insert(0) += 1;
        if matches!(frame.packet.kind(), tonus_shared::wire::Kind::Status) {
            println!("{at} {frame:?}");
        }
    }
    println!(
        "{kinds:?} {} instructions {}",
        machine.now_us(),
        machine.instructions()
    );
    let ads = machine.world().unwrap().ads.as_ref().unwrap();
    println!("conversions {}", ads.converted.len());
    panic!();
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
    let mut unframer: Unframer = Unframer::new();
    let mut frames = Vec::new();
    for (cycle, byte) in &machine.world().unwrap().serial.sent {
        if let Some(bytes) = unframer.push(*byte).unwrap() {
            frames.push((cycle / 64, decode(bytes).unwrap()));
        }
    }
    frames
}

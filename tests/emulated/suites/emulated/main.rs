//! The wired image of the DK, executed: what leaves its serial port against what the host computes.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "test suite"
)]

mod acquisition;
mod attitude;
mod bare;
mod damaged;
mod faults;
mod guest;
mod host;
mod lost;
mod models;
mod power;
mod receiving;
mod recognising;
mod recording;
mod streaming;
mod uploading;

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
use tonus_shared::wire::{Frame, Packet, Status, cobs::Unframer, decode};

/// How the DK's board file wires the ADS1294: SCLK P0.27, DIN P0.26, DOUT P0.04, CS P0.28, DRDY P0.29, START P0.30,
/// RESET P0.31.
const CONVERTER: Wires = Wires {
    bus: [27, 26, 4],
    select: 28,
    ready: 29,
    start: Some(30),
    reset: Some(31),
};
/// The LSM6DSO: SA0 pulled up; SCL P0.25, SDA P1.08.
const SENSOR_ADDRESS: u8 = 0x6B;
const SENSOR_WIRES: [u32; 2] = [25, 40];
/// 1 g along z at +-4 g: 0.122 mg a count.
const AT_REST: [i16; 6] = [0, 0, 0, 0, 0, 8197];

/// The image, built from this tree once.
fn image() -> Image {
    static IMAGE: OnceLock<Image> = OnceLock::new();
    IMAGE
        .get_or_init(|| Image::read(std::fs::read(built()).unwrap()).unwrap())
        .clone()
}

/// Of the project.
fn root() -> std::path::PathBuf {
    Path::new(env!("CARGO_MANIFEST_DIR")).join("../..")
}

/// Builds the image as `cargo firmware-wired` does and gives its path.
fn built() -> std::path::PathBuf {
    let root = root();
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

/// A wearer whose four channels give these counts, over and over, and whose arm is still.
fn wearer(counts: Vec<Vec<i32>>) -> World {
    let mut imu = Lsm6dso::new(SENSOR_ADDRESS, SENSOR_WIRES);
    imu.measure(AT_REST);
    let mut world = World {
        seed: 20_260_101,
        ads: Some(Ads129x::new(CONVERTER, counts)),
        imu: Some(imu),
        ..World::default()
    };
    // Nobody presses it: its pull-up is drawn here.
    world.pins.set(SELF_TEST, true);
    world
}

/// Button 2, which asks the converter to measure itself at start; low while it is pressed.
const SELF_TEST: u32 = 12;

/// One whose muscles do nothing; the amplifier's noise is there.
fn quiet() -> World {
    wearer(
        (0..4)
            .map(|channel| vec![300 + channel, -300, 40, -40])
            .collect(),
    )
}

/// The image with a quiet wearer, running.
fn started() -> Machine {
    ran(quiet(), STARTED_US)
}

/// When the image surely streams.
const STARTED_US: u64 = 1_500_000;

fn converter(machine: &Machine) -> &Ads129x {
    machine.world().unwrap().ads.as_ref().unwrap()
}

fn converter_mut(machine: &mut Machine) -> &mut Ads129x {
    machine.world_mut().unwrap().ads.as_mut().unwrap()
}

fn last_status(frames: &[(u64, Frame)]) -> Status {
    let status = |(_, frame): &(u64, Frame)| match frame.packet {
        Packet::Status(status) => Some(status),
        _ => None,
    };
    frames.iter().rev().find_map(status).unwrap()
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

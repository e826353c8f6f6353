//! The ways by which a live program hears of its devices: a Myo's packets, a serial port that comes and goes, a Leap
//! service, BlueZ's pairing on a bus of our own, and what a computer without Bluetooth is told. The radio itself is
//! `tests/air`.
#![allow(
    clippy::unwrap_used,
    clippy::expect_used,
    clippy::panic,
    reason = "test suite"
)]

mod attitude;
#[cfg(target_os = "linux")]
mod bluez;
mod hand;
mod myo;
mod scan;
mod serial;

use std::time::{Duration, Instant};

use tonus::live::{Input, Inputs, Timed};

/// Long enough for anything here on a busy machine.
const PATIENCE: Duration = Duration::from_secs(20);

/// What comes up to the first input that is `wanted`, that one included.
fn until(inputs: &Inputs, wanted: impl Fn(&Input) -> bool) -> Vec<Timed> {
    let end = Instant::now() + PATIENCE;
    let mut all = Vec::new();
    while Instant::now() < end {
        if let Some(timed) = inputs.next(Duration::from_millis(20)) {
            let found = wanted(&timed.input);
            all.push(timed);
            if found {
                return all;
            }
        }
    }
    panic!("it did not come; this did: {all:?}");
}

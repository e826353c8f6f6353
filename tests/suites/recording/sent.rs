//! A wearable that says what a test wants.

use std::path::Path;

use tonus::live::{Input, Timed};
use tonus::recording::{Entry, Recorder};
use tonus_shared::wire::{Configuration, Header, Muscle, Packet};
use tonus_tests::frames::bytes_of;

use crate::child;

const BOOT: u32 = 0xB007;
/// The wearable's clock when the session began.
pub(crate) const DEVICE_US: u64 = 7_000_000;
/// A packet takes so long.
const DELAY_US: u64 = 3000;
/// Scale of the recording: ten microvolts a count is much, so that numbers are easily checked.
pub(crate) fn configuration(microvolts_per_count: f32) -> Configuration {
    let mut muscles = [Muscle::Absent; 8];
    muscles[0] = Muscle::BicepsShort;
    muscles[1] = Muscle::TricepsLong;
    Configuration {
        semg_hz: 1000.0,
        stream_hz: 100.0,
        volts_per_count: microvolts_per_count * 1e-6,
        offset_counts: 100,
        chain_delay_us: 30_000,
        channels: 2,
        muscles,
        mains_hz: Some(50),
        raw: true,
        firmware_hash: [0; 8],
    }
}

/// Packets and other inputs, with their times.
#[derive(Default)]
pub(crate) struct Sender {
    pub(crate) entries: Vec<(u64, Input)>,
    sequence: u32,
}

impl Sender {
    /// Sends at this device time; it comes `DELAY_US` and `late_us` after.
    pub(crate) fn send(&mut self, device_us: u64, packet: &Packet, late_us: u64) {
        let header = Header {
            boot_id: BOOT,
            sequence: self.sequence,
            device_us,
        };
        self.sequence += 1;
        let at_us = device_us - DEVICE_US + DELAY_US + late_us;
        let bytes = bytes_of(&header, packet).expect("a sound packet");
        self.entries.push((at_us, Input::Frame(bytes)));
    }

    /// Records everything in the order of its times.
    pub(crate) fn record(mut self, path: &Path) {
        self.entries.sort_by_key(|(at_us, _)| *at_us);
        let recorder = Recorder::create(path, &child::opening()).expect("a new file");
        for (at_us, input) in self.entries {
            recorder.note(Entry::Input(Timed { at_us, input }));
        }
        recorder.finish().expect("written");
    }
}

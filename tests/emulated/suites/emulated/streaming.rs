//! Five seconds (sixty with `TONUS_FULL`) of real sEMG.

use embassy_futures::poll_once;
use tonus_emulated::Machine;
use tonus_firmware::acquisition::{CHANNELS, MUSCLES, PERIOD_US, RATE_HZ};
use tonus_firmware::afe::ads129x::{self, Settings};
use tonus_firmware::outbox::Outbox;
use tonus_firmware::signal_path::SignalPath;
use tonus_shared::pipeline::illustrative;
use tonus_shared::sample::Scan;
use tonus_shared::wire::{Control, Frame, Packet, Stream, decode};

use super::{converter, frames, frames_since, host, last_status, ran, recording, wearer};

/// Scans between two stream frames.
const STREAM_SCANS: usize = 10;

fn seconds() -> u64 {
    if std::env::var_os("TONUS_FULL").is_some() {
        60
    } else {
        5
    }
}

/// The counts of every conversion that was made.
fn counts(machine: &Machine) -> Vec<[i32; CHANNELS]> {
    let conversions = converter(machine).converted.iter();
    conversions
        .map(|conversion| *conversion.counts.first_chunk().unwrap())
        .collect()
}

fn streams(frames: &[(u64, Frame)]) -> Vec<Stream> {
    let stream = |(_, frame): &(u64, Frame)| match frame.packet {
        Packet::Stream(stream) => Some(stream),
        _ => None,
    };
    frames.iter().filter_map(stream).collect()
}

/// What the same code makes on the host of these counts, every one a scan.
fn computed(counts: &[[i32; CHANNELS]], boot_id: u32) -> Vec<Stream> {
    let outbox = Outbox::new();
    let board = ads129x::board::<CHANNELS>(boot_id, &Settings::surface_emg()).unwrap();
    let mut path = SignalPath::new(board, &illustrative(MUSCLES, RATE_HZ)).unwrap();
    let mut frames = Vec::new();
    for (index, counts) in (0..).zip(counts) {
        let scan = Scan {
            index,
            acquired_us: u64::from(index * PERIOD_US),
            counts: *counts,
        };
        path.push_scan(&scan, &outbox).unwrap();
        while poll_once(async { frames.push((0, decode(&outbox.take().await).unwrap())) })
            .is_ready()
        {}
    }
    streams(&frames)
}

#[test]
fn real_semg_streams_as_the_host_computes_it_and_no_scan_is_lost() {
    // Without its attitude sensor: which scan an attitude comes between, no packet says.
    let mut world = wearer(recording::lift());
    world.imu = None;
    let machine = ran(world, seconds() * 1_000_000);
    let sent = frames(&machine);
    let chip = streams(&sent);
    let counts = counts(&machine);
    let host = computed(&counts, sent[0].1.header.boot_id);
    // The last ones may still be on the line.
    let waiting = host.len().checked_sub(chip.len());
    assert!(
        waiting.is_some_and(|waiting| waiting <= 2),
        "{} of {}",
        chip.len(),
        host.len()
    );
    for (number, (chip, host)) in chip.iter().zip(&host).enumerate() {
        assert_eq!(chip, host, "stream packet {number}");
    }
    assert!(counts.len() as u64 > (seconds() - 1) * u64::from(RATE_HZ));
    // The first scan makes one.
    assert!(counts.len().div_ceil(STREAM_SCANS).abs_diff(chip.len()) <= 2);
    let status = last_status(&sent);
    assert_eq!(
        (
            status.overruns,
            status.missed_scans,
            status.gaps,
            status.refused
        ),
        (0, 0, 0, 0)
    );
    report(&machine, &sent);
}

#[test]
fn raw_semg_is_what_the_converter_gave_to_the_count() {
    let mut machine = ran(wearer(recording::lift()), 1_500_000);
    let raw = Packet::Control(Control::Raw(true));
    assert_eq!(
        host::ask(&mut machine, 1, raw).map(|(outcome, _)| outcome),
        Some(Ok(()))
    );
    let from_us = machine.now_us();
    let end_us = from_us + (seconds() - 2) * 1_000_000;
    machine.run_through(end_us).unwrap();
    let counts = counts(&machine);
    let mut compared = 0;
    for (_, frame) in frames(&machine) {
        let Packet::RawSemg(raw) = frame.packet else {
            continue;
        };
        let first = raw.first_index as usize;
        for (number, scan) in raw.counts.chunks_exact(CHANNELS).enumerate() {
            assert_eq!(scan, counts[first + number], "scan {}", first + number);
            compared += 1;
        }
    }
    let sent = frames_since(&machine, 0);
    assert_eq!(last_status(&sent).dropped_packets, 0);
    assert!(compared as u64 > (seconds() - 3) * 1000, "{compared}");
}

/// The recording holds a lift: the envelope must show it, or the comparison above compared silence.
#[test]
fn the_lift_shows_in_the_envelope() {
    let machine = ran(wearer(recording::lift()), 5_000_000);
    let first_us = converter(&machine).converted[0].at / 64;
    let envelope = |from_s: f64, to_s: f64| {
        let values: Vec<f32> = frames(&machine)
            .iter()
            .filter(|(at_us, _)| {
                let t_s = (*at_us as f64 - first_us as f64) / 1e6;
                (from_s..to_s).contains(&t_s)
            })
            .filter_map(|(_, frame)| match &frame.packet {
                Packet::Stream(stream) => Some(stream.envelopes[0]),
                _ => None,
            })
            .collect();
        values.iter().sum::<f32>() / values.len() as f32
    };
    // The data's description: biceps at rest until 0.45 s, at most while the box is picked up (1.6 to 2.6 s).
    let (rest, lift) = (envelope(0.3, 0.45), envelope(1.8, 2.8));
    assert!(
        lift > 4.0 * rest.max(1e-3),
        "at rest {rest}, lifting {lift}"
    );
}

#[test]
fn frames_are_dated_when_their_newest_scan_was_converted() {
    let machine = ran(wearer(recording::lift()), 3_000_000);
    let converted = &converter(&machine).converted;
    // The device clock starts when the image starts it: the difference to the machine's is constant, but for one
    // period of the 32,768 Hz clock and the way to the processor.
    let mut differences = Vec::new();
    let streams = frames(&machine)
        .into_iter()
        .filter(|(_, frame)| matches!(frame.packet, Packet::Stream(_)));
    for (number, (complete_us, frame)) in streams.enumerate() {
        // The first scan is sent at once, then every tenth.
        let converted_us = converted[number * STREAM_SCANS].at / 64;
        differences.push(converted_us as i64 - frame.header.device_us as i64);
        // The line takes 1 ms for a frame of 97 bytes.
        assert!(
            complete_us - converted_us < 4_000,
            "{}",
            complete_us - converted_us
        );
    }
    let (least, most) = (
        differences.iter().min().unwrap(),
        differences.iter().max().unwrap(),
    );
    assert!(differences.len() > 200);
    assert!(
        most - least < 150,
        "the dates wander by {} us",
        most - least
    );
}

#[test]
fn two_runs_give_the_same_bytes_at_the_same_cycles() {
    let run = || {
        let machine = ran(wearer(recording::lift()), 2_500_000);
        let serial = machine.world().unwrap().serial.sent.clone();
        (serial, machine.instructions(), machine.log().to_vec())
    };
    assert_eq!(run(), run());
}

/// One instruction is one cycle here, so this is less than silicon needs.
fn report(machine: &Machine, sent: &[(u64, Frame)]) {
    let first_us = converter(machine).converted[0].at / 64;
    let awake = machine.instructions() as f64;
    let slept_s = machine.now_us() as f64 / 1e6;
    println!(
        "emulated: {} frames in {:.1} s; {:.2} million instructions a second, the start-up of {:.2} s counted \
         (one instruction taken as one cycle: optimistic)",
        sent.len(),
        slept_s,
        awake / slept_s / 1e6,
        first_us as f64 / 1e6,
    );
}

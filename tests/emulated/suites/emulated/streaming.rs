//! Five seconds (sixty with `TONUS_FULL`) of real sEMG.

use embassy_futures::poll_once;
use tonus_emulated::Machine;
use tonus_firmware::acquisition::{BUFFER_SCANS, PERIOD_US, RATE_HZ, ScanClock};
use tonus_firmware::afe::saadc;
use tonus_firmware::outbox::Outbox;
use tonus_firmware::signal_path::SignalPath;
use tonus_shared::pipeline::illustrative;
use tonus_shared::wire::{Frame, Packet, decode};

use super::{frames, ran, recording, wearer};

/// Scans between two stream frames.
const STREAM_SCANS: usize = 10;

fn seconds() -> u64 {
    if std::env::var_os("TONUS_FULL").is_some() {
        60
    } else {
        5
    }
}

/// What the same code makes on the host of the counts that the chip's converter gave.
fn computed(machine: &Machine, boot_id: u32) -> Vec<Frame> {
    let counts: Vec<[i16; 1]> = machine
        .world()
        .unwrap()
        .converter
        .converted
        .iter()
        .map(|(.., count)| [*count])
        .collect();
    let outbox = Outbox::new();
    let calibration = illustrative(saadc::MUSCLES, RATE_HZ);
    let mut path = SignalPath::new(saadc::board(boot_id).unwrap(), &calibration).unwrap();
    let mut clock = ScanClock::new(PERIOD_US, BUFFER_SCANS as u32);
    let mut frames = Vec::new();
    for (number, buffer) in (1_u64..).zip(counts.chunks_exact(BUFFER_SCANS)) {
        let seen_us = number * BUFFER_SCANS as u64 * 1_000_000 / u64::from(RATE_HZ);
        let block = clock.buffer_full(seen_us);
        let buffer: &[[i16; 1]; BUFFER_SCANS] = buffer.try_into().unwrap();
        path.buffer_full(block, PERIOD_US, buffer, &outbox).unwrap();
        while poll_once(async { frames.push(decode(&outbox.take().await).unwrap()) }).is_ready() {}
    }
    frames
}

#[test]
fn real_semg_streams_as_the_host_computes_it_and_no_scan_is_lost() {
    let machine = ran(wearer(recording::biceps()), seconds() * 1_000_000);
    let sent = frames(&machine);
    let expected = computed(&machine, sent[0].1.header.boot_id);
    // The last ones may still be on the line.
    let waiting = expected.len().checked_sub(sent.len());
    assert!(
        waiting.is_some_and(|waiting| waiting <= 2),
        "{} of {}",
        sent.len(),
        expected.len()
    );
    for ((_, chip), host) in sent.iter().zip(&expected) {
        assert_eq!(chip.packet, host.packet, "packet {}", chip.header.sequence);
        assert_eq!(chip.header.sequence, host.header.sequence);
        assert_eq!(chip.header.boot_id, host.header.boot_id);
    }
    let converter = &machine.world().unwrap().converter;
    assert_eq!(converter.missed, 0);
    let scans = converter.converted.len();
    assert!(scans as u64 > (seconds() - 1) * u64::from(RATE_HZ));
    let streams = sent
        .iter()
        .filter(|(_, frame)| matches!(frame.packet, Packet::Stream(_)))
        .count();
    assert!(
        // The first scan makes one.
        scans.div_ceil(STREAM_SCANS).abs_diff(streams) <= 1,
        "{streams} stream frames of {scans} scans"
    );
    for (_, frame) in &sent {
        if let Packet::Status(status) = frame.packet {
            assert_eq!(
                (
                    status.overruns,
                    status.missed_scans,
                    status.gaps,
                    status.refused
                ),
                (0, 0, 0, 0)
            );
        }
    }
    report(&machine, &sent);
}

/// The recording holds a lift: the envelope must show it, or the comparison above compared silence.
#[test]
fn the_lift_shows_in_the_envelope() {
    let machine = ran(wearer(recording::biceps()), 5_000_000);
    let envelope = |from_s: f64, to_s: f64| {
        let first_us = machine.world().unwrap().converter.converted[0].0 / 64;
        let values: Vec<f32> = frames(&machine)
            .iter()
            .filter(|(at_us, _)| {
                let t_s = (at_us - first_us) as f64 / 1e6;
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
    let machine = ran(wearer(recording::biceps()), 3_000_000);
    let converted = &machine.world().unwrap().converter.converted;
    // The device clock starts when the image starts it: the difference to the machine's is constant, but for one
    // period of the 32,768 Hz clock and the way to the processor.
    let mut differences = Vec::new();
    let streams = frames(&machine)
        .into_iter()
        .filter(|(_, frame)| matches!(frame.packet, Packet::Stream(_)));
    for (number, (complete_us, frame)) in streams.enumerate() {
        // The first scan is sent at once, then every tenth.
        let (cycle, ..) = converted[number * STREAM_SCANS];
        let converted_us = cycle / 64;
        differences.push(converted_us as i64 - frame.header.device_us as i64);
        // A frame waits for the end of its buffer, then for the line.
        assert!(
            complete_us - converted_us < 8_000,
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
        let machine = ran(wearer(recording::biceps()), 1_500_000);
        let serial = machine.world().unwrap().serial.sent.clone();
        (serial, machine.instructions(), machine.log().to_vec())
    };
    assert_eq!(run(), run());
}

/// One instruction is one cycle here, so this is less than silicon needs.
fn report(machine: &Machine, sent: &[(u64, Frame)]) {
    let first_us = machine.world().unwrap().converter.converted[0].0 / 64;
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

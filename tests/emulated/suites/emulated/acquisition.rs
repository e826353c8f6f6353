//! What becomes of scans when converter, bus or electrodes fail.

use tonus_emulated::Machine;
use tonus_firmware::acquisition::CHANNELS;
use tonus_shared::semg::quality::Quality;
use tonus_shared::wire::{Control, Frame, Packet, StatusFlags, StreamFlags};

use super::{
    SELF_TEST, STARTED_US, converter, converter_mut, frames_since, host, last_status, started,
};

/// Every scan that came since a time: its index and counts.
fn scans(machine: &Machine, from_us: u64) -> Vec<(usize, Vec<i32>)> {
    let mut scans = Vec::new();
    for (_, frame) in frames_since(machine, from_us) {
        if let Packet::RawSemg(raw) = frame.packet {
            let counts = raw.counts.chunks_exact(CHANNELS);
            scans.extend((raw.first_index as usize..).zip(counts.map(<[i32]>::to_vec)));
        }
    }
    scans
}

/// One that sends raw sEMG; each conversion has counts of its own.
fn raw() -> Machine {
    let signals = (0..4).map(|channel| (0..10_000).map(|n| 7 * n + channel).collect());
    let mut machine = super::ran(super::wearer(signals.collect()), STARTED_US);
    let raw = Packet::Control(Control::Raw(true));
    assert_eq!(
        host::ask(&mut machine, 1, raw).map(|(outcome, _)| outcome),
        Some(Ok(()))
    );
    machine
}

fn gap(frames: &[(u64, Frame)]) -> bool {
    frames.iter().any(|(_, frame)| {
        matches!(&frame.packet, Packet::Stream(stream) if stream.flags.contains(StreamFlags::GAP))
    })
}

/// Every scan has the counts of the conversion with its index, but those whose index is missing.
fn assert_missing(machine: &Machine, missing: &[usize]) {
    let scans = scans(machine, 0);
    let converted = &converter(machine).converted;
    for (index, counts) in &scans {
        assert_eq!(
            counts[..],
            converted[*index].counts[..CHANNELS],
            "scan {index}"
        );
    }
    let (first, last) = (scans[0].0, scans[scans.len() - 1].0);
    let came: Vec<usize> = scans.into_iter().map(|(index, _)| index).collect();
    let expected: Vec<usize> = (first..=last)
        .filter(|index| !missing.contains(index))
        .collect();
    assert_eq!(came, expected);
    let status = last_status(&frames_since(machine, 0));
    assert_eq!(status.missed_scans as usize, missing.len());
    assert!(gap(&frames_since(machine, 0)));
}

#[test]
fn a_missed_edge_is_a_gap_of_one_scan_and_shifts_none() {
    let mut machine = raw();
    let next = converter(&machine).converted.len();
    converter_mut(&mut machine).missed_edges = vec![next as u64 + 100];
    machine.run_through(machine.now_us() + 2_000_000).unwrap();
    assert_missing(&machine, &[next + 100]);
}

#[test]
fn a_slipped_frame_is_dropped_and_marked() {
    let mut machine = raw();
    let next = converter(&machine).converted.len();
    converter_mut(&mut machine).slipped = vec![(next as u64 + 100, 1)];
    machine.run_through(machine.now_us() + 2_000_000).unwrap();
    assert_missing(&machine, &[next + 100]);
}

#[test]
fn a_ready_line_that_rests_for_three_periods_restarts_the_converter_and_marks_the_gap() {
    let mut machine = raw();
    let next = converter(&machine).converted.len() as u64;
    converter_mut(&mut machine).missed_edges = (next + 100..next + 103).collect();
    machine.run_through(machine.now_us() + 3_000_000).unwrap();
    let frames = frames_since(&machine, 0);
    let status = last_status(&frames);
    assert!(gap(&frames));
    assert_eq!(status.gaps, 1);
    // Setting it up takes a third of a second, of which its own tests are the most.
    assert!(
        (2..500).contains(&status.missed_scans),
        "{}",
        status.missed_scans
    );
    assert!(!status.flags.contains(StatusFlags::FRONT_END_FAILED));
    // What came is some conversion each, in order, without a stranger.
    let converted = &converter(&machine).converted;
    let mut conversions = converted.iter();
    for (index, counts) in scans(&machine, 0) {
        let found = conversions.any(|conversion| conversion.counts[..CHANNELS] == counts[..]);
        assert!(found, "scan {index}");
    }
    assert_eq!(machine.resets(), []);
}

#[test]
fn a_dead_bus_stops_the_stream_says_so_and_comes_back() {
    for level in [false, true] {
        let mut machine = started();
        converter_mut(&mut machine).dead = Some(level);
        let dead_us = machine.now_us() + 500_000;
        machine.run_through(dead_us + 5_000_000).unwrap();
        let since = frames_since(&machine, dead_us);
        let invented = since
            .iter()
            .any(|(_, frame)| matches!(frame.packet, Packet::Stream(_)));
        assert!(!invented, "stuck at {level}");
        // Nothing that the image says needs the converter; but it lives.
        assert_eq!(machine.resets(), [], "stuck at {level}");
        converter_mut(&mut machine).dead = None;
        let mended_us = machine.now_us();
        machine.run_through(mended_us + 3_000_000).unwrap();
        let after = frames_since(&machine, mended_us);
        let streams = after
            .iter()
            .filter(|(_, frame)| matches!(frame.packet, Packet::Stream(_)));
        assert!(streams.count() > 100, "stuck at {level}");
        assert!(gap(&after));
        let flags = last_status(&after).flags;
        assert!(!flags.contains(StatusFlags::FRONT_END_FAILED));
    }
}

#[test]
fn an_electrode_that_comes_off_shows_within_a_tenth_of_a_second() {
    let mut machine = started();
    converter_mut(&mut machine).lead_off = [0b0100, 0];
    let off_us = machine.now_us();
    machine.run_through(off_us + 110_000).unwrap();
    let newest = frames_since(&machine, off_us)
        .into_iter()
        .rev()
        .find_map(|(_, frame)| match frame.packet {
            Packet::Stream(stream) => Some(stream),
            _ => None,
        })
        .unwrap();
    let off: Vec<bool> = newest.quality[..CHANNELS]
        .iter()
        .map(|quality| quality.contains(Quality::LEAD_OFF))
        .collect();
    assert_eq!(off, [false, false, true, false]);
}

#[test]
fn the_converter_measures_itself_when_its_button_is_held_and_then_gives_scans() {
    let mut world = super::wearer(vec![vec![1_000]; CHANNELS]);
    world.pins.set(SELF_TEST, false);
    let machine = super::ran(world, 4_500_000);
    let said = |line: &&String| line.contains("self-test");
    let lines: Vec<&String> = machine.log().iter().filter(said).collect();
    assert_eq!(lines.len(), 1, "{:#?}", machine.log());
    let (signal, noise) = lines[0].split_once("noise").unwrap();
    let volts = |text: &str| -> Vec<f64> {
        let numbers = text.split(|c: char| !c.is_ascii_digit() && !"e.-".contains(c));
        numbers.filter_map(|number| number.parse().ok()).collect()
    };
    // 1 mV by the datasheet; the model's channels make no noise.
    let signal = volts(signal);
    assert_eq!(signal.len(), CHANNELS, "{}", lines[0]);
    assert!(
        signal.iter().all(|volts| (volts - 1e-3).abs() < 1e-6),
        "{signal:?}"
    );
    assert_eq!(volts(noise), [0.0; CHANNELS]);
    assert!(frames_since(&machine, 3_500_000).len() > 50, "it streams");

    let untested = frames_since(&started(), 0);
    assert!(untested.len() > 50, "half a second after the start");
}

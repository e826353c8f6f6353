use std::{task::Poll, vec::Vec};

use embassy_futures::poll_once;
use tonus_shared::wire::{Packet, Status, Stream, StreamFlags, decode};

use super::*;

/// A burst of 100 Hz around the bias, its amplitude in counts.
fn buffer(number: u32, amplitude: f64) -> [[i16; CHANNELS]; BUFFER_SCANS] {
    core::array::from_fn(|scan| {
        let t_s = f64::from(number) * 0.005 + scan as f64 * 0.001;
        let volts = amplitude * (2.0 * core::f64::consts::PI * 100.0 * t_s).sin();
        [(f64::from(BIAS_COUNTS) + volts).round() as i16]
    })
}

/// Every frame that leaves within these buffers; those in `lost` never come.
fn run(buffers: u32, lost: core::ops::Range<u32>, amplitude: f64) -> Vec<Frame> {
    let outbox = Outbox::new();
    let mut path = SignalPath::new(0xB007).unwrap();
    let mut frames = Vec::new();
    for number in (0..buffers).filter(|number| !lost.contains(number)) {
        let end_us = 10_000 + u64::from(number) * 5_000;
        path.buffer_full(end_us, &buffer(number, amplitude), &outbox)
            .unwrap();
        while poll_once(async { frames.push(decode(&outbox.take().await).unwrap()) }).is_ready() {}
    }
    frames
}

fn streams(frames: &[Frame]) -> Vec<Stream> {
    frames
        .iter()
        .filter_map(|frame| match &frame.packet {
            Packet::Stream(stream) => Some(*stream),
            _ => None,
        })
        .collect()
}

#[test]
fn two_seconds_give_200_stream_frames_with_configuration_and_status_between() {
    let frames = run(400, 0..0, 0.0);
    assert_eq!(streams(&frames).len(), 200);
    let configurations = frames
        .iter()
        .filter(|frame| matches!(frame.packet, Packet::Configuration(_)))
        .count();
    assert_eq!(configurations, 2);
    assert!(frames.iter().all(|frame| frame.header.boot_id == 0xB007));
    let mut sequence: Vec<u32> = frames.iter().map(|frame| frame.header.sequence).collect();
    sequence.sort_unstable();
    assert!(sequence.into_iter().eq(0..frames.len() as u32), "none lost");
}

#[test]
fn a_contraction_shows_in_the_envelope_at_its_mean_magnitude() {
    // 100 counts of 3.6 V / 4096 / 200: 439.5 uV; mean magnitude 2 / pi of it, 279.8 uV. Rest 10 uV and
    // maximum 500 uV make 0.5506. The 20 Hz high-pass leaves 0.9992 of 100 Hz; rounding adds its noise.
    let last = *streams(&run(400, 0..0, 100.0)).last().unwrap();
    assert!(
        (last.envelopes[0] - 0.5506).abs() < 0.01,
        "{}",
        last.envelopes[0]
    );
    assert_eq!(last.channels, 1);
    assert!(
        last.stiffness_n_per_m
            .iter()
            .all(|k| k.is_finite() && *k > 0.0)
    );
}

#[test]
fn a_lost_buffer_is_flagged_and_counted() {
    let frames = run(400, 200..202, 0.0);
    let flagged = streams(&frames)
        .iter()
        .any(|stream| stream.flags.contains(StreamFlags::GAP));
    assert!(flagged);
    let status: Vec<&Status> = frames
        .iter()
        .filter_map(|frame| match &frame.packet {
            Packet::Status(status) => Some(status),
            _ => None,
        })
        .collect();
    let last = status.last().unwrap();
    assert_eq!((last.overruns, last.missed_scans, last.gaps), (10, 10, 1));
}

#[test]
fn a_stream_frame_is_dated_by_its_newest_scan() {
    let outbox = Outbox::new();
    let mut path = SignalPath::new(1).unwrap();
    let mut seen = 0;
    for number in 0..100 {
        let end_us = 10_000 + u64::from(number) * 5_000;
        path.buffer_full(end_us, &buffer(number, 0.0), &outbox)
            .unwrap();
        while let Poll::Ready(bytes) = poll_once(outbox.take()) {
            let device_us = decode(&bytes).unwrap().header.device_us;
            assert!((end_us - 4_000..=end_us).contains(&device_us));
            seen += 1;
        }
    }
    assert!(seen >= 50, "a frame in every other buffer: {seen}");
}

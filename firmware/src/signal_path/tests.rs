mod calibration;

use std::{task::Poll, vec::Vec};

use embassy_futures::poll_once;
use tonus_shared::{
    pipeline::illustrative,
    sample::AdcScale,
    wire::{Kind, Muscle, Refusal, Reply, Status, StatusFlags, Stream, StreamFlags, decode},
};

use super::*;
use crate::{
    acquisition::{BUFFER_SCANS, MUSCLES, PERIOD_US, RATE_HZ, ScanClock},
    outbox::REPORTS,
};

const BIAS_COUNTS: i32 = 1877;
/// A 12-bit converter of 3.6 V behind a gain of 200.
fn board() -> Board {
    Board {
        boot_id: 0xB007,
        firmware_hash: [0; 8],
        adc: AdcScale::new(3.6 / 4096.0 / 200.0, BIAS_COUNTS, 0, 4095).unwrap(),
        rates_hz: &[RATE_HZ],
    }
}

fn one_channel() -> SignalPath<1> {
    SignalPath::new(board(), &illustrative([Muscle::BicepsLong], RATE_HZ)).unwrap()
}

/// All that waits.
fn drain(outbox: &Outbox) -> Vec<Frame> {
    let mut frames = Vec::new();
    while poll_once(async { frames.push(decode(&outbox.take().await).unwrap()) }).is_ready() {}
    frames
}

/// A burst of 100 Hz around the bias, its amplitude in counts.
fn buffer(number: u32, amplitude: f64) -> [[i16; 1]; BUFFER_SCANS] {
    core::array::from_fn(|scan| {
        let t_s = f64::from(number) * 0.005 + scan as f64 * 0.001;
        let volts = amplitude * (2.0 * core::f64::consts::PI * 100.0 * t_s).sin();
        [(f64::from(BIAS_COUNTS) + volts).round() as i16]
    })
}

/// Every frame that leaves within these buffers; those in `lost` never come.
fn run(buffers: u32, lost: core::ops::Range<u32>, amplitude: f64) -> Vec<Frame> {
    let outbox = Outbox::new();
    let mut path = one_channel();
    let mut clock = ScanClock::new(PERIOD_US, BUFFER_SCANS as u32);
    let mut frames = Vec::new();
    for number in (0..buffers).filter(|number| !lost.contains(number)) {
        let end_us = 10_000 + u64::from(number) * 5_000;
        let block = clock.buffer_full(end_us);
        for scan in block.scans(PERIOD_US, buffer(number, amplitude)) {
            path.push_scan(&scan, &outbox).unwrap();
        }
        frames.extend(drain(&outbox));
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

fn last_status(frames: &[Frame]) -> Status {
    let status = |frame: &Frame| match frame.packet {
        Packet::Status(status) => Some(status),
        _ => None,
    };
    frames.iter().rev().find_map(status).unwrap()
}

/// Four channels at 1 kHz, pushed scan by scan.
struct Four {
    path: SignalPath<4>,
    outbox: Outbox,
    index: u32,
}

impl Four {
    fn new() -> Self {
        Self {
            path: SignalPath::new(board(), &illustrative(MUSCLES, RATE_HZ)).unwrap(),
            outbox: Outbox::new(),
            index: 0,
        }
    }

    fn now_us(&self) -> u64 {
        u64::from(self.index) * u64::from(PERIOD_US)
    }

    /// Scans of 100 counts at 97 Hz on every channel; what leaves, all of it taken at once.
    fn run(&mut self, scans: u32) -> Vec<Frame> {
        let mut frames = Vec::new();
        for _ in 0..scans {
            let t_s = f64::from(self.index) / f64::from(RATE_HZ);
            let sine = (2.0 * core::f64::consts::PI * 97.0 * t_s).sin();
            self.index += 1;
            let scan = Scan {
                index: self.index,
                acquired_us: self.now_us(),
                counts: [BIAS_COUNTS + (100.0 * sine).round() as i32; 4],
            };
            self.path.push_scan(&scan, &self.outbox).unwrap();
            frames.extend(drain(&self.outbox));
        }
        frames
    }
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
    let sequence = frames.iter().map(|frame| frame.header.sequence);
    assert!(sequence.eq(0..frames.len() as u32), "none lost, in order");
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
    let last = last_status(&frames);
    assert_eq!((last.missed_scans, last.gaps), (10, 1));
}

#[test]
fn a_stream_frame_is_dated_by_its_newest_scan() {
    let outbox = Outbox::new();
    let mut path = one_channel();
    let mut clock = ScanClock::new(PERIOD_US, BUFFER_SCANS as u32);
    let mut seen = 0;
    for number in 0..100 {
        let end_us = 10_000 + u64::from(number) * 5_000;
        let block = clock.buffer_full(end_us);
        for scan in block.scans(PERIOD_US, buffer(number, 0.0)) {
            path.push_scan(&scan, &outbox).unwrap();
        }
        while let Poll::Ready(bytes) = poll_once(outbox.take()) {
            let device_us = decode(&bytes).unwrap().header.device_us;
            assert!((end_us - 4_000..=end_us).contains(&device_us));
            seen += 1;
        }
    }
    assert!(seen >= 50, "a frame in every other buffer: {seen}");
}

#[test]
fn raw_semg_goes_out_only_while_it_is_wanted() {
    let mut four = Four::new();
    let raw = |frames: &[Frame]| {
        let counts = |frame: &Frame| match &frame.packet {
            Packet::RawSemg(raw) => Some(raw.counts.len()),
            _ => None,
        };
        frames.iter().filter_map(counts).sum::<usize>()
    };
    assert_eq!(raw(&four.run(900)), 0);
    four.path.set_raw(true).unwrap();
    let frames = four.run(900);
    assert_eq!(raw(&frames), 4 * 900, "every count, 18 scans a packet");
    let told = frames.iter().find_map(|frame| match frame.packet {
        Packet::Configuration(configuration) => Some(configuration.raw),
        _ => None,
    });
    assert_eq!(told, Some(true));
    four.path
        .recalibrate(&four.path.calibration().clone())
        .unwrap();
    assert_eq!(
        raw(&four.run(180)),
        4 * 180,
        "a new calibration does not switch it off"
    );
    four.path.set_raw(false).unwrap();
    assert_eq!(raw(&four.run(900)), 0);
}

#[test]
fn an_answer_is_numbered_among_the_others_and_a_ping_leaves_when_it_is_handed_over() {
    let mut four = Four::new();
    let before = four.run(10);
    let ping = Ping::Reply {
        id: 3,
        requested_us: 99,
        received_us: 9_000,
        replied_us: 0,
    };
    four.path
        .answer(Packet::Ping(ping), 9_700, &four.outbox)
        .unwrap();
    let frames = drain(&four.outbox);
    let expected = Packet::Ping(Ping::Reply {
        id: 3,
        requested_us: 99,
        received_us: 9_000,
        replied_us: 9_700,
    });
    assert_eq!(frames[0].packet, expected);
    assert_eq!(frames[0].header.device_us, 9_700);
    assert_eq!(frames[0].header.sequence, before.len() as u32);
    assert_eq!(four.run(10)[0].header.sequence, before.len() as u32 + 1);
}

#[test]
fn status_tells_what_was_replaced_refused_and_reported() {
    let mut four = Four::new();
    four.path.set_health(Health {
        flags: StatusFlags::LOW_BATTERY.with(StatusFlags::NO_MODEL, true),
        overruns: 2,
        dropped_packets: 100,
        lost_reports: 10,
        dropped_hypotheses: 5,
        refused_requests: 6,
        links: 7,
        ..Health::default()
    });
    let reply = Packet::Reply(Reply {
        answered: Kind::Control,
        sequence: 0,
        outcome: Err(Refusal::Busy),
        detail: 0,
    });
    for _ in 0..REPORTS {
        four.path.answer(reply.clone(), 0, &four.outbox).unwrap();
    }
    let full = four.path.answer(reply, 0, &four.outbox);
    assert_eq!(full, Err(SendError::Queue(QueueFull)));
    drain(&four.outbox);
    // Ten stream packets that nobody takes: each is replaced by the next, the last by the first that is taken.
    for _ in 0..100 {
        four.index += 1;
        let scan = Scan {
            index: four.index,
            acquired_us: four.now_us(),
            counts: [BIAS_COUNTS; 4],
        };
        four.path.push_scan(&scan, &four.outbox).unwrap();
    }
    let status = last_status(&four.run(1_000));
    assert_eq!(status.flags.bits(), 0b10_0001);
    assert_eq!((status.dropped_packets, status.lost_reports), (110, 11));
    assert_eq!((status.overruns, status.dropped_hypotheses), (2, 5));
    assert_eq!((status.refused_requests, status.links), (6, 7));
}

#[test]
fn hand_attitude_and_lead_off_reach_the_stream() {
    let mut four = Four::new();
    four.run(500);
    let now_us = four.now_us();
    four.path.set_hand(Some([0.4, 0.0, -0.3]), now_us).unwrap();
    four.path
        .set_attitude([0.0, 0.0, 0.0, 1.0], now_us)
        .unwrap();
    four.path.face_forward().unwrap();
    four.path
        .set_attitude([0.0, 0.0, 0.0, 1.0], now_us + 1)
        .unwrap();
    assert!(four.path.set_hand(Some([f32::NAN; 3]), now_us + 1).is_err());
    four.path.set_lead_off([false, true, false, false]);
    let frames = four.run(20);
    let last = *streams(&frames).last().unwrap();
    assert!(last.flags.contains(StreamFlags::HAND_SEEN));
    assert!(last.flags.contains(StreamFlags::ORIENTATION_SEEN));
    assert_eq!(
        last.quality.map(|quality| quality.bits()),
        [0, 8, 0, 0, 0, 0, 0, 0]
    );
    let attitude = |frame: &Frame| matches!(frame.packet, Packet::Orientation(_));
    assert_eq!(frames.iter().filter(|frame| attitude(frame)).count(), 1);
}

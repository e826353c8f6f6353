//! The wearable's signal path on made-up signals: timing, gaps, occlusion, losses, refusals.
#![allow(clippy::unwrap_used, clippy::panic, reason = "test suite")]

use proptest::prelude::*;
use tonus_shared::pipeline::{
    ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Health, InputError, Pipeline, PipelineConfig,
    PipelineError,
};
use tonus_shared::sample::{AdcScale, Scan};
use tonus_shared::semg::chain::{Chain, ChainConfig};
use tonus_shared::stiffness::{ArmPosture, ArmStiffness, CoContraction, Segments};
use tonus_shared::wire::{
    Frame, MAX_FRAME_BYTES, Muscle, Packet, ResetReason, SequenceTracker, Status, Stream,
    StreamFlags, decode,
};
use tonus_tests::seeded;

const VOLTS_PER_COUNT: f64 = 1e-7;
/// Envelope of a sine of amplitude 1 mV: mean of its magnitude.
const MVC_V: f64 = 1e-3 * std::f64::consts::FRAC_2_PI;

fn config<const C: usize>(rate_hz: f64) -> PipelineConfig<C> {
    use Muscle::{BicepsLong, BicepsShort, TricepsLateral, TricepsLong};
    let places = [BicepsShort, TricepsLateral, BicepsLong, TricepsLong];
    PipelineConfig {
        boot_id: 0xB007,
        firmware_hash: [7; 8],
        adc: AdcScale::new(VOLTS_PER_COUNT, 0, -(1 << 23), (1 << 23) - 1).unwrap(),
        chain: ChainConfig::at_rate(rate_hz),
        channels: std::array::from_fn(|at| ChannelConfig {
            muscle: places[at % 4],
            rest_v: 0.0,
            mvc_v: MVC_V,
        }),
        activation_window_s: DEFAULT_ACTIVATION_WINDOW_S,
        arm: ArmStiffness::illustrative(),
        raw: false,
    }
}

/// Frames that crossed the wire: encoded, decoded, found equal to what the pipeline made, bit for bit.
fn take<const C: usize>(pipeline: &mut Pipeline<C>) -> Vec<Frame> {
    let mut frames = Vec::new();
    while let Some(frame) = pipeline.next_frame() {
        let mut buffer = [0; MAX_FRAME_BYTES];
        let length = frame.encode(&mut buffer).unwrap();
        let crossed = decode(&buffer[..length]).unwrap();
        assert_eq!(crossed, frame);
        frames.push(crossed);
    }
    frames
}

/// A wearer: one count per channel by time, at the rate's exact instants.
struct Wearer<const C: usize> {
    pipeline: Pipeline<C>,
    rate_hz: f64,
    index: u32,
}

impl<const C: usize> Wearer<C> {
    fn new(config: &PipelineConfig<C>) -> Self {
        Self {
            pipeline: Pipeline::new(config).unwrap(),
            rate_hz: config.chain.rate_hz,
            index: 0,
        }
    }

    fn time_us(&self, index: u32) -> u64 {
        (f64::from(index) * 1e6 / self.rate_hz) as u64
    }

    /// One scan of a 97 Hz sine of `amplitude_v`, alike on all channels. (At a divisor of the rate the same few points
    /// of the sine would come again and again, and their mean magnitude is not that of the sine.)
    fn scan(&mut self, amplitude_v: f64) -> Vec<Frame> {
        let t_s = f64::from(self.index) / self.rate_hz;
        let sine = (2.0 * std::f64::consts::PI * 97.0 * t_s + 0.3).sin();
        self.push([(amplitude_v * sine / VOLTS_PER_COUNT).round() as i32; C])
    }

    fn push(&mut self, counts: [i32; C]) -> Vec<Frame> {
        let scan = Scan {
            index: self.index,
            acquired_us: self.time_us(self.index),
            counts,
        };
        self.index += 1;
        self.pipeline.push_scan(&scan).unwrap();
        take(&mut self.pipeline)
    }

    /// Scans for `seconds`; the stream packets and their device times.
    fn run(&mut self, seconds: f64, amplitude_v: f64) -> Vec<(u64, Stream)> {
        let scans = (seconds * self.rate_hz).round() as u32;
        (0..scans)
            .flat_map(|_| streams(&self.scan(amplitude_v)))
            .collect()
    }
}

fn streams(frames: &[Frame]) -> Vec<(u64, Stream)> {
    let stream = |frame: &Frame| match &frame.packet {
        Packet::Stream(stream) => Some((frame.header.device_us, *stream)),
        _ => None,
    };
    frames.iter().filter_map(stream).collect()
}

fn last_status(frames: &[Frame]) -> Option<Status> {
    frames.iter().rev().find_map(|frame| match frame.packet {
        Packet::Status(status) => Some(status),
        _ => None,
    })
}

/// Packet k comes with scan ceil(k rate / 100), for a minute, at any rate.
#[test]
fn the_stream_keeps_100_hz_at_every_rate() {
    for rate_hz in [200_u64, 250, 1_000, 1_111, 2_000] {
        let mut wearer = Wearer::<1>::new(&config(rate_hz as f64));
        let mut frames = Vec::new();
        for _ in 0..60 * rate_hz {
            frames.extend(wearer.push([0]));
        }
        let stream = streams(&frames);
        assert_eq!(stream.len(), 6_000, "{rate_hz} Hz");
        for (k, (device_us, _)) in (0_u64..).zip(&stream) {
            let scan = (k * rate_hz).div_ceil(100);
            assert_eq!(
                *device_us,
                wearer.time_us(scan as u32),
                "{rate_hz} Hz, packet {k}"
            );
        }
        let number = |wanted: fn(&Packet) -> bool| {
            frames.iter().filter(|frame| wanted(&frame.packet)).count()
        };
        assert_eq!(
            number(|packet| matches!(packet, Packet::Configuration(_))),
            60
        );
        assert_eq!(number(|packet| matches!(packet, Packet::Status(_))), 60);
        assert!(
            matches!(frames[0].packet, Packet::Configuration(_)),
            "the configuration comes first"
        );
        let mut tracker = SequenceTracker::new();
        for frame in &frames {
            tracker.observe(frame.header.boot_id, frame.header.sequence);
        }
        assert_eq!(tracker.counts().received, frames.len() as u64);
        assert_eq!(
            (tracker.counts().lost, frames[0].header.boot_id),
            (0, 0xB007)
        );
    }
}

/// A sine of half the amplitude of the maximum contraction on four heads: envelopes 0.5 (the 20 Hz high-pass leaves
/// 97 Hz alone to 0.1 %), activation 2, co-contraction by eq. 8, stiffness by eq. 6 in f64 in the assumed posture.
#[test]
fn a_steady_contraction_has_the_closed_form() {
    let mut config = config::<4>(2_000.0);
    let segments = Segments::new(75.0, 1.75).unwrap();
    let curve = CoContraction::new(0.7, 1.5).unwrap();
    config.arm = ArmStiffness::new(curve, [13.0, 13.0, 12.0, 12.0], segments).unwrap();
    let mut wearer = Wearer::new(&config);
    let (_, stream) = *wearer.run(2.0, 0.5e-3).last().unwrap();
    for (slot, envelope) in stream.envelopes.iter().enumerate() {
        let expected = if slot < 4 { 0.5 } else { 0.0 };
        assert!(
            (envelope - expected).abs() < 2e-3,
            "slot {slot}: {envelope}"
        );
    }
    assert!(
        (stream.activation - 2.0).abs() < 8e-3,
        "{}",
        stream.activation
    );
    let c = 1.0 + 0.7 * (1.5 * 2.0 / 2.0_f64).tanh();
    assert!((f64::from(stream.co_contraction) - c).abs() < 2e-3);
    let posture = ArmPosture::from_angles([0.0, 0.0, 0.0, std::f64::consts::FRAC_PI_2]).unwrap();
    let curve = CoContraction::new(0.7, 1.5).unwrap();
    let segments = Segments::new(75.0, 1.75).unwrap();
    let arm = ArmStiffness::<f64>::new(curve, [13.0, 13.0, 12.0, 12.0], segments).unwrap();
    let expected = arm
        .at(f64::from(stream.activation), &posture)
        .unwrap()
        .cartesian
        .diagonal();
    for (sent, expected) in stream.stiffness_n_per_m.iter().zip(expected.iter()) {
        assert!(
            (f64::from(*sent) / expected - 1.0).abs() < 1e-4,
            "{sent} {expected}"
        );
    }
    assert_eq!(
        stream.flags,
        StreamFlags::default(),
        "no hand, no attitude, nothing else"
    );
    assert_eq!(stream.channels, 4);
    let delay_s = Chain::<f64>::design(&config.chain).unwrap().delay_s();
    // 25 ms at 2 kHz: 51 scans, centre 25 scans back.
    assert!(
        (f64::from(stream.describes_before_us) - 1e6 * (delay_s + 25.0 / 2_000.0)).abs() <= 1.0
    );
}

#[test]
fn channels_on_one_head_are_averaged() {
    let activation = |muscles: [Muscle; 3]| {
        let mut config = config::<3>(1_000.0);
        for (channel, muscle) in config.channels.iter_mut().zip(muscles) {
            channel.muscle = muscle;
        }
        Wearer::new(&config)
            .run(1.0, 0.5e-3)
            .last()
            .unwrap()
            .1
            .activation
    };
    use Muscle::{BicepsLong, Other, TricepsLong};
    assert!((activation([BicepsLong, BicepsLong, BicepsLong]) - 0.5).abs() < 5e-3);
    assert!((activation([BicepsLong, TricepsLong, BicepsLong]) - 1.0).abs() < 5e-3);
    assert!((activation([BicepsLong, Other, Other]) - 0.5).abs() < 5e-3);
}

#[test]
fn a_short_gap_is_marked_counted_and_does_not_shake() {
    let mut wearer = Wearer::<4>::new(&config(1_000.0));
    let before = wearer.run(1.005, 0.5e-3);
    assert!(
        before
            .iter()
            .all(|(_, stream)| !stream.flags.contains(StreamFlags::GAP))
    );
    wearer.index += 50;
    let after = wearer.run(1.0, 0.5e-3);
    let marked: Vec<_> = after
        .iter()
        .map(|(_, stream)| stream.flags.contains(StreamFlags::GAP))
        .collect();
    assert!(marked[0], "the first packet after the gap says so");
    let clean = marked.iter().position(|gap| !gap).unwrap();
    assert!((15..40).contains(&clean), "for 0.15 to 0.4 s: {clean}");
    assert!(marked[clean..].iter().all(|gap| !gap));
    assert_eq!(
        after[0].0, 1_055_000,
        "what the gap made late comes at once"
    );
    for (device_us, stream) in &after[1..] {
        assert_eq!(device_us % 10_000, 0, "the grid stays");
        assert!(!stream.flags.contains(StreamFlags::ACTIVATION_HELD));
        assert!(
            (stream.activation - 2.0).abs() < 0.05,
            "{}",
            stream.activation
        );
    }
    let frames: Vec<_> = (0..1_000).flat_map(|_| wearer.scan(0.0)).collect();
    let status = last_status(&frames).unwrap();
    assert_eq!(
        (status.gaps, status.missed_scans, status.refused),
        (1, 50, 0)
    );
}

/// Filters restart after half a second without scans; until they have settled the activation is held.
#[test]
fn a_long_gap_holds_the_activation() {
    let mut wearer = Wearer::<4>::new(&config(1_000.0));
    let (_, before) = *wearer.run(1.0, 0.5e-3).last().unwrap();
    wearer.index += 500;
    let after = wearer.run(1.0, 0.5e-3);
    assert!(after[0].1.flags.contains(StreamFlags::ACTIVATION_HELD));
    for pair in after.windows(2) {
        let [a, b] = [pair[0].1, pair[1].1];
        assert!((b.activation - a.activation).abs() < 0.05);
        assert!((b.stiffness_n_per_m[0] / a.stiffness_n_per_m[0] - 1.0).abs() < 0.01);
    }
    let held = after
        .iter()
        .take_while(|(_, stream)| stream.flags.contains(StreamFlags::ACTIVATION_HELD));
    for (_, stream) in held {
        assert!((stream.activation - before.activation).abs() < 1e-3);
    }
    assert!(
        !after
            .last()
            .unwrap()
            .1
            .flags
            .contains(StreamFlags::ACTIVATION_HELD)
    );
}

#[test]
fn a_bad_channel_keeps_its_last_good_value() {
    let mut wearer = Wearer::<4>::new(&config(1_000.0));
    wearer.run(1.0, 0.5e-3);
    wearer.pipeline.set_lead_off([false, true, false, false]);
    let off = wearer.run(1.0, 0.5e-3);
    let (first_us, first) = off[0];
    assert!(
        first.flags.contains(StreamFlags::ACTIVATION_HELD),
        "at once, at {first_us}"
    );
    assert_eq!(
        first.quality.map(|quality| quality.bits()),
        [0, 8, 0, 0, 0, 0, 0, 0]
    );
    assert!((first.activation - 2.0).abs() < 0.02);
    let mut silent = config::<4>(1_000.0);
    silent.raw = false;
    // A rail on one channel: held within one tick too, and the stiffness does not jump with the artefact.
    let mut railed = Wearer::<4>::new(&silent);
    let (_, good) = *railed.run(1.0, 0.5e-3).last().unwrap();
    for n in 0..200 {
        for (_, stream) in streams(&railed.push([(1 << 23) - 1 - (n % 2), 0, 0, 0])) {
            assert!(stream.flags.contains(StreamFlags::ACTIVATION_HELD));
            assert!(
                stream.activation <= good.activation + 0.01,
                "{}",
                stream.activation
            );
        }
    }
}

/// Hand on a circle in front of the shoulder, lost for a second and found elsewhere.
#[test]
fn an_occlusion_does_not_step() {
    let mut wearer = Wearer::<4>::new(&config(1_000.0));
    let mut packets = Vec::new();
    for n in 0..5_000_u32 {
        packets.extend(streams(&wearer.scan(0.3e-3)));
        let t_s = f64::from(n) / 1_000.0;
        let seen = !(1.5..2.5).contains(&t_s);
        if n % 10 == 3 && seen {
            let (sin, cos) = (1.5 * t_s).sin_cos();
            let hand = [0.52 + 0.03 * cos, 0.1 * sin, 0.1 + 0.1 * cos].map(|x| x as f32);
            wearer
                .pipeline
                .set_hand(Some(hand), wearer.time_us(n))
                .unwrap();
        }
    }
    let at = |from_s: f64, to_s: f64| -> Vec<Stream> {
        let within = |us: u64| (from_s * 1e6..to_s * 1e6).contains(&(us as f64));
        packets
            .iter()
            .filter(|(us, _)| within(*us))
            .map(|(_, stream)| *stream)
            .collect()
    };
    let seen = |stream: &Stream| stream.flags.contains(StreamFlags::HAND_SEEN);
    assert!(at(0.02, 1.59).iter().all(seen), "seen, and 0.1 s longer");
    assert!(!at(1.61, 2.5).iter().any(seen), "then the elbow is assumed");
    assert!(at(2.52, 5.0).iter().all(seen));
    let mut largest = 0_f32;
    for pair in at(1.0, 5.0).windows(2) {
        for (a, b) in pair[0]
            .stiffness_n_per_m
            .iter()
            .zip(pair[1].stiffness_n_per_m)
        {
            largest = largest.max((b / a).ln().abs());
        }
    }
    let [before, after] =
        [at(1.5, 1.51)[0], at(2.3, 2.31)[0]].map(|stream| stream.stiffness_n_per_m);
    let apart = before
        .iter()
        .zip(after)
        .map(|(a, b)| (a / b).ln().abs())
        .fold(0.0, f32::max);
    assert!(
        apart > 0.25,
        "the sources must differ for the test to mean anything: {apart}"
    );
    println!("sources apart {apart}, largest step {largest}");
    assert!(
        largest < 0.03,
        "largest step between packets, logarithm: {largest}"
    );
    assert!(
        at(1.61, 2.05)
            .iter()
            .all(|stream| stream.flags.contains(StreamFlags::BLENDING))
    );
    assert!(
        !at(2.15, 2.49)
            .iter()
            .any(|stream| stream.flags.contains(StreamFlags::BLENDING))
    );
}

#[test]
fn a_hand_out_of_reach_is_held_then_dropped() {
    let mut wearer = Wearer::<4>::new(&config(1_000.0));
    let mut packets = Vec::new();
    for n in 0..2_000_u32 {
        packets.extend(streams(&wearer.scan(0.3e-3)));
        let reach = if n < 1_000 { 0.45 } else { 0.9 };
        if n % 10 == 9 {
            wearer
                .pipeline
                .set_hand(Some([reach, 0.0, 0.1]), wearer.time_us(n))
                .unwrap();
        }
    }
    let held: Vec<_> = packets
        .iter()
        .filter(|(_, stream)| stream.flags.contains(StreamFlags::STIFFNESS_HELD))
        .collect();
    assert!((10..=11).contains(&held.len()), "0.1 s: {}", held.len());
    assert!(
        held.iter()
            .all(|(_, stream)| stream.stiffness_n_per_m == held[0].1.stiffness_n_per_m)
    );
    let (_, last) = packets.last().unwrap();
    assert!(
        !last.flags.contains(StreamFlags::HAND_SEEN),
        "an impossible hand is as good as none"
    );
    let clamped = |reach: f32| {
        let mut wearer = Wearer::<1>::new(&config(1_000.0));
        wearer.push([0]);
        wearer
            .pipeline
            .set_hand(Some([reach, 0.0, 0.0]), 1)
            .unwrap();
        wearer.run(0.05, 0.0)[0].1.flags
    };
    assert!(!clamped(0.5).contains(StreamFlags::POSTURE_CLAMPED));
    assert!(
        clamped(0.65).contains(StreamFlags::POSTURE_CLAMPED),
        "the arm is 0.63 m long"
    );
    assert!(clamped(0.65).contains(StreamFlags::NEAR_SINGULAR));
}

#[test]
fn an_attitude_goes_out_and_counts() {
    let mut wearer = Wearer::<1>::new(&config(200.0));
    wearer.push([0]);
    let half = std::f32::consts::FRAC_1_SQRT_2;
    wearer
        .pipeline
        .set_orientation([0.0, -half, 0.0, half], 4_000)
        .unwrap();
    let frames: Vec<_> = (0..3).flat_map(|_| wearer.push([0])).collect();
    let sent = frames
        .iter()
        .find(|frame| matches!(frame.packet, Packet::Orientation(_)))
        .unwrap();
    assert_eq!(sent.header.device_us, 4_000);
    assert!(
        streams(&frames)[0]
            .1
            .flags
            .contains(StreamFlags::ORIENTATION_SEEN)
    );
    assert!(!streams(&frames)[0].1.flags.contains(StreamFlags::HAND_SEEN));
}

#[test]
fn a_slow_link_gets_the_newest_and_the_loss_is_counted() {
    let mut wearer = Wearer::<1>::new(&config(200.0));
    for index in 0..201 {
        let acquired_us = wearer.time_us(index);
        wearer
            .pipeline
            .push_scan(&Scan {
                index,
                acquired_us,
                counts: [0],
            })
            .unwrap();
    }
    let health = Health {
        battery_mv: Some(3_700),
        reset_reason: ResetReason::PowerOn,
        overruns: 3,
    };
    wearer.pipeline.set_health(health);
    let frames = take(&mut wearer.pipeline);
    assert_eq!(frames.len(), 3, "one of each kind waits");
    assert_eq!(streams(&frames)[0].0, 1_000_000, "the newest stream packet");
    let status = last_status(&frames).unwrap();
    assert_eq!(
        (status.dropped_packets, status.uptime_s, status.overruns),
        (100, 1, 3)
    );
    assert_eq!(
        (status.battery_mv, status.reset_reason),
        (Some(3_700), ResetReason::PowerOn)
    );
    assert_eq!(
        frames
            .iter()
            .map(|frame| frame.header.sequence)
            .collect::<Vec<_>>(),
        [0, 1, 2]
    );
}

#[test]
fn raw_packets_hold_every_count() {
    let mut config = config::<3>(2_000.0);
    config.raw = true;
    let mut wearer = Wearer::new(&config);
    let (mut pushed, mut received) = (Vec::new(), Vec::new());
    for n in 0..1_000_i32 {
        if n == 500 {
            wearer.index += 7;
        }
        let counts = [n, -n, n * 1_000 - 500_000];
        pushed.push((wearer.index, wearer.time_us(wearer.index), counts));
        for frame in wearer.push(counts) {
            if let Packet::RawSemg(raw) = frame.packet {
                assert_eq!(raw.channels, 3);
                let scans = raw.counts.chunks(3).map(|scan| [scan[0], scan[1], scan[2]]);
                received.extend((raw.first_index..).zip(scans));
                let (last, ..) = received.last().unwrap();
                assert_eq!(
                    frame.header.device_us,
                    wearer.time_us(*last),
                    "time of the last scan in it"
                );
            }
        }
    }
    // What the last packet has room for still waits.
    let waiting = pushed.len() - received.len();
    assert!(waiting < 24, "{waiting}");
    for ((index, _, counts), received) in pushed.iter().zip(&received) {
        assert_eq!((*index, *counts), *received);
    }
}

#[test]
fn refusals_have_types_and_change_nothing() {
    let mut pipeline = Pipeline::new(&config::<1>(200.0)).unwrap();
    assert_eq!(pipeline.set_hand(None, 0), Err(InputError::NoScanYet));
    let scan = |index, acquired_us| Scan {
        index,
        acquired_us,
        counts: [0],
    };
    pipeline.push_scan(&scan(u32::MAX, 1_000_000)).unwrap();
    pipeline.push_scan(&scan(0, 1_005_000)).unwrap();
    assert_eq!(
        pipeline.push_scan(&scan(0, 1_010_000)),
        Err(InputError::ScanNotNewer {
            index: 0,
            newest: 0
        })
    );
    assert_eq!(
        pipeline.push_scan(&scan(1, 1_005_000)),
        Err(InputError::TimeNotNewer {
            acquired_us: 1_005_000,
            newest_us: 1_005_000
        })
    );
    assert_eq!(
        pipeline.set_hand(Some([0.0, f32::NAN, 0.0]), 1_000_000),
        Err(InputError::NonFinite)
    );
    assert_eq!(
        pipeline.set_hand(None, 1_105_001),
        Err(InputError::Ahead {
            acquired_us: 1_105_001,
            newest_us: 1_005_000
        })
    );
    pipeline.set_hand(None, 1_000_000).unwrap();
    assert!(matches!(
        pipeline.set_hand(None, 1_000_000),
        Err(InputError::TimeNotNewer { .. })
    ));
    assert_eq!(
        pipeline.set_orientation([0.0, 0.0, 0.0, 2.0], 0),
        Err(InputError::NotUnit { norm: 2.0 })
    );
    assert_eq!(
        pipeline.set_orientation([f32::INFINITY; 4], 0),
        Err(InputError::NonFinite)
    );
    for index in 1..200 {
        pipeline
            .push_scan(&scan(index, 1_005_000 + 5_000 * u64::from(index)))
            .unwrap();
    }
    assert_eq!(last_status(&take(&mut pipeline)).unwrap().refused, 8);
}

#[test]
fn set_up_errors_name_the_part() {
    let good = config::<2>(1_000.0);
    let refused = |change: fn(&mut PipelineConfig<2>)| {
        let mut config = good;
        change(&mut config);
        Pipeline::new(&config).unwrap_err()
    };
    let rate = refused(|config| config.chain.rate_hz = 150.0);
    assert!(matches!(rate, PipelineError::Design(_)), "{rate}");
    let window = refused(|config| config.activation_window_s = f64::NAN);
    assert!(matches!(window, PipelineError::Design(_)), "{window}");
    for (rest_v, mvc_v) in [
        (f64::NAN, 1.0),
        (0.0, f64::INFINITY),
        (1e-3, 1e-3),
        (-1e-6, 1e-3),
    ] {
        let mut config = good;
        config.channels[1].rest_v = rest_v;
        config.channels[1].mvc_v = mvc_v;
        let calibration = Pipeline::new(&config).unwrap_err();
        assert!(
            matches!(calibration, PipelineError::Calibration { channel: 1, .. }),
            "{calibration}"
        );
    }
    let absent = refused(|config| config.channels[1].muscle = Muscle::Absent);
    assert_eq!(absent, PipelineError::AbsentMuscle { channel: 1 });
    let other = refused(|config| {
        for channel in &mut config.channels {
            channel.muscle = Muscle::Other;
        }
    });
    assert!(matches!(other, PipelineError::Activation(_)), "{other}");
    let wide = refused(|config| {
        config.raw = true;
        config.adc = AdcScale::new(1e-9, 0, i32::MIN, i32::MAX).unwrap();
    });
    assert_eq!(
        wide,
        PipelineError::RawRange {
            min_count: i32::MIN,
            max_count: i32::MAX
        }
    );
    let arm = |l1: f32, joint: f32| {
        let mut config = good;
        let curve = CoContraction::new(l1, 1.0).unwrap();
        config.arm =
            ArmStiffness::new(curve, [joint; 4], Segments::new(75.0, 1.75).unwrap()).unwrap();
        Pipeline::new(&config).unwrap_err()
    };
    assert!(matches!(
        arm(2e3, 12.0),
        PipelineError::CoContraction { .. }
    ));
    assert!(matches!(arm(0.5, 1e-3), PipelineError::RestingStiffness(_)));
}

proptest! {
    #![proptest_config(seeded(64))]

    /// Any counts, hands and attitudes: whatever comes out encodes, with positive finite stiffness.
    #[test]
    fn whatever_comes_in_what_goes_out_is_valid(
        inputs in proptest::collection::vec(
            (any::<[i32; 2]>(), 1_u32..300, any::<[u32; 3]>(), any::<[u32; 4]>(), any::<bool>(), -0.8_f32..0.8),
            1..200,
        ),
    ) {
        let mut pipeline = Pipeline::new(&config::<2>(500.0)).unwrap();
        let (mut index, mut now_us) = (0_u32, 0);
        for (counts, step, hand, attitude, plausible, coordinate) in inputs {
            let step = if step < 250 { 1 } else { step };
            index += step;
            now_us += 2_000 * u64::from(step);
            pipeline.push_scan(&Scan { index, acquired_us: now_us, counts }).unwrap();
            let hand = if plausible { [coordinate, 0.3, coordinate / 2.0] } else { hand.map(f32::from_bits) };
            let attitude = if plausible {
                [0.0, (coordinate / 2.0).sin(), 0.0, (coordinate / 2.0).cos()]
            } else {
                attitude.map(f32::from_bits)
            };
            // Refusals are among what is tried here.
            let _refused = pipeline.set_hand(Some(hand), now_us);
            let _refused = pipeline.set_orientation(attitude, now_us);
            for (_, stream) in streams(&take(&mut pipeline)) {
                prop_assert!(stream.stiffness_n_per_m.iter().all(|k| k.is_finite() && *k > 0.0));
            }
        }
    }
}

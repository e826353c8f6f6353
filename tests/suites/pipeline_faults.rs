//! The wearable's signal path when things go wrong: gaps, bad channels, occlusion, a slow link, any input.
#![allow(clippy::unwrap_used, reason = "test suite")]

use proptest::prelude::*;
use tonus_shared::pipeline::{Health, Pipeline};
use tonus_shared::sample::Scan;
use tonus_shared::wire::{ResetReason, Stream, StreamFlags};
use tonus_tests::seeded;
use tonus_tests::wearer::{Wearer, config, last_status, streams, take};

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

/// An electrode that comes off and floats: 20 mV of hum, which only a whole block of half a second proves. What the
/// hum did to the envelope until then must not be what is held.
#[test]
fn a_fault_found_late_does_not_leave_its_own_value() {
    for cut_ms in [2_000, 2_100, 2_250, 2_400, 2_490] {
        let mut wearer = Wearer::<4>::new(&config(1_000.0));
        let mut packets = Vec::new();
        for n in 0..6_000_u32 {
            let t_s = f64::from(n) / 1_000.0;
            let signal = (5e3 * (2.0 * std::f64::consts::PI * 97.0 * t_s).sin()) as i32;
            let hum = (2e5 * (2.0 * std::f64::consts::PI * 50.0 * t_s).sin()) as i32;
            let first = if n < cut_ms { signal } else { hum };
            packets.extend(streams(&wearer.push([first, signal, signal, signal])));
        }
        let held = |stream: &Stream| stream.flags.contains(StreamFlags::ACTIVATION_HELD);
        let told = packets.iter().position(|(_, stream)| held(stream)).unwrap();
        let after_ms = packets[told].0 / 1_000 - u64::from(cut_ms);
        assert!(after_ms <= 1_000, "told after {after_ms} ms");
        let [before, after] = [told - 1, told].map(|at| packets[at].1.stiffness_n_per_m[0]);
        assert!(
            (after / before).ln().abs() < 0.03,
            "{before} to {after} N/m"
        );
        for (device_us, stream) in &packets[told..] {
            assert!(held(stream));
            assert!(
                (stream.activation - 2.0).abs() < 0.05,
                "cut at {cut_ms} ms: {} at {device_us}",
                stream.activation
            );
        }
    }
}

/// A converter that stops converting but goes on counting: held within 0.1 s.
#[test]
fn a_frozen_channel_is_held_within_a_tenth_of_a_second() {
    for rate_hz in [200.0, 1_000.0, 2_000.0] {
        let mut wearer = Wearer::<4>::new(&config(rate_hz));
        wearer.run(1.33, 0.5e-3);
        let frozen_us = wearer.time_us(wearer.index);
        let mut held_us = None;
        while held_us.is_none() && wearer.time_us(wearer.index) < frozen_us + 1_000_000 {
            for (device_us, stream) in streams(&wearer.push([1_234; 4])) {
                if stream.flags.contains(StreamFlags::ACTIVATION_HELD) {
                    assert_eq!(stream.quality[..4].iter().map(|q| q.bits()).max(), Some(2));
                    held_us = held_us.or(Some(device_us));
                }
            }
        }
        let after_us = held_us.unwrap() - frozen_us;
        assert!(after_us <= 100_000, "{rate_hz} Hz: {after_us} us");
    }
}

/// Device time that jumps while the index goes on: the board lost scans and did not notice.
#[test]
fn a_jump_in_time_alone_is_a_long_gap() {
    let mut wearer = Wearer::<1>::new(&config(1_000.0));
    wearer.run(1.0, 0.5e-3);
    let mut frames = Vec::new();
    for n in 0..1_000 {
        let index = wearer.index + n;
        wearer
            .pipeline
            .push_scan(&Scan {
                index,
                acquired_us: wearer.time_us(index) + 10_000_000,
                counts: [(5e3 * (0.6 * f64::from(n)).sin()) as i32],
            })
            .unwrap();
        frames.extend(take(&mut wearer.pipeline));
    }
    let (_, first) = streams(&frames)[0];
    assert!(
        first
            .flags
            .contains(StreamFlags::GAP.with(StreamFlags::ACTIVATION_HELD, true))
    );
    let status = last_status(&frames).unwrap();
    assert_eq!((status.gaps, status.missed_scans), (1, 0));
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
        dropped_packets: 20,
        ..Health::default()
    };
    wearer.pipeline.set_health(health);
    let frames = take(&mut wearer.pipeline);
    assert_eq!(frames.len(), 3, "one of each kind waits");
    assert_eq!(streams(&frames)[0].0, 1_000_000, "the newest stream packet");
    let status = last_status(&frames).unwrap();
    assert_eq!(
        (status.dropped_packets, status.uptime_s, status.overruns),
        (120, 1, 3)
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

//! The wearable's signal path on made-up signals: timing, closed forms, raw counts, refusals.
#![allow(clippy::unwrap_used, clippy::panic, reason = "test suite")]

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use tonus_shared::pipeline::{HeadingError, InputError, Pipeline, PipelineConfig, PipelineError};
use tonus_shared::sample::{AdcScale, Scan};
use tonus_shared::semg::chain::Chain;
use tonus_shared::stiffness::{ArmPosture, ArmStiffness, CoContraction, Segments};
use tonus_shared::wire::{Muscle, Packet, SequenceTracker, Stream, StreamFlags};
use tonus_tests::wearer::{Wearer, config, last_status, streams, take};

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

/// An attitude in a level frame turned by any heading, told where forward is by a hanging arm: what goes out is the attitude
/// in the shoulder frame, and the stiffness that of a pipeline that was told it.
#[test]
fn a_heading_is_found_while_the_arm_hangs() {
    let about = |axis, degrees: f64| UnitQuaternion::from_axis_angle(&axis, degrees.to_radians());
    let xyzw = |turned: UnitQuaternion<f64>| <[f64; 4]>::from(turned.coords).map(|x| x as f32);
    let scan = |index| Scan {
        index,
        acquired_us: 5_000 * u64::from(index),
        counts: [0],
    };
    for heading_deg in [-179.0, -90.0, -12.5, 0.0, 77.0, 180.0] {
        let level = about(Vector3::z_axis(), heading_deg);
        // Hanging as well as may be asked of people; then raised by 50 degrees, turned out by 20.
        let hangs = about(Vector3::y_axis(), -8.0);
        let raised = about(Vector3::z_axis(), -20.0) * about(Vector3::y_axis(), -50.0);
        let [mut finds, mut told] = [0, 1].map(|_| Pipeline::<1>::new(&config(200.0)).unwrap());
        assert_eq!(finds.face_forward(), Err(HeadingError::NoAttitude));
        let mut newest = [None, None];
        let mut oriented = None;
        for index in 0..200 {
            let upper_arm = if index < 100 { hangs } else { raised };
            for pipeline in [&mut finds, &mut told] {
                pipeline.push_scan(&scan(index)).unwrap();
            }
            let at_us = 5_000 * u64::from(index);
            finds.set_attitude(xyzw(level * upper_arm), at_us).unwrap();
            told.set_orientation(xyzw(upper_arm), at_us).unwrap();
            if index == 50 {
                let (_, seen) = last(&mut finds);
                assert!(!seen.unwrap().flags.contains(StreamFlags::ORIENTATION_SEEN));
                assert_eq!(finds.face_forward(), Ok(()));
            }
            for (pipeline, newest) in [&mut finds, &mut told].into_iter().zip(&mut newest) {
                let (orientation, stream) = last(pipeline);
                *newest = stream.or(*newest);
                oriented = orientation.or(oriented);
            }
        }
        let [found, expected] = newest.map(Option::unwrap);
        assert!(found.flags.contains(StreamFlags::ORIENTATION_SEEN));
        for (found, expected) in found
            .stiffness_n_per_m
            .iter()
            .zip(expected.stiffness_n_per_m)
        {
            assert!(
                (found / expected - 1.0).abs() < 1e-4,
                "{heading_deg}: {found} {expected}"
            );
        }
        let oriented = UnitQuaternion::from_quaternion(Quaternion::from(oriented.unwrap()));
        assert!(oriented.cast::<f64>().angle_to(&raised) < 1e-3);
        let raised = Err(HeadingError::NotHanging { tilt_deg: 50.0 });
        let refused = finds.face_forward().map_err(|error| match error {
            HeadingError::NotHanging { tilt_deg } => HeadingError::NotHanging {
                tilt_deg: tilt_deg.round(),
            },
            HeadingError::NoAttitude => error,
        });
        assert_eq!(refused, raised);
    }
}

/// The newest attitude and stream packet that wait.
fn last(pipeline: &mut Pipeline<1>) -> (Option<[f32; 4]>, Option<Stream>) {
    let (mut xyzw, mut newest) = (None, None);
    for frame in take(pipeline) {
        match frame.packet {
            Packet::Orientation(orientation) => xyzw = Some(orientation.xyzw),
            Packet::Stream(stream) => newest = Some(stream),
            _ => {}
        }
    }
    (xyzw, newest)
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

/// The chip has 256 KiB; the documentation promises 2.3 kB per channel and 4 kB besides.
#[test]
fn it_fits_the_memory_that_is_promised() {
    assert!(size_of::<Pipeline<1>>() <= 6_300);
    assert!(size_of::<Pipeline<8>>() <= 22_400);
}

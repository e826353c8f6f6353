//! Whole movements: the chip's recogniser and the host's on the same packets.

use tonus::model::image::Export;
use tonus::model::tempo::{TempoConfig, TempoRecogniser};
use tonus_shared::image::{ModelImage, WEARABLE};
use tonus_shared::onset::{MotionEdge, OnsetDetector};
use tonus_shared::recognition::{HYPOTHESES, PERIOD_US, Recognition, Storage};
use tonus_shared::wire::{Header, Inference, MAX_FRAME_BYTES, Packet, Stream, StreamFlags, encode};

use super::simulated::{Heard, MODEL, Movement, ONSET, export, movements};

fn words(export: &Export) -> Vec<u32> {
    let bytes = export.image(&MODEL).unwrap().bytes;
    bytes
        .chunks_exact(4)
        .map(|word| u32::from_le_bytes(word.try_into().unwrap()))
        .collect()
}

/// What the chip said at every tick, and how often at least so many hypotheses were dropped.
fn chip(
    recognition: &mut Recognition<'_>,
    movement: &Movement,
    hand_sent: bool,
    most: usize,
) -> Vec<(u64, Inference)> {
    let mut said = Vec::new();
    let mut next_us = movement.heard[0].0;
    for (now_us, heard) in &movement.heard {
        while next_us <= *now_us {
            if let Some(inference) = recognition.tick(next_us).unwrap() {
                // What is said can be sent.
                let header = Header {
                    boot_id: 1,
                    sequence: 0,
                    device_us: next_us,
                };
                let packet = Packet::Inference(inference.clone());
                encode(&header, &packet, &mut [0; MAX_FRAME_BYTES]).unwrap();
                said.push((next_us, inference));
                recognition.keep(most);
                assert!(recognition.hypotheses() <= most);
            }
            next_us += PERIOD_US;
        }
        match heard {
            Heard::Stream(acquired_us, stream) => recognition.stream(*acquired_us, stream).unwrap(),
            Heard::Hand(at_us, position_m) if hand_sent => {
                recognition.hand(*at_us, Some(*position_m)).unwrap()
            }
            Heard::Hand(..) => {}
        }
    }
    said
}

/// What the host's recogniser says half-way and at the end.
fn host(movement: &Movement) -> [Option<usize>; 2] {
    let view = MODEL.view().unwrap();
    let given = export(16);
    let config = TempoConfig {
        onset_late_s: given.onset_late_s,
        onset_std_s: given.onset_std_s,
        lead_s: given.lead_s,
        ..TempoConfig::default()
    };
    let mut recogniser = TempoRecogniser::new(&MODEL, &view, config).unwrap();
    let mut detector = OnsetDetector::new(&ONSET).unwrap();
    let interval_us = (given.interval_s * 1e6) as u64;
    let mut last = [0; 2];
    let mut half = None;
    let best = |recogniser: &TempoRecogniser<'_>| {
        let log = recogniser.log_posterior();
        recogniser
            .begun()
            .then(|| (0..3).max_by(|a, b| log[*a].total_cmp(&log[*b])).unwrap())
    };
    for (now_us, heard) in &movement.heard {
        if *now_us <= movement.half_us {
            half = best(&recogniser);
        }
        let (sensor, at_us, values) = match heard {
            Heard::Stream(acquired_us, stream) => (
                1,
                stream.describes_us(*acquired_us),
                stream.stiffness_n_per_m,
            ),
            Heard::Hand(at_us, position_m) => (0, *at_us, *position_m),
        };
        let values = values.map(f64::from);
        let time_s = at_us as f64 * 1e-6;
        if sensor == 0
            && let Ok(Some(MotionEdge::Onset { at_s })) = detector.step(time_s, values)
            && !recogniser.begun()
        {
            recogniser.begin(at_s).unwrap();
        }
        let interval = at_us / interval_us;
        if interval > last[sensor] {
            last[sensor] = interval;
            for (axis, value) in values.into_iter().enumerate() {
                let std = if sensor == 0 {
                    given.position_sigma_m
                } else {
                    given.stiffness_sigma * value
                };
                recogniser
                    .observe(3 * sensor + axis, time_s, value, std)
                    .unwrap();
            }
        }
    }
    [half, best(&recogniser)]
}

/// Right half-way and at the end, of all; and movements of which something was said.
fn score(
    movements: &[Movement],
    export: &Export,
    hand_sent: bool,
    most: usize,
) -> ([usize; 2], usize, u32) {
    let words = words(export);
    let image = ModelImage::parse(bytemuck::cast_slice(&words), &WEARABLE).unwrap();
    let (mut right, mut said_of, mut dropped) = ([0; 2], 0, 0);
    for movement in movements {
        let mut storage = Storage::new();
        let mut recognition = Recognition::new(&image, &mut storage).unwrap();
        let said = chip(&mut recognition, movement, hand_sent, most);
        dropped += recognition.dropped();
        said_of += usize::from(!said.is_empty());
        let truth = MODEL.skill(movement.label).unwrap();
        for (right, until_us) in right.iter_mut().zip([movement.half_us, movement.end_us]) {
            let last = said.iter().rfind(|(at_us, _)| *at_us <= until_us);
            *right +=
                usize::from(last.is_some_and(|(_, one)| usize::from(one.top[0].skill) == truth));
        }
    }
    (right, said_of, dropped)
}

#[test]
fn it_recognises_as_the_host_does() {
    let movements = movements(15, 4242);
    let mut on_host = [0; 2];
    for movement in &movements {
        let truth = MODEL.skill(movement.label);
        for (right, got) in on_host.iter_mut().zip(host(movement)) {
            *right += usize::from(got == truth);
        }
    }
    let all = movements.len();
    let (with_hand, ..) = score(&movements, &export(16), true, HYPOTHESES);
    let (few, _, dropped) = score(&movements, &export(16), true, 6);
    let (alone, said_of, _) = score(&movements, &export(16), false, HYPOTHESES);
    println!(
        "half-way and at the end, of {all}: host {on_host:?}, chip {with_hand:?}, chip with six hypotheses {few:?} \
         ({dropped} dropped), chip without a hand {alone:?} (something said of {said_of})"
    );
    println!(
        "Storage {} B, Recognition {} B",
        size_of::<Storage>(),
        size_of::<Recognition<'_>>()
    );
    for (chip, host) in with_hand.iter().zip(on_host) {
        assert!(chip + 2 >= host, "chip {chip}, host {host}");
    }
    assert!(dropped > 0);
}

fn stream(stiffness_n_per_m: [f32; 3], flags: StreamFlags) -> Stream {
    Stream {
        describes_before_us: 0,
        envelopes: [0.0; 8],
        activation: 0.0,
        co_contraction: 1.0,
        stiffness_n_per_m,
        quality: [tonus_shared::semg::quality::Quality::default(); 8],
        channels: 4,
        flags,
    }
}

#[test]
fn at_rest_nothing_is_said_and_nonsense_is_refused() {
    let words = words(&export(16));
    let image = ModelImage::parse(bytemuck::cast_slice(&words), &WEARABLE).unwrap();
    let mut storage = Storage::new();
    let mut recognition = Recognition::new(&image, &mut storage).unwrap();
    for step in 0..500_u64 {
        let now_us = step * PERIOD_US;
        recognition.hand(now_us, Some([0.3, 0.1, -0.2])).unwrap();
        recognition
            .stream(
                now_us,
                &stream([300.0, 250.0, 200.0], StreamFlags::default()),
            )
            .unwrap();
        assert_eq!(recognition.tick(now_us), Ok(None));
    }
    let now_us = 500 * PERIOD_US;
    assert!(
        recognition
            .hand(now_us, Some([f32::NAN, 0.0, 0.0]))
            .is_err()
    );
    assert!(recognition.hand(now_us, None).is_ok());
    for wrong in [0.0, -1.0, f32::NAN, f32::INFINITY] {
        assert!(
            recognition
                .stream(
                    now_us,
                    &stream([300.0, wrong, 200.0], StreamFlags::default())
                )
                .is_err()
        );
        // What only stands for a measurement is not looked at.
        assert!(
            recognition
                .stream(
                    now_us,
                    &stream([300.0, wrong, 200.0], StreamFlags::STIFFNESS_HELD)
                )
                .is_ok()
        );
    }
    assert_eq!(
        (recognition.tick(now_us), recognition.dropped()),
        (Ok(None), 0)
    );
}

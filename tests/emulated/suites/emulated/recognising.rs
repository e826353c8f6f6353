//! A model that a host uploads, and a hand that it sends: what the executed image recognises, against the same code on the
//! host in the same numbers.

use std::collections::BTreeMap;

use tonus_emulated::Machine;
use tonus_shared::image::{ModelImage, WEARABLE};
use tonus_shared::recognition::{PERIOD_US, Recognition, Storage};
use tonus_shared::wire::{HandPosition, Inference, Kind, Packet, Stream};

use super::models::{self, Model};
use super::{frames_since, host, started};

/// The tracker's period.
const HAND_US: u64 = 10_000;
/// The hand rests, then moves at 0.5 m/s.
const REST_HANDS: u64 = 60;
const MOVING_HANDS: u64 = 60;
const SPEED_M_PER_S: f32 = 0.5;

/// Where the hand is at its n-th position.
fn position_m(number: u64) -> [f32; 3] {
    let moved_s = number.saturating_sub(REST_HANDS) as f32 * HAND_US as f32 * 1e-6;
    [0.2 + SPEED_M_PER_S * moved_s, 0.1, -0.3]
}

/// A stream packet is there for recognition some time after its scan, when that was read out and filtered and a posture's
/// stiffness computed: between these, us, and always about the same.
const STREAM_READY_US: core::ops::RangeInclusive<u64> = 800..=1_800;
/// A hand's frame and a stream's on the line.
const HAND_LINE_US: u64 = 370;
const STREAM_LINE_US: u64 = 910;

/// What came in one run: stream packets and inferences by device time, and the hands by the device time at which they had
/// come, with the time that they were for.
struct Heard {
    streams: BTreeMap<u64, Stream>,
    hands: BTreeMap<u64, (u64, [f32; 3])>,
    inferences: Vec<(u64, Inference)>,
    /// When recognition began: the upload was answered.
    began_us: u64,
}

/// A person who moves their hand, as the wearable hears of it, and what came from `from_us` on.
fn moved(machine: &mut Machine, from_us: u64) -> Heard {
    let mut sent = Vec::new();
    for number in 0..REST_HANDS + MOVING_HANDS {
        let newest = frames_since(machine, from_us)
            .into_iter()
            .filter(|(_, frame)| frame.packet.kind() == Kind::Stream)
            .map(|(_, frame)| frame.header.device_us)
            .max()
            .unwrap();
        let hand = HandPosition {
            position_m: Some(position_m(number)),
        };
        sent.push((machine.now_us(), newest, position_m(number)));
        machine.send(&host::dated(
            1_000 + number as u32,
            newest,
            Packet::HandPosition(hand),
        ));
        machine.run_through(machine.now_us() + HAND_US).unwrap();
    }
    let (mut streams, mut inferences, mut began_us) = (BTreeMap::new(), Vec::new(), 0);
    // The machine's clock began before the wearable's.
    let mut ahead_us = u64::MAX;
    for (complete_us, frame) in frames_since(machine, from_us) {
        let device_us = frame.header.device_us;
        match frame.packet {
            Packet::Stream(stream) => {
                ahead_us = ahead_us.min(complete_us - STREAM_LINE_US - device_us);
                streams.insert(device_us, stream);
            }
            Packet::Inference(inference) => inferences.push((device_us, inference)),
            Packet::Reply(reply) if reply.answered == Kind::ModelUpload => began_us = device_us,
            _ => {}
        }
    }
    let arrived = |(sent_us, at_us, position_m)| {
        let arrived_us: u64 = sent_us + HAND_LINE_US - ahead_us;
        (arrived_us, (at_us, position_m))
    };
    Heard {
        streams,
        hands: sent.into_iter().map(arrived).collect(),
        inferences,
        began_us,
    }
}

/// What the host's build of the same code says at the chip's own times, told the newest of what was there, where stream packets
/// are there so long after their scans.
fn computed(model: &Model, heard: &Heard, ready_us: u64) -> Vec<Inference> {
    let words = model.aligned();
    let bytes: &[u8] = bytemuck::cast_slice(&words);
    let image = ModelImage::parse(bytes, &WEARABLE).unwrap();
    let mut storage = Box::new(Storage::new());
    let mut recognition = Recognition::new(&image, &mut storage).unwrap();
    let first_us = heard.inferences[0].0;
    // Backwards in whole periods, to the first; from the first word on, when the chip spoke.
    let periods = (first_us - heard.began_us) / PERIOD_US - 1;
    let silent = (1..=periods).rev().map(|n| first_us - n * PERIOD_US);
    let spoken: Vec<u64> = heard.inferences.iter().map(|(at_us, _)| *at_us).collect();
    let mut told_us = 0;
    let mut said = Vec::new();
    for tick_us in silent.chain(spoken.iter().copied()) {
        if let Some((_, (at_us, position_m))) = heard.hands.range(told_us..tick_us).next_back() {
            recognition.hand(*at_us, Some(*position_m)).unwrap();
        }
        let before = |us: u64| us.saturating_sub(ready_us);
        let streams = heard.streams.range(before(told_us)..before(tick_us));
        if let Some((&acquired_us, stream)) = streams.last() {
            recognition.stream(acquired_us, stream).unwrap();
        }
        told_us = tick_us;
        said.extend(recognition.tick(tick_us).unwrap());
        // A step that came late dropped a quarter of its hypotheses.
        let next = spoken.iter().find(|at_us| **at_us > tick_us);
        if said.len() == 1 && next.is_some_and(|next_us| next_us - tick_us > 2 * PERIOD_US) {
            recognition.keep(recognition.hypotheses() * 3 / 4);
        }
    }
    assert_eq!(
        said.len(),
        heard.inferences.len(),
        "silent when the chip was"
    );
    said
}

#[test]
fn an_uploaded_model_recognises_a_movement_as_the_host_computes_it() {
    let mut machine = started();
    let model = Model::golden();
    let from_us = host::idle_line(&mut machine);
    models::upload(&mut machine, &model);
    assert_eq!(models::active(&mut machine), Some(model.hash()));
    let heard = moved(&mut machine, from_us);
    // At rest nothing is said; the movement's 0.6 s are 30 periods, of which the onset takes some.
    let count = heard.inferences.len();
    assert!((15..=30).contains(&count), "{count} inferences");
    // The first sets every hypothesis up and takes longer than a period: the next is a whole one later.
    let steps = heard.inferences[1..].windows(2);
    let steps: Vec<u64> = steps.map(|pair| pair[1].0 - pair[0].0).collect();
    assert!(
        steps.iter().all(|step| step.abs_diff(PERIOD_US) < 1_000),
        "{steps:?}"
    );
    let differ = |ready_us| differs(&heard, &computed(&model, &heard, ready_us));
    let all: Vec<_> = STREAM_READY_US.step_by(100).map(differ).collect();
    assert!(all.contains(&None), "{all:?}");
}

/// The first inference in which the chip differs from the host, if any.
fn differs(heard: &Heard, computed: &[Inference]) -> Option<String> {
    let log = |inference: &Inference| inference.top[0].log_posterior;
    for ((at_us, chip), host) in heard.inferences.iter().zip(computed) {
        let mut stiffnesses = chip.stiffness_n_per_m.iter().zip(host.stiffness_n_per_m);
        let same = chip.skills == host.skills
            && chip.top[0].skill == host.top[0].skill
            && (log(chip) - log(host)).abs() < 1e-3
            && (chip.phase - host.phase).abs() < 1e-3
            && stiffnesses.all(|(chip, host)| (chip / host - 1.0).abs() < 1e-3);
        if !same {
            return Some(format!("at {at_us} us: {chip:?} {host:?}"));
        }
    }
    None
}

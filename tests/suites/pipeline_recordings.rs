//! Real people through the wearable's signal path, every packet encoded and decoded on the way.
//!
//! Calibration, for want of anything better in the recordings: the maximum voluntary contraction of a channel is the
//! maximum of its envelope over the whole recording, its rest level the mean over the stated first part. Both come from a
//! first pass through the same pipeline.
#![allow(clippy::unwrap_used, clippy::panic, reason = "test suite")]

use std::path::Path;

use tonus_shared::pipeline::{
    ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Pipeline, PipelineConfig,
};
use tonus_shared::sample::{AdcScale, Scan};
use tonus_shared::semg::chain::ChainConfig;
use tonus_shared::stiffness::{ArmStiffness, CoContraction, Segments};
use tonus_shared::wire::{
    Frame, HandPosition, Header, MAX_FRAME_BYTES, Muscle, Packet, Stream, StreamFlags, decode,
    encode,
};
use tonus_tests::recordings;

/// Columns of a CSV file by name, and its rows.
struct Table {
    names: Vec<String>,
    rows: Vec<Vec<String>>,
}

impl Table {
    fn read(path: &Path) -> Self {
        let mut reader = csv::Reader::from_path(path).unwrap();
        let names = reader.headers().unwrap().iter().map(String::from).collect();
        let rows = reader
            .records()
            .map(|row| row.unwrap().iter().map(String::from).collect())
            .collect();
        Self { names, rows }
    }

    fn text(&self, name: &str) -> Vec<&str> {
        let at = self.names.iter().position(|found| found == name).unwrap();
        self.rows.iter().map(|row| row[at].as_str()).collect()
    }

    fn numbers(&self, name: &str) -> Vec<f64> {
        self.text(name)
            .iter()
            .map(|text| text.parse().unwrap())
            .collect()
    }
}

/// Over the wire and back.
fn cross(header: &Header, packet: &Packet) -> Frame {
    let mut buffer = [0; MAX_FRAME_BYTES];
    let length = encode(header, packet, &mut buffer).unwrap();
    let frame = decode(&buffer[..length]).unwrap();
    assert_eq!((frame.header, &frame.packet), (*header, packet));
    frame
}

/// A decoded stream packet and the time that its activation and stiffness describe, s.
struct Moment {
    describes_s: f64,
    stream: Stream,
}

/// Counts at the configured rate, from time 0, and hands (time in s, position), through pipeline and wire.
fn through<const C: usize>(
    config: &PipelineConfig<C>,
    counts: &[[i32; C]],
    hands: &[(f64, [f32; 3])],
) -> Vec<Moment> {
    let mut pipeline = Pipeline::new(config).unwrap();
    let mut hands = hands.iter().peekable();
    let mut moments = Vec::new();
    for (index, counts) in (0_u32..).zip(counts) {
        let t_s = f64::from(index) / config.chain.rate_hz;
        let acquired_us = 1_000_000 + (t_s * 1e6).round() as u64;
        pipeline
            .push_scan(&Scan {
                index,
                acquired_us,
                counts: *counts,
            })
            .unwrap();
        while let Some((seen_s, hand)) = hands.next_if(|(seen_s, _)| *seen_s <= t_s) {
            let header = Header {
                boot_id: 1,
                sequence: 0,
                device_us: 1_000_000 + (seen_s * 1e6).round() as u64,
            };
            let sent = Packet::HandPosition(HandPosition {
                position_m: Some(*hand),
            });
            let Packet::HandPosition(seen) = cross(&header, &sent).packet else {
                unreachable!()
            };
            pipeline
                .set_hand(seen.position_m, header.device_us)
                .unwrap();
        }
        while let Some(frame) = pipeline.next_frame() {
            let frame = cross(&frame.header, &frame.packet);
            if let Packet::Stream(stream) = frame.packet {
                let describes_us = frame.header.device_us - u64::from(stream.describes_before_us);
                moments.push(Moment {
                    describes_s: describes_us as f64 * 1e-6 - 1.0,
                    stream,
                });
            }
        }
    }
    moments
}

fn mean(values: impl Iterator<Item = f64>) -> f64 {
    let (sum, number) = values.fold((0.0, 0), |(sum, number), value| (sum + value, number + 1));
    assert!(number > 0, "nothing to average");
    sum / f64::from(number)
}

/// Rest (mean until `rest_s`) and maximum of each channel's envelope, V.
fn calibrated<const C: usize>(
    mut config: PipelineConfig<C>,
    counts: &[[i32; C]],
    rest_s: f64,
) -> PipelineConfig<C> {
    for channel in &mut config.channels {
        (channel.rest_v, channel.mvc_v) = (0.0, 1.0);
    }
    let moments = through(&config, counts, &[]);
    for (at, channel) in config.channels.iter_mut().enumerate() {
        let envelope = |moment: &Moment| f64::from(moment.stream.envelopes[at]);
        channel.rest_v = mean(
            moments
                .iter()
                .filter(|moment| moment.describes_s < rest_s)
                .map(envelope),
        );
        channel.mvc_v = moments.iter().map(envelope).fold(0.0, f64::max);
    }
    config
}

/// Lift of a box from one shelf to another: biceps and triceps at 2 kHz, hand from the wrist marker.
fn box_lift() -> Vec<Moment> {
    let folder = recordings().join("pyomeca_box_emg_mocap/csv");
    let emg = Table::read(&folder.join("emg_2000hz.csv"));
    let volts = ["emg0", "emg1"].map(|name| emg.numbers(name));
    // An ADS129x at gain 6: 0.4 V over 2^23 counts.
    let adc = AdcScale::new(0.4 / 8_388_607.0, 0, -8_388_608, 8_388_607).unwrap();
    let counts: Vec<_> = (0..volts[0].len())
        .map(|n| {
            [0, 1].map(|channel: usize| (volts[channel][n] / adc.volts_per_count()).round() as i32)
        })
        .collect();
    // The subject faces -x of the room with z up (the box stands at -x), so that left is -y. The wrist stands for the
    // palm, the acromion marker for the shoulder's centre.
    let motion = Table::read(&folder.join("pos_100hz.csv"));
    let axis = |wrist, shoulder, sign: f64| -> Vec<f32> {
        let pairs = motion
            .numbers(wrist)
            .into_iter()
            .zip(motion.numbers(shoulder));
        pairs
            .map(|(wrist, shoulder)| (sign * (wrist - shoulder)) as f32)
            .collect()
    };
    let [x, y, z] = [
        axis("x", "shoulder_x", -1.0),
        axis("y", "shoulder_y", -1.0),
        axis("z", "shoulder_z", 1.0),
    ];
    let times = motion.numbers("t_s").into_iter().enumerate();
    let hands: Vec<_> = times.map(|(n, t_s)| (t_s, [x[n], y[n], z[n]])).collect();
    let channel = |muscle| ChannelConfig {
        muscle,
        rest_v: 0.0,
        mvc_v: 1.0,
    };
    let config = PipelineConfig {
        boot_id: 1,
        firmware_hash: [0; 8],
        adc,
        chain: ChainConfig::at_rate(2_000.0),
        channels: [channel(Muscle::BicepsLong), channel(Muscle::TricepsLateral)],
        activation_window_s: DEFAULT_ACTIVATION_WINDOW_S,
        // The markers' upper arm of 0.30 m is that of a person of 1.61 m; the curve is illustrative.
        arm: ArmStiffness::new(
            CoContraction::new(0.7, 1.5).unwrap(),
            [13.0, 13.0, 12.0, 12.0],
            Segments::new(65.0, 1.61).unwrap(),
        )
        .unwrap(),
        raw: false,
    };
    through(&calibrated(config, &counts, 0.4), &counts, &hands)
}

#[test]
fn a_box_lift_goes_from_biceps_to_triceps() {
    let moments = box_lift();
    assert!(moments.len() >= 579, "100 Hz for 5.8 s: {}", moments.len());
    let over = |from_s: f64, to_s: f64, value: &dyn Fn(&Stream) -> f32| {
        let within = moments
            .iter()
            .filter(|moment| (from_s..to_s).contains(&moment.describes_s));
        mean(within.map(|moment| f64::from(value(&moment.stream))))
    };
    let biceps = |stream: &Stream| stream.envelopes[0];
    let triceps = |stream: &Stream| stream.envelopes[1];
    // The labels: rest until 0.45 s, the box moves from 1.61 to 3.87 s: picked up until 2.6 s, placed from 3.0 s.
    let figures = [(0.0, 0.45), (1.61, 2.6), (3.0, 3.87)]
        .map(|(from_s, to_s)| [biceps, triceps].map(|muscle| over(from_s, to_s, &muscle)));
    println!("biceps, triceps at rest, pick-up, placing: {figures:.3?}");
    let [rest, pick_up, placing] = figures;
    assert!(pick_up[0] > 2.0 * pick_up[1], "biceps leads the lift");
    assert!(placing[1] > 2.0 * placing[0], "triceps leads the placing");
    assert!(pick_up[0] > 5.0 * rest[0].max(0.01) && placing[1] > 5.0 * rest[1].max(0.01));
    let co_contraction = |stream: &Stream| stream.co_contraction;
    let [before, during] = [
        over(0.0, 0.45, &co_contraction),
        over(1.61, 2.6, &co_contraction),
    ];
    println!("co-contraction at rest {before:.3}, at pick-up {during:.3}");
    assert!(
        during > before + 0.1,
        "co-contraction rises at pick-up: {before} to {during}"
    );
}

#[test]
fn the_box_lift_has_stiffness_throughout() {
    let moments = box_lift();
    let all = moments
        .iter()
        .flat_map(|moment| moment.stream.stiffness_n_per_m);
    let (low, high) = all.fold((f32::MAX, 0_f32), |(low, high), k| {
        (low.min(k), high.max(k))
    });
    println!("stiffness from {low} to {high} N/m");
    let marked = |flag| {
        moments
            .iter()
            .filter(|moment| moment.stream.flags.contains(flag))
            .count()
    };
    println!(
        "near straight {}, clamped {}",
        marked(StreamFlags::NEAR_SINGULAR),
        marked(StreamFlags::POSTURE_CLAMPED)
    );
    assert!(low > 0.0 && high.is_finite());
    // The hand of the first stream packet came after it.
    for moment in &moments[1..] {
        let flags = moment.stream.flags;
        assert!(flags.contains(StreamFlags::HAND_SEEN));
        assert!(!flags.contains(StreamFlags::GAP) && !flags.contains(StreamFlags::ACTIVATION_HELD));
        assert!(
            !flags.contains(StreamFlags::STIFFNESS_HELD),
            "at {} s",
            moment.describes_s
        );
    }
}

/// Eight channels at 200 Hz. Where the bracelet sat is not recorded: for the activation its pods are dealt out to the four
/// heads in turn, so that the figure is the bracelet's mean times four.
#[test]
fn a_myo_at_rest_lies_below_every_gesture() {
    use Muscle::{BicepsLong, BicepsShort, TricepsLateral, TricepsLong};
    let table = Table::read(&recordings().join("libemg_myo_mit/csv/myo_dataset.csv"));
    let channels: Vec<_> = (0..8)
        .map(|at| table.numbers(&format!("emg{at}")))
        .collect();
    let (labels, trials) = (table.text("label"), table.text("trial"));
    let places = [BicepsShort, BicepsLong, TricepsLateral, TricepsLong];
    let config = PipelineConfig::<8> {
        boot_id: 1,
        firmware_hash: [0; 8],
        // The armband gives no volts: one count is the unit, and one of them the contraction.
        adc: AdcScale::new(1.0, 0, -128, 127).unwrap(),
        chain: ChainConfig::at_rate(200.0),
        channels: std::array::from_fn(|at| ChannelConfig {
            muscle: places[at % 4],
            rest_v: 0.0,
            mvc_v: 1.0,
        }),
        activation_window_s: DEFAULT_ACTIVATION_WINDOW_S,
        arm: ArmStiffness::illustrative(),
        raw: true,
    };
    let counts_of = |label: &str, trial: &str| -> Vec<[i32; 8]> {
        (0..labels.len())
            .filter(|row| labels[*row] == label && trials[*row] == trial)
            .map(|row| std::array::from_fn(|at| channels[at][row] as i32))
            .collect()
    };
    for trial in ["rep0", "rep1", "rep2", "rep3"] {
        let activation = ["class0", "class1", "class2", "class3", "class4"].map(|label| {
            let counts = counts_of(label, trial);
            assert!(counts.len() > 590, "3 s");
            let moments = through(&config, &counts, &[]);
            // The filters' first 0.3 s are not counted.
            mean(
                moments
                    .iter()
                    .skip(30)
                    .map(|moment| f64::from(moment.stream.activation)),
            )
        });
        println!("{trial}: {activation:.1?}");
        for (class, gesture) in activation
            .iter()
            .enumerate()
            .filter(|(class, _)| *class != 2)
        {
            assert!(
                activation[2] < *gesture,
                "{trial}: rest {} and class{class} {gesture}",
                activation[2]
            );
        }
    }
}

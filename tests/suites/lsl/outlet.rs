//! Envelopes and stiffness as pylsl sees them.

use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tonus::broadcast::Broadcast;
use tonus::clock::ClockConfig;
use tonus::live::{Input, SessionClock, Timed};
use tonus_native::lsl::Lsl;
use tonus_shared::wire::{Configuration, Header, Muscle, Packet, Stream};
use tonus_tests::frames::{bytes_of, golden_stream};

/// Every packet is so long on its way at least, microseconds: longer than pylsl takes.
const TRANSPORT_US: u32 = 300_000;

const LISTEN: &str = r#"
import json, pylsl
info, = pylsl.resolve_byprop("type", "EMG", timeout=20)
inlet = pylsl.StreamInlet(info)
info = inlet.info(timeout=10)
channel, channels = info.desc().child("channels").child("channel"), []
for _ in range(info.channel_count()):
    channels.append([channel.child_value(name) for name in ("label", "unit", "type")])
    channel = channel.next_sibling()
samples, late = [], []
while len(samples) < 100:
    sample, stamp = inlet.pull_sample(timeout=10)
    samples.append(sample + [stamp])
    late.append(pylsl.local_clock() - stamp)
print(json.dumps({
    "name": info.name(), "type": info.type(), "rate": info.nominal_srate(), "source": info.source_id(),
    "float32": info.channel_format() == pylsl.cf_float32, "channels": channels, "samples": samples, "late": sorted(late)[50],
}))
"#;

fn configuration() -> Packet {
    let mut muscles = [Muscle::Absent; 8];
    muscles[0] = Muscle::BicepsShort;
    muscles[1] = Muscle::TricepsLong;
    Packet::Configuration(Configuration {
        semg_hz: 1000.0,
        stream_hz: 100.0,
        volts_per_count: 1e-7,
        offset_counts: 0,
        chain_delay_us: 30_000,
        channels: 2,
        muscles,
        mains_hz: None,
        raw: false,
        firmware_hash: [0; 8],
    })
}

fn stream(number: u32) -> Packet {
    let Packet::Stream(stream) = golden_stream() else {
        panic!("golden_stream is one");
    };
    Packet::Stream(Stream {
        channels: 2,
        envelopes: [number as f32 / 1024.0, 0.25, 0.0, 0.0, 0.0, 0.0, 0.0, 0.0],
        quality: tonus_tests::frames::quality([0; 8]),
        ..stream
    })
}

#[test]
fn pylsl_reads_labels_units_rate_and_samples() {
    crate::inside("outlet::pylsl_reads_labels_units_rate_and_samples", send);
}

fn send(lsl: Lsl) {
    let clock = SessionClock::start();
    let told = ClockConfig {
        transport_us: TRANSPORT_US,
        ..ClockConfig::default()
    };
    let mut broadcast = Broadcast::new(lsl, "sim", told);
    let mut sequence = 0;
    let mut take = |broadcast: &mut Broadcast, packet: &Packet| {
        let at_us = clock.now_us();
        let header = Header {
            boot_id: 3,
            sequence,
            device_us: at_us,
        };
        sequence += 1;
        let input = Input::Frame(bytes_of(&header, packet).expect("a sound packet"));
        let timed = Timed { at_us, input };
        broadcast.take(&timed, clock.now_us()).expect("sent");
    };
    // Before the channels are known there is no stream, and nothing fails.
    take(&mut broadcast, &stream(0));
    take(&mut broadcast, &configuration());
    let mut listener = crate::python(LISTEN);
    let (began, mut number) = (Instant::now(), 0);
    while listener.try_wait().expect("waits").is_none() {
        assert!(
            began.elapsed() < Duration::from_secs(60),
            "pylsl heard nothing"
        );
        take(&mut broadcast, &stream(number));
        if number.is_multiple_of(100) {
            // Said again, as the wearable does once a second: the stream goes on.
            take(&mut broadcast, &configuration());
        }
        number += 1;
        std::thread::sleep(Duration::from_millis(10));
    }
    let output = listener.wait_with_output().expect("ended");
    assert!(output.status.success());
    check(&serde_json::from_slice(&output.stdout).expect("JSON"));
}

fn check(seen: &Value) {
    assert_eq!(
        (&seen["name"], &seen["type"], &seen["rate"]),
        (&"Tonus".into(), &"EMG".into(), &100.0.into())
    );
    assert_eq!(
        (&seen["source"], &seen["float32"]),
        (&"tonus:sim".into(), &true.into())
    );
    let channels = json!([
        ["envelope_1_biceps_short", "share of maximum", "EMG"],
        ["envelope_2_triceps_long", "share of maximum", "EMG"],
        ["activation", "share of maximum", "Activation"],
        ["co_contraction", "1", "Activation"],
        ["stiffness_x", "N/m", "Stiffness"],
        ["stiffness_y", "N/m", "Stiffness"],
        ["stiffness_z", "N/m", "Stiffness"],
    ]);
    assert_eq!(seen["channels"], channels);
    let samples = seen["samples"].as_array().expect("a list");
    let value = |sample: &Value, place: usize| sample[place].as_f64().expect("a number");
    for pair in samples.windows(2) {
        let step = (value(&pair[1], 0) - value(&pair[0], 0)) * 1024.0;
        assert_eq!(step, 1.0, "every sample, in order");
        assert!(value(&pair[1], 7) > value(&pair[0], 7), "stamps rise");
    }
    let rest: Vec<f64> = (1..7).map(|place| value(&samples[50], place)).collect();
    assert_eq!(rest, [0.25, 0.5, 1.75, 310.5, 222.25, 95.125]);
    let late_s = seen["late"].as_f64().expect("a number");
    assert!(
        (0.295..0.55).contains(&late_s),
        "heard {late_s} s after the scan"
    );
}

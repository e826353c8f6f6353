//! The armband's packets, made of what a real one measured.

use std::path::PathBuf;

use tonus::link::myo::{Armband, CHANNELS, MUSCLES, SEMG};
use tonus_shared::wire::{Control, Muscle, Packet, Stream, decode};
use tonus_tests::frames::{HEADER, bytes_of};

/// Each recording: its counts, and whether the person made the gesture.
fn recordings() -> Vec<(PathBuf, Vec<[i8; CHANNELS]>, Vec<bool>)> {
    let folder = tonus_tests::recordings().join("myo_readings_wrist_mit/csv");
    let files = std::fs::read_dir(folder)
        .unwrap()
        .map(|entry| entry.unwrap().path());
    let mut all: Vec<_> = files.map(read).collect();
    all.sort();
    assert_eq!(all.len(), 8);
    all
}

fn read(path: PathBuf) -> (PathBuf, Vec<[i8; CHANNELS]>, Vec<bool>) {
    let (mut counts, mut gesture) = (Vec::new(), Vec::new());
    for row in csv::Reader::from_path(&path).unwrap().records() {
        let row = row.unwrap();
        counts.push(std::array::from_fn(|channel| {
            row[1 + channel].parse().unwrap()
        }));
        gesture.push(&row[9] != "hibernation");
    }
    (path, counts, gesture)
}

/// Packets of two samples as the armband sends them, each from the next characteristic, 10 ms apart.
fn packets(counts: &[[i8; CHANNELS]]) -> impl Iterator<Item = (u128, Vec<u8>, u64)> {
    counts.chunks_exact(2).zip(0_u64..).map(|(pair, number)| {
        let bytes = pair
            .concat()
            .iter()
            .map(|count| count.cast_unsigned())
            .collect();
        (SEMG[number as usize % 4], bytes, 500_000 + 10_000 * number)
    })
}

/// What leaves an armband with raw sEMG switched on.
fn played(counts: &[[i8; CHANNELS]]) -> Vec<Packet> {
    let mut armband = Armband::new(7).unwrap();
    let mut left = Vec::new();
    let raw = bytes_of(&HEADER, &Packet::Control(Control::Raw(true))).unwrap();
    armband.connected();
    armband.request(&raw, 0, |_| {});
    for (characteristic, bytes, at_us) in packets(counts) {
        let send = |bytes: &[u8]| left.push(decode(bytes).unwrap().packet);
        armband.take(characteristic, &bytes, at_us, send).unwrap();
    }
    left
}

#[test]
fn every_count_of_every_recording_comes_out_in_its_place() {
    for (path, counts, _) in recordings() {
        // Whole raw packets: nine scans of eight channels.
        let counts = &counts[..counts.len() / 18 * 18];
        let mut came = Vec::new();
        let mut next = None;
        for packet in played(counts) {
            if let Packet::RawSemg(raw) = packet {
                assert!(next.is_none_or(|next| next == raw.first_index), "{path:?}");
                next = Some(raw.first_index + 9);
                came.extend(
                    raw.counts
                        .as_slice()
                        .as_chunks::<CHANNELS>()
                        .0
                        .iter()
                        .copied(),
                );
            }
        }
        let expected: Vec<_> = counts.iter().map(|scan| scan.map(i32::from)).collect();
        assert_eq!(came, expected, "{path:?}");
    }
}

#[test]
fn the_gesture_shows_in_the_envelopes_of_the_recordings() {
    for (path, counts, gesture) in recordings() {
        let streams: Vec<Stream> = played(&counts)
            .into_iter()
            .filter_map(|packet| match packet {
                Packet::Stream(stream) => Some(stream),
                _ => None,
            })
            .collect();
        // One for every two samples: 100 a second.
        assert_eq!(streams.len(), counts.len() / 2, "{path:?}");
        let mean = |wanted: bool| {
            let of = streams.iter().zip(gesture.iter().step_by(2));
            let envelopes: Vec<f32> = of
                .filter(|(_, gesture)| **gesture == wanted)
                .map(|(stream, _)| stream.envelopes.iter().sum())
                .collect();
            envelopes.iter().sum::<f32>() / envelopes.len() as f32
        };
        if gesture.contains(&true) {
            // The data's own description: the gesture's RMS is 1.4 to 7 times that of rest.
            assert!(
                mean(true) > 1.2 * mean(false),
                "{path:?}: {} {}",
                mean(true),
                mean(false)
            );
        }
    }
}

#[test]
fn eight_channels_at_two_hundred_hertz_are_announced_and_what_is_no_packet_is_refused() {
    let (_, counts, _) = recordings().swap_remove(0);
    let packets = played(&counts[..40]);
    let Packet::Configuration(told) = packets[0] else {
        panic!("first the configuration: {:?}", packets[0]);
    };
    assert_eq!(
        (told.channels, told.semg_hz, told.muscles),
        (8, 200.0, MUSCLES)
    );
    let of_the_arm = |muscle: &&Muscle| **muscle != Muscle::Other;
    assert_eq!(told.muscles.iter().filter(of_the_arm).count(), 4);
    let mut armband = Armband::new(7).unwrap();
    assert!(
        armband
            .take(SEMG[0], &[0; 20], 0, |_| panic!("no frame"))
            .is_err()
    );
    armband
        .take(0x1234, &[0; 16], 0, |_| panic!("no frame"))
        .unwrap();
}

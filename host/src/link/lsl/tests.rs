use tonus_shared::wire::{Control, Header, MAX_FRAME_BYTES, Packet, decode, encode};

use super::{Channel, StreamError, Streamed};

fn channels<const N: usize>(
    labels: [&'static str; N],
    unit: &'static str,
) -> [Channel<'static>; N] {
    labels.map(|label| Channel { label, unit })
}

/// Raw counts of the first scans, with their indexes.
fn raw(streamed: &mut Streamed, samples: &[(Vec<f32>, u64)]) -> Vec<(u32, Vec<i32>)> {
    let mut bytes = [0; MAX_FRAME_BYTES];
    let header = Header {
        boot_id: 1,
        sequence: 0,
        device_us: 0,
    };
    let length = encode(&header, &Packet::Control(Control::Raw(true)), &mut bytes).unwrap();
    streamed.request(&bytes[..length], 0, |_| {});
    let mut scans = Vec::new();
    for (sample, at_us) in samples {
        streamed.take(sample, *at_us, |frame| {
            if let Packet::RawSemg(raw) = decode(frame).unwrap().packet {
                for (scan, counts) in (0..).zip(raw.counts.chunks(4)) {
                    scans.push((raw.first_index + scan, counts.to_vec()));
                }
            }
        });
    }
    scans
}

#[test]
fn samples_become_counts_of_fifty_nanovolts_in_the_wearables_order() {
    let labels = [
        "Triceps long",
        "x",
        "BIC_SHORT",
        "biceps long head",
        "tric lat",
    ];
    let mut streamed = Streamed::new(7, 1000.0, &channels(labels, "microvolts")).unwrap();
    let samples: Vec<(Vec<f32>, u64)> = (0..72)
        .map(|number| {
            let sample = vec![4.0, 9.0, 1.0, f32::NAN, -500_000.0];
            (sample, 1_000_000 + number * 1000)
        })
        .collect();
    let scans = raw(&mut streamed, &samples);
    assert!(scans.len() > 10);
    assert_eq!(scans[0], (0, vec![20, 0x7f_ffff, -0x7f_ffff, 80]));
}

#[test]
fn a_gap_is_a_jump_of_the_index_and_jitter_is_none() {
    let mut streamed = Streamed::new(7, 1000.0, &channels(["", "", "", ""], "mV")).unwrap();
    let times = (0..60).map(|number| number * 1000 + (number % 3) * 400);
    let times = times.chain((0..60).map(|number| 100_000 + number * 1000));
    let samples: Vec<(Vec<f32>, u64)> = times.map(|at_us| (vec![0.001; 4], at_us)).collect();
    let scans = raw(&mut streamed, &samples);
    let indexes: Vec<u32> = scans.iter().map(|(index, _)| *index).collect();
    let jumps: Vec<u32> = indexes
        .windows(2)
        .map(|pair| pair[1] - pair[0])
        .filter(|step| *step != 1)
        .collect();
    // Sample 59 came at 59.8 ms, the next at 100 ms.
    assert_eq!(jumps, [40]);
    assert_eq!(scans[0].1, [20; 4]);
}

#[test]
fn a_stream_that_is_not_fit_is_refused_with_what_is_wrong() {
    let refused =
        |rate_hz, channels: &[Channel<'_>]| Streamed::new(7, rate_hz, channels).unwrap_err();
    assert_eq!(
        refused(1000.0, &channels(["a", "b"], "")),
        StreamError::Channels { got: 2 }
    );
    assert_eq!(
        refused(0.0, &channels([""; 4], "")),
        StreamError::Rate { got_hz: 0.0 }
    );
    let unit = "percent".to_owned();
    assert_eq!(
        refused(200.0, &channels([""; 4], "percent")),
        StreamError::Unit { channel: 1, unit }
    );
}

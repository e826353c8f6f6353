//! Real armbands: the same gestures later in a session, as they are, turned, with a dead and with a swapped channel.

use tonus::calibration::{Finding, FitCheck, Measured, Pattern, Verdict};
use tonus_shared::semg::chain::{Chain, ChainConfig, ChainState};
use tonus_shared::wire::Muscle;

const CHANNELS: usize = 8;
const RATE_HZ: f64 = 200.0;
/// Left out at the ends of each span of one label: reactions lag behind the labels.
const EDGE: usize = 300;
/// What an int8 of an armband is taken for, V: only ratios count.
const VOLTS_PER_COUNT: f64 = 1e-6;

/// Spans of one label: `(gesture?, envelopes)`, in order.
fn spans(file: &str) -> Vec<(bool, Vec<[f64; CHANNELS]>)> {
    let path = tonus_tests::recordings()
        .join("myo_readings_wrist_mit/csv")
        .join(file);
    let mut reader = csv::Reader::from_path(&path).unwrap();
    let chain = Chain::<f64>::design(&ChainConfig::at_rate(RATE_HZ)).unwrap();
    let mut states = [ChainState::new(); CHANNELS];
    let mut spans: Vec<(String, Vec<[f64; CHANNELS]>)> = Vec::new();
    for record in reader.records() {
        let record = record.unwrap();
        let envelopes = std::array::from_fn(|channel| {
            let count: f64 = record[1 + channel].parse().unwrap();
            chain
                .step(&mut states[channel], count * VOLTS_PER_COUNT)
                .unwrap()
        });
        let label = record[1 + CHANNELS].to_owned();
        match spans.last_mut().filter(|(last, _)| *last == label) {
            Some((_, span)) => span.push(envelopes),
            None => spans.push((label, vec![envelopes])),
        }
    }
    let gesture = |label: &str| !label.contains("hibernation") && !label.contains("rest");
    spans
        .into_iter()
        .filter(|(_, span)| span.len() > 2 * EDGE + 100)
        .map(|(label, span)| (gesture(&label), span[EDGE..span.len() - EDGE / 2].to_vec()))
        .collect()
}

fn mean(spans: &[&Vec<[f64; CHANNELS]>]) -> Vec<f64> {
    let count = spans.iter().map(|span| span.len()).sum::<usize>() as f64;
    let sum = |channel: usize| {
        spans
            .iter()
            .flat_map(|span| span.iter())
            .map(|v| v[channel])
            .sum::<f64>()
    };
    (0..CHANNELS).map(|channel| sum(channel) / count).collect()
}

/// Two wrist gestures of one person: the first spans of each are the reference, every later one a check.
struct Recording {
    reference: Pattern,
    later: Vec<[Vec<[f64; CHANNELS]>; 2]>,
}

fn recording(person: &str) -> Recording {
    let [flexion, extension] =
        ["flexion", "extension"].map(|what| spans(&format!("{person}_{what}.csv")));
    let of = |spans: &[(bool, Vec<[f64; CHANNELS]>)], gesture: bool| -> Vec<Vec<[f64; CHANNELS]>> {
        spans
            .iter()
            .filter(|span| span.0 == gesture)
            .map(|span| span.1.clone())
            .collect()
    };
    let rest = of(&flexion, false);
    let (flex, extend) = (of(&flexion, true), of(&extension, true));
    let first = |spans: &[Vec<[f64; CHANNELS]>]| mean(&spans.iter().take(2).collect::<Vec<_>>());
    Recording {
        reference: Pattern {
            rest_v: first(&rest),
            flex_v: first(&flex),
            extend_v: first(&extend),
        },
        later: flex
            .into_iter()
            .zip(extend)
            .skip(2)
            .map(|(flex, extend)| [flex, extend])
            .collect(),
    }
}

fn checked(
    recording: &Recording,
    later: &[Vec<[f64; CHANNELS]>; 2],
    worn: &dyn Fn(&[f64; CHANNELS]) -> [f64; CHANNELS],
) -> Verdict {
    let muscles = [Muscle::Other; CHANNELS];
    let mut check = FitCheck::begin(recording.reference.clone(), &muscles).unwrap();
    let mut at_us = 0;
    for span in later {
        check.start();
        // Every second sample: 100 Hz, as the stream's. A span shorter than the step is given twice.
        for envelopes in span.iter().step_by(2).cycle().take(450) {
            at_us += 10_000;
            let envelope_v = worn(envelopes);
            check.sample(
                at_us,
                &Measured {
                    envelope_v: &envelope_v,
                    good: &[true; CHANNELS],
                    hand_m: None,
                },
            );
        }
        check.go_on();
    }
    check.verdict().unwrap().clone()
}

#[test]
fn an_armband_that_sits_as_it_did_passes_and_one_that_is_turned_does_not() {
    let (mut sound, mut passed, mut turned, mut found) = (0, 0, 0, 0);
    let (mut dead, mut named) = (0, 0);
    for person in ["12345-1", "45612-1"] {
        let recording = recording(person);
        assert!(!recording.later.is_empty());
        for later in &recording.later {
            sound += 1;
            let verdict = checked(&recording, later, &|v| *v);
            passed += usize::from(verdict.findings.is_empty());
            if !verdict.findings.is_empty() {
                println!("{person}: {:?}", verdict.findings);
            }
            for turn in 1..CHANNELS {
                turned += 1;
                let verdict = checked(&recording, later, &|v| {
                    std::array::from_fn(|c| v[(c + turn) % CHANNELS])
                });
                found += usize::from(verdict.findings == [Finding::Turned(turn)]);
                assert!(
                    !verdict.findings.is_empty(),
                    "{person}: turned by {turn} passes"
                );
            }
            for channel in 0..CHANNELS {
                // Only channels that these gestures use at all can be missed.
                let loudest =
                    recording.reference.flex_v[channel].max(recording.reference.extend_v[channel]);
                if loudest < 5.0 * recording.reference.rest_v[channel] {
                    continue;
                }
                dead += 1;
                let rest_v = recording.reference.rest_v[channel];
                let verdict = checked(&recording, later, &|v| {
                    let mut v = *v;
                    v[channel] = rest_v;
                    v
                });
                let says = |finding: &Finding| matches!(finding, Finding::Dead(channels) if channels.contains(&channel));
                named += usize::from(verdict.findings.iter().any(says));
            }
        }
    }
    println!(
        "as it was: {passed} of {sound} pass; turned: {found} of {turned} named with their turn; dead: {named} of {dead} named"
    );
    assert!(found == turned, "{found} of {turned}");
    assert!(named == dead, "{named} of {dead}");
    // Free gestures vary: one repeat of eight is louder in one channel by a factor of seven with nothing moved.
    assert!(8 * passed >= 7 * sound, "{passed} of {sound}");
}

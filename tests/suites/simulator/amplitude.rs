//! The simulated sEMG beside real recordings, all measured by the same code.
//!
//! A recording is cut into bursts (envelope above 0.3 of its 95th percentile for at least 0.3 s); rest is the
//! lowest fifth of its envelope. Each burst gives three figures: mean envelope over rest, coefficient of
//! variation of the envelope, median frequency over 20 to 450 Hz. The range that the real bursts span is
//! what the mean of the simulated bursts must lie within, for every skill. Armband recordings at 200 Hz have no
//! spectrum to compare (Nyquist 100 Hz), but they widen the range of envelope over rest to weak gestures.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use std::ops::Range;
use tonus::simulate::emg::RATE_HZ;
use tonus::simulate::skills::Skill;
use tonus::simulate::tracker::TrackerNoise;
use tonus::simulate::wearer::{Action, Task, Wearer};
use tonus_shared::semg::chain::{Chain, ChainConfig, ChainState};
use tonus_tests::recordings;

/// Figures of one burst.
#[derive(Debug, Clone, Copy)]
struct Burst {
    over_rest: f64,
    variation: f64,
    median_hz: f64,
}

/// Envelope by the wearable's default chain.
fn envelope(signal: &[f64], rate_hz: f64) -> Vec<f64> {
    let chain = Chain::<f64>::design(&ChainConfig::at_rate(rate_hz)).unwrap();
    let mut state = ChainState::new();
    signal
        .iter()
        .map(|&x| chain.step(&mut state, x).unwrap())
        .collect()
}

/// The value below which this share of the values lies.
fn quantile(values: &[f64], share: f64) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    sorted[((sorted.len() - 1) as f64 * share) as usize]
}

fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

fn variation(values: &[f64]) -> f64 {
    let mean = mean(values);
    (values.iter().map(|v| (v - mean).powi(2)).sum::<f64>() / values.len() as f64).sqrt() / mean
}

fn bursts(signal: &[f64], rate_hz: f64) -> Vec<Burst> {
    let envelope = envelope(signal, rate_hz);
    let fifth = quantile(&envelope, 0.2);
    let rest = mean(
        &envelope
            .iter()
            .copied()
            .filter(|&e| e <= fifth)
            .collect::<Vec<_>>(),
    );
    let threshold = 0.3 * quantile(&envelope, 0.95);
    let shortest = (0.3 * rate_hz) as usize;
    active(&envelope, threshold)
        .into_iter()
        .filter(|burst| burst.len() >= shortest)
        .map(|burst| Burst {
            over_rest: mean(&envelope[burst.clone()]) / rest,
            variation: variation(&envelope[burst.clone()]),
            median_hz: median_frequency(&signal[burst], rate_hz),
        })
        .collect()
}

fn active(envelope: &[f64], threshold: f64) -> Vec<Range<usize>> {
    let mut bursts = Vec::new();
    let mut start = None;
    for (n, &e) in envelope.iter().enumerate() {
        match (e > threshold, start) {
            (true, None) => start = Some(n),
            (false, Some(from)) => {
                bursts.push(from..n);
                start = None;
            }
            _ => {}
        }
    }
    bursts
}

/// The frequency that halves the power between 20 and 450 Hz: Hann windows of 250 ms, half overlapping.
fn median_frequency(signal: &[f64], rate_hz: f64) -> f64 {
    let length = (0.25 * rate_hz) as usize;
    let lines: Vec<f64> = (5..=112).map(|n| f64::from(n) * 4.0).collect();
    let mut power = vec![0.0; lines.len()];
    for start in (0..signal.len() - length).step_by(length / 2) {
        let block = &signal[start..start + length];
        let level = mean(block);
        for (power, line_hz) in power.iter_mut().zip(&lines) {
            let (mut re, mut im) = (0.0, 0.0);
            for (n, x) in block.iter().enumerate() {
                let window = (std::f64::consts::PI * n as f64 / length as f64)
                    .sin()
                    .powi(2);
                let angle = std::f64::consts::TAU * line_hz * n as f64 / rate_hz;
                re += window * (x - level) * angle.cos();
                im += window * (x - level) * angle.sin();
            }
            *power += re * re + im * im;
        }
    }
    let half = power.iter().sum::<f64>() / 2.0;
    let mut sum = 0.0;
    let at = power.iter().position(|p| {
        sum += p;
        sum >= half
    });
    lines[at.unwrap()]
}

/// Columns of a recording, by name, and the texts of `label`.
fn columns(file: &str, names: &[&str]) -> (Vec<Vec<f64>>, Vec<String>) {
    let mut reader = csv::Reader::from_path(recordings().join(file)).unwrap();
    let headers = reader.headers().unwrap().clone();
    let find = |name: &str| headers.iter().position(|h| h == name).unwrap();
    let (places, label): (Vec<usize>, usize) =
        (names.iter().map(|name| find(name)).collect(), find("label"));
    let (mut values, mut labels) = (vec![Vec::new(); names.len()], Vec::new());
    for row in reader.records() {
        let row = row.unwrap();
        for (column, place) in values.iter_mut().zip(&places) {
            column.push(row[*place].parse().unwrap());
        }
        labels.push(row[label].to_owned());
    }
    (values, labels)
}

/// Bursts of the upper arm recorded fast enough for a spectrum: biceps at 1 kHz, biceps and triceps at 2 kHz.
fn real_bursts() -> Vec<Burst> {
    let (plux, _) = columns("biosignalsplux_biceps_mit/csv/emg_bursts.csv", &["emg0"]);
    let (pyomeca, _) = columns(
        "pyomeca_box_emg_mocap/csv/emg_2000hz.csv",
        &["emg0", "emg1"],
    );
    let mut all = bursts(&plux[0], 1000.0);
    assert_eq!(all.len(), 9, "the recording has nine contractions");
    all.extend(bursts(&pyomeca[0], 2000.0));
    all.extend(bursts(&pyomeca[1], 2000.0));
    all
}

/// Mean envelope over rest of gestures recorded by an armband at 200 Hz, each channel by itself.
fn armband_gestures() -> Vec<f64> {
    let names: Vec<String> = (0..8).map(|n| format!("emg{n}")).collect();
    let names: Vec<&str> = names.iter().map(String::as_str).collect();
    let (channels, labels) = columns("libemg_myo_mit/csv/myo_dataset.csv", &names);
    let mut gestures = Vec::new();
    for channel in channels {
        let of = |class: &str| {
            let signal: Vec<f64> = channel
                .iter()
                .zip(&labels)
                .filter(|(_, l)| *l == class)
                .map(|(x, _)| *x)
                .collect();
            // The first half second settles the chain.
            envelope(&signal, 200.0).split_off(100)
        };
        let rest = mean(&of("class2"));
        for class in ["class0", "class1", "class3", "class4"] {
            gestures.push(mean(&of(class)) / rest);
        }
    }
    gestures
}

fn range(values: impl Iterator<Item = f64>) -> (f64, f64) {
    values.fold((f64::INFINITY, 0.0), |(low, high), v| {
        (low.min(v), high.max(v))
    })
}

/// Bursts of one channel while a skill is done twelve times.
fn simulated_bursts(skill: Skill, channel: usize) -> Vec<Burst> {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let tasks: Vec<Task> = (0..12)
        .map(|_| Task::Perform(Action::sample(skill, &mut rng)))
        .collect();
    let wearer = Wearer::new(&tasks, TrackerNoise::STATED, 9).unwrap();
    let scale = wearer.scale();
    let volts: Vec<f64> = wearer
        .map(|moment| scale.volts(moment.scan.counts[channel]))
        .collect();
    bursts(&volts, RATE_HZ)
}

#[test]
fn simulated_bursts_lie_within_the_real_ones() {
    let real = real_bursts();
    let armband = armband_gestures();
    let over_rest = range(real.iter().map(|b| b.over_rest));
    let over_rest_any = range(
        real.iter()
            .map(|b| b.over_rest)
            .chain(armband.iter().copied()),
    );
    let varies = range(real.iter().map(|b| b.variation));
    let median_hz = range(real.iter().map(|b| b.median_hz));
    println!(
        "real bursts {}, armband gestures {}",
        real.len(),
        armband.len()
    );
    println!(
        "over rest {over_rest:.1?} (with the armband {over_rest_any:.1?}), variation {varies:.2?}, median {median_hz:.0?} Hz"
    );
    // The muscle that works against the load: biceps in the lifts, triceps against the band. Its antagonist
    // only co-contracts, some of it too weakly to be called a burst.
    let working = Skill::LIFTS
        .into_iter()
        .flat_map(|skill| [(skill, 0), (skill, 1)])
        .chain([(Skill::HandOver, 2), (Skill::HandOver, 3)]);
    let within = |value: f64, (low, high): (f64, f64)| (low..=high).contains(&value);
    for (skill, channel) in working {
        let all = simulated_bursts(skill, channel);
        let average = |figure: fn(&Burst) -> f64| mean(&all.iter().map(figure).collect::<Vec<_>>());
        let figures = [
            average(|b| b.over_rest),
            average(|b| b.variation),
            average(|b| b.median_hz),
        ];
        println!(
            "{:12} channel {channel}: {} bursts, {figures:.2?}",
            skill.label(),
            all.len()
        );
        // The last action ends with the recording.
        assert!((11..=13).contains(&all.len()), "twelve actions");
        assert!(
            within(figures[0], over_rest_any)
                && within(figures[1], varies)
                && within(figures[2], median_hz)
        );
        if skill == Skill::LiftFilter {
            assert!(
                within(figures[0], over_rest),
                "a heavy lift is a burst of the biceps like the recorded ones"
            );
        }
    }
}

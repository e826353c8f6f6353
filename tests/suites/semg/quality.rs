//! Quality lamps against signals whose hum ratio has a closed form, and on real recordings.

use std::f64::consts::PI;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus_shared::sample::AdcScale;
use tonus_shared::semg::quality::{Quality, QualityMonitor, QualityState};
use tonus_tests::recordings;

use crate::column;

const FULL_SCALE: i32 = 8_388_607;

/// ADS129x at gain 6: 47.7 nV a count.
fn ads129x() -> AdcScale {
    AdcScale::new(0.4 / f64::from(FULL_SCALE), 0, -FULL_SCALE - 1, FULL_SCALE).unwrap()
}

/// Last warnings and hum figure after feeding `counts`.
fn judged(rate_hz: f64, scale: AdcScale, counts: &[i32]) -> (Quality, f32) {
    let monitor = QualityMonitor::new(rate_hz, scale).unwrap();
    let mut state = QualityState::new();
    let mut quality = Quality::GOOD;
    for count in counts {
        quality = monitor.step(&mut state, *count, false);
    }
    (quality, state.hum_db())
}

/// Hum of `amplitude_v` at `line_hz` over white noise of `noise_v` RMS and 20 mV of electrode offset.
fn signal(rate_hz: f64, line_hz: f64, amplitude_v: f64, noise_v: f64, seed: u64) -> Vec<i32> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    (0..(2.0 * rate_hz) as u32)
        .map(|n| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            let hum = (2.0 * PI * line_hz * f64::from(n) / rate_hz + 0.3).sin();
            let volts = 0.02 + amplitude_v * hum + noise_v * noise;
            (volts / ads129x().volts_per_count()).round() as i32
        })
        .collect()
}

#[test]
fn hum_ratio_is_line_power_over_all_power() {
    for rate_hz in [200.0, 500.0, 1000.0, 1111.0, 2000.0] {
        for line_hz in [50.0, 60.0] {
            for (amplitude_v, noise_v) in [(1e-4, 1e-5), (1e-4, 1e-4), (1e-3, 4e-4)] {
                // The noise in the line's bin scatters each block; the mean of many is compared.
                let (mut ratio, mut blocks) = (0.0, 0.0);
                let monitor = QualityMonitor::new(rate_hz, ads129x()).unwrap();
                let mut state = QualityState::new();
                for seed in 0..20 {
                    for count in signal(rate_hz, line_hz, amplitude_v, noise_v, seed) {
                        monitor.step(&mut state, count, false);
                    }
                    ratio += f64::powf(10.0, f64::from(state.hum_db()) / 10.0);
                    blocks += 1.0;
                }
                let hum_db = 10.0 * f64::log10(ratio / blocks);
                let line = amplitude_v * amplitude_v / 2.0;
                let expected = 10.0 * (line / (line + noise_v * noise_v)).log10();
                // Half a decibel for the approximate logarithm, half for what chance is left.
                assert!(
                    (hum_db - expected).abs() < 1.0,
                    "{rate_hz} {line_hz}: {hum_db} {expected}"
                );
            }
        }
    }
}

#[test]
fn hum_lights_when_it_carries_most_of_the_power() {
    for (amplitude_v, noise_v, lit) in [(1e-3, 2e-4, true), (1e-4, 2e-4, false)] {
        for rate_hz in [200.0, 2000.0] {
            for seed in 0..20 {
                let counts = signal(rate_hz, 60.0, amplitude_v, noise_v, seed);
                let expected = if lit { Quality::HUM } else { Quality::GOOD };
                assert_eq!(judged(rate_hz, ads129x(), &counts).0, expected);
            }
        }
    }
}

#[test]
fn noise_alone_is_good() {
    for rate_hz in [200.0, 1000.0, 2000.0] {
        for seed in 0..20 {
            let counts = signal(rate_hz, 50.0, 0.0, 1e-4, seed);
            assert_eq!(judged(rate_hz, ads129x(), &counts).0, Quality::GOOD);
        }
    }
}

#[test]
fn one_count_at_a_rail_shows_at_once_and_clears_with_a_clean_block() {
    let monitor = QualityMonitor::new(1000.0, ads129x()).unwrap();
    let mut state = QualityState::new();
    let good = signal(1000.0, 50.0, 0.0, 1e-4, 1);
    assert_eq!(monitor.step(&mut state, good[0], false), Quality::GOOD);
    for rail in [FULL_SCALE, -FULL_SCALE - 1] {
        assert!(
            monitor
                .step(&mut state, rail, false)
                .contains(Quality::SATURATED)
        );
    }
    assert!(
        monitor
            .step(&mut state, good[1], true)
            .contains(Quality::LEAD_OFF)
    );
    // The rest of this block and the next one: two whole blocks are 1000 samples.
    let last = good.iter().take(1100).fold(Quality::GOOD, |_, count| {
        monitor.step(&mut state, *count, false)
    });
    assert_eq!(last, Quality::GOOD);
}

/// New extreme or not: what is at a rail, or beyond it, is told until the end of the next block.
#[test]
fn every_count_at_a_rail_is_told() {
    const BLOCK: usize = 100;
    let scale = AdcScale::new(1.0, 0, -40, 40).unwrap();
    let monitor = QualityMonitor::new(200.0, scale).unwrap();
    let mut state = QualityState::new();
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let counts: Vec<i32> = (0..200 * BLOCK)
        .map(|n| {
            // Blocks that never come near a rail, that touch one, and that lie at one.
            let reach = [20, 20, 41, 45][n / BLOCK % 4];
            let middle = if n / BLOCK % 8 == 7 { 40 } else { 0 };
            rng.random_range(middle - reach..=middle + reach)
        })
        .collect();
    let mut told = [0, 0];
    for (n, count) in counts.iter().enumerate() {
        let since = (n / BLOCK).saturating_sub(1) * BLOCK;
        let expected = counts[since..=n].iter().any(|count| count.abs() >= 40);
        let quality = monitor.step(&mut state, *count, false);
        let got = quality.contains(Quality::SATURATED);
        // The last sample of a block is answered with its own judgement alone.
        if n % BLOCK < BLOCK - 1 {
            assert_eq!(got, expected, "sample {n}");
        }
        told[usize::from(expected)] += 1;
    }
    assert!(told.iter().all(|&count| count > 1000), "{told:?}");
}

#[test]
fn flat_and_unconnected_inputs_are_told() {
    let flat = judged(1000.0, ads129x(), &[12_345; 1500]).0;
    assert_eq!(flat, Quality::FLAT);
    // An input that has drifted to within 1 % of a rail, noise still on it.
    let noise = signal(1000.0, 50.0, 0.0, 1e-4, 3);
    let high: Vec<i32> = noise.iter().map(|count| count + 7_870_000).collect();
    assert_eq!(judged(1000.0, ads129x(), &high).0, Quality::LEAD_OFF);
    // A floating electrode: 20 mV of hum.
    let floating = judged(1000.0, ads129x(), &signal(1000.0, 50.0, 2e-2, 1e-4, 4)).0;
    assert_eq!(floating, Quality::HUM.with(Quality::LEAD_OFF));
}

#[test]
fn bits_travel() {
    for bits in 0..16 {
        assert_eq!(Quality::from_bits(bits).unwrap().bits(), bits);
    }
    assert_eq!(Quality::from_bits(16), None);
    assert_eq!(
        Quality::SATURATED.bits()
            | Quality::FLAT.bits()
            | Quality::HUM.bits()
            | Quality::LEAD_OFF.bits(),
        15
    );
}

#[test]
fn extreme_counts_do_not_panic() {
    let scale = AdcScale::new(1.0, 0, i32::MIN, i32::MAX).unwrap();
    let counts: Vec<i32> = (0..1000)
        .map(|n| if n % 2 == 0 { i32::MIN } else { i32::MAX })
        .collect();
    let (quality, hum_db) = judged(200.0, scale, &counts);
    assert!(quality.contains(Quality::SATURATED) && hum_db.is_finite());
    assert!(QualityMonitor::new(f64::NAN, scale).is_err());
}

#[test]
fn a_real_biceps_recording_is_good() {
    let path = recordings().join("biosignalsplux_biceps_mit/csv/emg_bursts.csv");
    // 16 bits over 3 V, gain 1000 (biosignalsplux EMG): 45.8 nV a count, 0 V at the middle.
    let scale = AdcScale::new(3.0 / 65_536.0 / 1000.0, 32_768, 0, 65_535).unwrap();
    let monitor = QualityMonitor::new(1000.0, scale).unwrap();
    let mut state = QualityState::new();
    for count in column(&path, "emg0") {
        assert_eq!(monitor.step(&mut state, count as i32, false), Quality::GOOD);
    }
}

/// Eight bits at 200 Hz hardly move at rest, and are no flat line for it.
#[test]
fn a_real_armband_is_never_flat() {
    let scale = AdcScale::new(1.0, 0, -128, 127).unwrap();
    let monitor = QualityMonitor::new(200.0, scale).unwrap();
    let folder = recordings().join("myo_readings_wrist_mit/csv");
    let wrist = std::fs::read_dir(folder).unwrap();
    let mut paths: Vec<_> = wrist.map(|entry| entry.unwrap().path()).collect();
    paths.push(recordings().join("libemg_myo_mit/csv/myo_dataset.csv"));
    for path in paths {
        for channel in 0..8 {
            let mut state = QualityState::new();
            for count in column(&path, &format!("emg{channel}")) {
                let quality = monitor.step(&mut state, count as i32, false);
                assert!(!quality.contains(Quality::FLAT), "{}", path.display());
            }
        }
    }
}

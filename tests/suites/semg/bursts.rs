//! The burst detector on noise whose bursts are known.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus_shared::semg::bursts::{BurstConfig, BurstDetector};
use tonus_shared::semg::chain::{Chain, ChainConfig};

use crate::envelopes::stream;
use crate::recordings::bursts;

/// Envelope of white noise whose standard deviation at second t is `level(t)`.
fn noise_envelope(rate_hz: f64, seconds: f64, seed: u64, level: impl Fn(f64) -> f64) -> Vec<f64> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let x: Vec<f64> = (0..(seconds * rate_hz) as u32)
        .map(|n| {
            let noise: f64 = StandardNormal.sample(&mut rng);
            level(f64::from(n) / rate_hz) * noise
        })
        .collect();
    stream::<f32>(&ChainConfig::at_rate(rate_hz), &x)
}

#[test]
fn rest_alone_has_no_burst() {
    for rate_hz in [200.0, 2000.0] {
        let envelope = noise_envelope(rate_hz, 600.0, 1, |_| 1.0);
        assert_eq!(bursts::<f32>(&BurstConfig::at_rate(rate_hz), &envelope), []);
    }
}

#[test]
fn known_bursts_are_found_at_their_times() {
    for rate_hz in [200.0, 1000.0, 2000.0] {
        // 1 s of activity from the third second of every four, 12 times the rest.
        let level = |t: f64| {
            if t % 4.0 >= 2.0 && t % 4.0 < 3.0 {
                12e-6
            } else {
                1e-6
            }
        };
        let envelope = noise_envelope(rate_hz, 60.0, 2, level);
        let found = bursts::<f32>(&BurstConfig::at_rate(rate_hz), &envelope);
        assert_eq!(found.len(), 15);
        let config = ChainConfig::at_rate(rate_hz);
        let delay_s = Chain::<f32>::design(&config).unwrap().delay_s();
        for (n, (on, off)) in (0_u8..).zip(found) {
            let start = 4.0 * f64::from(n) + 2.0;
            // The onset crosses 5 of 12, near the middle of the step; the offset crosses 2.5, later.
            assert!((on - delay_s - start).abs() < 0.04, "{on} {start}");
            assert!(
                (0.0..0.12).contains(&(off - delay_s - start - 1.0)),
                "{off} {start}"
            );
        }
    }
}

#[test]
fn a_start_in_contraction_is_corrected_by_the_first_pause() {
    let level = |t: f64| {
        if t < 3.0 || (6.0..7.0).contains(&t) {
            10.0
        } else {
            1.0
        }
    };
    let envelope = noise_envelope(1000.0, 10.0, 3, level);
    let found = bursts::<f32>(&BurstConfig::at_rate(1000.0), &envelope);
    assert_eq!(found.len(), 1, "{found:?}");
    assert!((6.0..6.2).contains(&found[0].0));
}

#[test]
fn a_blip_shorter_than_the_shortest_burst_is_none() {
    let config = BurstConfig::at_rate(1000.0);
    for (milliseconds, expected) in [(49, 0), (50, 1)] {
        let blip = 2000..2000 + milliseconds;
        let envelope: Vec<f64> = (0..4000)
            .map(|n| if blip.contains(&n) { 6.0 } else { 1.0 })
            .collect();
        assert_eq!(bursts::<f64>(&config, &envelope).len(), expected);
    }
}

#[test]
fn detectors_that_cannot_work_are_refused() {
    let base = BurstConfig::at_rate(1000.0);
    let bad = [
        BurstConfig {
            rate_hz: 20.0,
            ..base
        },
        BurstConfig {
            threshold: 1.0,
            ..base
        },
        BurstConfig {
            threshold: f64::NAN,
            ..base
        },
        BurstConfig {
            release: 0.0,
            ..base
        },
        BurstConfig {
            release: 1.1,
            ..base
        },
        BurstConfig {
            shortest_burst_s: -0.1,
            ..base
        },
        BurstConfig {
            shortest_pause_s: f64::INFINITY,
            ..base
        },
    ];
    for config in bad {
        assert!(BurstDetector::<f32>::new(&config).is_err(), "{config:?}");
    }
}

//! The delay a chain states, against the delay measured by cross-correlation on amplitude-modulated noise.

use std::f64::consts::PI;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus::envelope::filter_forward;
use tonus_shared::semg::chain::{Chain, ChainConfig, Conditioner, NotchConfig};
use tonus_shared::semg::design::{self, Mains};
use tonus_shared::semg::smoother::Smoother;

use crate::envelopes::stream;

/// Enough that chance moves the measured delay by less than half a millisecond.
const SAMPLES: u32 = 1_600_000;

/// Correlation of `envelope[n + lag]` with `modulation[n]` over all but the last second, both without mean.
fn correlation(modulation: &[f64], envelope: &[f64], lag: usize, span: usize) -> f64 {
    let mean = envelope[lag..lag + span].iter().sum::<f64>() / span as f64;
    (modulation[..span].iter().zip(&envelope[lag..]))
        .map(|(m, e)| (m - 1.0) * (e - mean))
        .sum()
}

/// Lag of the largest correlation, samples: coarse over 0 to 0.4 s, then each sample, then a parabola.
fn measured_delay(modulation: &[f64], envelope: &[f64], rate_hz: f64) -> f64 {
    let span = modulation.len() - rate_hz as usize;
    let at = |lag: usize| correlation(modulation, envelope, lag, span);
    let best = |lags: &mut dyn Iterator<Item = usize>| {
        lags.map(|lag| (lag, at(lag)))
            .max_by(|a, b| a.1.total_cmp(&b.1))
            .unwrap()
            .0
    };
    let stride = (rate_hz * 0.01) as usize;
    let coarse = best(&mut (0..=(rate_hz * 0.4) as usize).step_by(stride));
    let top = best(&mut (coarse.saturating_sub(stride).max(1)..=coarse + stride));
    let (before, middle, after) = (at(top - 1), at(top), at(top + 1));
    top as f64 + 0.5 * (before - after) / (before - 2.0 * middle + after)
}

#[test]
fn stated_delay_is_the_measured_one() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for rate_hz in [200.0, 500.0, 2000.0] {
        let modulation: Vec<f64> = (0..SAMPLES)
            .map(|n| 2.0 * PI * f64::from(n) / rate_hz)
            .map(|t| 1.0 + 0.5 * t.sin() + 0.3 * (0.61 * t + 1.0).sin())
            .collect();
        let white: Vec<f64> = (0..SAMPLES)
            .map(|_| StandardNormal.sample(&mut rng))
            .collect();
        // The band of sEMG, as far as the rate carries it.
        let high = design::high_pass(rate_hz, 20.0, 2).unwrap();
        let low = design::low_pass(rate_hz, f64::min(450.0, 0.45 * rate_hz), 4).unwrap();
        let carrier = filter_forward(&low, &filter_forward(&high, &white));
        let x: Vec<f64> = modulation
            .iter()
            .zip(&carrier)
            .map(|(m, c)| m * c)
            .collect();

        let notch = Some(NotchConfig {
            mains: Mains::Hz50,
            q: 30.0,
        });
        let conditionings = [
            (Conditioner::default(), None),
            (Conditioner::DcBlock { cutoff_hz: 1.0 }, None),
            (Conditioner::default(), notch),
        ];
        let smoothers = [
            Smoother::default(),
            Smoother::MovingAverage { window_s: 0.15 },
            Smoother::Rms { window_s: 0.15 },
        ];
        for (conditioner, notch) in conditionings {
            for smoother in smoothers {
                let config = ChainConfig {
                    rate_hz,
                    conditioner,
                    notch,
                    smoother,
                };
                let stated_s = Chain::<f32>::design(&config).unwrap().delay_s();
                let envelope = stream::<f32>(&config, &x);
                let measured_s = measured_delay(&modulation, &envelope, rate_hz) / rate_hz;
                let error_ms = 1e3 * (measured_s - stated_s);
                println!(
                    "{rate_hz} Hz {smoother:?} {conditioner:?} notch {}: stated {:.1} ms, measured {error_ms:+.2} ms from it",
                    notch.is_some(),
                    1e3 * stated_s,
                );
                assert!(error_ms.abs() < 3.0);
            }
        }
    }
}

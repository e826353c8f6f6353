//! Envelopes against SciPy: the reference columns, 2 kHz, and the offline forms.

use std::f64::consts::PI;

use tonus::envelope::{self, Baseline, OfflineEnvelope};
use tonus_shared::Real;
use tonus_shared::semg::activation::{Activation, ActivationState, Normalisation};
use tonus_shared::semg::biquad::CascadeState;
use tonus_shared::semg::chain::{Chain, ChainConfig, ChainState, Conditioner, NotchConfig};
use tonus_shared::semg::design::{self, Mains};
use tonus_shared::semg::smoother::{Smoother, Window};

use crate::{column, golden, peak, worst};

pub(crate) fn stream<T: Real>(config: &ChainConfig, x: &[f64]) -> Vec<f64> {
    let chain = Chain::<T>::design(config).unwrap();
    let mut state = ChainState::new();
    x.iter()
        .map(|value| chain.step(&mut state, T::of(*value)).unwrap().widen())
        .collect()
}

fn reference(name: &str) -> Vec<f64> {
    column(&golden("reference/emg_ref.csv"), name)
}

#[test]
fn streaming_equals_the_reference_columns() {
    let x = reference("x");
    let dc_block = Conditioner::DcBlock { cutoff_hz: 1.0 };
    for (name, conditioner) in [
        ("stream_hp2_20Hz", Conditioner::default()),
        ("stream_dcblock_1Hz", dc_block),
    ] {
        let config = ChainConfig {
            conditioner,
            ..ChainConfig::at_rate(200.0)
        };
        let expected = reference(name);
        let single = worst(&stream::<f32>(&config, &x), &expected) / peak(&expected);
        let double = worst(&stream::<f64>(&config, &x), &expected) / peak(&expected);
        println!("{name}: f32 {single:.1e}, f64 {double:.1e} of the peak");
        assert!(single < 1e-4);
        assert!(double < 1e-12);
    }
}

/// The formula of `golden/semg_design.py`.
fn signal_2khz() -> Vec<f64> {
    (0..4000)
        .map(|n| {
            let t = f64::from(n) / 2000.0;
            let burst = (2.0 * PI * 0.8 * t).sin().max(0.0);
            let tones = [41.3, 77.7, 103.9, 151.1, 223.3];
            let carrier: f64 = (tones.iter().zip(0_u8..))
                .map(|(hz, k)| (2.0 * PI * hz * t + 0.7 * f64::from(k)).sin())
                .sum();
            5.0 + 0.4 * t + 0.1 * (2.0 * PI * 50.0 * t).sin() + burst * carrier
        })
        .collect()
}

#[test]
fn f32_at_2_khz_equals_scipy() {
    let x = signal_2khz();
    for (name, smoother) in [
        ("butterworth", Smoother::default()),
        ("mean", Smoother::MovingAverage { window_s: 0.0755 }),
        ("rms", Smoother::Rms { window_s: 0.0755 }),
    ] {
        let config = ChainConfig {
            smoother,
            ..ChainConfig::at_rate(2000.0)
        };
        let expected = column(&golden("semg_2khz.csv"), name);
        let every_20th = |x: Vec<f64>| x.into_iter().step_by(20).collect::<Vec<_>>();
        let single = worst(&every_20th(stream::<f32>(&config, &x)), &expected) / peak(&expected);
        let double = worst(&every_20th(stream::<f64>(&config, &x)), &expected) / peak(&expected);
        println!("2 kHz {name}: f32 {single:.1e}, f64 {double:.1e} of the peak");
        assert!(single < 1e-4);
        assert!(double < 1e-10);
    }
}

#[test]
fn f32_stays_near_f64_for_every_order_and_rate() {
    let x = signal_2khz();
    let mut worst_error = 0.0_f64;
    for rate_hz in [200.0, 500.0, 1000.0, 2000.0] {
        for order in 1..=8 {
            let config = ChainConfig {
                conditioner: Conditioner::HighPass {
                    cutoff_hz: 20.0,
                    order,
                },
                notch: Some(NotchConfig {
                    mains: Mains::Hz50,
                    q: 30.0,
                }),
                smoother: Smoother::Butterworth {
                    order,
                    cutoff_hz: 5.0,
                },
                rate_hz,
            };
            let double = stream::<f64>(&config, &x);
            let error = worst(&stream::<f32>(&config, &x), &double) / peak(&double);
            worst_error = worst_error.max(error);
        }
    }
    println!("f32, orders 1 to 8, 200 to 2000 Hz: {worst_error:.1e} of the peak");
    assert!(worst_error < 1e-4);
}

#[test]
fn offline_forms_equal_the_reference_columns() {
    let x = reference("x");
    let low_pass = design::low_pass(200.0, 5.0, 3).unwrap();
    let detrended = envelope::detrend(&x);
    let rectified: Vec<f64> = detrended.iter().map(|value| value.abs()).collect();
    let offline = |smoother, zero_phase| {
        let baseline = Baseline::Detrend;
        let form = OfflineEnvelope {
            rate_hz: 200.0,
            baseline,
            notch: None,
            smoother,
            zero_phase,
        };
        form.apply(&x).unwrap()
    };
    let window_s = 0.15;
    let butterworth = Smoother::default();
    let forms = [
        ("detrended", detrended),
        ("rect", rectified.clone()),
        ("lfilter", envelope::filter_forward(&low_pass, &rectified)),
        ("lfilter", offline(butterworth, false)),
        (
            "filtfilt",
            envelope::filter_zero_phase(&low_pass, &rectified).unwrap(),
        ),
        ("filtfilt", offline(butterworth, true)),
        (
            "ma150_centered",
            offline(Smoother::MovingAverage { window_s }, true),
        ),
        ("rms150_centered", offline(Smoother::Rms { window_s }, true)),
    ];
    for (name, form) in forms {
        let error = worst(&form, &reference(name));
        println!("{name}: {error:.1e}");
        assert!(error < 1e-9, "{name}: {error:e}");
    }
}

#[test]
fn a_constant_start_gives_no_transient() {
    // An electrode's offset of 300 mV under a first sample: the envelope starts and stays at zero.
    for smoother in [
        Smoother::default(),
        Smoother::MovingAverage { window_s: 0.1 },
        Smoother::Rms { window_s: 0.1 },
    ] {
        for conditioner in [
            Conditioner::default(),
            Conditioner::DcBlock { cutoff_hz: 0.5 },
        ] {
            let notch = Some(NotchConfig {
                mains: Mains::Hz50,
                q: 30.0,
            });
            let config = ChainConfig {
                rate_hz: 1000.0,
                conditioner,
                notch,
                smoother,
            };
            assert_eq!(peak(&stream::<f32>(&config, &[0.3; 2000])), 0.0);
        }
    }
}

#[test]
fn f32_keeps_the_gain_at_zero_frequency() {
    // Low-pass and notch pass a constant, a high-pass stops it; settled on 1, then a step to 3.
    let filters = [
        (design::low_pass(200.0, 5.0, 8).unwrap(), 1.0),
        (design::low_pass(2000.0, 5.0, 3).unwrap(), 1.0),
        (design::low_pass(2000.0, 5.0, 8).unwrap(), 1.0),
        (design::low_pass(2000.0, 0.5, 4).unwrap(), 1.0),
        (design::notch(2000.0, Mains::Hz60, 30.0).unwrap(), 1.0),
        (design::high_pass(2000.0, 20.0, 8).unwrap(), 0.0),
    ];
    for (filter, gain) in filters {
        let filter = filter.convert::<f32>();
        let mut state = CascadeState::zero();
        assert_eq!(filter.settle(&mut state, 1.0), gain);
        assert_eq!(filter.step(&mut state, 1.0), gain);
        for _ in 0..40_000 {
            filter.step(&mut state, 3.0);
        }
        let error = (filter.step(&mut state, 3.0) / 3.0 - gain).abs();
        println!("order {} gain {gain}: {error:.1e}", filter.order());
        assert!(error < 1e-4, "{error:.1e}");
    }
}

#[test]
fn a_running_window_does_not_drift() {
    // An hour at 2 kHz with bursts a million times the rest: two windows after a burst the mean is exact.
    let mut window = Window::<f32>::zero();
    window.settle(301, 0.0);
    let mut mean = 0.0;
    for n in 0..7_200_000_u32 {
        let burst = n % 100_000 < 5_000;
        mean = window.step(301, if burst { 1000.3 } else { 0.001 });
    }
    assert!((f64::from(mean) - 0.001).abs() < 1e-8, "{mean}");
}

#[test]
fn normalisation_is_zero_at_rest_and_one_at_mvc() {
    let scale = Normalisation::new(0.02_f32, 0.22).unwrap();
    for (envelope, expected) in [
        (0.02, 0.0),
        (0.22, 1.0),
        (0.12, 0.5),
        (0.0, 0.0),
        (0.42, 2.0),
    ] {
        assert!((scale.apply(envelope) - expected).abs() < 1e-6);
    }
    let refused = [
        (0.2, 0.2),
        (0.3, 0.2),
        (-0.1, 1.0),
        (0.0, f32::NAN),
        (f32::NAN, 1.0),
        (0.0, f32::INFINITY),
    ];
    for (rest, mvc) in refused {
        assert!(Normalisation::new(rest, mvc).is_err());
    }
}

#[test]
fn activation_is_the_windowed_sum_of_mapped_channels() {
    let activation = Activation::<4>::new([true, true, false, true], 5).unwrap();
    let mut state = ActivationState::<f64>::new();
    let channel = |n: u32, i: u32| f64::from((7 * n + 3 * i) % 11);
    for n in 0..40 {
        let normalised = [0, 1, 2, 3].map(|i| channel(n, i));
        let e = activation.step(&mut state, &normalised).unwrap();
        let window = (0..5).map(|back| n.saturating_sub(back));
        let expected: f64 = window
            .map(|tau| channel(tau, 0) + channel(tau, 1) + channel(tau, 3))
            .sum::<f64>()
            / 5.0;
        assert!((e - expected).abs() < 1e-12);
    }
    assert_eq!(activation.delay_s(200.0), 0.01);
    for samples in [0, 2, 513] {
        assert!(Activation::<1>::new([true], samples).is_err());
    }
    assert!(Activation::<2>::new([false; 2], 3).is_err());
}

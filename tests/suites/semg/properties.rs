//! Whatever the bits, nothing panics and nothing but finite numbers comes out.

use proptest::prelude::*;
use tonus_shared::Real;
use tonus_shared::semg::activation::{Activation, ActivationState, Normalisation};
use tonus_shared::semg::bursts::{BurstConfig, BurstDetector, BurstState};
use tonus_shared::semg::chain::{Chain, ChainConfig, ChainState, Conditioner, NotchConfig};
use tonus_shared::semg::design::Mains;
use tonus_shared::semg::smoother::Smoother;

fn chains() -> impl Strategy<Value = ChainConfig> {
    let conditioner = prop_oneof![
        (1_usize..=8, 0.01..0.4).prop_map(|(order, part)| (Some(order), part)),
        (0.001..0.4).prop_map(|part| (None, part)),
    ];
    let smoother = prop_oneof![
        (1_usize..=8, 0.005..0.4)
            .prop_map(|(order, cutoff_hz)| Smoother::Butterworth { order, cutoff_hz }),
        (0.001..0.25).prop_map(|window_s| Smoother::MovingAverage { window_s }),
        (0.001..0.25).prop_map(|window_s| Smoother::Rms { window_s }),
    ];
    let notch = proptest::option::of((any::<bool>(), 1.0..100.0));
    (200.0..2000.0, conditioner, notch, smoother).prop_map(
        |(rate_hz, (order, part), notch, smoother)| {
            let cutoff_hz = part * rate_hz;
            ChainConfig {
                rate_hz,
                conditioner: match order {
                    Some(order) => Conditioner::HighPass { cutoff_hz, order },
                    None => Conditioner::DcBlock { cutoff_hz },
                },
                notch: notch.map(|(fifty, q)| NotchConfig {
                    mains: if fifty { Mains::Hz50 } else { Mains::Hz60 },
                    q,
                }),
                smoother: match smoother {
                    Smoother::Butterworth {
                        order,
                        cutoff_hz: part,
                    } => Smoother::Butterworth {
                        order,
                        cutoff_hz: part * rate_hz,
                    },
                    window => window,
                },
            }
        },
    )
}

/// Any bit pattern, with the special ones as likely as the rest.
fn any_f32() -> impl Strategy<Value = f32> {
    prop_oneof![
        any::<u32>().prop_map(f32::from_bits),
        prop::sample::select(vec![
            f32::NAN,
            f32::INFINITY,
            f32::NEG_INFINITY,
            f32::MAX,
            f32::MIN,
            0.0,
            -0.0,
            1e-45
        ]),
        -10.0_f32..10.0,
    ]
}

fn any_f64() -> impl Strategy<Value = f64> {
    prop_oneof![
        any::<u64>().prop_map(f64::from_bits),
        any_f32().prop_map(f64::from),
        Just(f64::MAX),
    ]
}

fn survives<T: Real>(config: &ChainConfig, samples: &[T]) -> Result<(), TestCaseError> {
    let chain = Chain::<T>::design(config).unwrap();
    prop_assert!((0.0..10.0).contains(&chain.delay_s()));
    let mut state = ChainState::new();
    let mut fresh = None;
    for sample in samples {
        let result = chain.step(&mut state, *sample);
        // After a refusal the channel behaves as a new one.
        if let Some(mut fresh) = fresh.take() {
            let expected = chain.step(&mut fresh, *sample);
            // The error holds the sample, and NaN differs from itself.
            prop_assert_eq!(result.ok(), expected.ok());
        }
        match result {
            Ok(envelope) => prop_assert!(envelope.is_finite()),
            Err(_) => fresh = Some(ChainState::new()),
        }
        prop_assert!(sample.is_finite() || result.is_err());
    }
    Ok(())
}

proptest! {
    #![proptest_config(tonus_tests::seeded(256))]

    #[test]
    fn chain_of_any_f32(config in chains(), samples in prop::collection::vec(any_f32(), 0..60)) {
        survives(&config, &samples)?;
    }

    #[test]
    fn chain_of_any_f64(config in chains(), samples in prop::collection::vec(any_f64(), 0..60)) {
        survives(&config, &samples)?;
    }

    /// Whatever the channels beside it: started at other times, refused, or sound.
    #[test]
    fn channels_together_are_channels_alone(
        config in chains(),
        scans in prop::collection::vec((any_f32(), -1.0_f32..1.0, -1.0_f32..1.0), 0..60),
        late in 0_usize..60,
    ) {
        let chain = Chain::<f32>::design(&config).unwrap();
        let (mut together, mut alone) = ([ChainState::new(); 3], [ChainState::new(); 3]);
        for (index, scan) in scans.into_iter().map(<[f32; 3]>::from).enumerate() {
            if index == late {
                together[2].reset();
                alone[2].reset();
            }
            let got = chain.step_all(together.each_mut(), scan);
            for ((got, state), x) in got.into_iter().zip(&mut alone).zip(scan) {
                // The error holds the sample, and NaN differs from itself.
                prop_assert_eq!(got.ok(), chain.step(state, x).ok());
            }
        }
    }

    #[test]
    fn envelope_scales_with_the_signal(
        config in chains(),
        samples in prop::collection::vec(-1.0_f64..1.0, 1..60),
        exponent in -20_i32..20,
    ) {
        // A power of two changes no rounding, so the envelopes agree to the last bit.
        let gain = f64::powi(2.0, exponent);
        let chain = Chain::<f64>::design(&config).unwrap();
        let (mut plain, mut scaled) = (ChainState::new(), ChainState::new());
        for x in samples {
            let envelope = chain.step(&mut plain, x).unwrap();
            prop_assert_eq!(envelope * gain, chain.step(&mut scaled, gain * x).unwrap());
        }
    }

    #[test]
    fn bursts_of_any_f32(samples in prop::collection::vec(any_f32(), 0..400)) {
        let detector = BurstDetector::<f32>::new(&BurstConfig::at_rate(200.0)).unwrap();
        let mut state = BurstState::new();
        for sample in samples {
            let result = detector.step(&mut state, sample);
            prop_assert_eq!(result.is_err(), !sample.is_finite());
        }
    }

    #[test]
    fn activation_of_any_f32(
        rest in any_f32(),
        mvc in any_f32(),
        envelopes in prop::collection::vec(any_f32(), 0..60),
    ) {
        let activation = Activation::<2>::new([true, true], 5).unwrap();
        let mut state = ActivationState::<f32>::new();
        let scale = Normalisation::new(rest, mvc);
        prop_assert!(scale.is_err() || (mvc > rest && rest >= 0.0 && mvc.is_finite()));
        for envelope in envelopes {
            let a = scale.map_or(envelope, |scale| scale.apply(envelope));
            if let Ok(e) = activation.step(&mut state, &[a, envelope]) {
                prop_assert!(e.is_finite());
            }
        }
    }
}

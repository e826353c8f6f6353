//! Filter designs against SciPy (`golden/semg_design.py`), and what cannot be designed.

use std::f64::consts::PI;

use nalgebra::Complex;
use tonus_shared::semg::biquad::Cascade;
use tonus_shared::semg::chain::{Chain, ChainConfig, Conditioner, NotchConfig};
use tonus_shared::semg::design::{self, DesignError, Mains};
use tonus_shared::semg::smoother::Smoother;

use crate::{golden, table};

fn response(filter: &Cascade<f64>, hz: f64, rate_hz: f64) -> Complex<f64> {
    let z1 = Complex::from_polar(1.0, -2.0 * PI * hz / rate_hz);
    let z2 = z1 * z1;
    filter
        .sections()
        .iter()
        .map(|section| {
            let (b, a) = section.transfer();
            (z1 * b[1] + z2 * b[2] + b[0]) / (z1 * a[1] + z2 * a[2] + a[0])
        })
        .product()
}

fn poles_of(filter: &Cascade<f64>) -> Vec<[f64; 2]> {
    let denominators = filter.sections().iter().map(|s| s.transfer().1);
    denominators.map(|a| [a[1], a[2]]).collect()
}

fn designed(kind: &str, rate_hz: f64, cutoff_hz: f64, parameter: f64) -> Cascade<f64> {
    let order = parameter as usize;
    match kind {
        "low" => design::low_pass(rate_hz, cutoff_hz, order),
        "high" => design::high_pass(rate_hz, cutoff_hz, order),
        "notch" if cutoff_hz == 50.0 => design::notch(rate_hz, Mains::Hz50, parameter),
        "notch" => design::notch(rate_hz, Mains::Hz60, parameter),
        "dc" => design::dc_block(rate_hz, cutoff_hz),
        other => panic!("unknown kind {other}"),
    }
    .unwrap()
}

#[test]
fn poles_and_responses_equal_scipy() {
    let (_, rows) = table(&golden("semg_design.csv"));
    assert_eq!(rows.len(), 6 * (8 * 6 + 4 + 3));
    let (mut worst_pole, mut worst_response) = (0.0_f64, 0.0_f64);
    for row in &rows {
        let n: Vec<f64> = row.iter().skip(1).map(|v| v.parse().unwrap()).collect();
        let (rate_hz, cutoff_hz) = (n[0], n[1]);
        let filter = designed(&row[0], rate_hz, cutoff_hz, n[2]);
        let mut poles = poles_of(&filter);
        poles.sort_by(|x, y| (x[1], x[0]).partial_cmp(&(y[1], y[0])).unwrap());
        poles.resize(4, [0.0, 0.0]);
        for (pole, expected) in poles.iter().flatten().zip(&n[3..11]) {
            worst_pole = worst_pole.max((pole - expected).abs());
        }
        let frequencies = [0.02, 0.31, 0.83].map(|f| f * rate_hz / 2.0);
        for (hz, expected) in frequencies
            .into_iter()
            .chain([cutoff_hz])
            .zip(n[11..].chunks(2))
        {
            let difference =
                response(&filter, hz, rate_hz) - Complex::new(expected[0], expected[1]);
            worst_response = worst_response.max(difference.norm());
        }
    }
    println!(
        "{} designs: coefficients {worst_pole:.1e}, response {worst_response:.1e}",
        rows.len()
    );
    assert!(worst_pole < 1e-10);
    assert!(worst_response < 1e-9);
}

#[test]
fn the_published_envelope_filter() {
    // Butterworth order 3 at 5 Hz, 200 samples/s: a = [1, -2.6861574, 2.4196551, -0.7301653].
    let filter = design::low_pass(200.0, 5.0, 3).unwrap();
    let [first, second] = filter.sections() else {
        panic!("two sections")
    };
    let ((b, p), (d, q)) = (first.transfer(), second.transfer());
    let a = [p[1] + q[1], q[2] + p[1] * q[1], p[1] * q[2]];
    for (a, published) in a.into_iter().zip([-2.686_157_4, 2.419_655_1, -0.730_165_3]) {
        assert!((a - published).abs() < 5e-8, "{a} {published}");
    }
    assert!((b[0] * d[0] - 4.165_461_4e-4).abs() < 5e-12);
    // Group delay 63.5 ms at zero frequency.
    assert!((filter.slow_delay_samples() / 200.0 - 0.0635).abs() < 5e-5);
}

#[test]
fn what_the_rate_cannot_carry_is_refused_with_its_limits() {
    for rate_hz in [0.0, 199.0, 2001.0, -200.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            design::low_pass(rate_hz, 5.0, 3),
            Err(DesignError::Rate { .. })
        ));
    }
    for cutoff_hz in [0.0, -5.0, 100.0, 99.0, 450.0, 0.04, f64::NAN, f64::INFINITY] {
        for filter in [
            design::low_pass(200.0, cutoff_hz, 3),
            design::high_pass(200.0, cutoff_hz, 2),
            design::dc_block(200.0, cutoff_hz),
        ] {
            assert!(matches!(
                filter,
                Err(DesignError::Cutoff { rate_hz: 200.0, .. })
            ));
        }
    }
    let message = design::low_pass(200.0, 450.0, 2).unwrap_err().to_string();
    assert!(
        message.contains("450") && message.contains("200") && message.contains("98"),
        "{message}"
    );
    for order in [0, 9, usize::MAX] {
        assert!(matches!(
            design::high_pass(1000.0, 20.0, order),
            Err(DesignError::Order { highest: 8, .. })
        ));
    }
    for q in [0.0, -1.0, 101.0, f64::NAN] {
        assert!(matches!(
            design::notch(1000.0, Mains::Hz50, q),
            Err(DesignError::NotchQ { .. })
        ));
    }
}

#[test]
fn a_window_longer_than_its_ring_is_refused() {
    for window_s in [0.257, 1e9, 0.0, -0.1, f64::NAN, f64::INFINITY] {
        for smoother in [
            Smoother::MovingAverage { window_s },
            Smoother::Rms { window_s },
        ] {
            let config = ChainConfig {
                smoother,
                ..ChainConfig::at_rate(2000.0)
            };
            assert!(matches!(
                Chain::<f32>::design(&config),
                Err(DesignError::Window {
                    rate_hz: 2000.0,
                    ..
                })
            ));
        }
    }
    let config = ChainConfig {
        smoother: Smoother::Rms { window_s: 0.25 },
        ..ChainConfig::at_rate(2000.0)
    };
    assert!(Chain::<f32>::design(&config).is_ok());
}

#[test]
fn every_part_of_a_chain_is_checked() {
    let base = ChainConfig::at_rate(200.0);
    let bad = [
        ChainConfig {
            rate_hz: 100.0,
            ..base
        },
        ChainConfig {
            conditioner: Conditioner::HighPass {
                cutoff_hz: 120.0,
                order: 2,
            },
            ..base
        },
        ChainConfig {
            conditioner: Conditioner::DcBlock { cutoff_hz: 0.0 },
            ..base
        },
        ChainConfig {
            notch: Some(NotchConfig {
                mains: Mains::Hz60,
                q: 0.5,
            }),
            ..base
        },
        ChainConfig {
            smoother: Smoother::Butterworth {
                order: 9,
                cutoff_hz: 5.0,
            },
            ..base
        },
    ];
    assert!(Chain::<f64>::design(&base).is_ok());
    for config in bad {
        assert!(Chain::<f64>::design(&config).is_err(), "{config:?}");
    }
}

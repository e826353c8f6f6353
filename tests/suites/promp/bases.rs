//! Bases against their formulas written out over complex numbers, whose imaginary step gives the
//! derivative to the last digits (no difference, no cancellation).

use nalgebra::{Complex, ComplexField};
use tonus_shared::promp::{Basis, BasisError, Family, RowError};

type C = Complex<f64>;

fn formula(basis: &Basis, s: C) -> Vec<C> {
    let count = basis.count();
    match basis.family() {
        Family::Gaussian { width } => {
            let b: Vec<C> = (0..count)
                .map(|k| {
                    let center = k as f64 / (count.max(2) - 1) as f64;
                    (-(s - center) * (s - center) / (2.0 * width)).exp()
                })
                .collect();
            let sum: C = b.iter().sum();
            b.iter().map(|value| value / sum).collect()
        }
        Family::Fourier => (0..count)
            .map(|k| {
                let angle = s * std::f64::consts::TAU * k.div_ceil(2) as f64;
                match k {
                    0 => C::new(1.0, 0.0),
                    k if k % 2 == 1 => angle.sin(),
                    _ => angle.cos(),
                }
            })
            .collect(),
        Family::Bernstein => {
            let degree = count - 1;
            (0..count)
                .map(|k| {
                    let choose = (0..k).fold(1.0, |c, i| c * (degree - i) as f64 / (i + 1) as f64);
                    s.powi(k as i32) * (C::new(1.0, 0.0) - s).powi((degree - k) as i32) * choose
                })
                .collect()
        }
    }
}

fn all() -> Vec<Basis> {
    let mut bases: Vec<Basis> = [1, 2, 5, 30]
        .iter()
        .flat_map(|k| [Basis::gaussian(*k).unwrap(), Basis::bernstein(*k).unwrap()])
        .collect();
    bases.extend([1, 3, 21].map(|k| Basis::fourier(k).unwrap()));
    bases.push(Basis::new(Family::Gaussian { width: 0.02 }, 12).unwrap());
    bases
}

fn values(basis: &Basis, phase: f64) -> Vec<f64> {
    let mut out = vec![f64::NAN; basis.count()];
    basis.values(phase, &mut out).unwrap();
    out
}

fn derivatives(basis: &Basis, phase: f64) -> Vec<f64> {
    let mut out = vec![f64::NAN; basis.count()];
    basis.derivatives(phase, &mut out).unwrap();
    out
}

#[test]
fn values_and_derivatives_follow_the_formulas() {
    const STEP: f64 = 1e-30;
    for basis in all() {
        for i in 0..=97 {
            let phase = f64::from(i) / 97.0;
            let exact = formula(&basis, C::new(phase, STEP));
            let slope = exact
                .iter()
                .map(|c| (c.im / STEP).abs())
                .fold(1.0, f64::max);
            let (psi, rate) = (values(&basis, phase), derivatives(&basis, phase));
            for k in 0..basis.count() {
                assert!(
                    (psi[k] - exact[k].re).abs() < 1e-12,
                    "{basis:?} {phase} {k}"
                );
                let error = (rate[k] - exact[k].im / STEP).abs();
                assert!(error < 1e-12 * slope, "{basis:?} {phase} {k}: {error}");
            }
        }
    }
}

#[test]
fn strokes_sum_to_one_and_their_derivatives_to_zero() {
    for basis in all() {
        if basis.family() == Family::Fourier {
            continue;
        }
        for phase in [-3.0, 0.0, 1e-9, 0.37, 0.5, 1.0, 1.0 + 1e-9, 40.0] {
            let slope = derivatives(&basis, phase);
            let scale = slope.iter().fold(1.0, |m: f64, d| m.max(d.abs()));
            assert!((values(&basis, phase).iter().sum::<f64>() - 1.0).abs() < 1e-14);
            assert!(slope.iter().sum::<f64>().abs() < 1e-13 * scale);
        }
    }
}

#[test]
fn bernstein_touches_its_end_weights() {
    let basis = Basis::bernstein(6).unwrap();
    assert_eq!(values(&basis, 0.0), [1.0, 0.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(values(&basis, 1.0), [0.0, 0.0, 0.0, 0.0, 0.0, 1.0]);
    assert_eq!(derivatives(&basis, 0.0), [-5.0, 5.0, 0.0, 0.0, 0.0, 0.0]);
    assert_eq!(derivatives(&basis, 1.0), [0.0, 0.0, 0.0, 0.0, -5.0, 5.0]);
}

#[test]
fn fourier_goes_round() {
    let basis = Basis::fourier(11).unwrap();
    for phase in [0.0, 0.25, 0.625, 0.875] {
        // Exact in binary, so the whole turns leave no rounding behind.
        for turns in [-4096.0, -1.0, 1.0, 1024.0] {
            assert_eq!(values(&basis, phase), values(&basis, phase + turns));
            assert_eq!(
                derivatives(&basis, phase),
                derivatives(&basis, phase + turns)
            );
        }
    }
}

#[test]
fn strokes_hold_their_ends() {
    for basis in [Basis::gaussian(8).unwrap(), Basis::bernstein(8).unwrap()] {
        for (outside, end) in [(-1e300, 0.0), (-0.01, 0.0), (1.01, 1.0), (1e300, 1.0)] {
            assert_eq!(values(&basis, outside), values(&basis, end));
            assert!(derivatives(&basis, outside).iter().all(|d| *d == 0.0));
        }
        // Rounding is not the outside: a velocity at t = duration keeps its slope.
        assert_eq!(derivatives(&basis, 1.0 + 1e-7), derivatives(&basis, 1.0));
        assert_eq!(derivatives(&basis, -1e-7), derivatives(&basis, 0.0));
    }
}

/// Halfway between centres every one of these Gaussians is `exp(-12500)`: 0 / 0 if taken as written.
#[test]
fn narrow_gaussians_do_not_underflow() {
    let basis = Basis::new(Family::Gaussian { width: 1e-6 }, 3).unwrap();
    let mut out = [f32::NAN; 3];
    for (phase, expected) in [(0.2, [1.0, 0.0, 0.0]), (0.3, [0.0, 1.0, 0.0])] {
        basis.values(phase, &mut out).unwrap();
        assert_eq!(out, expected);
    }
    basis.values(0.25, &mut out).unwrap();
    assert_eq!(out, [0.5, 0.5, 0.0]);
}

#[test]
fn f32_follows_f64() {
    for basis in all() {
        let (mut psi, mut rate) = (vec![0.0_f32; basis.count()], vec![0.0_f32; basis.count()]);
        for i in 0..=64 {
            let phase = f64::from(i) / 64.0;
            let (exact, slope) = (values(&basis, phase), derivatives(&basis, phase));
            basis.values(phase as f32, &mut psi).unwrap();
            basis.derivatives(phase as f32, &mut rate).unwrap();
            let steepest = slope.iter().fold(1.0, |m: f64, d| m.max(d.abs()));
            for k in 0..basis.count() {
                assert!((f64::from(psi[k]) - exact[k]).abs() < 2e-6);
                assert!((f64::from(rate[k]) - slope[k]).abs() < 1e-5 * steepest);
            }
        }
    }
}

#[test]
fn what_cannot_be_is_refused() {
    assert_eq!(Basis::gaussian(0), Err(BasisError::Empty));
    assert_eq!(Basis::bernstein(0), Err(BasisError::Empty));
    assert_eq!(Basis::fourier(4), Err(BasisError::EvenFourier { count: 4 }));
    for width in [0.0, -1.0, 1e-9, f64::INFINITY, f64::NAN] {
        let refused = Basis::new(Family::Gaussian { width }, 5);
        assert!(matches!(refused, Err(BasisError::Width { .. })), "{width}");
    }
    assert!(Basis::gaussian(590).is_ok() && Basis::gaussian(600).is_err());
    for basis in all() {
        let mut out = vec![0.0; basis.count()];
        for phase in [f64::NAN, f64::INFINITY, f64::NEG_INFINITY] {
            let refused = Err::<(), _>(RowError::Phase { phase });
            let same = |got: Result<(), RowError>| format!("{got:?}") == format!("{refused:?}");
            assert!(same(basis.values(phase, &mut out)));
            assert!(same(basis.derivatives(phase, &mut out)));
        }
        let mut long = vec![0.0; basis.count() + 1];
        let refused = RowError::Buffer {
            what: "basis",
            expected: basis.count(),
            got: basis.count() + 1,
        };
        assert_eq!(basis.values(0.5, &mut long), Err(refused));
    }
}

//! The onset detector against movements whose onset and end are known in closed form.
#![allow(
    clippy::unwrap_used,
    reason = "a test's helpers may stop it; clippy exempts test functions only"
)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus_shared::onset::{MotionEdge, OnsetConfig, OnsetDetector, OnsetError};

/// A minimum-jerk movement along a line: `x(s) = A (10 s^3 - 15 s^4 + 6 s^5)` from `start_s` for `duration_s`.
#[derive(Clone, Copy)]
struct Reach {
    amplitude_m: f64,
    start_s: f64,
    duration_s: f64,
}

impl Reach {
    fn at(&self, time_s: f64) -> [f64; 3] {
        let s = ((time_s - self.start_s) / self.duration_s).clamp(0.0, 1.0);
        let way = self.amplitude_m * s.powi(3) * (10.0 - 15.0 * s + 6.0 * s * s);
        [0.6 * way, -0.8 * way, 0.3]
    }

    fn end_s(&self) -> f64 {
        self.start_s + self.duration_s
    }
}

/// Edges told from the beginning to the end, with the time at which they were told.
fn edges(
    config: &OnsetConfig,
    rate_hz: f64,
    seconds: f64,
    mut position_m: impl FnMut(f64) -> [f64; 3],
) -> Vec<(f64, MotionEdge<f64>)> {
    let mut detector = OnsetDetector::new(config).unwrap();
    let mut told = Vec::new();
    for index in 0..(seconds * rate_hz) as usize {
        let time_s = index as f64 / rate_hz;
        if let Some(edge) = detector.step(time_s, position_m(time_s)).unwrap() {
            told.push((time_s, edge));
        }
    }
    told
}

/// Onset and end of exactly one movement.
fn one_movement(told: &[(f64, MotionEdge<f64>)]) -> (f64, f64) {
    match told {
        [
            (_, MotionEdge::Onset { at_s: onset }),
            (_, MotionEdge::End { at_s: end }),
        ] => (*onset, *end),
        other => panic!("not one movement: {other:?}"),
    }
}

/// The start of a reach is quadratic in speed only to first order (`(1 - s)^2` is left out), and an edge is put at
/// most 0.2 s beyond a crossing: within 40 ms over these, 14 ms in the median (measured).
#[test]
fn minimum_jerk_reaches_are_found_where_they_begin_and_end() {
    let config = OnsetConfig::default();
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut errors = Vec::new();
    for _ in 0..100 {
        let reach = Reach {
            amplitude_m: rng.random_range(0.3..1.0),
            start_s: rng.random_range(0.8..1.2),
            duration_s: rng.random_range(0.6..1.6),
        };
        let told = edges(&config, 100.0, 4.0, |t| reach.at(t));
        let (onset_s, end_s) = one_movement(&told);
        errors.extend([onset_s - reach.start_s, end_s - reach.end_s()].map(f64::abs));
        // Told within the window, the crossing and the 30 ms that it must last.
        let late_s = told[0].0 - reach.start_s;
        assert!(late_s < 0.35 * reach.duration_s + 0.1, "{late_s}");
    }
    errors.sort_by(f64::total_cmp);
    let (median, worst) = (errors[errors.len() / 2], errors[errors.len() - 1]);
    println!("minimum jerk: median error {median:.4} s, worst {worst:.4} s");
    assert!(median < 0.03 && worst < 0.08, "{median} {worst}");
}

/// A speed that grows evenly with the square of time is put exactly: `x = c t^3 / 3`, `v = c t^2`.
#[test]
fn a_quadratic_start_is_exact_but_for_the_window() {
    let config = OnsetConfig {
        window_s: 0.003,
        ..OnsetConfig::default()
    };
    let start_s = 0.5;
    let told = edges(&config, 1000.0, 1.0, |t| {
        let since = (t - start_s).max(0.0);
        [4.0 * since.powi(3) / 3.0, 0.0, 0.0]
    });
    let [(_, MotionEdge::Onset { at_s })] = told[..] else {
        panic!("{told:?}");
    };
    assert!((at_s - start_s).abs() < 2e-3, "{at_s}");
}

#[test]
fn a_hand_that_rests_is_not_moved_by_a_noisy_tracker() {
    let config = OnsetConfig::default();
    // White noise of 2 mm at 60 Hz over a 50 ms window is a slope of about 0.08 m/s, the threshold 0.2.
    for (noise_m, seconds) in [(0.001, 60.0), (0.002, 60.0)] {
        let mut rng = ChaCha8Rng::seed_from_u64(7);
        let told = edges(&config, 60.0, seconds, |_| {
            [0.0; 3].map(|_: f64| {
                let white: f64 = StandardNormal.sample(&mut rng);
                noise_m * white
            })
        });
        assert!(told.len() <= 2, "{noise_m}: {told:?}");
    }
    // A movement is still found in 1 mm of noise.
    let reach = Reach {
        amplitude_m: 0.6,
        start_s: 3.0,
        duration_s: 1.0,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let told = edges(&config, 60.0, 6.0, |t| {
        reach.at(t).map(|x| {
            let white: f64 = StandardNormal.sample(&mut rng);
            x + 0.001 * white
        })
    });
    let (onset_s, end_s) = one_movement(&told);
    assert!((onset_s - 3.0).abs() < 0.08 && (end_s - 4.0).abs() < 0.08);
}

#[test]
fn two_reaches_with_a_pause_are_two_movements() {
    let reaches = [(0.5, 1.0), (2.0, 0.8)].map(|(start_s, duration_s)| Reach {
        amplitude_m: 0.5,
        start_s,
        duration_s,
    });
    let told = edges(&OnsetConfig::default(), 100.0, 4.0, |t| {
        let [one, two] = reaches.map(|reach| reach.at(t));
        [one[0] + two[0], one[1] + two[1], 0.0]
    });
    assert_eq!(told.len(), 4, "{told:?}");
    let (first, second) = told.split_at(2);
    for (told, reach) in [(first, reaches[0]), (second, reaches[1])] {
        let (onset_s, end_s) = one_movement(told);
        assert!((onset_s - reach.start_s).abs() < 0.06 && (end_s - reach.end_s()).abs() < 0.06);
    }
}

#[test]
fn f32_tells_the_same_edges() {
    let reach = Reach {
        amplitude_m: 0.6,
        start_s: 1.0,
        duration_s: 1.0,
    };
    let config = OnsetConfig::default();
    let wide = edges(&config, 100.0, 3.0, |t| reach.at(t));
    let mut detector = OnsetDetector::<f32>::new(&config).unwrap();
    let mut narrow = Vec::new();
    for index in 0..300 {
        let time_s = f64::from(index) / 100.0;
        let position_m = reach.at(time_s).map(|x| x as f32);
        narrow.extend(detector.step(time_s as f32, position_m).unwrap());
    }
    assert_eq!(narrow.len(), wide.len());
    for (narrow, (_, wide)) in narrow.iter().zip(&wide) {
        let (a, b) = match (narrow, wide) {
            (MotionEdge::Onset { at_s: a }, MotionEdge::Onset { at_s: b })
            | (MotionEdge::End { at_s: a }, MotionEdge::End { at_s: b }) => (a, b),
            _ => panic!("{narrow:?} {wide:?}"),
        };
        // A crossing is put on a line between two speeds; their rounding is drawn out as far as the edge is.
        assert!((f64::from(*a) - b).abs() < 5e-3, "{a} {b}");
    }
}

#[test]
fn bad_samples_and_settings_are_refused_and_change_nothing() {
    let mut detector = OnsetDetector::<f64>::new(&OnsetConfig::default()).unwrap();
    for index in 0..5 {
        detector.step(f64::from(index) * 0.01, [0.0; 3]).unwrap();
    }
    let before = detector.clone();
    for time_s in [0.04, 0.0, f64::NAN] {
        let refused = detector.step(time_s, [0.0; 3]);
        assert!(matches!(refused, Err(OnsetError::Time { .. })));
    }
    for wrong in [f64::NAN, f64::INFINITY] {
        let refused = detector.step(0.06, [0.0, wrong, 0.0]);
        assert!(matches!(refused, Err(OnsetError::Position { .. })));
    }
    assert_eq!(detector, before);
    detector.restart();
    // After a restart any time may come.
    assert_eq!(detector.step(0.0, [0.0; 3]), Ok(None));
    assert!(detector.speed().is_none() && !detector.moving());
    let fine = OnsetConfig::default();
    for wrong in [
        OnsetConfig {
            window_s: 0.0,
            ..fine
        },
        OnsetConfig {
            start_m_per_s: f64::NAN,
            ..fine
        },
        OnsetConfig {
            release: 1.0,
            ..fine
        },
        OnsetConfig {
            rest_multiple: -1.0,
            ..fine
        },
        OnsetConfig {
            shortest_pause_s: 11.0,
            ..fine
        },
    ] {
        assert!(OnsetDetector::<f64>::new(&wrong).is_err());
    }
}

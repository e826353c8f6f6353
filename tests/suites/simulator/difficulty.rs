//! The difficulty of telling the objects apart by position, fixed from the simulator's own densities.

use nalgebra::{Cholesky, DMatrix, DVector};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tonus::simulate::difficulty::{BestRecogniser, DensityError};
use tonus::simulate::skills::{DURATION_US, Skill};
use tonus::simulate::tracker::{NoiseSource, TrackedHand, Tracker, TrackerNoise};
use tonus::simulate::wearer::{Action, Task, Wearer};

const DURATION_S: f64 = DURATION_US as f64 * 1e-6;

/// Exposure times of every frame within one action, as the tracker takes them (none occluded).
fn frame_times() -> Vec<u64> {
    let mut tracker = Tracker::new(TrackerNoise::NONE, 77);
    let mut times = Vec::new();
    while tracker.next_us() < DURATION_US {
        times.push(tracker.next_us());
        tracker.expose([0.0; 3]);
    }
    times
}

/// How often the best recogniser of `skills` is right over `runs` executions of each.
fn accuracy(skills: &[Skill], noise: TrackerNoise, runs: u64) -> f64 {
    let times = frame_times();
    assert!(times.len() > 200, "{} frames", times.len());
    let phases: Vec<f64> = times
        .iter()
        .map(|&t| t as f64 / DURATION_US as f64)
        .collect();
    let best = BestRecogniser::new(skills, &phases, DURATION_S, &noise).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(2024);
    let mut right = 0;
    for run in 0..runs {
        for (number, &skill) in skills.iter().enumerate() {
            let latent = skill.sample(&mut rng);
            let mut source = NoiseSource::new(noise, run * 10 + number as u64);
            let seen: Vec<[f64; 3]> = times
                .iter()
                .zip(&phases)
                .map(|(&t, &s)| {
                    let (at, error) = (skill.position_m(&latent, s), source.error_m(t));
                    std::array::from_fn(|axis| at[axis] + error[axis])
                })
                .collect();
            right += u64::from(best.recognise(&seen).unwrap() == Some(skill));
        }
    }
    right as f64 / (runs * skills.len() as u64) as f64
}

#[test]
fn position_tells_the_objects_apart_only_without_noise() {
    // 6000 trials each: standard error at most 0.007.
    let clean = accuracy(&Skill::LIFTS, TrackerNoise::NONE, 2000);
    let stated = accuracy(&Skill::LIFTS, TrackerNoise::STATED, 2000);
    println!(
        "best recogniser from position, three objects: {clean:.3} without noise, {stated:.3} at the stated noise"
    );
    assert!(clean >= 0.9, "{clean}");
    assert!((0.33..=0.45).contains(&stated), "{stated}");
}

#[test]
fn the_zero_noise_accuracy_is_that_of_three_grasp_heights() {
    // Heights 8 mm apart, met with 2.5 mm: errors beyond 4 mm confuse neighbours, 4/3 P(Z > 1.6) in all,
    // and P(Z > 1.6) = 0.0548 (tables).
    let expected = 1.0 - 4.0 / 3.0 * 0.0548;
    let clean = accuracy(&Skill::LIFTS, TrackerNoise::NONE, 2000);
    assert!(
        (clean - expected).abs() < 4.0 * (expected * (1.0 - expected) / 6000.0).sqrt(),
        "{clean} against {expected}"
    );
}

#[test]
fn jitter_alone_would_average_out() {
    let jitter = TrackerNoise {
        bias_sd_m: 0.0,
        ..TrackerNoise::STATED
    };
    let accuracy = accuracy(&Skill::LIFTS, jitter, 500);
    assert!(accuracy > 0.88, "{accuracy}");
}

#[test]
fn the_hand_over_is_easy_by_position_even_under_noise() {
    let accuracy = accuracy(
        &[Skill::HandOver, Skill::LiftBook],
        TrackerNoise::STATED,
        300,
    );
    assert!(accuracy > 0.99, "{accuracy}");
}

#[test]
fn what_the_wearer_shows_the_tracker_is_drawn_from_the_stated_density() {
    // Whitened by the true density, every frame must be standard normal: the sum of squares over n numbers is
    // chi-square, mean n, variance 2 n; frames of consecutive actions share the bias, which costs the sum some
    // variance, so the bound is five standard deviations of the independent case.
    let mut rng = ChaCha8Rng::seed_from_u64(31);
    let actions: Vec<Action> = (0..160)
        .map(|n| Action::sample(Skill::ALL[n % 4], &mut rng))
        .collect();
    let tasks: Vec<Task> = actions
        .iter()
        .map(|&action| Task::Perform(action))
        .collect();
    let wearer = Wearer::new(&tasks, TrackerNoise::STATED, 12).unwrap();
    let spans = wearer.spans().to_vec();
    let frames: Vec<TrackedHand> = wearer.filter_map(|moment| moment.hand).collect();
    let (mut squares, mut count) = (0.0, 0.0);
    for (span, action) in spans.iter().zip(&actions) {
        // Every fourth frame: its density is the marginal, and the factorisations stay small.
        let seen: Vec<_> = frames
            .iter()
            .filter(|f| (span.start_us..span.end_us).contains(&f.exposed_us))
            .step_by(4)
            .collect();
        assert!(seen.len() > 35);
        for axis in 0..3 {
            let phases: Vec<f64> = seen
                .iter()
                .map(|f| (f.exposed_us - span.start_us) as f64 / DURATION_US as f64)
                .collect();
            let whitened = whiten(
                action.skill,
                axis,
                &phases,
                seen.iter().map(|f| f.position_m[axis]),
            );
            squares += whitened.norm_squared();
            count += whitened.len() as f64;
        }
    }
    let deviation = (squares - count) / (2.0 * count).sqrt();
    assert!(
        deviation.abs() < 5.0,
        "{squares} against {count}: {deviation} standard deviations"
    );
}

/// The positions less their mean, times the inverse root of their covariance: built here from the
/// stated formulas alone.
fn whiten(
    skill: Skill,
    axis: usize,
    phases: &[f64],
    positions: impl Iterator<Item = f64>,
) -> DVector<f64> {
    let noise = TrackerNoise::STATED;
    let covariance = DMatrix::from_fn(phases.len(), phases.len(), |i, j| {
        let apart_s = (phases[i] - phases[j]).abs() * DURATION_S;
        let bias = noise.bias_sd_m.powi(2) * (-apart_s / noise.bias_time_s).exp();
        let jitter = if i == j {
            noise.jitter_sd_m.powi(2)
        } else {
            0.0
        };
        skill.covariance_m2(phases[i], phases[j])[axis] + bias + jitter
    });
    let mean = phases.iter().map(|&s| skill.mean_m(s)[axis]);
    let deviation = DVector::from_iterator(phases.len(), positions.zip(mean).map(|(p, m)| p - m));
    Cholesky::new(covariance)
        .unwrap()
        .l()
        .solve_lower_triangular(&deviation)
        .unwrap()
}

#[test]
fn the_recogniser_computes_the_gaussian_density() {
    // One frame, by hand: three independent normals.
    let noise = TrackerNoise {
        jitter_sd_m: 0.01,
        bias_sd_m: 0.02,
        bias_time_s: 1.0,
    };
    let best = BestRecogniser::new(&[Skill::LiftBook], &[0.3], DURATION_S, &noise).unwrap();
    let at = [0.3, 0.05, -0.2];
    let mut expected = 0.0;
    for (axis, position) in at.into_iter().enumerate() {
        let variance =
            Skill::LiftBook.covariance_m2(0.3, 0.3)[axis] + 0.01_f64.powi(2) + 0.02_f64.powi(2);
        let deviation = position - Skill::LiftBook.mean_m(0.3)[axis];
        expected -=
            0.5 * (deviation * deviation / variance + (std::f64::consts::TAU * variance).ln());
    }
    assert!((best.log_likelihoods(&[at]).unwrap()[0] - expected).abs() < 1e-9);
    assert_eq!(
        best.log_likelihoods(&[]),
        Err(DensityError::Frames {
            expected: 1,
            got: 0
        })
    );
    let still = TrackerNoise {
        jitter_sd_m: 0.0,
        ..noise
    };
    assert_eq!(
        BestRecogniser::new(&[Skill::LiftBook], &[0.3, 0.3], DURATION_S, &still).unwrap_err(),
        DensityError::Singular { frames: 2 }
    );
}

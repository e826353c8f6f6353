//! Onset and end of real movements: the detector on six actions of two people who pick and place, against the frames at
//! which people cut them. What is recognised from there on is in suite `recordings`.
#![allow(missing_docs, reason = "test suite")]

mod recordings;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use recordings::{Action, actions, runs};
use tonus_shared::onset::{MotionEdge, OnsetConfig, OnsetDetector};

/// The recording is watched from so long before the action, the same for the same seed.
fn lead_s(seed: u64) -> f64 {
    ChaCha8Rng::seed_from_u64(seed).random_range(0.2..0.5)
}

/// The onset told last in the first half of the action, less the true one, s; none if there is none.
fn onset_error_s(action: &Action<'_>, config: &OnsetConfig, seed: u64) -> Option<f64> {
    let mut detector = OnsetDetector::new(config).expect("a detector");
    let mut last = None;
    for (time_s, position_m) in action.stream(lead_s(seed), 0.5) {
        if let Some(MotionEdge::Onset { at_s }) = detector.step(time_s, position_m).expect("a step")
        {
            last = Some(at_s - action.start_s());
        }
    }
    last
}

/// The end told within 0.5 s of the true one and nearest to it, less that, s.
fn end_error_s(action: &Action<'_>, config: &OnsetConfig, seed: u64) -> Option<f64> {
    let mut detector = OnsetDetector::new(config).expect("a detector");
    let true_s = action.start_s() + action.duration_s();
    let mut ends = Vec::new();
    let share = 1.0 + 0.5 / action.duration_s();
    for (time_s, position_m) in action.stream(lead_s(seed), share) {
        if let Some(MotionEdge::End { at_s }) = detector.step(time_s, position_m).expect("a step") {
            ends.push(at_s - true_s);
        }
    }
    let near = ends.into_iter().filter(|error| error.abs() <= 0.5);
    near.min_by(|a, b| a.abs().total_cmp(&b.abs()))
}

fn median(mut numbers: Vec<f64>) -> f64 {
    numbers.sort_by(f64::total_cmp);
    numbers[numbers.len() / 2]
}

#[test]
fn onset_and_end_of_real_movements() {
    let config = OnsetConfig::default();
    // The thresholds were chosen on subject 1.
    for (person, count) in [("subject1", 54), ("subject2", 36)] {
        let runs = runs(person);
        let of_person = actions(&runs);
        let told = |of: &dyn Fn(&Action<'_>, u64) -> Option<f64>| -> Vec<f64> {
            let errors = of_person.iter().zip(1..);
            errors
                .filter_map(|(action, seed)| of(action, seed))
                .collect()
        };
        let onsets = told(&|action, seed| onset_error_s(action, &config, seed));
        let ends = told(&|action, seed| end_error_s(action, &config, seed));
        let absolute = |errors: &[f64]| median(errors.iter().map(|e| e.abs()).collect());
        println!(
            "{person}: {} of {count} onsets told in the first half, median error {:+.3} s, absolute {:.3} s; \
             {} ends within 0.5 s, {:+.3} s, {:.3} s",
            onsets.len(),
            median(onsets.clone()),
            absolute(&onsets),
            ends.len(),
            median(ends.clone()),
            absolute(&ends),
        );
        assert_eq!(of_person.len(), count);
        assert!(onsets.len() * 100 >= 95 * count, "{} onsets", onsets.len());
        assert!(absolute(&onsets) <= 0.15 && absolute(&ends) <= 0.2);
    }
}

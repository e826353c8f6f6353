//! What is seen of a movement in a recording that goes on.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::super::data::{Run, Set};
use super::super::setting::Phase;
use super::followed::Watch;
use crate::demonstration::{Demonstration, PathLength};
use crate::experiment::ExperimentError;

/// The recording is watched from so long before the movement, whatever happens there; seeded, seconds.
const LEAD_S: std::ops::Range<f64> = 0.2..0.5;
/// Ways of the hand shorter than this are none, metres.
const LEAST_WAY_M: f64 = 0.005;

/// One row of the recording as it comes in.
#[derive(Debug, Clone, Copy)]
pub(super) struct Moment {
    pub(super) time_s: f64,
    /// Length of the hand's path since the first.
    pub(super) path_m: f64,
    pub(super) row_m: [f64; 6],
}

impl Moment {
    /// Where it is by this phase.
    pub(super) const fn along(&self, phase: Phase) -> f64 {
        match phase {
            Phase::Time => self.time_s,
            Phase::Path => self.path_m,
        }
    }

    pub(super) const fn hand_m(&self) -> [f64; 3] {
        let [x, y, z, ..] = self.row_m;
        [x, y, z]
    }
}

/// From before a movement, by a lead of this seed, to its end; before the recording's first row the arm is held where that
/// has it. A movement of no run has no moments.
pub(super) fn moments(set: &Set, movement: usize, seed: u64) -> Vec<Moment> {
    let Some(run) = set.run(movement) else {
        return Vec::new();
    };
    let shape = &set.demonstrations()[movement];
    let lead_s = ChaCha8Rng::seed_from_u64(seed).random_range(LEAD_S);
    let from_s = shape.t_s()[0] - lead_s;
    let to_s = shape.t_s()[0] + shape.duration_s() + 1e-9;
    let mut path = PathLength::new(LEAST_WAY_M);
    let mut moments = held_before(run, from_s);
    let recorded = run.t_s.iter().copied().zip(run.rows_m.iter().copied());
    moments.extend(recorded.filter(|(time_s, _)| (from_s..=to_s).contains(time_s)));
    let moment = |(time_s, row_m): (f64, [f64; 6])| Moment {
        time_s,
        path_m: path.step([row_m[0], row_m[1], row_m[2]]),
        row_m,
    };
    moments.into_iter().map(moment).collect()
}

fn held_before(run: &Run, from_s: f64) -> Vec<(f64, [f64; 6])> {
    let ([first_s, second_s, ..], Some(&held_m)) = (run.t_s.as_slice(), run.rows_m.first()) else {
        return Vec::new();
    };
    let interval_s = second_s - first_s;
    let missing = libm::floor(((first_s - from_s) / interval_s).max(0.0)) as usize;
    let held = (1..=missing).rev();
    held.map(|ago| (first_s - ago as f64 * interval_s, held_m))
        .collect()
}

/// A movement as it is learnt from, so watched.
pub(super) fn demonstration(
    set: &Set,
    movement: usize,
    watch: Watch,
) -> Result<Demonstration, ExperimentError> {
    let shape = &set.demonstrations()[movement];
    let mut values = shape.values().to_vec();
    if let (true, Some(run)) = (watch.upper_arm, set.run(movement)) {
        let first = run.t_s.partition_point(|t| *t < shape.t_s()[0]);
        // Rows of a recording whose times go back are too few, which is refused below.
        let rows = run.rows_m.iter().skip(first).take(shape.t_s().len());
        values.extend((3..6).map(|column| rows.clone().map(|row| row[column]).collect()));
    }
    let refused = |source| ExperimentError::Recording {
        file: shape.file().to_owned(),
        trial: shape.trial().to_owned(),
        source,
    };
    let (label, trial, times) = (shape.label(), shape.trial(), shape.t_s().to_vec());
    let timed = Demonstration::new(label, trial, shape.file(), times, values).map_err(refused)?;
    match watch.phase {
        Phase::Time => Ok(timed),
        Phase::Path => timed
            .by_path_length([0, 1, 2], LEAST_WAY_M)
            .map_err(refused),
    }
}

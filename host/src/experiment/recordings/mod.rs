//! The same questions to recordings of real people by others.
//!
//! ```text
//! data (tables -> demonstrations) --> choose (training part alone) --> mixture --> held_out --> calibration
//!                                                                             \-> unknown_tempo, others; novelty by itself
//! ```
//!
//! Everything that is chosen (basis, ridge, shrinkage, placement, assumed noise, the ways in which a class is
//! performed: weights of such settings in a mixture; temperatures) is chosen on the training part alone, by leaving out
//! parts of it in turn. Start and duration are known (an oracle) unless a field says `unknown_tempo`. What was not
//! decided that way: the values that may be chosen from, that settings are mixed, and that each is tempered before it is
//! weighed, all with figures on these recordings in view.

mod calibration;
mod choose;
mod data;
mod grids;
mod held_out;
mod look;
mod mixture;
mod novelty;
mod others;
mod parts;
mod setting;
mod unknown_tempo;

use std::path::Path;

use serde::Serialize;

pub use calibration::Calibration;
pub use choose::{Chosen, Member};
pub use novelty::{Nearest, Novelty};
pub use others::Other;
pub use setting::{Phase, Setting, Ways};
pub use unknown_tempo::{Candidate, InRuns, Onset, Tried, UnknownTempo, Watch};

use super::{Config, ExperimentError, Progress, Score};
use data::Set;
use held_out::Held;
use parts::Part;

/// Parts of the movement that are looked at.
const FRACTIONS: [f64; 4] = [0.2, 0.3, 0.5, 1.0];
/// Confidence that a decision needs.
const CONFIDENCE: f64 = 0.9;

/// What was found on all of them.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Recordings {
    /// Each recording in each way of holding out.
    pub sets: Vec<Recording>,
    /// Over all of `sets` together, at each part of the movement.
    pub calibration: Vec<Calibration>,
    /// Each class left out of the library in turn, each recording.
    pub novelty: Vec<Novelty>,
}

/// What was found on one recording. Log-losses are of tempered probabilities.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Recording {
    /// Its folder.
    pub name: String,
    /// How what is tested was held out.
    pub held_out: String,
    /// Classes.
    pub classes: usize,
    /// Demonstrations tested.
    pub demonstrations: usize,
    /// Observations of each, unless that is swept.
    pub observations: usize,
    /// What was decided on each training part.
    pub chosen: Vec<Chosen>,
    /// The whole movement of what was learnt from: no accuracy.
    pub training: Score,
    /// Observations in the first 20, 30, 50, 100 % of the movement.
    pub by_fraction: Vec<At>,
    /// 1 to 10 observations over the whole movement, a single one at its end.
    pub by_observations: Vec<At>,
    /// White noise of 0 to 0.05 m added to each observed position; whole movement.
    pub by_noise_m: Vec<At>,
    /// Confidence against accuracy at each part of the movement.
    pub calibration: Vec<Calibration>,
    /// When a class is probable enough.
    pub decision: Decisions,
    /// Nobody says how long the movement takes.
    pub unknown_tempo: UnknownTempo,
    /// Other methods, same observations of the whole movement, learnt from the training parts.
    pub others: Vec<Other>,
}

/// One point of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct At {
    /// What is swept.
    pub at: f64,
    /// What came of it.
    #[serde(flatten)]
    pub score: Score,
}

/// Decisions at a confidence, the observations streamed.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Decisions {
    /// Probability that a class must have.
    pub confidence: f64,
    /// Movements.
    pub total: usize,
    /// Those decided by their end.
    pub decided: usize,
    /// Of those, wrong ones.
    pub wrong: usize,
    /// Median time from the movement's start to the decision.
    pub median_time_s: Option<f64>,
}

/// Evaluates the recordings below `folder`.
///
/// # Errors
/// A recording that is missing or cannot be read; what learning or inference refuses.
pub fn run(
    folder: &Path,
    config: &Config,
    progress: &mut dyn FnMut(Progress),
) -> Result<Recordings, ExperimentError> {
    let mut step = 0;
    let mut next = |what| {
        progress(Progress {
            what,
            done: step,
            total: 7,
        });
        step += 1;
    };
    next("recordings: reading");
    let actions = Set::read(folder, &grids::ACTIONS)?;
    unknown_tempo::learnable(&actions)?;
    let digits = Set::read(folder, &grids::DIGITS)?;
    let reaches = Set::read(folder, &grids::REACHES)?;
    let mut found = Vec::new();
    next("recordings: six actions, from person to person");
    for (held_out, part) in parts::from_person_to_person(&actions) {
        found.push(in_parts(&actions, held_out, &[part], config)?);
    }
    next("recordings: six actions, each person's own runs");
    let parts = parts::own_runs(&actions);
    let held_out = "a third of each person's runs";
    found.push(in_parts(&actions, held_out, &parts, config)?);
    next("recordings: ten digits");
    let parts = parts::leave_one_out(&digits);
    found.push(in_parts(&digits, "leave one out", &parts, config)?);
    next("recordings: three reaches to grasp");
    let parts = parts::leave_one_out(&reaches);
    found.push(in_parts(&reaches, "leave one out", &parts, config)?);
    next("recordings: movements that no skill is");
    let novelty = [&actions, &digits, &reaches].map(novelty::each_class_left_out);
    let novelty = novelty.into_iter().collect::<Result<_, _>>()?;
    next("recordings: calibration");
    let helds: Vec<&Held> = found.iter().map(|(_, held)| held).collect();
    let calibration = calibration::pooled(&helds)?;
    Ok(Recordings {
        sets: found.into_iter().map(|(recording, _)| recording).collect(),
        calibration,
        novelty,
    })
}

/// One recording, held out in these parts.
fn in_parts(
    set: &Set,
    held_out: &str,
    parts: &[Part],
    config: &Config,
) -> Result<(Recording, Held), ExperimentError> {
    let chosen = choose::each(set, parts)?;
    let held = held_out::test(set, parts, &chosen, config)?;
    let recording = Recording {
        name: set.plan.name.to_owned(),
        held_out: held_out.to_owned(),
        classes: set.classes().len(),
        demonstrations: parts.iter().map(|part| part.tested.len()).sum(),
        observations: set.plan.observations,
        training: held.training(),
        by_fraction: held.by_fraction(),
        by_observations: held.by_observations(),
        by_noise_m: held.by_noise_m(),
        calibration: calibration::of(&held)?,
        decision: held.decisions(),
        unknown_tempo: held.unknown_tempo(),
        others: others::compared(set, parts, &chosen, config)?,
        chosen,
    };
    Ok((recording, held))
}

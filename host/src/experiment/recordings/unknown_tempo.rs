//! The same movements where nobody says how long they take and, in a recording that goes on, when they begin.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use tonus_shared::onset::{MotionEdge, OnsetConfig, OnsetDetector};

use super::At;
use super::choose::Chosen;
use super::data::{Run, Set};
use super::look::floored;
use super::parts::Fold;
use super::setting::{Phase, Setting};
use crate::experiment::statistics::median;
use crate::experiment::{ExperimentError, Score};
use crate::model::stacking::mixed;
use crate::model::tempo::{TempoConfig, TempoRecogniser};

/// After which parts of the true movement something is said.
const FRACTIONS: [f64; 3] = [0.3, 0.5, 1.0];
/// The recording is watched from so long before the movement, whatever happens there; seeded, seconds.
const LEAD_S: std::ops::Range<f64> = 0.2..0.5;
/// A Gaussian's standard deviation over its median distance from the middle.
const SPREAD: f64 = 1.4826;
/// Durations of each skill that are followed.
const DURATIONS: usize = 7;

/// How a movement's start is known.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Default, Serialize)]
#[serde(rename_all = "snake_case")]
pub enum Onset {
    /// Found by the detector in the recording that goes on.
    Detected,
    /// The recording is cut there: it is announced, only the duration is unknown.
    #[default]
    Announced,
}

/// Recognition with the duration unknown.
#[derive(Debug, Clone, Default, PartialEq, Serialize)]
pub struct UnknownTempo {
    /// How the start is known.
    pub onset: Onset,
    /// After 30, 50, 100 % of the movement, of which the recogniser does not know how much it is.
    pub by_fraction: Vec<At>,
}

/// How the hand is followed.
#[derive(Debug, Clone, Copy)]
pub(super) struct Following {
    tempo: TempoConfig,
    onset: Option<OnsetConfig>,
    /// One observation so often.
    interval_s: f64,
}

impl Following {
    /// The detector's error, and how often is observed, from the training part alone.
    pub(super) fn of(set: &Set, training: &[usize]) -> Result<Self, ExperimentError> {
        let of_training = training
            .iter()
            .map(|&i| set.demonstrations()[i].duration_s());
        let durations: Vec<f64> = of_training.collect();
        let steps = set.plan.observations.max(2) - 1;
        let onset = set.plan.runs.then(OnsetConfig::default);
        let (onset_late_s, onset_std_s) = match &onset {
            Some(config) => onset_error(set, training, config)?,
            None => (0.0, 0.0),
        };
        Ok(Self {
            tempo: TempoConfig {
                durations: DURATIONS,
                onsets: if onset.is_some() {
                    TempoConfig::default().onsets
                } else {
                    1
                },
                onset_late_s,
                onset_std_s,
                lead_s: 0.0,
                ..TempoConfig::default()
            },
            onset,
            interval_s: median(&durations) / steps as f64,
        })
    }
}

/// Answers after each of the fractions.
#[derive(Debug)]
pub(super) struct Said {
    onset: Onset,
    answers: [Vec<(f64, bool)>; 3],
}

impl Said {
    pub(super) fn add(&mut self, other: Self) {
        for (all, more) in self.answers.iter_mut().zip(other.answers) {
            all.extend(more);
        }
    }

    pub(super) fn scores(&self) -> UnknownTempo {
        let points = FRACTIONS.iter().zip(&self.answers);
        let point = |(&at, answers): (&f64, &Vec<(f64, bool)>)| At {
            at,
            score: Score::of(answers.iter().copied()),
        };
        UnknownTempo {
            onset: self.onset,
            by_fraction: points.map(point).collect(),
        }
    }
}

/// What is said of a fold's movements by models of its others; by time, whatever the phase was when known.
pub(super) fn said(
    set: &Set,
    chosen: &Chosen,
    following: &Following,
    fold: &Fold,
) -> Result<Said, ExperimentError> {
    let members = by_time(chosen);
    let weights: Vec<f64> = members.iter().map(|(_, _, weight)| *weight).collect();
    // For each movement and fraction, what each member says.
    let mut posteriors = vec![[const { Vec::new() }; 3]; fold.tested.len()];
    let mut classes = Vec::new();
    for (setting, sigma_m, _) in &members {
        let model = set.learn(setting, &fold.learned)?;
        let view = model.view()?;
        let mut recogniser = TempoRecogniser::new(&model, &view, following.tempo)?;
        for (&movement, posteriors) in fold.tested.iter().zip(&mut posteriors) {
            let of_skills = follow(&mut recogniser, set, following, (movement, *sigma_m))?;
            for (posteriors, of_skills) in posteriors.iter_mut().zip(of_skills) {
                let of_classes = model.class_log_posterior(&of_skills);
                posteriors.push(
                    of_classes
                        .into_iter()
                        .map(|log| floored(log).min(0.0))
                        .collect(),
                );
            }
        }
        classes = model.classes().into_iter().map(str::to_owned).collect();
    }
    let mut answers = [const { Vec::new() }; 3];
    for (&movement, posteriors) in fold.tested.iter().zip(&posteriors) {
        let class = set.demonstrations()[movement].class();
        for (answers, posteriors) in answers.iter_mut().zip(posteriors) {
            answers.push(answer(&classes, &mixed(&weights, posteriors)?, class));
        }
    }
    Ok(Said {
        onset: if following.onset.is_some() {
            Onset::Detected
        } else {
            Onset::Announced
        },
        answers,
    })
}

/// Settings with phase by time, noises and weights: those over all parts of the movement, for nobody knows which was
/// seen.
fn by_time(chosen: &Chosen) -> Vec<(Setting, f64, f64)> {
    let mut members: Vec<(Setting, f64, f64)> = Vec::new();
    for member in &chosen.mixture {
        let setting = Setting {
            phase: Phase::Time,
            ..member.setting
        };
        let same =
            |known: &&mut (Setting, f64, f64)| (known.0, known.1) == (setting, member.sigma_m);
        match members.iter_mut().find(same) {
            Some(known) => known.2 += member.weight,
            None => members.push((setting, member.sigma_m, member.weight)),
        }
    }
    members
}

fn answer(classes: &[String], posterior: &[f64], class: &str) -> (f64, bool) {
    let pairs = || classes.iter().zip(posterior);
    let own = pairs().find(|(name, _)| *name == class);
    let own = own.map_or(f64::NEG_INFINITY, |(_, log)| *log);
    let mut others = pairs().filter(|(name, _)| *name != class);
    (floored(own), others.all(|(_, other)| *other < own))
}

/// Log posterior of the skills after each fraction of a movement, with so much noise assumed.
fn follow(
    recogniser: &mut TempoRecogniser<'_>,
    set: &Set,
    following: &Following,
    (movement, sigma_m): (usize, f64),
) -> Result<[Vec<f64>; 3], ExperimentError> {
    recogniser.end();
    let shape = &set.demonstrations()[movement];
    let (start_s, duration_s) = (shape.t_s()[0], shape.duration_s());
    let mut detector = match &following.onset {
        Some(config) => Some(OnsetDetector::new(config)?),
        None => {
            recogniser.begin(start_s)?;
            None
        }
    };
    let mut next_s = f64::NEG_INFINITY;
    let mut said: [Option<Vec<f64>>; 3] = [const { None }; 3];
    for (time_s, values) in stream(set, movement, 1.0) {
        for (said, fraction) in said.iter_mut().zip(FRACTIONS) {
            if said.is_none() && time_s > start_s + fraction * duration_s + 1e-9 {
                *said = Some(recogniser.log_posterior());
            }
        }
        if time_s >= next_s {
            next_s = time_s + following.interval_s - 1e-3;
            for (dof, value) in values.iter().enumerate() {
                recogniser.observe(dof, time_s, *value, sigma_m)?;
            }
        }
        if let (Some(detector), [x, y, z, ..]) = (&mut detector, values.as_slice())
            && let Some(MotionEdge::Onset { at_s }) = detector.step(time_s, [*x, *y, *z])?
        {
            recogniser.begin(at_s)?;
        }
    }
    Ok(said.map(|said| said.unwrap_or_else(|| recogniser.log_posterior())))
}

/// Times and values up to a share of a movement; in a recording that goes on, from before it.
fn stream(set: &Set, movement: usize, share: f64) -> Vec<(f64, Vec<f64>)> {
    let shape = &set.demonstrations()[movement];
    let start_s = shape.t_s()[0];
    let end_s = start_s + share * shape.duration_s() + 1e-9;
    let Some(run) = set.run(movement) else {
        let row = |sample: usize| shape.values().iter().map(|series| series[sample]).collect();
        let rows = shape
            .t_s()
            .iter()
            .enumerate()
            .map(|(sample, t)| (*t, row(sample)));
        return rows.take_while(|(time_s, _)| *time_s <= end_s).collect();
    };
    let lead_s = ChaCha8Rng::seed_from_u64(movement as u64 + 1).random_range(LEAD_S);
    let mut stream = before(run, start_s - lead_s);
    let recorded = run.t_s.iter().zip(&run.position_m);
    let within = recorded.filter(|(time_s, _)| (start_s - lead_s..=end_s).contains(*time_s));
    stream.extend(within.map(|(time_s, position_m)| (*time_s, position_m.to_vec())));
    stream
}

/// The hand held where the recording's first sample has it.
fn before(run: &Run, from_s: f64) -> Vec<(f64, Vec<f64>)> {
    let ([first_s, second_s, ..], Some(held_m)) = (run.t_s.as_slice(), run.position_m.first())
    else {
        return Vec::new();
    };
    let interval_s = second_s - first_s;
    let missing = libm::floor(((first_s - from_s) / interval_s).max(0.0)) as usize;
    let held = (1..=missing).rev();
    held.map(|ago| (first_s - ago as f64 * interval_s, held_m.to_vec()))
        .collect()
}

/// The onset told last in the first half of the training part's movements, later than the true one: median, and the
/// standard deviation of a Gaussian that has its median distance.
fn onset_error(
    set: &Set,
    training: &[usize],
    config: &OnsetConfig,
) -> Result<(f64, f64), ExperimentError> {
    let mut late_s = Vec::with_capacity(training.len());
    for &movement in training {
        let start_s = set.demonstrations()[movement].t_s()[0];
        let mut detector = OnsetDetector::new(config)?;
        let mut last = None;
        for (time_s, values) in stream(set, movement, 0.5) {
            if let [x, y, z, ..] = values.as_slice()
                && let Some(MotionEdge::Onset { at_s }) = detector.step(time_s, [*x, *y, *z])?
            {
                last = Some(at_s - start_s);
            }
        }
        late_s.extend(last);
    }
    if late_s.is_empty() {
        let TempoConfig {
            onset_late_s,
            onset_std_s,
            ..
        } = TempoConfig::default();
        return Ok((onset_late_s, onset_std_s));
    }
    let middle = median(&late_s);
    let distances: Vec<f64> = late_s.iter().map(|late| (late - middle).abs()).collect();
    Ok((middle, SPREAD * median(&distances)))
}

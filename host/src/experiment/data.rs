//! Demonstrations and new motions of the three experiments, recorded through the whole chain: twelve DoFs in the order
//! of [`DOFS`], human position and stiffness as tracked and streamed, robot position and stiffness as shown by
//! teleoperation ([`operator`](crate::simulate::operator)).
//!
//! Demonstrations and new motions of one seed are different sittings: electrodes, tracker, links and muscles are
//! drawn anew.

mod paced;

pub use paced::{Paced, paced_hand_over, paced_objects, paced_pick_and_place};

use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use super::figures::Envelopes;
use super::{Config, ExperimentError};
use crate::demonstration::Demonstration;
use crate::link::simulated::LinkConditions;
use crate::model::{Dof, Hyperparameters, Model, Predictive, Shrinkage, Valid};
use crate::session::DOFS;
use crate::simulate::muscle::CHANNEL_NAMES;
use crate::simulate::operator::{Teleoperated, teleoperated};
use crate::simulate::rig::RigConfig;
use crate::simulate::signals::{self, Signals};
use crate::simulate::skills::{Skill, pull_along, with_object_anywhere};
use crate::simulate::tracker::TrackerNoise;
use crate::simulate::wearer::{Action, Task};
use tonus_shared::promp::Basis;

/// Demonstrations of each object and of each case of the hand-over.
const EACH: usize = 10;
/// Cases of the hand-over.
const CASES: usize = 3;
/// Demonstrations of each of reach, pick and place.
const ACTIONS_EACH: usize = 50;
/// Keep the seeds of the sittings apart.
const NEW_SITTING: u64 = 0x6e65_7700;
const BIASED_SITTING: u64 = 0x6269_6173;
const ENVELOPE_SITTING: u64 = 0x656e_7665;
const SECOND_PASS: u64 = 0x7465_6c65;
/// Jitter of the tracker without its slow bias: what the hand-over and pick-and-place are recorded with.
pub const JITTER: TrackerNoise = TrackerNoise {
    bias_sd_m: 0.0,
    ..TrackerNoise::STATED
};

/// The signals of all experiments, in the order of a demonstration's values.
#[must_use]
pub fn dofs() -> Vec<Dof> {
    let of_name = |name: &str| {
        if name.contains("_k") {
            Dof::stiffness(name)
        } else {
            Dof::position(name)
        }
    };
    DOFS.into_iter().map(of_name).collect()
}

/// How all experiments learn: 30 functions for each DoF, shrinkage and degrees of freedom by leave-one-out likelihood.
///
/// # Errors
/// A basis or hyperparameters out of range: none.
pub fn hyperparameters() -> Result<Valid, ExperimentError> {
    let basis = Basis::gaussian(super::BASIS_FUNCTIONS)?;
    Ok(Hyperparameters::new(dofs(), basis).check()?)
}

/// The same with the shrinkage and degrees of freedom that were chosen for `model`.
///
/// # Errors
/// As [`hyperparameters`].
pub fn as_chosen(model: &Model) -> Result<Valid, ExperimentError> {
    let parts = model.parts();
    let given = Hyperparameters {
        shrinkage: Shrinkage::Fixed {
            pooled: parts.pooled_share,
            diagonal: parts.diagonal_share,
        },
        predictive: Predictive::Fixed {
            freedom: parts.freedom.first().copied().flatten(),
        },
        ..hyperparameters()?.get().clone()
    };
    Ok(given.check()?)
}

/// Ten lifts of each object under the tracker's stated noise, labelled `lift_filter`, `lift_book`, `lift_bottle`.
///
/// # Errors
/// [`ExperimentError`]: the rig, or a movement of which nothing was recorded.
pub fn objects(config: &Config) -> Result<Vec<Demonstration>, ExperimentError> {
    lifts(EACH, TrackerNoise::STATED, config.seed, config)
}

/// New lifts, `each` of each object, in another sitting.
///
/// # Errors
/// As [`objects`].
pub fn new_objects(each: usize, config: &Config) -> Result<Vec<Demonstration>, ExperimentError> {
    lifts(
        each,
        TrackerNoise::STATED,
        config.seed ^ NEW_SITTING,
        config,
    )
}

fn lifts(
    each: usize,
    noise: TrackerNoise,
    seed: u64,
    config: &Config,
) -> Result<Vec<Demonstration>, ExperimentError> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut skills: Vec<_> = (0..each).flat_map(|_| Skill::LIFTS).collect();
    skills.shuffle(&mut rng);
    let actions = skills.into_iter().enumerate().map(|(trial, skill)| {
        let action = Action::sample(skill, &mut rng);
        (action, trial.to_string())
    });
    record(actions.collect(), noise, seed, config)
}

/// Raw sEMG and envelopes of one lift of each object.
///
/// # Errors
/// As [`objects`].
pub fn lift_envelopes(config: &Config) -> Result<Vec<Envelopes>, ExperimentError> {
    let seed = config.seed ^ ENVELOPE_SITTING;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let actions = Skill::LIFTS.map(|skill| Action::sample(skill, &mut rng));
    let recorded = signals::record(&actions.map(Task::Perform), &rig(JITTER, seed, config))?;
    let of = |(action, of): (Action, Signals)| Envelopes {
        performed: action.skill.label().to_owned(),
        channels: CHANNEL_NAMES.map(str::to_owned).to_vec(),
        raw_t_s: of.raw_t_s,
        raw_v: of.raw_v,
        t_s: of.t_s,
        envelope: of.envelope,
    };
    Ok(actions.into_iter().zip(recorded).map(of).collect())
}

/// Ten pulls along each of three lines, in turn, labelled `pull_band`, with trials `case 1, 1` to `case 3, 10`.
///
/// # Errors
/// As [`objects`].
pub fn hand_over(config: &Config) -> Result<Vec<Demonstration>, ExperimentError> {
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    let trials = (1..=EACH).flat_map(|trial| (0..CASES).map(move |case| (case, trial)));
    let actions = trials.map(|(case, trial)| {
        let name = format!("case {}, {trial}", case + 1);
        (pull(case as f64, &mut rng), name)
    });
    record(actions.collect(), JITTER, config.seed, config)
}

/// New pulls: `each` along each case, as many altogether evenly between the cases, in another sitting. Trials are named
/// by where they were sent: `case 1`, `between 1.374`.
///
/// # Errors
/// As [`objects`].
pub fn new_hand_over(each: usize, config: &Config) -> Result<Vec<Demonstration>, ExperimentError> {
    let seed = config.seed ^ NEW_SITTING;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut cases: Vec<(f64, bool)> = (0..each * CASES)
        .flat_map(|n| {
            let between = rng.random_range(0.0..(CASES - 1) as f64);
            [((n % CASES) as f64, false), (between, true)]
        })
        .collect();
    cases.shuffle(&mut rng);
    let actions = cases
        .into_iter()
        .map(|(case, between)| (pull(case, &mut rng), line_name(case, between)));
    record(actions.collect(), JITTER, seed, config)
}

/// The paper's six new motions: numbers 1, 3 and 5 along the demonstrated cases, 2, 4 and 6 between them (half-way, half-way,
/// and a quarter of the way from the third to the second).
///
/// # Errors
/// As [`objects`].
pub fn six_hand_overs(config: &Config) -> Result<Vec<Demonstration>, ExperimentError> {
    let seed = config.seed ^ NEW_SITTING.rotate_left(8);
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let cases = [0.0, 0.5, 1.0, 1.5, 2.0, 1.75]
        .map(|case: f64| (pull(case, &mut rng), line_name(case, case.fract() != 0.0)));
    record(cases.to_vec(), JITTER, seed, config)
}

/// New pulls before a tracker with its slow bias, `each` along each case.
///
/// # Errors
/// As [`objects`].
pub fn biased_hand_over(
    each: usize,
    config: &Config,
) -> Result<Vec<Demonstration>, ExperimentError> {
    let seed = config.seed ^ BIASED_SITTING;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let actions = (0..each * CASES).map(|n| {
        let case = (n % CASES) as f64;
        (pull(case, &mut rng), line_name(case, false))
    });
    record(actions.collect(), TrackerNoise::STATED, seed, config)
}

fn pull(case: f64, rng: &mut ChaCha8Rng) -> Action {
    let latent = pull_along(case, rng);
    Action::with_latent(Skill::Pull, latent, rng)
}

/// Lines count from 1, as the paper's cases do.
fn line_name(case: f64, between: bool) -> String {
    let kind = if between { "between" } else { "case" };
    format!("{kind} {:.3}", case + 1.0)
}

/// Fifty each of `reach`, `pick` and `place`, in turn.
///
/// # Errors
/// As [`objects`].
pub fn pick_and_place(config: &Config) -> Result<Vec<Demonstration>, ExperimentError> {
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    let skills = (0..ACTIONS_EACH).flat_map(|_| Skill::PICK_AND_PLACE);
    let actions = skills.enumerate().map(|(trial, skill)| {
        let latent = with_object_anywhere(skill, &mut rng);
        let action = Action::with_latent(skill, latent, &mut rng);
        (action, trial.to_string())
    });
    record(actions.collect(), JITTER, config.seed, config)
}

fn rig(noise: TrackerNoise, seed: u64, config: &Config) -> RigConfig {
    let link = LinkConditions {
        loss: config.loss,
        ..LinkConditions::default()
    };
    RigConfig {
        noise,
        up: link,
        down: link,
        seed,
    }
}

/// Both passes of every action: the person's before a tracker with `noise`, the operator's without its bias.
fn record(
    actions: Vec<(Action, String)>,
    noise: TrackerNoise,
    seed: u64,
    config: &Config,
) -> Result<Vec<Demonstration>, ExperimentError> {
    let (actions, names): (Vec<_>, Vec<_>) = actions.into_iter().unzip();
    let person = rig(noise, seed, config);
    let operator = rig(JITTER, seed ^ SECOND_PASS, config);
    let recorded = teleoperated(&actions, &person, &operator)?;
    let named = recorded.into_iter().zip(&actions).zip(names).enumerate();
    let named = named.map(|(trial, ((recording, action), name))| {
        let Teleoperated { t_s, values } = recording;
        named_movement(action.skill, trial, name, t_s, values)
    });
    named.collect()
}

fn named_movement(
    skill: Skill,
    trial: usize,
    name: String,
    t_s: Vec<f64>,
    values: Vec<Vec<f64>>,
) -> Result<Demonstration, ExperimentError> {
    Demonstration::new(skill.label(), name, "simulated wearer", t_s, values)
        .map_err(|source| ExperimentError::Demonstration { trial, source })
}

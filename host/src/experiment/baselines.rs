//! Other methods on the data of the three experiments, and on positions of real people: one table each.

use serde::Serialize;

use super::look::{HAND, HAND_STIFFNESS, Look, ROBOT, ROBOT_STIFFNESS, STIFFNESS_SIGMA};
use super::{Config, ExperimentError, Progress, data};
use crate::baseline::{Protocol, Roles, Row, compare, cross_validate};
use crate::demonstration::Demonstration;
use crate::model::Valid;
use crate::simulate::tracker::TrackerNoise;

/// Folds of pick-and-place: what is tested had no part in what it is tested on.
const FOLDS: usize = 5;
/// Observations of each movement that is to be recognised.
const OBSERVATIONS: usize = 10;
/// Phases that the hand-over is observed at, scheme (c).
const LAST_FOUR: [f64; 4] = [0.7, 0.8, 0.9, 1.0];

/// How many movements the methods are tried on.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sizes {
    /// New pulls along each of the three cases; as many lie between the cases.
    pub pulls_each: usize,
    /// New lifts of each object.
    pub lifts_each: usize,
    /// Folds of pick-and-place, at least 2.
    pub folds: usize,
}

impl Default for Sizes {
    fn default() -> Self {
        Self {
            pulls_each: 17,
            lifts_each: 34,
            folds: FOLDS,
        }
    }
}

/// One table for each experiment.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Baselines {
    /// New pulls, scheme (c): hand x-y and stiffness at 1.4, 1.6, 1.8 and 2 s. One skill, nothing to recognise.
    pub hand_over: Vec<Row>,
    /// New lifts of three objects, ten observations over the whole movement, the tracker with its bias.
    pub object_matching: Vec<Row>,
    /// Reach, pick and place, cross-validated, ten observations over the first half.
    pub pick_and_place: Vec<Row>,
}

/// All methods on the three experiments' data.
///
/// # Errors
/// [`ExperimentError`] says which part failed.
pub fn run(
    config: &Config,
    sizes: &Sizes,
    progress: &mut dyn FnMut(Progress),
) -> Result<Baselines, ExperimentError> {
    let mut step = 0;
    let mut next = |what| {
        progress(Progress {
            what,
            done: step,
            total: 3,
        });
        step += 1;
    };
    next("other methods: hand-over");
    let pulls = compare(
        &data::hand_over(config)?,
        &data::new_hand_over(sizes.pulls_each, config)?,
        &Protocol {
            observed: [&HAND[..2], &HAND_STIFFNESS[..]].concat(),
            ..protocol(&LAST_FOUR, config)?
        },
    )?;
    next("other methods: object matching");
    let whole = Look::spaced(OBSERVATIONS, 1.0, true).phases;
    let lifts = compare(
        &data::objects(config)?,
        &data::new_objects(sizes.lifts_each, config)?,
        &protocol(&whole, config)?,
    )?;
    next("other methods: pick and place");
    let half = Look::spaced(OBSERVATIONS, 0.5, true).phases;
    let actions = cross_validate(
        &data::pick_and_place(config)?,
        sizes.folds,
        &protocol(&half, config)?,
    )?;
    Ok(Baselines {
        hand_over: pulls,
        object_matching: lifts,
        pick_and_place: actions,
    })
}

/// Recognition of recorded positions, `observations` in the first `fraction` of each movement, by models of `train`.
///
/// # Errors
/// As [`compare`].
pub fn of_positions(
    train: &[Demonstration],
    test: &[Demonstration],
    valid: &Valid,
    (observations, fraction, sigma_m): (usize, f64, f64),
) -> Result<Vec<Row>, ExperimentError> {
    let protocol = Protocol {
        observed: (0..valid.get().dofs.len()).collect(),
        valid: valid.clone(),
        phases: Look::spaced(observations, fraction, false).phases,
        sigma_m,
        sigma_share: STIFFNESS_SIGMA,
        noise_m: 0.0,
        seed: 0,
        roles: None,
    };
    Ok(compare(train, test, &protocol)?)
}

/// Hand and its stiffness at these phases, as the experiments observe them.
fn protocol(phases: &[f64], config: &Config) -> Result<Protocol, ExperimentError> {
    Ok(Protocol {
        valid: data::hyperparameters()?,
        observed: [HAND, HAND_STIFFNESS].concat(),
        phases: phases.to_vec(),
        sigma_m: TrackerNoise::STATED.jitter_sd_m,
        sigma_share: STIFFNESS_SIGMA,
        noise_m: 0.0,
        seed: config.seed,
        roles: Some(Roles {
            hand: HAND,
            robot: ROBOT,
            robot_stiffness: ROBOT_STIFFNESS,
            // The person sits opposite: their forward and their left are the robot's back and right.
            facing: [-1.0, -1.0, 1.0],
        }),
    })
}

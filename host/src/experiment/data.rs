//! Demonstrations and new motions of the three experiments, recorded through the whole chain: twelve DoFs in the order
//! of [`DOFS`], human position and stiffness as tracked and streamed, robot position and stiffness as shown.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;

use super::{Config, ExperimentError};
use crate::demonstration::Demonstration;
use crate::link::simulated::LinkConditions;
use crate::model::Dof;
use crate::session::DOFS;
use crate::simulate::demonstrations::{self, Row};
use crate::simulate::rig::RigConfig;
use crate::simulate::skills::Skill;
use crate::simulate::tracker::TrackerNoise;
use crate::simulate::wearer::Action;

/// Demonstrations of each object and of each case of the hand-over.
const EACH: usize = 10;

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

/// Ten lifts of each object, labelled `lift_filter`, `lift_book`, `lift_bottle`.
///
/// # Errors
/// [`ExperimentError`]: the rig, or a movement of which nothing was recorded.
pub fn objects(config: &Config) -> Result<Vec<Demonstration>, ExperimentError> {
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    let lifts = (0..EACH).flat_map(|_| Skill::LIFTS);
    let actions: Vec<_> = lifts.map(|skill| Action::sample(skill, &mut rng)).collect();
    record(&actions, config)
}

fn record(actions: &[Action], config: &Config) -> Result<Vec<Demonstration>, ExperimentError> {
    let link = LinkConditions {
        loss: config.loss,
        ..LinkConditions::default()
    };
    let rig = RigConfig {
        noise: TrackerNoise::STATED,
        up: link,
        down: link,
        seed: config.seed,
    };
    let recorded = demonstrations::record(actions, &rig)?;
    let named = recorded.iter().enumerate().map(|(trial, recording)| {
        let t_s = recording.rows.iter().map(|row| row.t_s).collect();
        let series = |dof: usize| recording.rows.iter().map(|row| values(row)[dof]).collect();
        let values = (0..DOFS.len()).map(series).collect();
        let label = recording.action.skill.label();
        Demonstration::new(label, trial.to_string(), "simulated wearer", t_s, values)
            .map_err(|source| ExperimentError::Demonstration { trial, source })
    });
    named.collect()
}

/// A recorded instant in the order of [`DOFS`].
fn values(row: &Row) -> [f64; DOFS.len()] {
    let [hx, hy, hz] = row.human_m;
    let [hkx, hky, hkz] = row.human_n_per_m;
    let [rx, ry, rz] = row.robot.position_m;
    let [rkx, rky, rkz] = row.robot.stiffness_n_per_m;
    [hx, hy, hz, hkx, hky, hkz, rx, ry, rz, rkx, rky, rkz]
}

//! Movements whose start is announced: the recording is cut there, only the duration is unknown.

use super::super::choose::Chosen;
use super::super::data::Set;
use super::super::look::floored;
use super::super::parts::Fold;
use super::super::setting::{Phase, Setting};
use super::{DURATIONS, FRACTIONS, Onset, Said};
use crate::demonstration::Demonstration;
use crate::experiment::ExperimentError;
use crate::experiment::statistics::median;
use crate::model::stacking::mixed;
use crate::model::tempo::{TempoConfig, TempoRecogniser};

/// How the hand is followed.
#[derive(Debug, Clone, Copy)]
pub(in super::super) struct Following {
    tempo: TempoConfig,
    /// One observation so often.
    interval_s: f64,
}

impl Following {
    /// How often is observed, from the training part alone.
    pub(super) fn of(set: &Set, training: &[usize]) -> Self {
        let of_training = training
            .iter()
            .map(|&i| set.demonstrations()[i].duration_s());
        let durations: Vec<f64> = of_training.collect();
        let steps = set.plan.observations.max(2) - 1;
        Self {
            tempo: TempoConfig {
                durations: DURATIONS,
                onsets: 1,
                onset_std_s: 0.0,
                lead_s: 0.0,
                ..TempoConfig::default()
            },
            interval_s: median(&durations) / steps as f64,
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
            let movement = &set.demonstrations()[movement];
            let of_skills = follow(&mut recogniser, following, movement, *sigma_m)?;
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
    let mut said = Said::none(Onset::Announced);
    for (&movement, posteriors) in fold.tested.iter().zip(&posteriors) {
        let mut together = [const { Vec::new() }; 3];
        for (together, posteriors) in together.iter_mut().zip(posteriors) {
            *together = mixed(&weights, posteriors)?;
        }
        said.take(&classes, together, set.demonstrations()[movement].class());
    }
    Ok(said)
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

/// Log posterior of the skills after each fraction of a movement, with so much noise assumed.
fn follow(
    recogniser: &mut TempoRecogniser<'_>,
    following: &Following,
    movement: &Demonstration,
    sigma_m: f64,
) -> Result<[Vec<f64>; 3], ExperimentError> {
    recogniser.end();
    let (start_s, duration_s) = (movement.t_s()[0], movement.duration_s());
    recogniser.begin(start_s)?;
    let mut next_s = f64::NEG_INFINITY;
    let mut said: [Option<Vec<f64>>; 3] = [const { None }; 3];
    for (sample, &time_s) in movement.t_s().iter().enumerate() {
        for (said, fraction) in said.iter_mut().zip(FRACTIONS) {
            if said.is_none() && time_s > start_s + fraction * duration_s + 1e-9 {
                *said = Some(recogniser.log_posterior());
            }
        }
        if time_s >= next_s {
            next_s = time_s + following.interval_s - 1e-3;
            for (dof, series) in movement.values().iter().enumerate() {
                recogniser.observe(dof, time_s, series[sample], sigma_m)?;
            }
        }
    }
    Ok(said.map(|said| said.unwrap_or_else(|| recogniser.log_posterior())))
}

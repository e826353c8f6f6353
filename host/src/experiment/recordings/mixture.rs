//! Recognisers of several settings that answer together.

use super::choose::{Chosen, Member};
use super::data::Set;
use super::look::{Look, floored};
use crate::demonstration::Demonstration;
use crate::experiment::ExperimentError;
use crate::model::Model;
use crate::model::calibration::Forecast;
use crate::model::evaluate::EvaluateError;
use crate::model::recognise::Recogniser;
use crate::model::stacking;

/// A model for each member, learnt from the same demonstrations.
pub(super) fn learn(
    set: &Set,
    chosen: &Chosen,
    training: &[usize],
) -> Result<Vec<Model>, ExperimentError> {
    let members = chosen.mixture.iter();
    members
        .map(|member| set.learn(&member.setting, training))
        .collect()
}

/// Who answers.
pub(super) struct Ensemble<'m> {
    set: &'m Set,
    members: Vec<(&'m Member, Recogniser<'m>)>,
}

/// After some of a movement.
pub(super) struct Seen {
    pub(super) time_s: f64,
    /// Share of the movement.
    pub(super) share: f64,
    pub(super) forecast: Forecast,
}

impl<'m> Ensemble<'m> {
    /// The members of `chosen` with their recognisers, in their order.
    pub(super) fn new(set: &'m Set, chosen: &'m Chosen, recognisers: Vec<Recogniser<'m>>) -> Self {
        Self {
            set,
            members: chosen.mixture.iter().zip(recognisers).collect(),
        }
    }

    /// What is said at the end of the look by the members tempered, and as they are.
    pub(super) fn forecast(
        &mut self,
        look: &Look,
        movement: usize,
    ) -> Result<(Forecast, Forecast), ExperimentError> {
        let place = Chosen::place(look.fraction);
        let (mut weights, mut softened, mut raw) = (Vec::new(), Vec::new(), Vec::new());
        let mut true_class = 0;
        for (member, recogniser) in &mut self.members {
            if member.weights[place] <= 0.0 {
                continue;
            }
            let shape = &self.set.at(member.setting.phase)[movement];
            look.watch(recogniser, member.sigma_m, shape, |_, _| Ok(()))?;
            let (posterior, truth) = over_classes(recogniser, shape)?;
            weights.push(member.weights[place]);
            softened.push(member.softening[place].soften(&posterior));
            raw.push(posterior);
            true_class = truth;
        }
        Ok((
            mixed(&weights, &softened, true_class)?,
            mixed(&weights, &raw, true_class)?,
        ))
    }

    /// What is said after each instant. Those who see the movement by path have seen another part of it than those by
    /// time; the answer is given when the later of both was seen.
    pub(super) fn stream(
        &mut self,
        look: &Look,
        movement: usize,
    ) -> Result<Vec<Seen>, ExperimentError> {
        let mut instants: Vec<Instant> = Vec::new();
        let mut true_class = 0;
        for (number, (member, recogniser)) in self.members.iter_mut().enumerate() {
            let phase = member.setting.phase;
            let shape = &self.set.at(phase)[movement];
            let mut step = 0;
            look.watch(recogniser, member.sigma_m, shape, |share, seen| {
                let (posterior, truth) = over_classes(seen, shape)?;
                true_class = truth;
                if number == 0 {
                    instants.push(Instant {
                        share,
                        ..Instant::default()
                    });
                }
                if let Some(instant) = instants.get_mut(step) {
                    let place = Chosen::place(instant.share);
                    let weight = member.weights[place];
                    if weight > 0.0 {
                        let time_s = self.set.time_s(movement, phase, share);
                        instant.time_s = instant.time_s.max(time_s);
                        instant.weights.push(weight);
                        let softened = member.softening[place].soften(&posterior);
                        instant.posteriors.push(softened);
                    }
                }
                step += 1;
                Ok(())
            })?;
        }
        let seen = instants.into_iter().map(|instant| {
            Ok(Seen {
                time_s: instant.time_s,
                share: instant.share,
                forecast: mixed(&instant.weights, &instant.posteriors, true_class)?,
            })
        });
        seen.collect()
    }
}

/// What the members make of a movement at one instant.
#[derive(Default)]
struct Instant {
    share: f64,
    time_s: f64,
    weights: Vec<f64>,
    posteriors: Vec<Vec<f64>>,
}

/// The mixture of posteriors as a forecast.
pub(super) fn mixed(
    weights: &[f64],
    posteriors: &[Vec<f64>],
    truth: usize,
) -> Result<Forecast, ExperimentError> {
    Ok(Forecast::new(stacking::mixed(weights, posteriors)?, truth)?)
}

/// Log posterior over classes, and which the movement is. None is held impossible.
pub(super) fn over_classes(
    recogniser: &Recogniser<'_>,
    movement: &Demonstration,
) -> Result<(Vec<f64>, usize), ExperimentError> {
    let model = recogniser.model();
    let classes = model.classes();
    let truth = classes.iter().position(|class| *class == movement.class());
    let truth = truth.ok_or_else(|| EvaluateError::Unknown {
        file: movement.file().to_owned(),
        label: movement.class().to_owned(),
        known: classes.iter().map(|class| (*class).to_owned()).collect(),
    })?;
    let posterior = model.class_log_posterior(&recogniser.log_posterior());
    let posterior = posterior.into_iter().map(|log| floored(log).min(0.0));
    Ok((posterior.collect(), truth))
}

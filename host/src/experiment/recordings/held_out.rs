//! What was said of movements that nothing was learnt from or chosen on.

use rayon::prelude::*;

use super::choose::Chosen;
use super::data::Set;
use super::look::{Look, score};
use super::mixture::{self, Ensemble};
use super::parts::{Fold, Part};
use super::unknown_tempo::{self, Following, InRuns, UnknownTempo};
use super::{At, CONFIDENCE, Decisions, FRACTIONS};
use crate::experiment::{Config, ExperimentError, Score};
use crate::model::Model;
use crate::model::calibration::{Decision, Early, Forecast, decide};
use crate::model::recognise::Recogniser;

/// Most observations of their sweep.
const OBSERVATIONS: usize = 10;
/// Most noise of its sweep, centimetres.
const NOISE_CM: u32 = 5;

/// Forecasts, tempered unless they are `raw`: neither the mixture nor its members are.
#[derive(Debug, Default)]
pub(super) struct Held {
    /// At each of the fractions.
    pub(super) raw: [Vec<Forecast>; 4],
    pub(super) tempered: [Vec<Forecast>; 4],
    observations: Vec<Vec<Forecast>>,
    noises: Vec<Vec<Forecast>>,
    decisions: Vec<(Option<Decision>, usize)>,
    training: Vec<Forecast>,
    tempo: Option<unknown_tempo::Said>,
    in_runs: Vec<InRuns>,
}

/// Everything that is tested.
pub(super) fn test(
    set: &Set,
    parts: &[Part],
    chosen: &[Chosen],
    config: &Config,
) -> Result<Held, ExperimentError> {
    let followings = parts.iter().map(|part| Following::of(set, part));
    let followings = followings.collect::<Result<Vec<_>, _>>()?;
    let mut tests = Vec::new();
    for ((part, chosen), following) in parts.iter().zip(chosen).zip(&followings) {
        let of_part = part.tests.iter().enumerate();
        tests.extend(of_part.map(|(place, fold)| (fold, chosen, following, place == 0)));
    }
    let one = |(fold, chosen, following, first): (&Fold, &Chosen, &Following, bool)| {
        let mut held = Held::default();
        let shown = Shown {
            set,
            chosen,
            config,
        };
        held.one(&shown, fold, first)?;
        held.tempo = Some(following.said(set, chosen, fold)?);
        Ok(held)
    };
    let helds: Result<Vec<Held>, ExperimentError> = tests.into_par_iter().map(one).collect();
    let mut all = Held::default();
    for held in helds? {
        all.add(held);
    }
    let in_runs = followings.iter().filter_map(Following::chosen);
    all.in_runs = in_runs.cloned().collect();
    Ok(all)
}

/// How movements are shown.
struct Shown<'a> {
    set: &'a Set,
    chosen: &'a Chosen,
    config: &'a Config,
}

impl Shown<'_> {
    fn look(&self, observations: usize, fraction: f64, noise_m: f64, movement: usize) -> Look {
        Look {
            observations,
            fraction,
            noise_m,
            seed: self
                .config
                .seed
                .wrapping_mul(1_000_003)
                .wrapping_add(movement as u64),
        }
    }
}

impl Held {
    /// One model, and what is tested on it; `training`: what it was learnt from, too.
    fn one(
        &mut self,
        shown: &Shown<'_>,
        fold: &Fold,
        training: bool,
    ) -> Result<(), ExperimentError> {
        let Shown { set, chosen, .. } = *shown;
        let models = mixture::learn(set, chosen, &fold.learned)?;
        let views: Vec<_> = models.iter().map(Model::view).collect::<Result<_, _>>()?;
        let recognisers = models.iter().zip(&views);
        let recognisers = recognisers.map(|(model, view)| Recogniser::new(model, view));
        let mut mixture = Ensemble::new(set, chosen, recognisers.collect::<Result<_, _>>()?);
        let count = set.plan.observations;
        self.observations.resize(OBSERVATIONS, Vec::new());
        self.noises.resize(NOISE_CM as usize + 1, Vec::new());
        for &i in &fold.tested {
            let mut say =
                |look: Look, fraction: f64| -> Result<(Forecast, Forecast), ExperimentError> {
                    let (tempered, raw) = mixture.forecast(&look, i)?;
                    Ok((chosen.tempering(fraction).softened(&tempered), raw))
                };
            for (place, fraction) in FRACTIONS.into_iter().enumerate() {
                let (tempered, raw) = say(shown.look(count, fraction, 0.0, i), fraction)?;
                self.tempered[place].push(tempered);
                self.raw[place].push(raw);
            }
            for (number, said) in (1..).zip(&mut self.observations) {
                said.push(say(shown.look(number, 1.0, 0.0, i), 1.0)?.0);
            }
            for (cm, said) in (0_u32..).zip(&mut self.noises) {
                let noise_m = 0.01 * f64::from(cm);
                said.push(say(shown.look(count, 1.0, noise_m, i), 1.0)?.0);
            }
            self.decisions.push(decided(shown, &mut mixture, i)?);
        }
        if training {
            for &i in &fold.learned {
                let look = shown.look(count, 1.0, 0.0, i);
                let (tempered, _) = mixture.forecast(&look, i)?;
                self.training
                    .push(chosen.tempering(1.0).softened(&tempered));
            }
        }
        Ok(())
    }

    fn add(&mut self, other: Self) {
        extend(&mut self.raw, other.raw);
        extend(&mut self.tempered, other.tempered);
        self.observations.resize(OBSERVATIONS, Vec::new());
        self.noises.resize(NOISE_CM as usize + 1, Vec::new());
        extend(&mut self.observations, other.observations);
        extend(&mut self.noises, other.noises);
        self.decisions.extend(other.decisions);
        self.training.extend(other.training);
        match (&mut self.tempo, other.tempo) {
            (Some(tempo), Some(other)) => tempo.add(other),
            (tempo, other) => *tempo = tempo.take().or(other),
        }
    }

    pub(super) fn training(&self) -> Score {
        score(&self.training)
    }

    pub(super) fn by_fraction(&self) -> Vec<At> {
        sweep(FRACTIONS, &self.tempered)
    }

    pub(super) fn by_observations(&self) -> Vec<At> {
        sweep((1_u32..).map(f64::from), &self.observations)
    }

    pub(super) fn by_noise_m(&self) -> Vec<At> {
        sweep((0_u32..).map(|cm| 0.01 * f64::from(cm)), &self.noises)
    }

    pub(super) fn decisions(&self) -> Decisions {
        let early = Early::of(&self.decisions);
        Decisions {
            confidence: CONFIDENCE,
            total: early.total,
            decided: early.decided,
            wrong: early.wrong,
            median_time_s: early.median_time_s,
        }
    }

    pub(super) fn unknown_tempo(&self) -> UnknownTempo {
        self.tempo
            .as_ref()
            .map(|said| said.scores(self.in_runs.clone()))
            .unwrap_or_default()
    }
}

/// When the observations of the whole movement, one after the other, make a class probable enough.
fn decided(
    shown: &Shown<'_>,
    mixture: &mut Ensemble<'_>,
    movement: usize,
) -> Result<(Option<Decision>, usize), ExperimentError> {
    let look = shown.look(shown.set.plan.observations, 1.0, 0.0, movement);
    let seen = mixture.stream(&look, movement)?;
    let truth = seen.first().map_or(0, |seen| seen.forecast.truth());
    let stream = seen.iter().map(|seen| {
        let tempered = shown.chosen.tempering(seen.share).softened(&seen.forecast);
        (seen.time_s, tempered.log_posterior().to_vec())
    });
    Ok((decide(stream, CONFIDENCE)?, truth))
}

fn extend(all: &mut [Vec<Forecast>], more: impl IntoIterator<Item = Vec<Forecast>>) {
    for (all, more) in all.iter_mut().zip(more) {
        all.extend(more);
    }
}

fn sweep(at: impl IntoIterator<Item = f64>, forecasts: &[Vec<Forecast>]) -> Vec<At> {
    let points = at.into_iter().zip(forecasts);
    points
        .map(|(at, forecasts)| At {
            at,
            score: score(forecasts),
        })
        .collect()
}

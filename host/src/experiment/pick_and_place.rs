//! Section 3.3: reach, pick and place, 50 demonstrations each, recognised from ten observations.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::bands::{figure, infer};
use super::figures::{Inference, Trace};
use super::look::{Answers, Look, Looks, answer, recognise, score};
use super::tempo::{self, UnknownTempo};
use super::widths::NOMINAL;
use super::{Config, ExperimentError, Point, Progress, Score, Sweeps, data};
use crate::demonstration::Demonstration;
use crate::model::cluster::{ClusterConfig, adjusted_rand_index, cluster};
use crate::model::recognise::Recogniser;
use crate::model::{Model, Valid, learn};
use crate::simulate::skills::Skill;

/// What was found.
#[derive(Debug, Clone, Serialize)]
pub struct PickAndPlace {
    /// Ten observations over the whole of each demonstration, by a model of all the others.
    pub leave_one_out: Score,
    /// Ten observations in the first half, likewise.
    pub first_half: Score,
    /// Three observations over the whole, likewise.
    pub three_observations: Score,
    /// Ten observations by a model of all demonstrations, the one tested among them: what the paper reports, and no
    /// accuracy.
    pub training: Score,
    /// The demonstrations clustered without their labels.
    pub unlabelled: Unlabelled,
    /// Onset and duration of each movement not announced.
    pub unknown_tempo: UnknownTempo,
    /// Over what is observed, each by models that were learnt without the demonstration tested.
    #[serde(flatten)]
    pub sweeps: Sweeps,
    /// For the report.
    #[serde(skip)]
    pub figures: Figures,
}

/// Clusters found without labels.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Unlabelled {
    /// How many the program chose.
    pub components: usize,
    /// Agreement with the labels, 1 for the same partition, 0 for what chance gives (Hubert and Arabie 1985).
    pub adjusted_rand_index: f64,
}

/// What the report shows beside the numbers.
#[derive(Debug, Clone, Default)]
pub struct Figures {
    /// The 150 demonstrations (figure 6).
    pub demonstrations: Vec<Demonstration>,
    /// The model of three skills (figure 14; weights for the t-SNE of figure 6 are its demonstrations').
    pub model: Option<Model>,
    /// One Gaussian over all skills: the grey band of figure 14.
    pub single: Option<Model>,
    /// One reach, held out: recognition over its observations (figure 15).
    pub traces: Vec<Trace>,
    /// The same reach: inferred against recorded after 1, 3, 5 and 10 observations (figure 15).
    pub inferences: Vec<Inference>,
}

/// Observations of each movement.
const OBSERVATIONS: usize = 10;
/// Observations after which figure 15 shows what is inferred.
const SHOWN_AFTER: [usize; 4] = [1, 3, 5, 10];

/// Runs the experiment. The tracker has its jitter and no slow bias.
///
/// How strongly covariances are shrunk is chosen by leave-one-out likelihood inside each half of the demonstrations,
/// and used for the models that are tested on the other half: what is tested has no part in the choice. Everything
/// else is learnt anew without each demonstration.
///
/// # Errors
/// [`ExperimentError`] says which part failed.
pub fn run(
    config: &Config,
    progress: &mut dyn FnMut(Progress),
) -> Result<PickAndPlace, ExperimentError> {
    let say = |what, done: usize| Progress {
        what,
        done: done as u64,
        total: 200,
    };
    progress(say(
        "pick and place: 150 demonstrations, two passes each",
        0,
    ));
    let demonstrations = data::pick_and_place(config)?;
    progress(say("pick and place: learning from all of them", 20));
    let model = learn(&demonstrations, &data::hyperparameters()?)?;
    let single = learn_as_one(&demonstrations)?;
    let training = {
        let view = model.view()?;
        let mut recogniser = Recogniser::new(&model, &view)?;
        let mut noise = ChaCha8Rng::seed_from_u64(config.seed);
        let whole = Look::spaced(OBSERVATIONS, 1.0, true);
        score(&whole, &mut recogniser, &demonstrations, &mut noise)?
    };
    progress(say("pick and place: choosing the shrinkage", 40));
    let halves = chosen_by_halves(&demonstrations)?;
    let mut held_out = HeldOut::new(config.seed);
    let mut figures = Figures::default();
    for left_out in 0..demonstrations.len() {
        progress(say("pick and place: leaving one out", 50 + left_out));
        let others = without(&demonstrations, left_out);
        let model = learn(&others, &halves[left_out % 2])?;
        let view = model.view()?;
        let mut recogniser = Recogniser::new(&model, &view)?;
        let movement = &demonstrations[left_out];
        held_out.test(&mut recogniser, movement)?;
        if left_out == 0 {
            held_out.show(&mut recogniser, movement, &mut figures)?;
        }
    }
    let sweeps = held_out.sweeps();
    let paced = data::paced_pick_and_place(tempo::NEW_EACH, tempo::MARGIN_S, config)?;
    let unknown_tempo = tempo::recognised(&demonstrations, &paced)?;
    Ok(PickAndPlace {
        leave_one_out: at(&sweeps.by_fraction, 1.0),
        first_half: at(&sweeps.by_fraction, 0.5),
        three_observations: at(&sweeps.by_observations, 3.0),
        training,
        unlabelled: unlabelled(&demonstrations, config.seed)?,
        unknown_tempo,
        sweeps,
        figures: Figures {
            demonstrations,
            model: Some(model),
            single: Some(single),
            ..figures
        },
    })
}

/// With sEMG, at this point of a sweep.
fn at(points: &[Point], at: f64) -> Score {
    let found = points.iter().find(|point| point.at.total_cmp(&at).is_eq());
    found.map_or_else(Score::default, |point| point.with_semg)
}

fn without(demonstrations: &[Demonstration], left_out: usize) -> Vec<Demonstration> {
    let others = demonstrations
        .iter()
        .enumerate()
        .filter(|(index, _)| *index != left_out);
    others
        .map(|(_, demonstration)| demonstration.clone())
        .collect()
}

/// One Gaussian over all skills: every demonstration under one label.
fn learn_as_one(demonstrations: &[Demonstration]) -> Result<Model, ExperimentError> {
    let renamed = demonstrations.iter().enumerate().map(|(trial, d)| {
        let (t_s, values) = (d.t_s().to_vec(), d.values().to_vec());
        Demonstration::new("any", d.trial(), d.file(), t_s, values)
            .map_err(|source| ExperimentError::Demonstration { trial, source })
    });
    let renamed = renamed.collect::<Result<Vec<_>, _>>()?;
    Ok(learn(&renamed, &data::hyperparameters()?)?)
}

/// Clusters of the demonstrations, whose labels are looked at for the agreement alone.
///
/// Objects stand anywhere in a rectangle, so that within a skill movements are spread evenly and some are far from all
/// others: few directions, heavy tails and a stricter count than by default. Set on seeds 1 to 40, of which 38 then give
/// the skills exactly.
fn unlabelled(demonstrations: &[Demonstration], seed: u64) -> Result<Unlabelled, ExperimentError> {
    let given = ClusterConfig {
        seed,
        variance_kept: 0.6,
        freedom: 4.0,
        standard_errors: 2.0,
        ..ClusterConfig::default()
    };
    let none = vec![None; demonstrations.len()];
    let clusters = cluster(demonstrations, &data::hyperparameters()?, &none, &given)?;
    let labels = Skill::PICK_AND_PLACE.map(Skill::label);
    let own = |d: &Demonstration| labels.iter().position(|label| *label == d.label());
    let own: Vec<usize> = demonstrations.iter().filter_map(own).collect();
    Ok(Unlabelled {
        components: clusters.components,
        adjusted_rand_index: adjusted_rand_index(&own, &clusters.assignment).unwrap_or(f64::NAN),
    })
}

/// How to learn models that are tested on even and on odd demonstrations, each chosen on the others. Demonstrations
/// come in turn, so both halves hold as many of each skill.
fn chosen_by_halves(demonstrations: &[Demonstration]) -> Result<[Valid; 2], ExperimentError> {
    let chosen_on = |rest: usize| {
        let half = demonstrations.iter().skip(rest).step_by(2).cloned();
        let half: Vec<_> = half.collect();
        data::as_chosen(&learn(&half, &data::hyperparameters()?)?)
    };
    Ok([chosen_on(1)?, chosen_on(0)?])
}

/// Answers on movements that were left out, at every point of the sweeps.
struct HeldOut {
    looks: Looks,
    /// `[sweep][point][with, without]`.
    answers: [Vec<[Answers; 2]>; 3],
    noise: ChaCha8Rng,
}

impl HeldOut {
    fn new(seed: u64) -> Self {
        let looks = Looks::new(OBSERVATIONS);
        let none = |points: &[(f64, [Look; 2])]| vec![<[Answers; 2]>::default(); points.len()];
        Self {
            answers: [
                none(&looks.by_fraction),
                none(&looks.by_observations),
                none(&looks.by_noise_m),
            ],
            looks,
            noise: ChaCha8Rng::seed_from_u64(seed),
        }
    }

    fn test(
        &mut self,
        recogniser: &mut Recogniser<'_>,
        movement: &Demonstration,
    ) -> Result<(), ExperimentError> {
        let Looks {
            by_fraction,
            by_observations,
            by_noise_m,
        } = &self.looks;
        let sweeps = [by_fraction, by_observations, by_noise_m];
        for (points, answers) in sweeps.into_iter().zip(&mut self.answers) {
            for ((_, looks), both) in points.iter().zip(answers) {
                for (look, of) in looks.iter().zip(both) {
                    of.0.push(recognise(look, recogniser, movement, &mut self.noise)?);
                }
            }
        }
        Ok(())
    }

    /// Figure 15: recognition of one movement over its observations, and what is inferred meanwhile.
    fn show(
        &mut self,
        recogniser: &mut Recogniser<'_>,
        movement: &Demonstration,
        figures: &mut Figures,
    ) -> Result<(), ExperimentError> {
        let whole = Look::spaced(OBSERVATIONS, 1.0, true);
        figures
            .traces
            .push(whole.trace(recogniser, movement, &mut self.noise)?);
        for count in SHOWN_AFTER {
            let look = Look::at(&whole.phases[..count], true);
            let observed = look.of(movement, &mut self.noise);
            look.observe(recogniser, &observed)?;
            let (best, _) = answer(recogniser, movement.label());
            let bands = infer(recogniser, (best, &NOMINAL), movement)?;
            let recognised = &recogniser.model().labels()[best];
            let s = if count == 1 { "" } else { "s" };
            let name = format!("{} after {count} observation{s}", movement.label());
            figures
                .inferences
                .push(figure(name, recognised, movement, (&observed, bands)));
        }
        Ok(())
    }

    fn sweeps(&self) -> Sweeps {
        let points = |looks: &[(f64, [Look; 2])], answers: &[[Answers; 2]]| {
            let point = |((at, _), [with, without]): (&(f64, _), &[Answers; 2])| Point {
                at: *at,
                with_semg: with.score(),
                without_semg: without.score(),
            };
            looks.iter().zip(answers).map(point).collect()
        };
        let [fractions, counts, noises] = &self.answers;
        Sweeps {
            by_fraction: points(&self.looks.by_fraction, fractions),
            by_observations: points(&self.looks.by_observations, counts),
            by_noise_m: points(&self.looks.by_noise_m, noises),
        }
    }
}

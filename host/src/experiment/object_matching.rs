//! Section 3.2: three objects that nearly the same hand path lifts, told apart by the muscles.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;

use super::bands::{Errors, figure, infer, robot_stiffness_ranges};
use super::figures::{Envelopes, Inference, Trace};
use super::look::{Answers, Look, Looks, answer, recognise, score};
use super::tempo::{self, UnknownTempo};
use super::widths::NOMINAL;
use super::{Config, ExperimentError, Point, Progress, Score, Sweeps, data};
use crate::demonstration::Demonstration;
use crate::model::recognise::Recogniser;
use crate::model::{Model, learn};
use crate::simulate::difficulty::BestRecogniser;
use crate::simulate::skills::{DURATION_US, Skill};
use crate::simulate::tracker::{NoiseSource, TrackerNoise};
use crate::statistics::{mean, root_mean_square};

/// What was found.
#[derive(Debug, Clone, Serialize)]
pub struct ObjectMatching {
    /// New trials, ten observations of hand position and stiffness.
    pub with_semg: Score,
    /// The same from positions alone.
    pub without_semg: Score,
    /// Share of the trials that the best possible recogniser from positions gets right: it knows the simulator's
    /// true densities and sees every frame.
    pub best_possible_without_semg: f64,
    /// The demonstrations themselves, with sEMG: what the paper reports, and no accuracy.
    pub training: Score,
    /// Root mean square error of the inferred robot stiffness, where the object was recognised, over the range of the
    /// demonstrated one; mean of the three axes.
    pub robot_stiffness_nrmse: f64,
    /// The same from positions alone, right or wrong.
    pub robot_stiffness_nrmse_without_semg: f64,
    /// Root mean square distance along the robot's path where the object was recognised, metres.
    pub robot_path_rmse_m: f64,
    /// Share of the recorded values inside their pointwise 95 % interval, all DoFs, where recognised.
    pub coverage_95: f64,
    /// Over what is observed.
    #[serde(flatten)]
    pub sweeps: Sweeps,
    /// One biased tracker, one observation (the last) against ten: `[one, ten]`, position and stiffness.
    pub one_against_ten: [Score; 2],
    /// Onset and duration of each lift not announced, with sEMG.
    pub unknown_tempo: UnknownTempo,
    /// For the report.
    #[serde(skip)]
    pub figures: Figures,
}

/// What the report shows beside the numbers.
#[derive(Debug, Clone, Default)]
pub struct Figures {
    /// The 30 demonstrations (figure 12).
    pub demonstrations: Vec<Demonstration>,
    /// One new trial of each object, as inferred with sEMG (figure 13, middle).
    pub with_semg: Vec<Inference>,
    /// The same trials, inferred from positions alone (figure 13, right).
    pub without_semg: Vec<Inference>,
    /// Recognition of those trials over time, with sEMG.
    pub traces: Vec<Trace>,
    /// Raw sEMG and envelopes of one lift of each object (figure 4).
    pub envelopes: Vec<Envelopes>,
    /// The model.
    pub model: Option<Model>,
}

/// New trials of each object.
const NEW_EACH: usize = 100;
/// Observations of each movement.
const OBSERVATIONS: usize = 10;
/// Frames that the best possible recogniser sees: 110 a second for two seconds.
const FRAMES: usize = 220;

/// Runs the experiment: the tracker has its stated noise, a slow bias of 28 mm among it, in demonstrations and trials.
///
/// # Errors
/// [`ExperimentError`] says which part failed.
pub fn run(
    config: &Config,
    progress: &mut dyn FnMut(Progress),
) -> Result<ObjectMatching, ExperimentError> {
    let mut step = 0;
    let mut next = |what| {
        progress(Progress {
            what,
            done: step,
            total: 6,
        });
        step += 1;
    };
    next("object matching: 30 demonstrations, two passes each");
    let demonstrations = data::objects(config)?;
    next("object matching: new trials");
    let new = data::new_objects(NEW_EACH, config)?;
    let envelopes = data::lift_envelopes(config)?;
    next("object matching: learning");
    let model = learn(&demonstrations, &data::hyperparameters()?)?;
    let view = model.view()?;
    let mut asked = Asked {
        recogniser: Recogniser::new(&model, &view)?,
        ranges: robot_stiffness_ranges(&demonstrations),
        noise: ChaCha8Rng::seed_from_u64(config.seed),
    };
    next("object matching: new trials recognised");
    let with = Look::spaced(OBSERVATIONS, 1.0, true);
    let without = Look::spaced(OBSERVATIONS, 1.0, false);
    let (with_semg, right) = asked.trials(&with, &new)?;
    let (without_semg, all) = asked.trials(&without, &new)?;
    let right: Vec<&Errors> = right
        .iter()
        .filter_map(|(errors, right)| right.then_some(errors))
        .collect();
    let one = asked.score(&Look::spaced(1, 1.0, true), &new)?;
    let shown = asked.figures(&new, [&with, &without])?;
    let training = asked.score(&with, &demonstrations)?;
    next("object matching: sweeps");
    let sweeps = asked.sweeps(&new)?;
    next("object matching: at any tempo");
    let paced = data::paced_objects(tempo::NEW_EACH, tempo::MARGIN_S, config)?;
    let unknown_tempo = tempo::recognised(&demonstrations, &paced)?;
    Ok(ObjectMatching {
        with_semg,
        without_semg,
        best_possible_without_semg: best_possible(config.seed)?,
        training,
        robot_stiffness_nrmse: over(right.iter().copied(), |e| e.stiffness),
        robot_stiffness_nrmse_without_semg: over(all.iter().map(|(e, _)| e), |e| e.stiffness),
        robot_path_rmse_m: over(right.iter().copied(), |e| e.path_m),
        coverage_95: mean(&right.iter().map(|e| e.coverage()).collect::<Vec<_>>()),
        sweeps,
        one_against_ten: [one, with_semg],
        unknown_tempo,
        figures: Figures {
            demonstrations,
            envelopes,
            model: Some(model.clone()),
            ..shown
        },
    })
}

fn over<'e>(errors: impl Iterator<Item = &'e Errors>, figure: fn(&Errors) -> f64) -> f64 {
    root_mean_square(&errors.map(figure).collect::<Vec<_>>())
}

/// A model that is asked about trials.
struct Asked<'m> {
    recogniser: Recogniser<'m>,
    ranges: [f64; 3],
    noise: ChaCha8Rng,
}

impl Asked<'_> {
    /// Recognition, and the errors of what the recognised skill expects; true where it is the right one.
    fn trials(
        &mut self,
        look: &Look,
        movements: &[Demonstration],
    ) -> Result<(Score, Vec<(Errors, bool)>), ExperimentError> {
        let mut answers = Answers::default();
        let mut errors = Vec::with_capacity(movements.len());
        for movement in movements {
            let one = recognise(look, &mut self.recogniser, movement, &mut self.noise)?;
            let (best, _) = answer(&self.recogniser, movement.label());
            let bands = infer(&mut self.recogniser, (best, &NOMINAL), movement)?;
            errors.push((Errors::of(&bands, &self.ranges), one.1));
            answers.0.push(one);
        }
        Ok((answers.score(), errors))
    }

    fn score(
        &mut self,
        look: &Look,
        movements: &[Demonstration],
    ) -> Result<Score, ExperimentError> {
        score(look, &mut self.recogniser, movements, &mut self.noise)
    }

    fn sweeps(&mut self, new: &[Demonstration]) -> Result<Sweeps, ExperimentError> {
        let mut points = |looks: &[(f64, [Look; 2])]| {
            let point = |(at, [with, without]): &(f64, [Look; 2])| {
                Ok(Point {
                    at: *at,
                    with_semg: self.score(with, new)?,
                    without_semg: self.score(without, new)?,
                })
            };
            looks
                .iter()
                .map(point)
                .collect::<Result<Vec<_>, ExperimentError>>()
        };
        let looks = Looks::new(OBSERVATIONS);
        Ok(Sweeps {
            by_fraction: points(&looks.by_fraction)?,
            by_observations: points(&looks.by_observations)?,
            by_noise_m: points(&looks.by_noise_m)?,
        })
    }

    fn shown(
        &mut self,
        name: String,
        look: &Look,
        movement: &Demonstration,
    ) -> Result<Inference, ExperimentError> {
        let observed = look.of(movement, &mut self.noise);
        look.observe(&mut self.recogniser, &observed)?;
        let (best, _) = answer(&self.recogniser, movement.label());
        let bands = infer(&mut self.recogniser, (best, &NOMINAL), movement)?;
        let recognised = &self.recogniser.model().labels()[best];
        Ok(figure(name, recognised, movement, (&observed, bands)))
    }

    /// The first trial of each object, inferred both ways.
    fn figures(
        &mut self,
        new: &[Demonstration],
        looks: [&Look; 2],
    ) -> Result<Figures, ExperimentError> {
        let mut figures = Figures::default();
        for label in Skill::LIFTS.map(Skill::label) {
            let Some(movement) = new.iter().find(|d| d.label() == label) else {
                continue;
            };
            let with = format!("{label}, with sEMG");
            figures
                .with_semg
                .push(self.shown(with, looks[0], movement)?);
            let without = format!("{label}, positions alone");
            figures
                .without_semg
                .push(self.shown(without, looks[1], movement)?);
            let trace = looks[0].trace(&mut self.recogniser, movement, &mut self.noise)?;
            figures.traces.push(trace);
        }
        Ok(figures)
    }
}

/// Share of simulated hand paths, tracked with the stated noise, that the simulator's own densities tell apart.
fn best_possible(seed: u64) -> Result<f64, ExperimentError> {
    const RUNS: usize = 1000;
    let duration_s = DURATION_US as f64 * 1e-6;
    let phases: Vec<f64> = (0..FRAMES)
        .map(|frame| frame as f64 / FRAMES as f64)
        .collect();
    let noise = TrackerNoise::STATED;
    let best = BestRecogniser::new(&Skill::LIFTS, &phases, duration_s, &noise)?;
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut right = 0;
    for run in 0..RUNS {
        let skill = Skill::LIFTS[run % Skill::LIFTS.len()];
        let latent = skill.sample(&mut rng);
        let mut source = NoiseSource::new(noise, rng.random());
        let positions = phases.iter().map(|&phase| {
            let error_m = source.error_m((phase * DURATION_US as f64) as u64);
            let at_m = skill.position_m(&latent, phase);
            std::array::from_fn(|axis| at_m[axis] + error_m[axis])
        });
        let positions: Vec<[f64; 3]> = positions.collect();
        right += usize::from(best.recognise(&positions)? == Some(skill));
    }
    Ok(right as f64 / RUNS as f64)
}

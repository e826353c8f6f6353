//! A movement whose start and duration nobody announced: one observed number after another, posterior over skill,
//! duration and onset, and prediction in time.
//!
//! ```text
//! observe (rest: kept for a moment) -> begin (onset detected: hypotheses, the kept ones replayed) -> observe ... -> end
//! ```
//!
//! Until [`TempoRecogniser::begin`] observations are only kept, and forgotten after [`TempoConfig::lead_s`]. Then a grid of
//! hypotheses is set up around the onset that was detected ([`tonus_shared::onset`]): every skill, durations by its
//! log-normal prior, onsets by the detector's error. All of them are conditioned on what was kept and on what follows.

mod config;
mod grid;
mod interval;

use tonus_shared::promp::{
    Bank, Grid, Hypothesis, Observation, Observed, Quantity, Row, bank_len, trajectory_scratch_len,
};

use super::recognise::{Prediction, RecogniseError};
use super::{Durations, Model, View};
pub use config::{TempoConfig, TempoError};
pub(super) use grid::LogNormal;
pub use interval::Interval;
use interval::{Cell, credible};

/// Hypotheses of less than this share of the most probable one's weight are left out of predictions.
const NEGLIGIBLE: f64 = 1e-6;

type Hypotheses<'m> = Bank<'m, f64, Vec<Hypothesis<f64>>, Vec<f64>>;

/// All skills of a model at all tempos, conditioned on what was seen of one movement.
#[derive(Debug)]
pub struct TempoRecogniser<'m> {
    model: &'m Model,
    config: TempoConfig,
    /// Prior over the duration of each skill.
    durations: Vec<LogNormal>,
    bank: Hypotheses<'m>,
    /// Observations of the last [`TempoConfig::lead_s`] before a movement begins.
    kept: Vec<Observed<f64>>,
    scratch: Vec<f64>,
}

impl<'m> TempoRecogniser<'m> {
    /// At rest. `view` is the model's own.
    ///
    /// # Errors
    /// [`TempoError`], a model without skills.
    pub fn new(
        model: &'m Model,
        view: &'m View<'m>,
        config: TempoConfig,
    ) -> Result<Self, RecogniseError> {
        config.check()?;
        let (latent, skills) = (view.latent, &view.skills);
        let (basis, rank) = (latent.basis().count(), latent.rank());
        let grid = config.durations.saturating_mul(config.onsets);
        let capacity = config.capacity.min(grid.saturating_mul(skills.len()));
        let slots = vec![Hypothesis::default(); capacity];
        let storage = vec![0.0; bank_len(capacity, basis, rank)];
        let prior = |durations: &Durations| LogNormal::new(durations, config.tempo_log_std);
        Ok(Self {
            model,
            config,
            durations: model.durations().iter().map(prior).collect(),
            bank: Bank::new(latent, skills, slots, storage, config.floor_nats)?,
            kept: Vec::new(),
            scratch: vec![0.0; trajectory_scratch_len(basis, rank)],
        })
    }

    /// The model.
    #[must_use]
    pub const fn model(&self) -> &'m Model {
        self.model
    }

    /// The hypotheses.
    #[must_use]
    pub const fn bank(&self) -> &Hypotheses<'m> {
        &self.bank
    }

    /// Whether a movement is followed.
    #[must_use]
    pub fn begun(&self) -> bool {
        !self.bank.hypotheses().is_empty()
    }

    /// A movement began at about `onset_s`: hypotheses around it, conditioned on what was kept since
    /// [`TempoConfig::lead_s`] before it. What an earlier movement left is forgotten.
    ///
    /// # Errors
    /// A time that is not finite, a kept observation that inference refuses; no movement is followed then.
    pub fn begin(&mut self, onset_s: f64) -> Result<(), RecogniseError> {
        self.bank.reset();
        let expected_s = onset_s - self.config.onset_late_s;
        let onsets = Grid::new(self.config.onsets);
        for (skill, durations) in self.durations.iter().enumerate() {
            for (tempo, tempo_log_prior) in Grid::new(self.config.durations).points::<f64>() {
                for (late, onset_log_prior) in onsets.points::<f64>() {
                    let hypothesis = Hypothesis {
                        skill,
                        duration_s: durations.at(tempo),
                        onset_s: expected_s + late * self.config.onset_std_s,
                        log_prior: tempo_log_prior + onset_log_prior,
                    };
                    self.bank.add(hypothesis, &[])?;
                }
            }
        }
        let replayed = self.replay(expected_s - self.config.lead_s);
        if replayed.is_err() {
            self.end();
        }
        replayed
    }

    fn replay(&mut self, since_s: f64) -> Result<(), RecogniseError> {
        for seen in self.kept.drain(..).filter(|seen| seen.time_s >= since_s) {
            self.bank.observe(&seen)?;
        }
        Ok(())
    }

    /// The movement is over: back to rest.
    pub fn end(&mut self) {
        self.bank.reset();
        self.kept.clear();
    }

    /// Takes `value` of a DoF at a time, its noise of standard deviation `std`, both in the DoF's unit: conditions every
    /// hypothesis while a movement is followed, is kept for a moment otherwise.
    ///
    /// # Errors
    /// [`RecogniseError`]; the recogniser is as before then.
    pub fn observe(
        &mut self,
        dof: usize,
        time_s: f64,
        value: f64,
        std: f64,
    ) -> Result<(), RecogniseError> {
        let unknown = RecogniseError::Unknown {
            what: "DoF",
            index: dof,
            count: self.model.dofs().len(),
        };
        // The phase is each hypothesis' own.
        let encoded = self.model.observation(dof, 0.0, value, std);
        let Observation {
            value, variance, ..
        } = encoded.ok_or(unknown)??;
        let seen = Observed {
            dof,
            quantity: Quantity::Position,
            time_s,
            value,
            variance,
        };
        if self.begun() {
            return Ok(self.bank.observe(&seen)?);
        }
        if !time_s.is_finite() {
            return Err(RecogniseError::Time { time_s });
        }
        // An onset is told of some time after it happened.
        let oldest_s = time_s - self.config.lead_s - LATEST_S;
        self.kept.retain(|kept| kept.time_s >= oldest_s);
        self.kept.push(seen);
        Ok(())
    }

    /// Log posterior probability of each skill, in the order of [`Model::labels`]; the prior at rest, negative infinity
    /// for a skill of which every hypothesis was dropped.
    #[must_use]
    pub fn log_posterior(&self) -> Vec<f64> {
        let skills = self.bank.skills();
        let mut out: Vec<f64> = skills.iter().map(|skill| skill.log_prior()).collect();
        // Of the right length by construction.
        if self.begun() && self.bank.log_posterior(&mut out).is_err() {
            out.fill(f64::NEG_INFINITY);
        }
        out
    }

    /// Mean and standard deviation of the phase at a time; `None` at rest.
    #[must_use]
    pub fn phase(&self, time_s: f64) -> Option<(f64, f64)> {
        let moments = self.bank.phase(None, time_s)?;
        Some((moments.mean, moments.variance.sqrt()))
    }

    /// Probability that the movement is over at a time; `None` at rest.
    #[must_use]
    pub fn over(&self, time_s: f64) -> Option<f64> {
        self.bank.over(time_s)
    }

    /// Posterior of the duration over all skills: mean, and the central interval that holds `probability` of it,
    /// seconds; `None` at rest. A hypothesis stands for its cell of the grid.
    #[must_use]
    pub fn duration(&self, probability: f64) -> Option<Interval> {
        let half = 0.5 * Grid::new(self.config.durations).step::<f64>();
        let cell = |h: &Hypothesis<f64>| {
            let width = (half * self.durations[h.skill].log_std).exp();
            (h.duration_s / width, h.duration_s * width)
        };
        self.credible(probability, cell)
    }

    /// As [`TempoRecogniser::duration`], of the onset.
    #[must_use]
    pub fn onset(&self, probability: f64) -> Option<Interval> {
        let half_s = 0.5 * Grid::new(self.config.onsets).step::<f64>() * self.config.onset_std_s;
        self.credible(probability, |h| (h.onset_s - half_s, h.onset_s + half_s))
    }

    fn credible(
        &self,
        probability: f64,
        cell: impl Fn(&Hypothesis<f64>) -> (f64, f64),
    ) -> Option<Interval> {
        let hypotheses = self.bank.hypotheses().iter().enumerate();
        let cells = hypotheses.map(|(index, hypothesis)| {
            let (low, high) = cell(hypothesis);
            Some(Cell {
                low,
                high,
                weight: self.bank.probability(index)?,
            })
        });
        credible(&cells.collect::<Option<Vec<_>>>()?, probability)
    }

    /// What one skill (`None`: all of them together), given all observations, expects of a DoF at a time: mean,
    /// standard deviation within and between the hypotheses, and change of the mean per **second**.
    ///
    /// # Errors
    /// A DoF or skill that there is not, a time that is not finite, no hypothesis of the skill left, no movement.
    pub fn predict(
        &mut self,
        skill: Option<usize>,
        dof: usize,
        time_s: f64,
    ) -> Result<Prediction, RecogniseError> {
        let unknown = |what, index, count| RecogniseError::Unknown { what, index, count };
        let (dofs, skills) = (self.model.dofs(), self.model.labels().len());
        let signal = (dofs.get(dof)).ok_or_else(|| unknown("DoF", dof, dofs.len()))?;
        if let Some(skill) = skill.filter(|skill| *skill >= skills) {
            return Err(unknown("skill", skill, skills));
        }
        if !time_s.is_finite() {
            return Err(RecogniseError::Time { time_s });
        }
        let of_skill = |h: &Hypothesis<f64>| skill.is_none_or(|skill| skill == h.skill);
        let joints = self.bank.hypotheses().iter().enumerate();
        let joints = joints.filter(|(_, hypothesis)| of_skill(hypothesis));
        let joints: Vec<(usize, f64)> = joints
            .filter_map(|(index, _)| Some((index, self.bank.log_joint(index)?)))
            .collect();
        let largest = joints.iter().map(|(_, joint)| *joint);
        let largest = largest.fold(f64::NEG_INFINITY, f64::max);
        let mut sums = Sums::default();
        for (index, joint) in joints {
            let weight = libm::exp(joint - largest);
            let (Some(trajectory), true) = (self.bank.trajectory(index), weight >= NEGLIGIBLE)
            else {
                continue;
            };
            let hypothesis = self.bank.hypotheses()[index];
            let phase = hypothesis.phase(time_s);
            let (mean, std) = self
                .model
                .expected(&trajectory, dof, phase, &mut self.scratch)?;
            let row = Row::velocity(dof, phase, hypothesis.duration_s);
            let slope = trajectory.mean(&row, &mut self.scratch)?;
            let rate = if hypothesis.moving(time_s) {
                signal.decode_rate(mean, slope)
            } else {
                0.0
            };
            sums.add(weight, &Prediction { mean, std, rate });
        }
        sums.mixed().ok_or(RecogniseError::NoHypothesis)
    }
}

/// How late after its onset a movement may be told of, seconds.
const LATEST_S: f64 = 0.5;

/// Weighted sums of predictions, about the first of them.
#[derive(Debug, Default)]
struct Sums {
    about: Option<f64>,
    weight: f64,
    mean: f64,
    square: f64,
    rate: f64,
}

impl Sums {
    fn add(&mut self, weight: f64, one: &Prediction) {
        let offset = one.mean - *self.about.get_or_insert(one.mean);
        self.weight += weight;
        self.mean += weight * offset;
        self.square += weight * (one.std * one.std + offset * offset);
        self.rate += weight * one.rate;
    }

    fn mixed(&self) -> Option<Prediction> {
        let shift = self.mean / self.weight;
        Some(Prediction {
            mean: self.about? + shift,
            std: (self.square / self.weight - shift * shift).max(0.0).sqrt(),
            rate: self.rate / self.weight,
        })
    }
}

//! A movement as it comes in: one observed number after another, posterior and prediction at any time.

use tonus_shared::promp::{
    BankError, ConditionError, Mixture, ModelError, Row, RowError, trajectory_scratch_len,
};

use super::tempo::TempoError;
use super::{Model, NotPositive, Spread, View};

/// What the model refused.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum RecogniseError {
    /// A DoF or a skill that the model has not.
    #[error("the model has no {what} number {index}, it has {count}")]
    Unknown {
        /// `DoF` or `skill`.
        what: &'static str,
        /// The number asked for, from 0.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// A value without a logarithm.
    #[error(transparent)]
    NotPositive(#[from] NotPositive),
    /// An observation that inference refused.
    #[error(transparent)]
    Condition(#[from] ConditionError),
    /// A row that inference refused.
    #[error(transparent)]
    Row(#[from] RowError),
    /// A model that inference refused.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A hypothesis or an observation that a bank refused.
    #[error(transparent)]
    Bank(#[from] BankError),
    /// Durations and onsets that cannot be guessed so.
    #[error(transparent)]
    Tempo(#[from] TempoError),
    /// A time that is NaN or infinite.
    #[error("the time is {time_s} s: give a finite time")]
    Time {
        /// The time, seconds.
        time_s: f64,
    },
    /// Nothing to predict from.
    #[error("no hypothesis of the skill is left, or no movement has begun")]
    NoHypothesis,
}

/// What a skill expects of one DoF at one phase, in the DoF's unit.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Prediction {
    /// Mean.
    pub mean: f64,
    /// Standard deviation of the movement itself; a sensor sees its own noise on top.
    pub std: f64,
    /// Change of the mean per unit of phase (divide by the duration for a velocity); per second where
    /// the duration is not known ([`super::tempo`]).
    pub rate: f64,
}

/// All skills of a model, conditioned on what was seen of one movement.
#[derive(Debug)]
pub struct Recogniser<'m> {
    model: &'m Model,
    mixture: Mixture<'m, f64, Vec<f64>>,
    scratch: Vec<f64>,
}

impl<'m> Recogniser<'m> {
    /// Before the first observation. `view` is the model's own.
    ///
    /// # Errors
    /// A model without skills.
    pub fn new(model: &'m Model, view: &'m View<'m>) -> Result<Self, RecogniseError> {
        let latent = &view.latent;
        Ok(Self {
            model,
            mixture: view.mixture()?,
            scratch: vec![0.0; trajectory_scratch_len(latent.basis().count(), latent.rank())],
        })
    }

    /// The model.
    #[must_use]
    pub const fn model(&self) -> &'m Model {
        self.model
    }

    /// Forgets every observation, for the next movement.
    pub fn reset(&mut self) {
        self.mixture.reset();
    }

    /// Conditions every skill on `value` of a DoF at a phase, its noise of standard deviation `std`, both in
    /// the DoF's unit.
    ///
    /// # Errors
    /// [`RecogniseError`]; the recogniser is as before then.
    pub fn observe(
        &mut self,
        dof: usize,
        phase: f64,
        value: f64,
        std: f64,
    ) -> Result<(), RecogniseError> {
        let observation = self.model.observation(dof, phase, value, std);
        let unknown = RecogniseError::Unknown {
            what: "DoF",
            index: dof,
            count: self.model.dofs().len(),
        };
        self.mixture.observe(&observation.ok_or(unknown)??)?;
        Ok(())
    }

    /// Log posterior probability of each skill, in the order of [`Model::labels`].
    #[must_use]
    pub fn log_posterior(&self) -> Vec<f64> {
        let mut out = vec![0.0; self.model.labels().len()];
        // Of the right length by construction.
        if self.mixture.log_posterior(&mut out).is_err() {
            out.fill(f64::NEG_INFINITY);
        }
        out
    }

    /// What a skill, given all observations, expects of a DoF at a phase.
    ///
    /// # Errors
    /// A DoF or skill that there is not, a phase that is not finite.
    pub fn predict(
        &mut self,
        skill: usize,
        dof: usize,
        phase: f64,
    ) -> Result<Prediction, RecogniseError> {
        let unknown = |what, index, count| RecogniseError::Unknown { what, index, count };
        let dofs = self.model.dofs();
        let signal = (dofs.get(dof)).ok_or_else(|| unknown("DoF", dof, dofs.len()))?;
        let skills = self.model.labels().len();
        let trajectory =
            (self.mixture.trajectory(skill)).ok_or_else(|| unknown("skill", skill, skills))?;
        let (mean, std) = self
            .model
            .expected(&trajectory, dof, phase, &mut self.scratch)?;
        // A duration of one makes the velocity one per unit of phase.
        let slope = trajectory.mean(&Row::velocity(dof, phase, 1.0), &mut self.scratch)?;
        Ok(Prediction {
            mean,
            std,
            rate: signal.decode_rate(mean, slope),
        })
    }

    /// The same as a distribution, for intervals.
    ///
    /// # Errors
    /// A DoF or skill that there is not, a phase that is not finite.
    pub fn spread(
        &self,
        skill: usize,
        dof: usize,
        phase: f64,
    ) -> Result<Spread<'m>, RecogniseError> {
        let (skills, dofs) = (self.model.labels().len(), self.model.dofs().len());
        let spread = Spread::of(self.model, &self.mixture, (skill, dof, phase))?;
        let (what, index, count) = if dof < dofs {
            ("skill", skill, skills)
        } else {
            ("DoF", dof, dofs)
        };
        spread.ok_or(RecogniseError::Unknown { what, index, count })
    }
}

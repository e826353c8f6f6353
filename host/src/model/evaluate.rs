//! How good a model is: recognition, and prediction of what was not seen yet.
//!
//! **The duration is an oracle here.** A demonstration is looked at by phase, time since its start over its
//! known duration, which nobody knows while a movement is going on.

mod outcomes;

pub use outcomes::{Evaluation, Outcome};

use std::path::PathBuf;

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus_shared::promp::{ConditionError, Mixture, ModelError, RowError, trajectory_scratch_len};

use super::first_part::FirstPart;
use super::{LearnError, Model, NotPositive, Valid, learn};
use crate::demonstration::Demonstration;

/// What is observed of each demonstration, and how.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Protocol {
    /// How many times every DoF is observed, equally spaced from the start, at least 1. Samples after the fraction
    /// are not looked at: the last observation is the last sample within it.
    pub observations: usize,
    /// The first part of the duration that they span, above 0, at most 1.
    pub fraction: f64,
    /// Standard deviation of the noise that the recogniser assumes on positions, metres, above 0. More than the
    /// sensor's own: it stands for all that new performances differ in and the demonstrations do not show.
    pub sigma_m: f64,
    /// The same for all other DoFs, as a share of each one's standard deviation in the demonstrations, above 0.
    pub sigma_share: f64,
    /// Standard deviation of noise added to positions, metres, from 0. The recogniser knows of it.
    pub noise_m: f64,
    /// Seed of the noise.
    pub seed: u64,
}

impl Default for Protocol {
    fn default() -> Self {
        Self {
            observations: 10,
            fraction: 0.5,
            sigma_m: 0.05,
            sigma_share: 0.15,
            noise_m: 0.0,
            seed: 0,
        }
    }
}

/// Why a model could not be evaluated.
#[derive(Debug, thiserror::Error)]
pub enum EvaluateError {
    /// Nothing to evaluate on.
    #[error("no demonstrations to evaluate on")]
    None,
    /// A number of the protocol outside its range.
    #[error("{what} is {value}: give {range}")]
    Protocol {
        /// Which number.
        what: &'static str,
        /// The number.
        value: f64,
        /// What it may be.
        range: &'static str,
    },
    /// A demonstration of a skill that the model does not know.
    #[error("{}: the model does not know `{label}`, only {}", file.display(), known.join(", "))]
    Unknown {
        /// The file.
        file: PathBuf,
        /// The label.
        label: String,
        /// Labels of the model.
        known: Vec<String>,
    },
    /// A demonstration with other DoFs than the model.
    #[error("{}: a demonstration of `{label}` has {got} DoFs, the model {expected}", file.display())]
    Dofs {
        /// The file.
        file: PathBuf,
        /// Its label.
        label: String,
        /// DoFs of the model.
        expected: usize,
        /// Its DoFs.
        got: usize,
    },
    /// A value without a logarithm.
    #[error("{}: `{label}`: {reason}", file.display())]
    NotPositive {
        /// The file.
        file: PathBuf,
        /// The demonstration's label.
        label: String,
        /// The DoF and the value.
        reason: NotPositive,
    },
    /// An observation that inference refused.
    #[error(transparent)]
    Condition(#[from] ConditionError),
    /// A row that inference refused.
    #[error(transparent)]
    Row(#[from] RowError),
    /// A model that inference refused.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// The model without one demonstration could not be learnt.
    #[error("without one demonstration of `{label}` ({})", file.display())]
    Learn {
        /// The file of the one left out.
        file: PathBuf,
        /// Its label.
        label: String,
        /// Why.
        source: Box<LearnError>,
    },
}

impl Protocol {
    fn check(&self) -> Result<(), EvaluateError> {
        let numbers = [
            (
                "the number of observations",
                self.observations as f64,
                self.observations >= 1,
                "at least 1",
            ),
            (
                "the fraction",
                self.fraction,
                self.fraction > 0.0 && self.fraction <= 1.0,
                "above 0 and at most 1",
            ),
            (
                "sigma",
                self.sigma_m,
                self.sigma_m > 0.0,
                "a finite length above 0",
            ),
            (
                "sigma's share",
                self.sigma_share,
                self.sigma_share > 0.0,
                "a finite number above 0",
            ),
            (
                "the noise",
                self.noise_m,
                self.noise_m >= 0.0,
                "a finite length from 0",
            ),
        ];
        for (what, value, within, range) in numbers {
            if !(value.is_finite() && within) {
                return Err(EvaluateError::Protocol { what, value, range });
            }
        }
        Ok(())
    }

    /// Equally spaced from 0 to the fraction; a single one is at its end.
    fn phases(&self) -> impl Iterator<Item = f64> {
        let (count, last) = (self.observations, self.fraction);
        (0..count).map(move |step| {
            if count == 1 {
                last
            } else {
                last * step as f64 / (count - 1) as f64
            }
        })
    }
}

/// Evaluates a model on demonstrations it was (one hopes) not learnt from.
///
/// # Errors
/// [`EvaluateError`].
pub fn evaluate(
    model: &Model,
    demonstrations: &[Demonstration],
    protocol: &Protocol,
) -> Result<Evaluation, EvaluateError> {
    protocol.check()?;
    let mut noise = ChaCha8Rng::seed_from_u64(protocol.seed);
    let view = model.view()?;
    let mut mixture = view.mixture()?;
    let outcomes = demonstrations.iter().map(|demonstration| {
        mixture.reset();
        outcome(model, &mut mixture, demonstration, protocol, &mut noise)
    });
    let outcomes = outcomes.collect::<Result<Vec<_>, _>>()?;
    Evaluation::of(outcomes, model.dofs()).ok_or(EvaluateError::None)
}

/// Learns without each demonstration in turn and evaluates on that one. `done` is told how many are done.
///
/// # Errors
/// [`EvaluateError`].
pub fn leave_one_out(
    demonstrations: &[Demonstration],
    valid: &Valid,
    protocol: &Protocol,
    done: &mut dyn FnMut(usize),
) -> Result<Evaluation, EvaluateError> {
    protocol.check()?;
    let mut noise = ChaCha8Rng::seed_from_u64(protocol.seed);
    let mut outcomes = Vec::with_capacity(demonstrations.len());
    for (index, left_out) in demonstrations.iter().enumerate() {
        let (before, after) = demonstrations.split_at(index);
        let others: Vec<_> = before.iter().chain(&after[1..]).cloned().collect();
        let model = learn(&others, valid).map_err(|source| EvaluateError::Learn {
            file: left_out.file().to_owned(),
            label: left_out.label().to_owned(),
            source: Box::new(source),
        })?;
        let view = model.view()?;
        let mut mixture = view.mixture()?;
        outcomes.push(outcome(
            &model,
            &mut mixture,
            left_out,
            protocol,
            &mut noise,
        )?);
        done(index + 1);
    }
    Evaluation::of(outcomes, &valid.get().dofs).ok_or(EvaluateError::None)
}

/// Observes one demonstration with `mixture`, which is at its priors.
fn outcome(
    model: &Model,
    mixture: &mut Mixture<'_, f64, Vec<f64>>,
    demonstration: &Demonstration,
    protocol: &Protocol,
    noise: &mut ChaCha8Rng,
) -> Result<Outcome, EvaluateError> {
    let (expected, got) = (model.dofs().len(), demonstration.values().len());
    if expected != got {
        return Err(EvaluateError::Dofs {
            file: demonstration.file().to_owned(),
            label: demonstration.label().to_owned(),
            expected,
            got,
        });
    }
    let classes = model.classes();
    let Some(performed) = classes.iter().position(|c| *c == demonstration.class()) else {
        return Err(EvaluateError::Unknown {
            file: demonstration.file().to_owned(),
            label: demonstration.class().to_owned(),
            known: classes.into_iter().map(str::to_owned).collect(),
        });
    };
    let part = FirstPart::of(demonstration, protocol.fraction);
    let mut phases: Vec<f64> = protocol.phases().map(|phase| part.phase(phase)).collect();
    // Where samples are sparse one may be the last for several: it is seen once.
    phases.dedup();
    for phase in phases {
        observe(
            model,
            mixture,
            (demonstration, &part),
            (phase, protocol),
            noise,
        )?;
    }
    let mut of_skills = vec![0.0; model.labels().len()];
    mixture.log_posterior(&mut of_skills)?;
    let (squared_error, unobserved) = prediction_error(
        model,
        mixture,
        mixture.most_likely(),
        (demonstration, protocol.fraction),
    )?;
    let log_posterior = model.class_log_posterior(&of_skills);
    let recognised = (1..classes.len()).fold(0, |best, class| {
        if log_posterior[class] > log_posterior[best] {
            class
        } else {
            best
        }
    });
    Ok(Outcome {
        label: demonstration.class().to_owned(),
        recognised: classes[recognised].to_owned(),
        log_probability: log_posterior[performed],
        performed,
        log_posterior,
        squared_error,
        unobserved,
    })
}

fn observe(
    model: &Model,
    mixture: &mut Mixture<'_, f64, Vec<f64>>,
    (demonstration, part): (&Demonstration, &FirstPart<'_>),
    (phase, protocol): (f64, &Protocol),
    noise: &mut ChaCha8Rng,
) -> Result<(), EvaluateError> {
    for (index, dof) in model.dofs().iter().enumerate() {
        let recorded = part.value(index, phase).unwrap_or(f64::NAN);
        let mut value = recorded;
        if dof.is_position() && protocol.noise_m > 0.0 {
            let normal: f64 = StandardNormal.sample(noise);
            value += protocol.noise_m * normal;
        }
        let std = libm::hypot(protocol.sigma_m, protocol.noise_m);
        let Some(mut observation) = model
            .observation(index, phase, value, std)
            .transpose()
            .map_err(|reason| EvaluateError::NotPositive {
                file: demonstration.file().to_owned(),
                label: demonstration.label().to_owned(),
                reason,
            })?
        else {
            continue;
        };
        if !dof.is_position() {
            let share = protocol.sigma_share * model.parts().scale[index];
            observation.variance = share * share;
        }
        mixture.observe(&observation)?;
    }
    Ok(())
}

/// Per DoF the squared error of the predicted samples after `fraction`, summed, and their number.
fn prediction_error(
    model: &Model,
    mixture: &Mixture<'_, f64, Vec<f64>>,
    skill: usize,
    (demonstration, fraction): (&Demonstration, f64),
) -> Result<(Vec<f64>, usize), EvaluateError> {
    let mut squared = vec![0.0; model.dofs().len()];
    let mut unobserved = 0;
    let latent = mixture.latent();
    let mut scratch = vec![0.0; trajectory_scratch_len(latent.basis().count(), latent.rank())];
    let Some(trajectory) = mixture.trajectory(skill) else {
        return Ok((squared, unobserved));
    };
    for (sample, phase) in demonstration.phases().enumerate() {
        if phase <= fraction {
            continue;
        }
        unobserved += 1;
        for (index, squared) in squared.iter_mut().enumerate() {
            let (predicted, _) = model.expected(&trajectory, index, phase, &mut scratch)?;
            let error = predicted - demonstration.values()[index][sample];
            *squared += error * error;
        }
    }
    Ok((squared, unobserved))
}

//! The work that is timed, on the reference demonstrations: 30 of them, 12 DoFs, 30 functions, 200 samples. The same
//! for the benches and for the comparison with other packages (`tests/compare/run`).

use serde_json::Value;
use tonus::demonstration::Demonstration;
use tonus::model::{
    Dof, EmConfig, Hyperparameters, Model, Parts, Predictive, Shrinkage, Valid, View, learn,
    learn_em,
};
use tonus_shared::promp::{
    Basis, Mixture, Moments, Observation, Order, Row, Trajectory, curves_scratch_len,
};

use crate::{demos, reference};

type Error = Box<dyn std::error::Error>;

/// Samples of a demonstration.
const SAMPLES: usize = 200;
const FUNCTIONS: usize = 30;
const RIDGE: f64 = 1e-8;

/// Demonstrations, and the observations that `reference.json` states.
pub struct Work {
    /// All demonstrations as one skill.
    pub alike: Vec<Demonstration>,
    /// The same by class: three skills.
    pub labelled: Vec<Demonstration>,
    hyperparameters: Valid,
    one: Vec<Observation<f64>>,
    sequence: Vec<Observation<f64>>,
    phases: Vec<f64>,
}

/// Reusable room for [`Work::moments`].
pub struct Curves {
    scratch: Vec<f64>,
    moments: Vec<Moments<f64>>,
}

impl Work {
    /// Reads the reference files.
    ///
    /// # Errors
    /// Files that are missing or not what they were.
    pub fn read() -> Result<Self, Error> {
        let text = std::fs::read_to_string(reference().join("reference.json"))?;
        let stated: Value = serde_json::from_str(&text)?;
        let names = stated["convention"]["dofs"].as_array();
        let names: Vec<&str> = names
            .ok_or("no DoFs")?
            .iter()
            .filter_map(Value::as_str)
            .collect();
        let dofs = names.iter().map(|&name| Dof::position(name)).collect();
        let given = Hyperparameters {
            ridge: RIDGE,
            shrinkage: Shrinkage::Fixed {
                pooled: 0.0,
                diagonal: 0.0,
            },
            // As the other packages: a Gaussian of the estimates.
            predictive: Predictive::PlugIn,
            ..Hyperparameters::new(dofs, Basis::gaussian(FUNCTIONS)?)
        };
        let one = &stated["one_observation"];
        let sequence = &stated["mixture_pos3"];
        let steps = numbers(&sequence["s"]);
        let values = sequence["y"].as_array().ok_or("no values")?;
        Ok(Self {
            alike: demonstrations(&names, true),
            labelled: demonstrations(&names, false),
            hyperparameters: given.check()?,
            one: observations(one, one["s"].as_f64().ok_or("no phase")?, &one["y"]),
            sequence: steps
                .iter()
                .zip(values)
                .flat_map(|(&phase, values)| observations(sequence, phase, values))
                .collect(),
            phases: (0..SAMPLES)
                .map(|i| i as f64 / (SAMPLES - 1) as f64)
                .collect(),
        })
    }

    /// Weights of all demonstrations, their mean and covariance, ready for inference.
    ///
    /// # Errors
    /// As [`learn`].
    pub fn learn(&self, demonstrations: &[Demonstration]) -> Result<Model, Error> {
        Ok(learn(demonstrations, &self.hyperparameters)?)
    }

    /// As [`Work::learn`], by EM over trajectories until it has converged.
    ///
    /// # Errors
    /// As [`learn_em`].
    pub fn learn_em(&self, demonstrations: &[Demonstration]) -> Result<Model, Error> {
        let config = EmConfig::default();
        Ok(learn_em(demonstrations, &self.hyperparameters, &config)?)
    }

    /// As [`Work::learn`], without the residual variance, which the other packages do not have.
    ///
    /// # Errors
    /// As [`learn`].
    pub fn without_residual(&self, demonstrations: &[Demonstration]) -> Result<Model, Error> {
        let model = self.learn(demonstrations)?;
        let residual_variance = vec![0.0; model.dofs().len()];
        let parts = Parts {
            residual_variance,
            ..model.parts().clone()
        };
        Ok(Model::assemble(parts)?)
    }

    /// From the prior: conditions on three positions at one phase.
    ///
    /// # Errors
    /// As [`Mixture::observe`].
    pub fn condition(&self, mixture: &mut Mixture<'_, f64, Vec<f64>>) -> Result<(), Error> {
        mixture.reset();
        for observation in &self.one {
            mixture.observe(observation)?;
        }
        Ok(())
    }

    /// From the prior: ten times three positions, the posterior of the skills after each time.
    ///
    /// # Errors
    /// As [`Mixture::observe`].
    pub fn recognise(
        &self,
        mixture: &mut Mixture<'_, f64, Vec<f64>>,
        log_posterior: &mut [f64],
    ) -> Result<(), Error> {
        mixture.reset();
        for instant in self.sequence.chunks_exact(self.one.len()) {
            for observation in instant {
                mixture.observe(observation)?;
            }
            mixture.log_posterior(log_posterior)?;
        }
        Ok(())
    }

    /// Room for [`Work::moments`].
    #[must_use]
    pub fn curves(&self, view: &View<'_>) -> Curves {
        let (count, rank) = (view.latent.basis().count(), view.latent.rank());
        let nothing = Moments {
            mean: 0.0,
            variance: 0.0,
        };
        Curves {
            scratch: vec![0.0; curves_scratch_len(view.latent.dofs(), count, rank)],
            moments: vec![nothing; view.latent.dofs() * self.phases.len()],
        }
    }

    /// Mean and standard deviation (in place of the variance) of every DoF at 200 phases.
    ///
    /// # Errors
    /// As [`Trajectory::curves`].
    pub fn moments<'c>(
        &self,
        trajectory: &Trajectory<'_, f64>,
        curves: &'c mut Curves,
    ) -> Result<&'c [Moments<f64>], Error> {
        let Curves { scratch, moments } = curves;
        trajectory.curves(Order::Position, &self.phases, scratch, moments)?;
        for moment in moments.iter_mut() {
            moment.variance = moment.variance.sqrt();
        }
        Ok(moments)
    }
}

fn observations(stated: &Value, phase: f64, values: &Value) -> Vec<Observation<f64>> {
    let dofs = numbers(&stated["dofs"]).into_iter();
    dofs.zip(numbers(values).into_iter().zip(numbers(&stated["R_diag"])))
        .map(|(dof, (value, variance))| Observation {
            row: Row::position(dof as usize, phase),
            value,
            variance,
        })
        .collect()
}

fn numbers(value: &Value) -> Vec<f64> {
    let list = value.as_array().map(Vec::as_slice).unwrap_or_default();
    list.iter().filter_map(Value::as_f64).collect()
}

fn demonstrations(dofs: &[&str], alike: bool) -> Vec<Demonstration> {
    let all = demos(dofs);
    if alike {
        all.iter().map(|one| one.with_label("all")).collect()
    } else {
        all
    }
}

//! How hard the simulator's recognition problem is, from its own true densities.
//!
//! [`BestRecogniser`] knows what no learner can: each skill's exact Gaussian over hand paths and the
//! tracker's exact noise. It sees **every** frame of an action with its exact time, duration and start
//! known, and takes the skill of largest likelihood (all equally likely beforehand). No recogniser from
//! position alone is right more often, on average; what a learnt model gains beyond comes from the muscles.

use super::skills::Skill;
use super::tracker::TrackerNoise;
use nalgebra::{Cholesky, DMatrix, DVector, Dyn};
use thiserror::Error;

/// The densities cannot be evaluated.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Error)]
pub enum DensityError {
    /// Without jitter, nearby frames determine each other.
    #[error(
        "covariance of {frames} frames is not positive definite: the tracker needs some jitter"
    )]
    Singular {
        /// Number of frames.
        frames: usize,
    },
    /// An observation does not belong to the frames' times.
    #[error("{got} positions for {expected} frames")]
    Frames {
        /// Frames that the recogniser was made for.
        expected: usize,
        /// Positions given.
        got: usize,
    },
}

/// Mean and factored covariance of all frames on one axis.
#[derive(Debug, Clone)]
struct AxisDensity {
    mean: DVector<f64>,
    covariance: Cholesky<f64, Dyn>,
}

/// The best recogniser from positions at given phases.
#[derive(Debug, Clone)]
pub struct BestRecogniser {
    skills: Vec<(Skill, Vec<AxisDensity>)>,
    frames: usize,
}

impl BestRecogniser {
    /// A recogniser of `skills` from frames at the phases `phases` of actions that last `duration_s`, under
    /// tracker noise `noise`.
    ///
    /// # Errors
    /// [`DensityError::Singular`] when the noise leaves a covariance singular.
    pub fn new(
        skills: &[Skill],
        phases: &[f64],
        duration_s: f64,
        noise: &TrackerNoise,
    ) -> Result<Self, DensityError> {
        let axis_density = |skill: Skill, axis: usize| {
            let covariance = DMatrix::from_fn(phases.len(), phases.len(), |i, j| {
                let (s, t) = (phases[i], phases[j]);
                let jitter = if i == j {
                    noise.jitter_sd_m * noise.jitter_sd_m
                } else {
                    0.0
                };
                skill.covariance_m2(s, t)[axis]
                    + noise.bias_covariance_m2((s - t) * duration_s)
                    + jitter
            });
            let mean =
                DVector::from_iterator(phases.len(), phases.iter().map(|&s| skill.mean_m(s)[axis]));
            let covariance = Cholesky::new(covariance).ok_or(DensityError::Singular {
                frames: phases.len(),
            })?;
            Ok(AxisDensity { mean, covariance })
        };
        let skills = skills
            .iter()
            .map(|&skill| {
                Ok((
                    skill,
                    (0..3)
                        .map(|axis| axis_density(skill, axis))
                        .collect::<Result<_, _>>()?,
                ))
            })
            .collect::<Result<_, _>>()?;
        Ok(Self {
            skills,
            frames: phases.len(),
        })
    }

    /// Natural logarithm of each skill's density at the observed positions (metres), in the order the skills
    /// were given in. Densities in metres to the power of minus three per frame.
    ///
    /// # Errors
    /// [`DensityError::Frames`] unless there is one position for each phase.
    pub fn log_likelihoods(&self, positions_m: &[[f64; 3]]) -> Result<Vec<f64>, DensityError> {
        if positions_m.len() != self.frames {
            return Err(DensityError::Frames {
                expected: self.frames,
                got: positions_m.len(),
            });
        }
        let of_axis = |axis: usize, density: &AxisDensity| {
            let mut whitened =
                DVector::from_iterator(self.frames, positions_m.iter().map(|p| p[axis]))
                    - &density.mean;
            let factor = density.covariance.l_dirty();
            // The factor's diagonal is positive, so the solution exists.
            factor.solve_lower_triangular_mut(&mut whitened);
            let log_root: f64 = factor.diagonal().iter().map(|d| d.ln()).sum();
            #[allow(clippy::cast_precision_loss, reason = "hundreds of frames")]
            let constant = 0.5 * self.frames as f64 * std::f64::consts::TAU.ln();
            -0.5 * whitened.norm_squared() - log_root - constant
        };
        let of_skill = |axes: &[AxisDensity]| {
            axes.iter()
                .enumerate()
                .map(|(axis, density)| of_axis(axis, density))
                .sum()
        };
        Ok(self.skills.iter().map(|(_, axes)| of_skill(axes)).collect())
    }

    /// The likeliest skill; `None` when made for none.
    ///
    /// # Errors
    /// As [`BestRecogniser::log_likelihoods`].
    pub fn recognise(&self, positions_m: &[[f64; 3]]) -> Result<Option<Skill>, DensityError> {
        let scores = self.log_likelihoods(positions_m)?;
        let best = scores
            .iter()
            .zip(&self.skills)
            .max_by(|(a, _), (b, _)| a.total_cmp(b));
        Ok(best.map(|(_, (skill, _))| *skill))
    }
}

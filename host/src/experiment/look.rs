//! What of a recorded movement a recogniser is shown, and what it makes of it.

use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::figures::{Observed, Trace};
use super::{ExperimentError, Score};
use crate::demonstration::Demonstration;
use crate::model::recognise::Recogniser;
use crate::simulate::tracker::TrackerNoise;

/// The hand's positions and stiffnesses in [`DOFS`](crate::session::DOFS).
pub(super) const HAND: [usize; 3] = [0, 1, 2];
pub(super) const HAND_STIFFNESS: [usize; 3] = [3, 4, 5];
/// The robot's.
pub(super) const ROBOT: [usize; 3] = [6, 7, 8];
pub(super) const ROBOT_STIFFNESS: [usize; 3] = [9, 10, 11];
/// Standard deviation of a streamed stiffness as a share of it, as the demo's session has it.
pub(super) const STIFFNESS_SIGMA: f64 = 0.05;

/// What is observed of a movement.
#[derive(Debug, Clone, PartialEq)]
pub(super) struct Look {
    /// When, as phases.
    pub(super) phases: Vec<f64>,
    /// What, of [`DOFS`](crate::session::DOFS).
    pub(super) dofs: Vec<usize>,
    /// Standard deviation of white noise added to positions, metres; the recogniser knows of it.
    pub(super) noise_m: f64,
    /// Standard deviation of a slow error of positions that the recogniser believes in, metres.
    pub(super) doubt_m: f64,
}

impl Look {
    /// Hand position, and stiffness `with_semg`, at these phases.
    pub(super) fn at(phases: &[f64], with_semg: bool) -> Self {
        let stiffness = HAND_STIFFNESS.into_iter().filter(|_| with_semg);
        Self {
            phases: phases.to_vec(),
            dofs: HAND.into_iter().chain(stiffness).collect(),
            noise_m: 0.0,
            doubt_m: 0.0,
        }
    }

    /// `count` times, equally spaced over the first `fraction`; a single one is at its end.
    pub(super) fn spaced(count: usize, fraction: f64, with_semg: bool) -> Self {
        let step = |n: usize| {
            if count == 1 {
                fraction
            } else {
                fraction * n as f64 / (count - 1) as f64
            }
        };
        Self::at(&(0..count).map(step).collect::<Vec<_>>(), with_semg)
    }

    /// The same in white noise.
    pub(super) fn in_noise(self, noise_m: f64) -> Self {
        Self { noise_m, ..self }
    }

    /// Everything that is observed of `movement`, in time order.
    pub(super) fn of(&self, movement: &Demonstration, noise: &mut ChaCha8Rng) -> Vec<Observed> {
        let mut observed = Vec::with_capacity(self.phases.len() * self.dofs.len());
        for &phase in &self.phases {
            for &dof in &self.dofs {
                let Some(mut value) = movement.value_at(dof, phase) else {
                    continue;
                };
                if self.noise_m > 0.0 && HAND.contains(&dof) {
                    let normal: f64 = StandardNormal.sample(noise);
                    value += self.noise_m * normal;
                }
                observed.push(Observed { dof, phase, value });
            }
        }
        observed
    }

    /// Standard deviation that the recogniser is told.
    fn std(&self, observed: &Observed) -> f64 {
        if HAND.contains(&observed.dof) {
            let white = libm::hypot(TrackerNoise::STATED.jitter_sd_m, self.noise_m);
            libm::hypot(white, self.doubt_m)
        } else {
            STIFFNESS_SIGMA * observed.value
        }
    }

    /// Forgets the last movement and observes this one.
    pub(super) fn observe(
        &self,
        recogniser: &mut Recogniser<'_>,
        observed: &[Observed],
    ) -> Result<(), ExperimentError> {
        recogniser.reset();
        for one in observed {
            recogniser.observe(one.dof, one.phase, one.value, self.std(one))?;
        }
        Ok(())
    }

    /// Recognition of one movement after each of its instants.
    pub(super) fn trace(
        &self,
        recogniser: &mut Recogniser<'_>,
        movement: &Demonstration,
        noise: &mut ChaCha8Rng,
    ) -> Result<Trace, ExperimentError> {
        recogniser.reset();
        let observed = self.of(movement, noise);
        let mut posterior = Vec::with_capacity(self.phases.len());
        let mut log_likelihood = Vec::with_capacity(self.phases.len());
        let prior = recogniser.log_posterior();
        for instant in observed.chunks(self.dofs.len().max(1)) {
            for one in instant {
                recogniser.observe(one.dof, one.phase, one.value, self.std(one))?;
            }
            let log_posterior = recogniser.log_posterior();
            let without_prior = log_posterior.iter().zip(&prior).map(|(p, prior)| p - prior);
            let without_prior: Vec<f64> = without_prior.collect();
            let most = without_prior
                .iter()
                .copied()
                .fold(f64::NEG_INFINITY, f64::max);
            log_likelihood.push(without_prior.iter().map(|l| l - most).collect());
            posterior.push(log_posterior.iter().map(|l| libm::exp(*l)).collect());
        }
        Ok(Trace {
            performed: movement.label().to_owned(),
            labels: recogniser.model().labels().to_vec(),
            phases: self.phases.clone(),
            posterior,
            log_likelihood,
        })
    }
}

/// Index of the likeliest skill, and the log probability of the one of this label.
pub(super) fn answer(recogniser: &Recogniser<'_>, label: &str) -> (usize, f64) {
    let log_posterior = recogniser.log_posterior();
    let best = log_posterior
        .iter()
        .enumerate()
        .max_by(|a, b| a.1.total_cmp(b.1))
        .map_or(0, |(skill, _)| skill);
    let own = recogniser
        .model()
        .skill(label)
        .and_then(|skill| log_posterior.get(skill));
    (best, own.copied().unwrap_or(f64::NEG_INFINITY))
}

/// Whether and with which log probability `movement` is recognised under `look`.
pub(super) fn recognise(
    look: &Look,
    recogniser: &mut Recogniser<'_>,
    movement: &Demonstration,
    noise: &mut ChaCha8Rng,
) -> Result<(f64, bool), ExperimentError> {
    look.observe(recogniser, &look.of(movement, noise))?;
    let (best, own) = answer(recogniser, movement.label());
    let right = recogniser.model().labels().get(best).map(String::as_str) == Some(movement.label());
    Ok((own, right))
}

/// Recognition of many movements under `look`.
pub(super) fn score<'d>(
    look: &Look,
    recogniser: &mut Recogniser<'_>,
    movements: impl IntoIterator<Item = &'d Demonstration>,
    noise: &mut ChaCha8Rng,
) -> Result<Score, ExperimentError> {
    let one = |movement| recognise(look, recogniser, movement, noise);
    let answers = movements
        .into_iter()
        .map(one)
        .collect::<Result<Vec<_>, _>>()?;
    Ok(Score::of(answers))
}

/// The looks of [`Sweeps`](super::Sweeps): at each point with sEMG and with positions alone.
pub(super) struct Looks {
    pub(super) by_fraction: Vec<(f64, [Look; 2])>,
    pub(super) by_observations: Vec<(f64, [Look; 2])>,
    pub(super) by_noise_m: Vec<(f64, [Look; 2])>,
}

impl Looks {
    /// `observations` wherever their number is not swept.
    pub(super) fn new(observations: usize) -> Self {
        let both = |count, fraction| [true, false].map(|semg| Look::spaced(count, fraction, semg));
        let fractions = [0.2, 0.3, 0.5, 1.0].into_iter();
        let counts = 1..=10_usize;
        let noises = (0..=5).map(|cm| f64::from(cm) * 0.01);
        Self {
            by_fraction: fractions.map(|f| (f, both(observations, f))).collect(),
            by_observations: counts.map(|n| (n as f64, both(n, 1.0))).collect(),
            by_noise_m: noises
                .map(|noise| {
                    (
                        noise,
                        both(observations, 1.0).map(|look| look.in_noise(noise)),
                    )
                })
                .collect(),
        }
    }
}

/// Answers of many movements to one [`Look`].
#[derive(Debug, Clone, Default)]
pub(super) struct Answers(pub(super) Vec<(f64, bool)>);

impl Answers {
    pub(super) fn score(&self) -> Score {
        Score::of(self.0.iter().copied())
    }
}

//! A hidden semi-Markov model for each skill: states from left to right, each with a Gaussian over all DoFs and a
//! distribution of how long it lasts.
//!
//! Zeestraten et al. (2016, *Variable duration movement encoding with minimal intervention control*) and Zeng et al.
//! (2020, *A learning framework of adaptive manipulative skills from human to robot*) use it for motion and for
//! stiffness. Learnt by EM over explicit durations, number of states by BIC on the demonstrations; recognition by the
//! forward algorithm on the DoFs observed (instants without an observation say nothing); regression by the states'
//! probabilities given all observations, each state's Gaussian conditioned on what is seen at the instant. Within a
//! state instants are independent: an observation tells when the movement is where, and nothing of how this movement
//! differs from the others.

use nalgebra::DMatrix;

use super::aligned::{Aligned, SAMPLES, phase_of, seen_at};
use super::gaussian::{Gaussian, Seen, matched};
use super::{Answer, BaselineError, Observed, largest, log_sum, normalised};
use crate::demonstration::Demonstration;
use crate::model::Dof;

/// Numbers of states tried.
const COUNTS: [usize; 3] = [5, 8, 12];
/// Least variance of a state, as a share of a DoF's own; and of a duration, samples squared.
const FLOOR: f64 = 1e-3;
const DURATION_FLOOR: f64 = 0.25;
const ITERATIONS: usize = 20;
/// EM stops when the log-likelihood of a sample grows by less, nats.
const TOLERANCE: f64 = 1e-4;

/// What the states make of one sequence.
#[derive(Debug, Clone, PartialEq)]
pub struct Segments {
    /// Log-likelihood over all ways to cut the sequence into one stretch of each state, in order.
    pub log_likelihood: f64,
    /// `states x instants`: probability of being in the state at the instant, given the sequence.
    pub occupancy: DMatrix<f64>,
    /// `states x instants`: probability that the state lasts `column + 1` instants, given the sequence.
    pub lasting: DMatrix<f64>,
}

/// Forward-backward over explicit durations. `emission[(state, t)]` is the log density of the instant in the state,
/// `duration[(state, d - 1)]` the log weight of lasting `d` instants. Cost: states times instants squared.
#[must_use]
pub fn segments(emission: &DMatrix<f64>, duration: &DMatrix<f64>) -> Segments {
    let (states, instants) = emission.shape();
    // Sums of the emissions before each instant: a stretch's likelihood is a difference.
    let mut before = DMatrix::<f64>::zeros(states, instants + 1);
    for t in 0..instants {
        for state in 0..states {
            before[(state, t + 1)] = before[(state, t)] + emission[(state, t)];
        }
    }
    let stretch = |state: usize, from: usize, to: usize| -> f64 {
        duration[(state, to - from - 1)] + before[(state, to)] - before[(state, from)]
    };
    // ended[(n, t)]: the first n states explain the first t instants; to_come[(n, t)]: the states from n on, the rest.
    let mut ended = DMatrix::<f64>::from_element(states + 1, instants + 1, f64::NEG_INFINITY);
    let mut to_come = ended.clone();
    ended[(0, 0)] = 0.0;
    to_come[(states, instants)] = 0.0;
    let mut terms = Vec::with_capacity(instants);
    for state in 0..states {
        for to in 1..=instants {
            terms.clear();
            terms.extend((0..to).map(|from| ended[(state, from)] + stretch(state, from, to)));
            ended[(state + 1, to)] = log_sum(&terms);
        }
    }
    for state in (0..states).rev() {
        for from in 0..instants {
            terms.clear();
            let ends = from + 1..=instants;
            terms.extend(ends.map(|to| stretch(state, from, to) + to_come[(state + 1, to)]));
            to_come[(state, from)] = log_sum(&terms);
        }
    }
    let log_likelihood = ended[(states, instants)];
    let mut occupancy = DMatrix::zeros(states, instants);
    let mut lasting = DMatrix::zeros(states, instants);
    for state in 0..states {
        for from in 0..instants {
            for to in from + 1..=instants {
                let log =
                    ended[(state, from)] + stretch(state, from, to) + to_come[(state + 1, to)];
                let share = libm::exp(log - log_likelihood);
                lasting[(state, to - from - 1)] += share;
                for t in from..to {
                    occupancy[(state, t)] += share;
                }
            }
        }
    }
    Segments {
        log_likelihood,
        occupancy,
        lasting,
    }
}

/// States of one skill.
#[derive(Debug, Clone)]
struct States {
    emissions: Vec<Gaussian>,
    /// `states x SAMPLES`, log probabilities.
    durations: DMatrix<f64>,
}

impl States {
    /// EM from equal stretches, and the log-likelihood.
    fn fitted(series: &[&DMatrix<f64>], count: usize) -> Result<(Self, f64), BaselineError> {
        let samples = (series.len() * SAMPLES) as f64;
        let stretched = |state: usize, t: usize| f64::from(u8::from(t * count / SAMPLES == state));
        let equal = Segments {
            log_likelihood: f64::NEG_INFINITY,
            occupancy: DMatrix::from_fn(count, SAMPLES, stretched),
            lasting: DMatrix::from_fn(count, SAMPLES, |_, d| {
                f64::from(u8::from(d + 1 == SAMPLES / count))
            }),
        };
        // Wide at first, so that EM can move the ends of the stretches.
        let wide = (SAMPLES / count) as f64;
        let mut states = Self::maximised(series, &vec![equal; series.len()], wide * wide);
        let mut last = f64::NEG_INFINITY;
        for _ in 0..ITERATIONS {
            let cut: Vec<Segments> = series
                .iter()
                .map(|one| Ok(segments(&states.emission_of(one)?, &states.durations)))
                .collect::<Result<_, BaselineError>>()?;
            let total = cut.iter().map(|c| c.log_likelihood).sum::<f64>();
            if total - last < TOLERANCE * samples {
                last = last.max(total);
                break;
            }
            last = total;
            states = Self::maximised(series, &cut, DURATION_FLOOR);
        }
        Ok((states, last))
    }

    fn maximised(series: &[&DMatrix<f64>], cut: &[Segments], duration_floor: f64) -> Self {
        let count = cut.first().map_or(0, |c| c.occupancy.nrows());
        let width = series.first().map_or(0, |s| s.ncols());
        let points = DMatrix::from_fn(series.len() * SAMPLES, width, |row, column| {
            series[row / SAMPLES][(row % SAMPLES, column)]
        });
        let mut durations = DMatrix::zeros(count, SAMPLES);
        let mut emissions = Vec::with_capacity(count);
        for state in 0..count {
            let occupied = cut
                .iter()
                .flat_map(|c| c.occupancy.row(state).iter().copied().collect::<Vec<_>>());
            let weights: Vec<f64> = occupied.collect();
            emissions.push(Gaussian::weighted(&points, &weights, FLOOR));
            let lasting: Vec<f64> = (0..SAMPLES)
                .map(|d| cut.iter().map(|c| c.lasting[(state, d)]).sum())
                .collect();
            let total: f64 = lasting.iter().sum::<f64>().max(f64::MIN_POSITIVE);
            let moment = |about: f64, power: i32| -> f64 {
                let terms = lasting.iter().enumerate();
                let sum: f64 = terms
                    .map(|(d, p)| p * ((d + 1) as f64 - about).powi(power))
                    .sum();
                sum / total
            };
            let mean = moment(0.0, 1);
            let variance = moment(mean, 2).max(duration_floor);
            let logs: Vec<f64> = (0..SAMPLES)
                .map(|d| -0.5 * ((d + 1) as f64 - mean).powi(2) / variance)
                .collect();
            for (d, log) in normalised(&logs).into_iter().enumerate() {
                durations[(state, d)] = log;
            }
        }
        Self {
            emissions,
            durations,
        }
    }

    fn emission_of(&self, series: &DMatrix<f64>) -> Result<DMatrix<f64>, BaselineError> {
        let mut out = DMatrix::zeros(self.emissions.len(), SAMPLES);
        for t in 0..SAMPLES {
            let seen = Seen::all(series.row(t).iter().copied());
            for (state, gaussian) in self.emissions.iter().enumerate() {
                out[(state, t)] = gaussian.log_density(&seen)?;
            }
        }
        Ok(out)
    }

    /// The cut of a movement of which only some instants are seen.
    fn cut(&self, phases: &[f64], instants: &[Seen]) -> Result<Segments, BaselineError> {
        let mut emission = DMatrix::zeros(self.emissions.len(), SAMPLES);
        for (seen, phase) in instants.iter().zip(phases) {
            let sample = nearest_sample(*phase);
            for (state, gaussian) in self.emissions.iter().enumerate() {
                emission[(state, sample)] += gaussian.log_density(seen)?;
            }
        }
        Ok(segments(&emission, &self.durations))
    }

    /// Moments at a sample, given what is seen at it.
    fn expected(
        &self,
        cut: &Segments,
        sample: usize,
        seen: &Seen,
    ) -> Result<Gaussian, BaselineError> {
        let mut parts = Vec::with_capacity(self.emissions.len());
        for (state, gaussian) in self.emissions.iter().enumerate() {
            let share = cut.occupancy[(state, sample)];
            if share > 0.0 {
                parts.push((libm::log(share), gaussian.given(seen)?));
            }
        }
        matched(&parts).ok_or(BaselineError::Numerical("cut of a movement into states"))
    }
}

fn nearest_sample(phase: f64) -> usize {
    (libm::round(phase.clamp(0.0, 1.0) * (SAMPLES - 1) as f64) as usize).min(SAMPLES - 1)
}

/// Hidden semi-Markov models of all skills.
#[derive(Debug, Clone)]
pub struct HiddenMarkov {
    aligned: Aligned,
    /// `[label]`.
    states: Vec<States>,
}

impl HiddenMarkov {
    /// Learns one model for each label.
    ///
    /// # Errors
    /// No demonstrations, or some of other DoFs.
    pub fn learn(train: &[Demonstration], dofs: &[Dof]) -> Result<Self, BaselineError> {
        let aligned = Aligned::new(train, dofs)?;
        let mut states = Vec::new();
        for label in 0..aligned.labels.len() {
            let series: Vec<_> = aligned.of_label(label).collect();
            let parameters = (dofs.len() * (dofs.len() + 3) / 2 + 2) as f64;
            let mut best: Option<(States, f64)> = None;
            for count in COUNTS {
                let (fitted, log_likelihood) = States::fitted(&series, count)?;
                let size = parameters * count as f64;
                let samples = (series.len() * SAMPLES) as f64;
                let bic = size * libm::log(samples) - 2.0 * log_likelihood;
                if best.as_ref().is_none_or(|(_, least)| bic < *least) {
                    best = Some((fitted, bic));
                }
            }
            states.extend(best.map(|(fitted, _)| fitted));
        }
        Ok(Self { aligned, states })
    }

    /// Recognises by the forward likelihood of what is observed; regresses with the likeliest skill's states.
    ///
    /// # Errors
    /// An observation without a logarithm.
    pub fn answer(&self, observed: &Observed, phases: &[f64]) -> Result<Answer, BaselineError> {
        let instants = self.aligned.standardised(observed)?;
        let (mut log_joint, mut cuts) = (Vec::new(), Vec::new());
        for (label, states) in self.states.iter().enumerate() {
            let cut = states.cut(&observed.phases, &instants)?;
            log_joint.push(self.aligned.log_prior(label) + cut.log_likelihood);
            cuts.push(cut);
        }
        let log_posterior = normalised(&log_joint);
        let recognised = largest(&log_posterior);
        let mut paths = Vec::new();
        if let Some(label) = recognised {
            let mut expected = Vec::with_capacity(SAMPLES);
            for sample in 0..SAMPLES {
                let seen = seen_at(&observed.phases, &instants, phase_of(sample));
                expected.push(self.states[label].expected(&cuts[label], sample, &seen)?);
            }
            for dof in 0..self.aligned.dofs().len() {
                let mean = between(&expected, phases, |g| g.mean[dof]);
                let variance = between(&expected, phases, |g| g.covariance[(dof, dof)]);
                paths.push(Some(self.aligned.path(dof, &mean, Some(&variance))));
            }
        }
        Ok(Answer {
            log_posterior: Some(log_posterior),
            recognised,
            paths,
        })
    }
}

/// A number of the expected samples at the phases asked for, linearly between samples.
fn between(expected: &[Gaussian], phases: &[f64], of: impl Fn(&Gaussian) -> f64) -> Vec<f64> {
    let last = expected.len() - 1;
    let one = |phase: &f64| {
        let at = phase.clamp(0.0, 1.0) * last as f64;
        let before = (libm::floor(at) as usize).min(last - 1);
        let (low, high) = (of(&expected[before]), of(&expected[before + 1]));
        low + (at - before as f64) * (high - low)
    };
    phases.iter().map(one).collect()
}

//! Whether a wearable that was put on again sits as it did when its person was calibrated.
//!
//! The person bends the elbow against a weight, then stretches it. Each channel's two envelopes, as logarithms, are
//! compared with those of the calibration under every order of the channels; how hard the person worked is one unknown
//! factor for each of the two. A channel that barely answers is dead; another order that fits far better means cables
//! swapped or a band turned; a channel that alone is much louder or quieter sits elsewhere or is dry.

use serde::{Deserialize, Serialize};
use tonus_shared::wire::Muscle;

use super::measurement::Measurement;
use super::plan::Task;
use super::view::{Estimate, StepView};
use super::{Measured, muscle_name};
use crate::statistics::median;

mod compare;

pub use compare::Finding;

/// What a calibration keeps for later checks: each channel's envelope, V.
#[derive(Debug, Clone, Default, PartialEq, Serialize, Deserialize)]
pub struct Pattern {
    /// At rest.
    pub rest_v: Vec<f64>,
    /// Bending the elbow against a weight.
    pub flex_v: Vec<f64>,
    /// Stretching it.
    pub extend_v: Vec<f64>,
}

/// Why no check is possible.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum FitCheckError {
    /// The pattern belongs to another wearable.
    #[error("the calibration has {expected} channels, the wearable {got}: calibrate this wearable")]
    Channels {
        /// Channels of the pattern.
        expected: usize,
        /// Channels of the wearable.
        got: usize,
    },
    /// The pattern is not one of positive levels.
    #[error("the pattern kept with the calibration is broken: calibrate again")]
    Broken,
}

/// The end of a check.
#[derive(Debug, Clone, PartialEq)]
pub struct Verdict {
    /// What is wrong; empty if nothing is.
    pub findings: Vec<Finding>,
    /// For people: what is wrong and what to do.
    pub text: String,
}

#[derive(Debug, Clone)]
enum Phase {
    Waiting,
    Measuring(Measurement),
    Done,
    Problem(String),
}

/// A check under way: two steps, measured as those of a [`super::Guide`] are.
///
/// The wearable keeps the calibration in use; an envelope that it cuts off ([`super::volts`] gives none) is given as the
/// channel's rest.
#[derive(Debug, Clone)]
pub struct FitCheck {
    reference: Pattern,
    muscles: Vec<Muscle>,
    at: usize,
    phase: Phase,
    flex: Vec<Estimate>,
    verdict: Option<Verdict>,
}

const STEPS: [Task; 2] = [Task::Flex, Task::Extend];

impl Pattern {
    pub(super) fn new(rest: &[Estimate], flex: &[Estimate], extend: &[Estimate]) -> Self {
        let values = |levels: &[Estimate]| levels.iter().map(|level| level.value).collect();
        Self {
            rest_v: values(rest),
            flex_v: values(flex),
            extend_v: values(extend),
        }
    }

    /// Each channel's mean, or why there is none.
    pub(super) fn of(measured: &Measurement, muscles: &[Muscle]) -> Result<Vec<Estimate>, String> {
        let means = (0..muscles.len()).map(|channel| measured.mean(channel));
        means
            .collect::<Option<Vec<_>>>()
            .ok_or_else(|| "Too few good samples arrived: do this step again.".into())
    }

    fn sound(&self) -> bool {
        let all = self.rest_v.iter().chain(&self.flex_v).chain(&self.extend_v);
        let alike =
            self.flex_v.len() == self.rest_v.len() && self.extend_v.len() == self.rest_v.len();
        let rest = median(&self.rest_v);
        alike
            && rest > 0.0
            && all
                .into_iter()
                .all(|level| level.is_finite() && *level >= 0.0)
    }
}

impl FitCheck {
    /// Begins with bending the elbow.
    ///
    /// # Errors
    /// [`FitCheckError`].
    pub fn begin(reference: Pattern, muscles: &[Muscle]) -> Result<Self, FitCheckError> {
        if reference.rest_v.len() != muscles.len() {
            return Err(FitCheckError::Channels {
                expected: reference.rest_v.len(),
                got: muscles.len(),
            });
        }
        if !reference.sound() {
            return Err(FitCheckError::Broken);
        }
        Ok(Self {
            reference,
            muscles: muscles.to_vec(),
            at: 0,
            phase: Phase::Waiting,
            flex: Vec::new(),
            verdict: None,
        })
    }

    /// What the person is to do now.
    #[must_use]
    pub fn task(&self) -> Task {
        match self.phase {
            Phase::Done => Task::Free,
            _ => STEPS[self.at],
        }
    }

    /// Measures the step that is shown, again if it was measured before.
    pub fn start(&mut self) {
        self.verdict = None;
        self.phase = Phase::Measuring(Measurement::new(STEPS[self.at].seconds()));
    }

    /// Goes on to the next step, if this one is measured and good; false if not, or if it was the last.
    pub fn go_on(&mut self) -> bool {
        let may = matches!(self.phase, Phase::Done) && self.at + 1 < STEPS.len();
        if may {
            self.at += 1;
            self.phase = Phase::Waiting;
        }
        may
    }

    /// Goes back to bending, which stands until it is measured again; false if that is shown already.
    pub fn back(&mut self) -> bool {
        let may = self.at > 0;
        if may {
            self.at = 0;
            self.phase = Phase::Done;
        }
        may
    }

    /// Takes one instant; without a step under way it is passed over.
    pub fn sample(&mut self, at_us: u64, measured: &Measured<'_>) {
        let Phase::Measuring(measurement) = &mut self.phase else {
            return;
        };
        if !measurement.take(at_us, measured) {
            return;
        }
        // A dead channel may be flat or off: the verdict names it, so only missing samples stand against the step.
        let judged = match measurement.problem(&[]) {
            Some(problem) => Err(problem),
            None => Ok(levels_of(measurement, self.muscles.len())),
        };
        self.phase = match judged {
            Ok(levels) if self.at == 0 => {
                self.flex = levels;
                Phase::Done
            }
            Ok(levels) => {
                let seen = Pattern::new(&[], &self.flex, &levels);
                self.verdict = Some(compare::verdict(&self.reference, &seen, &self.muscles));
                Phase::Done
            }
            Err(problem) => Phase::Problem(problem),
        };
    }

    /// What was found, after the second step.
    #[must_use]
    pub fn verdict(&self) -> Option<&Verdict> {
        self.verdict.as_ref()
    }

    /// What to show.
    #[must_use]
    pub fn view(&self) -> StepView {
        let task = STEPS[self.at];
        StepView {
            name: task.name().into(),
            number: if self.at == 0 { 1 } else { 2 },
            of: 2,
            instruction: task.instruction(),
            measuring: matches!(self.phase, Phase::Measuring(_)),
            progress: match &self.phase {
                Phase::Waiting | Phase::Problem(_) => 0.0,
                Phase::Measuring(measurement) => measurement.progress(),
                Phase::Done => 1.0,
            },
            done: matches!(self.phase, Phase::Done),
            problem: match &self.phase {
                Phase::Problem(problem) => Some(problem.clone()),
                _ => None,
            },
        }
    }
}

/// A channel of which no sample was good gives nothing.
fn levels_of(measurement: &Measurement, channels: usize) -> Vec<Estimate> {
    let level = |channel| measurement.mean(channel).unwrap_or_default();
    (0..channels).map(level).collect()
}

/// "a, b and c", by muscle and place.
fn named(channels: &[usize], muscles: &[Muscle]) -> String {
    let names = channels.iter().map(|channel| {
        let muscle = muscles.get(*channel).copied().unwrap_or_default();
        format!("channel {} ({})", channel + 1, muscle_name(muscle))
    });
    names.collect::<Vec<_>>().join(", ")
}

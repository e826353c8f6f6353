//! The guided calibration: one step after another, each measured until it is good.

use nalgebra::Vector3;
use tonus_shared::pipeline::activation_weight;
use tonus_shared::stiffness::{ArmPosture, ParameterError, PostureError, Segments};
use tonus_shared::wire::{Calibration, MAX_CHANNELS, Muscle};

use super::Measured;
use super::fit::Load;
use super::fit_check::Pattern;
use super::levels::{self, Scale};
use super::measurement::Measurement;
use super::plan::{Hold, Task, plan};
use super::view::{Estimate, Person, StepView};

mod conclude;

use conclude::base;
pub use conclude::{Outcome, measures, unknown};

/// An effort may be off by this factor either way: it is measured, but the levels must stay apart.
const EFFORT_FACTOR: f64 = 3.0;
/// Why nobody can be calibrated like that.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub enum GuideError {
    /// Body mass or height.
    #[error(transparent)]
    Person(#[from] ParameterError),
    /// A frequency that no power line has.
    #[error("mains frequency {got_hz} Hz: give 50 or 60, or none for no notch")]
    Mains {
        /// The frequency given, Hz.
        got_hz: u8,
    },
    /// No wearable has so many channels.
    #[error("{got} channels: a wearable has 1 to {most}")]
    Channels {
        /// Channels given.
        got: usize,
        /// Channels that a packet carries.
        most: usize,
    },
    /// No channel counts in the activation.
    #[error("no channel sits on biceps or triceps: say where the electrodes are")]
    NoArmMuscle,
    /// The arm cannot be where the holds want it.
    #[error("this arm cannot take the postures of the calibration: {0}")]
    Posture(#[from] PostureError),
}

#[derive(Debug, Clone)]
enum Phase {
    Waiting,
    Measuring(Measurement),
    Done,
    Problem(String),
}

/// Where the hand was in a hold, and how firm: the envelopes stay as they came, because rest and maximum may be measured
/// again.
#[derive(Debug, Clone)]
struct Held {
    hold: Hold,
    hand_m: Vector3<f64>,
    /// Of each channel, V.
    envelope_v: Vec<f64>,
}

/// A calibration under way.
#[derive(Debug, Clone)]
pub struct Guide {
    base: Calibration,
    revision: u32,
    muscles: Vec<Muscle>,
    segments: Segments<f64>,
    plan: Vec<Task>,
    at: usize,
    phase: Phase,
    rest: Vec<Estimate>,
    mvc: Vec<Estimate>,
    flex: Vec<Estimate>,
    extend: Vec<Estimate>,
    held: Vec<Held>,
    outcome: Option<Outcome>,
}

impl Guide {
    /// Begins with the rest. `muscles` and `semg_hz` are the wearable's, `revision` names the calibration (not 0).
    ///
    /// # Errors
    /// [`GuideError`].
    pub fn begin(
        person: &Person,
        muscles: &[Muscle],
        semg_hz: f32,
        revision: u32,
    ) -> Result<Self, GuideError> {
        let segments = Segments::new(person.body_mass_kg, person.body_height_m)?;
        if let Some(got_hz) = person.mains_hz.filter(|hz| ![50, 60].contains(hz)) {
            return Err(GuideError::Mains { got_hz });
        }
        if muscles.is_empty() || muscles.len() > MAX_CHANNELS {
            return Err(GuideError::Channels {
                got: muscles.len(),
                most: MAX_CHANNELS,
            });
        }
        let counts = |channel| activation_weight(muscles, channel).is_some();
        if !(0..muscles.len()).any(counts) {
            return Err(GuideError::NoArmMuscle);
        }
        Ok(Self {
            base: base(person, muscles, semg_hz),
            revision,
            muscles: muscles.to_vec(),
            plan: plan(&segments)?,
            segments,
            at: 0,
            phase: Phase::Waiting,
            rest: Vec::new(),
            mvc: Vec::new(),
            flex: Vec::new(),
            extend: Vec::new(),
            held: Vec::new(),
            outcome: None,
        })
    }

    /// The calibration to measure with: shares of the stream are millivolts under it. Its revision is 0.
    #[must_use]
    pub fn measuring(&self) -> Calibration {
        self.base
    }

    /// What the person is to do now.
    #[must_use]
    pub fn task(&self) -> Task {
        match self.phase {
            Phase::Done => Task::Free,
            _ => self.plan.get(self.at).copied().unwrap_or(Task::Free),
        }
    }

    /// Measures the step that is shown, again if it was measured before. After the last step there is nothing to measure.
    pub fn start(&mut self) {
        if let Some(task) = self.plan.get(self.at) {
            self.phase = Phase::Measuring(Measurement::new(task.seconds()));
        }
    }

    /// Goes on to the next step that is not measured, if this one is measured and good; false if not.
    pub fn go_on(&mut self) -> bool {
        if !matches!(self.phase, Phase::Done) || self.at >= self.plan.len() {
            return false;
        }
        let standing = |phase: &Phase| matches!(phase, Phase::Done);
        self.at = (self.at + 1..self.plan.len())
            .find(|at| !standing(&self.stands(*at)))
            .unwrap_or(self.plan.len());
        self.phase = self.stands(self.at);
        if self.at == self.plan.len() {
            self.phase = match self.conclude() {
                Ok(outcome) => {
                    self.outcome = Some(outcome);
                    Phase::Done
                }
                Err(problem) => Phase::Problem(problem),
            };
        }
        true
    }

    /// Goes back to the step before; false at the first. What was measured there stands until it is measured again, and a
    /// measurement under way is given up. [`Self::go_on`] stops at every later step that no longer stands.
    pub fn back(&mut self) -> bool {
        let Some(before) = self.at.checked_sub(1) else {
            return false;
        };
        self.at = before;
        self.outcome = None;
        self.phase = self.stands(before);
        true
    }

    /// How a step stands by what was measured, under the newest rest and maximum.
    fn stands(&self, at: usize) -> Phase {
        let judged = match self.plan.get(at).copied().unwrap_or(Task::Free) {
            Task::Rest => (!self.rest.is_empty()).then_some(Ok(())),
            Task::Contract => {
                (!self.mvc.is_empty()).then(|| levels::strong(&self.mvc, &self.muscles, &self.rest))
            }
            Task::Flex => (!self.flex.is_empty()).then_some(Ok(())),
            Task::Extend => (!self.extend.is_empty()).then_some(Ok(())),
            Task::Hold(hold) => {
                let held = self.held.iter().find(|held| held.hold == hold);
                held.map(|held| self.effort(&hold, &held.envelope_v).map(|_| ()))
            }
            Task::Free => None,
        };
        match judged {
            None => Phase::Waiting,
            Some(Ok(())) => Phase::Done,
            Some(Err(problem)) => Phase::Problem(problem),
        }
    }

    /// Takes one instant; without a step under way it is passed over.
    pub fn sample(&mut self, at_us: u64, measured: &Measured<'_>) {
        let Phase::Measuring(measurement) = &mut self.phase else {
            return;
        };
        if !measurement.take(at_us, measured) {
            return;
        }
        let measurement = measurement.clone();
        self.phase = match self.judge(&measurement) {
            Ok(()) => Phase::Done,
            Err(problem) => Phase::Problem(problem),
        };
    }

    /// What to show.
    #[must_use]
    pub fn view(&self) -> StepView {
        let task = self.plan.get(self.at).copied().unwrap_or(Task::Free);
        let count = |n: usize| u32::try_from(n).unwrap_or(u32::MAX);
        StepView {
            name: task.name().into(),
            number: count(self.at + 1),
            of: count(self.plan.len() + 1),
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

    /// What was found, after the last step.
    #[must_use]
    pub fn result(&self) -> Option<&Outcome> {
        self.outcome.as_ref()
    }

    fn judge(&mut self, measurement: &Measurement) -> Result<(), String> {
        if let Some(problem) = measurement.problem(&self.muscles) {
            return Err(problem);
        }
        match self.plan.get(self.at).copied().unwrap_or(Task::Free) {
            Task::Free => {}
            Task::Rest => self.rest = levels::rest(measurement, &self.muscles)?,
            Task::Contract => {
                self.mvc = levels::maximum(measurement, &self.muscles, &self.rest)?;
            }
            Task::Flex => self.flex = Pattern::of(measurement, &self.muscles)?,
            Task::Extend => self.extend = Pattern::of(measurement, &self.muscles)?,
            Task::Hold(hold) => {
                let held = self.hold(hold, measurement)?;
                self.held.retain(|other| other.hold != hold);
                self.held.push(held);
            }
        }
        Ok(())
    }

    fn scale(&self) -> Result<Scale, String> {
        // `levels::maximum` let pass only maxima above their rest.
        Scale::new(&self.muscles, &self.rest, &self.mvc)
            .ok_or_else(|| "Rest and maximum do not differ: go back and measure both again.".into())
    }

    fn hold(&self, hold: Hold, measurement: &Measurement) -> Result<Held, String> {
        let hand_m = measurement.hand()?;
        // Where the loads start from must be a place that this arm reaches.
        ArmPosture::from_hand_and_swivel(&self.segments, &hand_m, 0.0)
            .map_err(|error| format!("No arm is like that: {error}. Then do this step again."))?;
        let mean = |channel| measurement.mean(channel).map_or(0.0, |mean| mean.value);
        let envelope_v: Vec<f64> = (0..self.muscles.len()).map(mean).collect();
        self.effort(&hold, &envelope_v)?;
        Ok(Held {
            hold,
            hand_m,
            envelope_v,
        })
    }

    /// The activation of these envelopes, V, under the newest rest and maximum; or why it is not what the hold asks for.
    fn effort(&self, hold: &Hold, envelope_v: &[f64]) -> Result<f64, String> {
        let scale = self.scale()?;
        let activation =
            scale.activation(|channel| envelope_v.get(channel).copied().unwrap_or(0.0));
        let effort = activation / scale.full();
        let (least, most) = (hold.effort / EFFORT_FACTOR, hold.effort * EFFORT_FACTOR);
        if (least..=most).contains(&effort) {
            return Ok(activation);
        }
        Err(format!(
            "The muscles were tensed to {:.0} % of their maximum, {:.0} % are wanted: watch the envelopes, then do this step \
             again.",
            100.0 * effort,
            100.0 * hold.effort
        ))
    }

    /// Every load with the unloaded hold of its group.
    fn loads(&self) -> Result<Vec<Load>, String> {
        let mut loads = Vec::new();
        let planned = self.plan.iter().filter_map(|task| match task {
            Task::Hold(hold) if hold.loaded() => self.held.iter().find(|held| held.hold == *hold),
            _ => None,
        });
        for held in planned {
            let same = |other: &&Held| other.hold.group == held.hold.group && !other.hold.loaded();
            let Some(unloaded) = self.held.iter().find(same) else {
                continue;
            };
            let hand = &unloaded.hand_m;
            let posture = ArmPosture::from_hand_and_swivel(&self.segments, hand, 0.0)
                .map_err(|error| error.to_string())?;
            loads.push(Load {
                posture,
                group: held.hold.group,
                force_n: held.hold.force_n.into(),
                activation: self.effort(&held.hold, &held.envelope_v)?,
                moved_m: held.hand_m - hand,
            });
        }
        Ok(loads)
    }
}

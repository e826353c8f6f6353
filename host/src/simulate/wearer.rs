//! The person in time: tasks one after another, a scan every millisecond, frames of the tracker as they
//! arrive.
//!
//! One clock serves wearable and host here; fitting two clocks is the clock room's matter.

use super::emg::{Electrodes, ElectrodesError, SCAN_US};
use super::muscle::{self, CHANNELS, Vigour};
use super::operator::Operation;
use super::skills::{DURATION_US, Latent, Skill, hand_over_to, minimum_jerk};
use super::tracker::{TrackedHand, Tracker, TrackerNoise};
use rand_chacha::ChaCha8Rng;
use std::collections::VecDeque;
use tonus_shared::sample::{AdcScale, Scan};

/// How long the arm rests, or contracts with all its strength, for calibration: microseconds.
pub const CALIBRATION_US: u64 = 4_000_000;
/// Time before every action in which the hand goes to its start and the muscles relax, microseconds.
pub const PAUSE_US: u64 = 1_500_000;
/// How long a hand rests before it travels and before it acts, where it does.
pub const REST_US: u64 = 1_000_000;
/// What the person does after the last task: nothing, until the last signals are through the filters. Microseconds.
pub const TAIL_US: u64 = 500_000;
/// Muscles let go of the last action within this time, microseconds.
const RELEASE_US: u64 = 500_000;
/// Calibration's contraction rises and falls within this time, microseconds.
const RAMP_US: u64 = 500_000;
/// Where the hand lies during calibration: shoulder frame, metres.
pub(super) const REST_M: [f64; 3] = [0.24, -0.10, -0.34];

/// One execution of a skill: everything random about it is here.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Action {
    /// What is done.
    pub skill: Skill,
    /// Which path the hand takes.
    pub latent: Latent,
    /// How the muscles differ from the usual.
    pub vigour: Vigour,
}

impl Action {
    /// Draws an execution of `skill`.
    pub fn sample(skill: Skill, rng: &mut ChaCha8Rng) -> Self {
        Self {
            skill,
            latent: skill.sample(rng),
            vigour: Vigour::sample(rng),
        }
    }

    /// Draws a hand-over to the target `y_m` (shoulder frame, metres; 0.05 to 0.35 are usual).
    pub fn hand_over(y_m: f64, rng: &mut ChaCha8Rng) -> Self {
        Self {
            skill: Skill::HandOver,
            latent: hand_over_to(y_m, rng),
            vigour: Vigour::sample(rng),
        }
    }

    /// Draws the muscles of an execution of `skill` along the path that `latent` says.
    pub fn with_latent(skill: Skill, latent: Latent, rng: &mut ChaCha8Rng) -> Self {
        Self {
            skill,
            latent,
            vigour: Vigour::sample(rng),
        }
    }

    /// Position of the hand at phase `s`, shoulder frame, metres.
    #[must_use]
    pub fn hand_m(&self, s: f64) -> [f64; 3] {
        self.skill.position_m(&self.latent, s)
    }

    /// Activation of the channels at phase `s`, shares of maximum voluntary contraction.
    #[must_use]
    pub fn activation(&self, s: f64) -> [f64; CHANNELS] {
        muscle::activation(self.skill, &self.latent, &self.vigour, s)
    }
}

/// What the person is asked to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Task {
    /// Lie still for [`CALIBRATION_US`].
    Rest,
    /// Contract all muscles with all strength for [`CALIBRATION_US`], ramps included.
    Contract,
    /// After a pause of [`PAUSE_US`], one action of [`DURATION_US`]. The hand travels to its start all through the pause.
    Perform(Action),
    /// The same, and the hand rests for [`REST_US`] before it travels and again before it acts: nobody announces anything to
    /// who watches.
    PerformRested(Action),
    /// After such a pause, one action at a tempo of its own.
    Paced {
        /// The action.
        action: Action,
        /// How long it takes, microseconds; not zero.
        duration_us: u64,
    },
    /// After such a pause, the second pass of an action: the robot's part shown by teleoperation, in [`DURATION_US`].
    Operate(Operation),
}

impl Task {
    /// The action of one that is performed in [`DURATION_US`].
    #[must_use]
    pub const fn performed(&self) -> Option<Action> {
        match self {
            Self::Perform(action) | Self::PerformRested(action) => Some(*action),
            _ => None,
        }
    }

    /// How long it lasts, and the pause before it, microseconds.
    fn lasts_us(&self) -> (u64, u64) {
        match self {
            Self::Rest | Self::Contract => (CALIBRATION_US, 0),
            Self::Perform(_) | Self::Operate(_) => (DURATION_US, PAUSE_US),
            Self::PerformRested(_) => (DURATION_US, REST_US + PAUSE_US + REST_US),
            Self::Paced { duration_us, .. } => (*duration_us, PAUSE_US),
        }
    }

    /// What is true at phase `s` of a movement; none of a calibration.
    fn moving(&self, s: f64) -> Option<Truth> {
        let (hand_m, activation) = match self {
            Self::Rest | Self::Contract => return None,
            Self::Perform(action) | Self::PerformRested(action) | Self::Paced { action, .. } => {
                (action.hand_m(s), action.activation(s))
            }
            Self::Operate(operation) => (operation.hand_m(s), operation.activation(s)),
        };
        Some(Truth { hand_m, activation })
    }
}

/// A task's place in time.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Span {
    /// The task.
    pub task: Task,
    /// When it starts, microseconds; for an action, after its pause.
    pub start_us: u64,
    /// When it ends, microseconds.
    pub end_us: u64,
}

/// What is true at one instant, for scoring; no part of the system may look at it.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Truth {
    /// Position of the hand, shoulder frame, metres.
    pub hand_m: [f64; 3],
    /// Activation of the channels, shares of maximum voluntary contraction.
    pub activation: [f64; CHANNELS],
}

/// One millisecond.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Moment {
    /// The scan of this millisecond; its `acquired_us` is the time.
    pub scan: Scan<CHANNELS>,
    /// A tracker frame that reached the host by now.
    pub hand: Option<TrackedHand>,
    /// What is true.
    pub truth: Truth,
}

/// The person: an iterator over milliseconds that ends [`TAIL_US`] after the last task.
#[derive(Debug, Clone)]
pub struct Wearer {
    spans: Vec<Span>,
    electrodes: Electrodes,
    tracker: Tracker,
    arriving: VecDeque<TrackedHand>,
    now_us: u64,
    end_us: u64,
}

impl Wearer {
    /// A person who does the tasks in order, from time zero. Electrodes and tracker draw from `seed`.
    ///
    /// # Errors
    /// [`ElectrodesError`]; none in practice.
    pub fn new(tasks: &[Task], noise: TrackerNoise, seed: u64) -> Result<Self, ElectrodesError> {
        let mut end_us = 0;
        let spans = tasks
            .iter()
            .map(|&task| {
                let (lasts_us, pause_us) = task.lasts_us();
                let start_us = end_us + pause_us;
                end_us = start_us + lasts_us;
                Span {
                    task,
                    start_us,
                    end_us,
                }
            })
            .collect();
        Ok(Self {
            spans,
            electrodes: Electrodes::new(seed)?,
            tracker: Tracker::new(noise, seed),
            arriving: VecDeque::new(),
            now_us: 0,
            end_us: end_us + TAIL_US,
        })
    }

    /// The tasks and their times, in order.
    #[must_use]
    pub fn spans(&self) -> &[Span] {
        &self.spans
    }

    /// The scale of the scans' counts.
    #[must_use]
    pub fn scale(&self) -> AdcScale {
        self.electrodes.scale()
    }

    /// What is true at `at_us`.
    #[must_use]
    pub fn truth(&self, at_us: u64) -> Truth {
        // The first task that ends later: the one under way, or the one whose pause it is.
        let next = self.spans.partition_point(|span| span.end_us <= at_us);
        let before = next.checked_sub(1).and_then(|last| self.spans.get(last));
        let Some(span) = self.spans.get(next) else {
            return end_of(before, at_us);
        };
        if at_us < span.start_us {
            let from = end_of(before, at_us);
            let Some(start) = span.task.moving(0.0) else {
                return from;
            };
            let rest_us = match span.task {
                Task::PerformRested(_) => REST_US,
                _ => 0,
            };
            let left_us = (span.start_us - at_us).saturating_sub(rest_us);
            let way = minimum_jerk(1.0 - share(left_us.min(PAUSE_US), PAUSE_US));
            let hand_m = std::array::from_fn(|axis| {
                from.hand_m[axis] + way * (start.hand_m[axis] - from.hand_m[axis])
            });
            return Truth { hand_m, ..from };
        }
        let s = share(at_us - span.start_us, span.end_us - span.start_us);
        if let Some(truth) = span.task.moving(s) {
            return truth;
        }
        let level = match span.task {
            Task::Contract => {
                let from_edge_us = (at_us - span.start_us).min(span.end_us - at_us);
                minimum_jerk(share(from_edge_us, RAMP_US))
            }
            _ => 0.0,
        };
        Truth {
            hand_m: REST_M,
            activation: [level; CHANNELS],
        }
    }

    /// The hand's acceleration at the present, m/s^2, by central differences.
    fn acceleration(&self) -> [f64; 3] {
        const STEP_US: u64 = 2_000;
        const STEP_S: f64 = 2e-3;
        if self.now_us < STEP_US {
            return [0.0; 3];
        }
        let [a, b, c] = [self.now_us - STEP_US, self.now_us, self.now_us + STEP_US]
            .map(|t| self.truth(t).hand_m);
        std::array::from_fn(|axis| (a[axis] - 2.0 * b[axis] + c[axis]) / (STEP_S * STEP_S))
    }
}

/// What lasts after a task (none: before the first): the hand stays, the muscles let go.
fn end_of(span: Option<&Span>, at_us: u64) -> Truth {
    let lying = Truth {
        hand_m: REST_M,
        activation: [0.0; CHANNELS],
    };
    let Some((span, truth)) = span.and_then(|span| Some((span, span.task.moving(1.0)?))) else {
        return lying;
    };
    let kept = 1.0 - minimum_jerk(share(at_us - span.end_us, RELEASE_US));
    Truth {
        activation: truth.activation.map(|a| a * kept),
        ..truth
    }
}

#[allow(clippy::cast_precision_loss, reason = "durations of seconds")]
fn share(part_us: u64, whole_us: u64) -> f64 {
    part_us as f64 / whole_us as f64
}

impl Iterator for Wearer {
    type Item = Moment;

    fn next(&mut self) -> Option<Moment> {
        if self.now_us >= self.end_us {
            return None;
        }
        while self.tracker.next_us() <= self.now_us {
            let hand_m = self.truth(self.tracker.next_us()).hand_m;
            self.arriving.extend(self.tracker.expose(hand_m));
        }
        let truth = self.truth(self.now_us);
        let acceleration = self.acceleration();
        let arrived = self
            .arriving
            .front()
            .is_some_and(|hand| hand.arrived_us <= self.now_us);
        let moment = Moment {
            scan: self.electrodes.scan(truth.activation, acceleration),
            hand: if arrived {
                self.arriving.pop_front()
            } else {
                None
            },
            truth,
        };
        self.now_us += SCAN_US;
        Some(moment)
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;

    fn a_day() -> Vec<Task> {
        let mut rng = ChaCha8Rng::seed_from_u64(8);
        let mut tasks = vec![Task::Rest, Task::Contract];
        tasks.extend(Skill::ALL.map(|skill| Task::Perform(Action::sample(skill, &mut rng))));
        tasks.push(Task::Perform(Action::hand_over(0.3, &mut rng)));
        tasks
    }

    #[test]
    fn hand_and_muscles_never_jump() {
        let wearer = Wearer::new(&a_day(), TrackerNoise::NONE, 1).unwrap();
        let mut last = wearer.truth(0);
        for moment in wearer {
            for axis in 0..3 {
                assert!((moment.truth.hand_m[axis] - last.hand_m[axis]).abs() < 0.002);
            }
            for channel in 0..CHANNELS {
                assert!(
                    (moment.truth.activation[channel] - last.activation[channel]).abs() < 0.006
                );
            }
            last = moment.truth;
        }
    }

    #[test]
    fn a_day_lasts_as_long_as_its_tasks_and_repeats_itself() {
        let day = || Wearer::new(&a_day(), TrackerNoise::STATED, 5).unwrap();
        let moments: Vec<_> = day().collect();
        assert_eq!(moments.len(), 2 * 4000 + 5 * 3500 + 500);
        assert_eq!(day().spans().last().unwrap().end_us, 25_500_000);
        assert!(day().eq(moments.iter().copied()));
        let other = Wearer::new(&a_day(), TrackerNoise::STATED, 6).unwrap();
        assert!(!other.eq(moments));
    }

    #[test]
    fn actions_happen_when_their_spans_say() {
        let wearer = Wearer::new(&a_day(), TrackerNoise::NONE, 1).unwrap();
        for span in wearer.spans() {
            if let Task::Perform(action) = span.task {
                assert_eq!(wearer.truth(span.start_us).hand_m, action.hand_m(0.0));
                assert_eq!(
                    wearer.truth(span.start_us + 500_000).activation,
                    action.activation(0.25)
                );
                assert_eq!(wearer.truth(span.end_us).hand_m, action.hand_m(1.0));
            }
        }
    }

    #[test]
    fn frames_show_where_the_hand_was_when_they_were_exposed() {
        let wearer = Wearer::new(&a_day(), TrackerNoise::NONE, 2).unwrap();
        let truth = wearer.clone();
        let mut frames = 0;
        for moment in wearer {
            if let Some(hand) = moment.hand {
                frames += 1;
                assert!(
                    hand.arrived_us <= moment.scan.acquired_us && hand.exposed_us < hand.arrived_us
                );
                let at_m = truth.truth(hand.exposed_us).hand_m;
                assert!((0..3).all(|axis| (hand.position_m[axis] - at_m[axis]).abs() < 1e-4));
            }
        }
        assert!(frames > 2500, "{frames}");
    }
}

//! One movement followed: the detector begins it, the bank of hypotheses takes what is seen from there on.

use serde::Serialize;
use tonus_shared::onset::{MotionEdge, OnsetConfig, OnsetDetector};

use super::super::data::Set;
use super::super::setting::Phase;
use super::moments::{Moment, moments};
use super::{DURATIONS, FRACTIONS};
use crate::experiment::ExperimentError;
use crate::experiment::statistics::median_and_spread;
use crate::model::Model;
use crate::model::tempo::{TempoConfig, TempoRecogniser};

/// One observation so often, by time.
const INTERVAL_S: f64 = 0.1;
/// One observation so often, by the length of the path.
const INTERVAL_M: f64 = 0.05;
/// How far a hand has gone before the detector takes it for moving, standard deviation: by path the onset is hardly unknown.
const ONSET_STD_M: f64 = 0.01;

/// What is watched, and by what its progress is told.
#[derive(Debug, Clone, Copy, PartialEq, Eq, Serialize)]
pub struct Watch {
    /// The time, or the length of the hand's path in its place: how fast somebody is does not matter then.
    pub phase: Phase,
    /// Besides the hand: where the elbow is from the shoulder, as a sensor of the upper arm's attitude tells.
    pub upper_arm: bool,
}

impl std::fmt::Display for Watch {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        let what = if self.upper_arm {
            "hand and upper arm"
        } else {
            "hand"
        };
        let by = match self.phase {
            Phase::Time => "time",
            Phase::Path => "path",
        };
        write!(f, "{what} by {by}")
    }
}

impl Watch {
    /// The hand alone.
    pub(super) const fn hand(phase: Phase) -> Self {
        Self {
            phase,
            upper_arm: false,
        }
    }

    /// The hand and the upper arm.
    pub(super) const fn arm(phase: Phase) -> Self {
        Self {
            phase,
            upper_arm: true,
        }
    }

    pub(super) const fn dofs(self) -> &'static [&'static str] {
        const ALL: [&str; 6] = ["x", "y", "z", "upper_arm_x", "upper_arm_y", "upper_arm_z"];
        if self.upper_arm {
            return &ALL;
        }
        ALL.split_at(3).0
    }

    const fn interval(self) -> f64 {
        match self.phase {
            Phase::Time => INTERVAL_S,
            Phase::Path => INTERVAL_M,
        }
    }
}

/// The detector's error: a Gaussian's mean and standard deviation.
#[derive(Debug, Clone, Copy)]
pub(super) struct Late {
    mean_s: f64,
    std_s: f64,
}

impl Late {
    /// The onset told last in the first half of these movements, later than the true one: median, and the standard deviation
    /// of a Gaussian that has its median distance.
    pub(super) fn of(set: &Set, movements: &[usize]) -> Result<Self, ExperimentError> {
        let mut late_s = Vec::with_capacity(movements.len());
        for (&movement, seed) in movements.iter().zip(1..) {
            let shape = &set.demonstrations()[movement];
            let (start_s, half_s) = (shape.t_s()[0], 0.5 * shape.duration_s() + 1e-9);
            let mut detector = OnsetDetector::new(&OnsetConfig::default())?;
            let mut last = None;
            let moments = moments(set, movement, seed);
            for moment in moments.iter().filter(|m| m.time_s <= start_s + half_s) {
                let edge = detector.step(moment.time_s, moment.hand_m())?;
                if let Some(MotionEdge::Onset { at_s }) = edge {
                    last = Some(at_s - start_s);
                }
            }
            late_s.extend(last);
        }
        if late_s.is_empty() {
            let TempoConfig {
                onset_late_s: mean_s,
                onset_std_s: std_s,
                ..
            } = TempoConfig::default();
            return Ok(Self { mean_s, std_s });
        }
        let (mean_s, std_s) = median_and_spread(&late_s);
        Ok(Self { mean_s, std_s })
    }

    /// Hypotheses by this phase; by path what is called a time, or a duration, is a length.
    fn tempo(self, phase: Phase) -> TempoConfig {
        let (onset_late_s, onset_std_s) = match phase {
            Phase::Time => (self.mean_s, self.std_s),
            Phase::Path => (0.0, ONSET_STD_M),
        };
        TempoConfig {
            durations: DURATIONS,
            onset_late_s,
            onset_std_s,
            lead_s: 0.0,
            ..TempoConfig::default()
        }
    }
}

/// Who follows: a model of what is so watched, and the noise assumed of it.
#[derive(Debug)]
pub(super) struct Follower<'m> {
    recogniser: TempoRecogniser<'m>,
    watch: Watch,
    sigma_m: f64,
    /// Where the next observation is due.
    next: f64,
}

impl<'m> Follower<'m> {
    pub(super) fn new(
        model: &'m Model,
        view: &'m crate::model::View<'m>,
        late: Late,
        watch: Watch,
        sigma_m: f64,
    ) -> Result<Self, ExperimentError> {
        Ok(Self {
            recogniser: TempoRecogniser::new(model, view, late.tempo(watch.phase))?,
            watch,
            sigma_m,
            next: f64::NEG_INFINITY,
        })
    }

    /// Log posterior of the skills after each fraction of a movement that starts there and takes so long, none of which is
    /// told to the recogniser.
    pub(super) fn follow(
        &mut self,
        moments: &[Moment],
        (start_s, duration_s): (f64, f64),
    ) -> Result<[Vec<f64>; 3], ExperimentError> {
        self.recogniser.end();
        self.next = f64::NEG_INFINITY;
        let mut detector = OnsetDetector::new(&OnsetConfig::default())?;
        let mut said: [Option<Vec<f64>>; 3] = [const { None }; 3];
        for (place, moment) in moments.iter().enumerate() {
            for (said, fraction) in said.iter_mut().zip(FRACTIONS) {
                if said.is_none() && moment.time_s > start_s + fraction * duration_s + 1e-9 {
                    *said = Some(self.recogniser.log_posterior());
                }
            }
            // By time the recogniser keeps what it needs of what was before the onset.
            if self.watch.phase == Phase::Time || self.recogniser.begun() {
                self.observe(moment)?;
            }
            let edge = detector.step(moment.time_s, moment.hand_m())?;
            if let Some(MotionEdge::Onset { at_s }) = edge {
                self.begin(&moments[..=place], at_s)?;
            }
        }
        Ok(said.map(|said| said.unwrap_or_else(|| self.recogniser.log_posterior())))
    }

    fn begin(&mut self, seen: &[Moment], at_s: f64) -> Result<(), ExperimentError> {
        if self.watch.phase == Phase::Time {
            return Ok(self.recogniser.begin(at_s)?);
        }
        let from = seen.partition_point(|moment| moment.time_s < at_s - 1e-9);
        let since = seen.get(from..).unwrap_or_default();
        let Some(first) = since.first().or(seen.last()) else {
            return Ok(());
        };
        self.recogniser.begin(first.path_m)?;
        self.next = f64::NEG_INFINITY;
        since.iter().try_for_each(|moment| self.observe(moment))
    }

    /// Observes if it is time, or far enough.
    fn observe(&mut self, moment: &Moment) -> Result<(), ExperimentError> {
        let along = moment.along(self.watch.phase);
        if along < self.next {
            return Ok(());
        }
        // Frames that come a little early are as good as the interval.
        let slack = match self.watch.phase {
            Phase::Time => 1e-3,
            Phase::Path => 0.0,
        };
        self.next = along + self.watch.interval() - slack;
        for (dof, &value_m) in (0..self.watch.dofs().len()).zip(&moment.row_m) {
            self.recogniser.observe(dof, along, value_m, self.sigma_m)?;
        }
        Ok(())
    }
}

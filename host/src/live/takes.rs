//! Demonstrations as they are recorded: what hand, muscles and robot did, joined by the instants that they describe.

use tonus_shared::onset::{MotionEdge, OnsetConfig, OnsetDetector};

use super::engine::Engine;
use super::view::{DemonstrationView, RecordingView};
use crate::demonstration::{Demonstration, DemonstrationError};
use crate::session::DOFS;

/// Longer gaps of hand or robot are not bridged, microseconds: as an occlusion.
const LONGEST_GAP_US: u64 = 60_000;
/// The longest demonstration, microseconds.
pub(super) const LONGEST_US: u64 = 60_000_000;
/// Stiffness describes what was so long ago at most, and packets come so much later: a demonstration waits for both,
/// microseconds.
const WAIT_US: u64 = 600_000;
/// Points of the speed curve that is shown.
const SHOWN: usize = 120;
/// A longer rest ends a movement, seconds: as in the session that follows it.
const LONGEST_REST_S: f64 = 0.5;
/// What stays before the hand moves and after it stopped, seconds.
const MARGIN_S: f64 = 0.05;

/// Values with their times: hand or robot.
#[derive(Debug, Default)]
struct Series<const N: usize>(Vec<(u64, [f64; N])>);

impl<const N: usize> Series<N> {
    fn push(&mut self, at_us: u64, values: [f64; N]) {
        // Out of order or twice: tells nothing new.
        if self.0.last().is_none_or(|(last_us, _)| *last_us < at_us) {
            self.0.push((at_us, values));
        }
    }

    /// By linear interpolation between neighbours that are near enough.
    fn at(&self, at_us: u64) -> Option<[f64; N]> {
        let next = self.0.partition_point(|(us, _)| *us < at_us);
        let (after_us, after) = self.0.get(next)?;
        if *after_us == at_us {
            return Some(*after);
        }
        let (before_us, before) = self.0.get(next.checked_sub(1)?)?;
        let gap_us = after_us - before_us;
        if gap_us > LONGEST_GAP_US {
            return None;
        }
        #[allow(clippy::cast_precision_loss, reason = "at most 60 ms")]
        let way = (at_us - before_us) as f64 / gap_us as f64;
        Some(std::array::from_fn(|axis| {
            before[axis] + way * (after[axis] - before[axis])
        }))
    }
}

/// A demonstration on its way.
#[derive(Debug)]
pub(super) struct Take {
    label: String,
    began_us: u64,
    ended_us: Option<u64>,
    hands: Series<3>,
    robots: Series<6>,
    stiffnesses: Series<3>,
}

impl Take {
    pub(super) fn new(label: String, began_us: u64) -> Self {
        Self {
            label,
            began_us,
            ended_us: None,
            hands: Series::default(),
            robots: Series::default(),
            stiffnesses: Series::default(),
        }
    }

    pub(super) fn hand(&mut self, exposed_us: u64, hand_m: [f64; 3]) {
        self.hands.push(exposed_us, hand_m);
    }

    pub(super) fn robot(&mut self, at_us: u64, position_m: [f64; 3], n_per_m: [f64; 3]) {
        let [x, y, z] = position_m;
        let [kx, ky, kz] = n_per_m;
        self.robots.push(at_us, [x, y, z, kx, ky, kz]);
    }

    pub(super) fn stiffness(&mut self, describes_us: u64, n_per_m: [f64; 3]) {
        if describes_us >= self.began_us
            && self.ended_us.is_none_or(|end_us| describes_us <= end_us)
        {
            self.stiffnesses.push(describes_us, n_per_m);
        }
    }

    /// A person says that it is over; what is still on its way is waited for.
    pub(super) fn stop(&mut self, at_us: u64) {
        self.ended_us.get_or_insert(at_us);
    }

    /// Whether everything that describes it has come.
    pub(super) fn complete(&self, now_us: u64) -> bool {
        self.ended_us
            .is_some_and(|ended_us| now_us >= ended_us + WAIT_US)
    }

    pub(super) fn began_us(&self) -> u64 {
        self.began_us
    }

    pub(super) fn view(&self, now_us: u64) -> RecordingView {
        let until_us = self.ended_us.unwrap_or(now_us);
        RecordingView {
            label: self.label.clone(),
            seconds: seconds(until_us.saturating_sub(self.began_us)),
            rows: self.stiffnesses.0.len(),
        }
    }

    /// Joined, and trimmed to where the hand moved.
    pub(super) fn finish(self, id: u32) -> Kept {
        let mut rows = Vec::new();
        for (at_us, stiffness) in &self.stiffnesses.0 {
            let (Some([hx, hy, hz]), Some([rx, ry, rz, rkx, rky, rkz])) =
                (self.hands.at(*at_us), self.robots.at(*at_us))
            else {
                continue;
            };
            let [kx, ky, kz] = *stiffness;
            rows.push(Row {
                t_s: seconds(at_us - self.began_us),
                values: [hx, hy, hz, kx, ky, kz, rx, ry, rz, rkx, rky, rkz],
            });
        }
        let end_us = self.ended_us.unwrap_or(self.began_us);
        let whole_s = seconds(end_us.saturating_sub(self.began_us));
        let moved = moved(&rows);
        let seen = [
            self.stiffnesses.0.len(),
            self.hands.0.len(),
            self.robots.0.len(),
        ];
        Kept {
            id,
            label: self.label,
            kept_s: moved.map_or([0.0, whole_s], |[from_s, to_s]| {
                [(from_s - MARGIN_S).max(0.0), (to_s + MARGIN_S).min(whole_s)]
            }),
            whole_s,
            moves: moved.is_some(),
            seen,
            rows,
        }
    }
}

/// One instant of a demonstration, in the order of [`DOFS`].
#[derive(Debug, Clone, Copy, PartialEq)]
pub(super) struct Row {
    pub(super) t_s: f64,
    pub(super) values: [f64; DOFS.len()],
}

/// The longest time in which the hand moved, seconds; none if it did not move. On the way to where the movement begins and back
/// the hand moves too; what lies apart by a shorter rest than ends a movement is one.
fn moved(rows: &[Row]) -> Option<[f64; 2]> {
    let mut detector = OnsetDetector::new(&OnsetConfig::default()).ok()?;
    let mut spans: Vec<[f64; 2]> = Vec::new();
    let end_s = rows.last()?.t_s;
    for row in rows {
        let [x, y, z, ..] = row.values;
        match detector.step(row.t_s, [x, y, z]) {
            Ok(Some(MotionEdge::Onset { at_s })) => match spans.last_mut() {
                Some([_, last_s]) if at_s - *last_s < LONGEST_REST_S => *last_s = end_s,
                _ => spans.push([at_s, end_s]),
            },
            Ok(Some(MotionEdge::End { at_s })) => {
                if let Some([_, last_s]) = spans.last_mut() {
                    *last_s = at_s;
                }
            }
            // Rows come in order and are finite.
            Ok(None) | Err(_) => {}
        }
    }
    spans
        .into_iter()
        .max_by(|a, b| (a[1] - a[0]).total_cmp(&(b[1] - b[0])))
}

/// A demonstration that was recorded.
#[derive(Debug, Clone)]
pub(super) struct Kept {
    pub(super) id: u32,
    pub(super) label: String,
    whole_s: f64,
    pub(super) kept_s: [f64; 2],
    moves: bool,
    /// Samples of stiffness, hand and robot.
    seen: [usize; 3],
    rows: Vec<Row>,
}

/// Why a demonstration cannot be learnt from.
#[derive(Debug, Clone, PartialEq, thiserror::Error)]
pub(super) enum TakeError {
    #[error("no stiffness arrived: check that the wearable streams and is calibrated")]
    NoStiffness,
    #[error("the hand was never seen: move into the tracker's view, and record again")]
    NoHand,
    #[error("the robot did not tell where it is: show it its part while you record")]
    NoRobot,
    #[error("the hand did not move faster than 0.2 m/s: record again, or trim by hand")]
    Still,
    #[error(transparent)]
    Demonstration(#[from] DemonstrationError),
}

impl Kept {
    /// Keeps a part, seconds since its begin.
    pub(super) fn trim(&mut self, from_s: f64, to_s: f64) -> Result<(), String> {
        let within = (0.0..=self.whole_s + 1e-9).contains(&from_s)
            && (0.0..=self.whole_s + 1e-9).contains(&to_s);
        if !within || to_s - from_s < 0.1 {
            return Err(format!(
                "cannot keep {from_s:.2} to {to_s:.2} s of demonstration {}: give a part of at least 0.1 s within 0 to {:.2} s",
                self.id, self.whole_s
            ));
        }
        self.kept_s = [from_s, to_s];
        self.moves = true;
        Ok(())
    }

    /// As it is learnt from.
    pub(super) fn demonstration(&self) -> Result<Demonstration, TakeError> {
        let [stiffnesses, hands, robots] = self.seen;
        if stiffnesses == 0 {
            return Err(TakeError::NoStiffness);
        }
        if hands == 0 {
            return Err(TakeError::NoHand);
        }
        if robots == 0 {
            return Err(TakeError::NoRobot);
        }
        if !self.moves {
            return Err(TakeError::Still);
        }
        let [from_s, to_s] = self.kept_s;
        let kept = (self.rows.iter()).filter(|row| (from_s..=to_s).contains(&row.t_s));
        let rows: Vec<&Row> = kept.collect();
        let t_s = rows.iter().map(|row| row.t_s - from_s).collect();
        let series = |dof: usize| rows.iter().map(|row| row.values[dof]).collect();
        let values = (0..DOFS.len()).map(series).collect();
        let made = Demonstration::new(
            self.label.clone(),
            self.id.to_string(),
            "recorded here",
            t_s,
            values,
        );
        Ok(made?)
    }

    pub(super) fn view(&self) -> DemonstrationView {
        let stride = self.rows.len().div_ceil(SHOWN).max(1);
        let shown: Vec<&Row> = self.rows.iter().step_by(stride).collect();
        let speeds = shown.windows(2).map(|pair| {
            let along = |axis: usize| pair[1].values[axis] - pair[0].values[axis];
            let moved_m = (0..3).map(|axis| along(axis).powi(2)).sum::<f64>().sqrt();
            let t_s = 0.5 * (pair[0].t_s + pair[1].t_s);
            (t_s, moved_m / (pair[1].t_s - pair[0].t_s))
        });
        #[allow(clippy::cast_possible_truncation, reason = "for the screen")]
        let (speed_t_s, speed_m_per_s) = speeds.map(|(t, v)| (t as f32, v as f32)).unzip();
        DemonstrationView {
            id: self.id,
            label: self.label.clone(),
            seconds: self.whole_s,
            rows: self.rows.len(),
            kept_s: self.kept_s,
            speed_m_per_s,
            speed_t_s,
            problem: self.demonstration().err().map(|error| error.to_string()),
        }
    }
}

impl Engine {
    /// Every demonstration that is kept, as it is learnt from; and why others cannot be.
    #[must_use]
    pub fn demonstrations(&self) -> (Vec<Demonstration>, Vec<String>) {
        let (mut good, mut problems) = (Vec::new(), Vec::new());
        for kept in &self.kept {
            match kept.demonstration() {
                Ok(demonstration) => good.push(demonstration),
                Err(error) => problems.push(format!(
                    "demonstration {} ({}): {error}",
                    kept.id, kept.label
                )),
            }
        }
        (good, problems)
    }
}

#[allow(clippy::cast_precision_loss, reason = "microseconds of a day")]
pub(super) fn seconds(us: u64) -> f64 {
    us as f64 * 1e-6
}

//! What the person does that no demonstration shows: whether it was named unknown, and what the robot did meanwhile.

use serde::Serialize;

use crate::robot::gate::FOLLOW_AGE_US;
use crate::session::NoveltyReport;

/// One action that is in no demonstration.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct OutsideScore {
    /// Label of what the person did.
    pub performed: String,
    /// Whether it was named unknown before it ended.
    pub named_unknown: bool,
    /// Time from its begin to that, seconds; none if it never was.
    pub seconds_to_unknown: Option<f64>,
    /// Label of the skill that it was nearest to in the end; none if the gate saw nothing.
    pub nearest: Option<String>,
    /// Distance from that, in standard deviations of one performance from another.
    pub distance: Option<f64>,
    /// Whether the robot was told to stay exactly where it was from then (and the 60 ms for which a command that was on its
    /// way may be followed) to the end of the action.
    pub held: bool,
    /// How far from where it was when the action began the robot was told to go at most, metres.
    pub moved_m: f64,
}

/// The robot's set-point through one such action.
#[derive(Debug, Clone, Copy)]
pub(super) struct Held {
    began_us: u64,
    from_m: [f64; 3],
    moved_m: f64,
    unknown_us: Option<u64>,
    kept_m: Option<[f64; 3]>,
    left: bool,
}

impl Held {
    pub(super) fn new(began_us: u64, from_m: [f64; 3]) -> Self {
        Self {
            began_us,
            from_m,
            moved_m: 0.0,
            unknown_us: None,
            kept_m: None,
            left: false,
        }
    }

    /// One millisecond: whether the movement is unknown by now, and where the robot is told to be.
    pub(super) fn add(&mut self, now_us: u64, unknown: bool, setpoint_m: [f64; 3]) {
        let way_m = (0..3).map(|axis| setpoint_m[axis] - self.from_m[axis]);
        let way_m = way_m.map(|d| d * d).sum::<f64>().sqrt();
        self.moved_m = self.moved_m.max(way_m);
        if unknown {
            self.unknown_us.get_or_insert(now_us);
        }
        let since = self.unknown_us.map(|since_us| now_us - since_us);
        if since.is_some_and(|since_us| since_us > FOLLOW_AGE_US) {
            self.left |= *self.kept_m.get_or_insert(setpoint_m) != setpoint_m;
        }
    }

    pub(super) fn score(self, performed: &str, novelty: Option<NoveltyReport<'_>>) -> OutsideScore {
        #[allow(clippy::cast_precision_loss, reason = "actions last seconds")]
        let after_s = |unknown_us: u64| (unknown_us - self.began_us) as f64 * 1e-6;
        OutsideScore {
            performed: performed.to_owned(),
            named_unknown: self.unknown_us.is_some(),
            seconds_to_unknown: self.unknown_us.map(after_s),
            nearest: novelty.map(|novelty| novelty.nearest.to_owned()),
            distance: novelty.map(|novelty| novelty.distance),
            held: self.kept_m.is_some() && !self.left,
            moved_m: self.moved_m,
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Held;

    #[test]
    fn a_robot_that_leaves_after_the_grace_has_not_held() {
        // Named at 0.1 s; the set-point moves until `stops_us`, from then on it stays.
        let run = |stops_us: u64, named: bool| {
            let mut held = Held::new(0, [0.4, 0.0, 0.0]);
            for now_us in (0..500_000).step_by(1000) {
                let x = 0.4 + 1e-6 * now_us.min(stops_us) as f64;
                held.add(now_us, named && now_us >= 100_000, [x, 0.0, 0.0]);
            }
            held.score("wave", None)
        };
        let good = run(160_000, true);
        assert!(good.named_unknown && good.held);
        assert!((good.seconds_to_unknown.unwrap() - 0.1).abs() < 1e-12);
        assert!((good.moved_m - 0.16).abs() < 1e-12);
        let late = run(170_000, true);
        assert!(late.named_unknown && !late.held);
        let never = run(0, false);
        assert!(!never.named_unknown && !never.held && never.moved_m == 0.0);
    }
}

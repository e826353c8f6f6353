//! Arrivals that come later than they did, until it is known whether the way became longer or the clock was set back.

use super::floor::Line;

/// How much of a lag round trips refute until the clock is said to have stepped, as a share of it.
const MOST: f64 = 0.5;

/// The line of before, on which instants stay as old as they are if the way became longer.
///
/// A way that is longer by some time makes every round trip longer by it; a clock that was set back does not. So of the
/// lag, no more is left than the shortest round trip is longer than it was.
#[derive(Debug, Clone, Copy)]
pub(super) struct Lag {
    before: Line,
    /// Shortest round trip of before; 0 where none is known, which grants the longest way.
    usual_us: f64,
    first_us: f64,
    refuted_us: f64,
    told: bool,
}

impl Lag {
    /// Starts at an arrival that came `first_us` after the line of before, which has this skew.
    pub(super) fn starting(first_us: f64, skew: f64, usual_us: f64) -> Self {
        Self {
            before: Line {
                offset_us: -first_us,
                skew,
            },
            usual_us,
            first_us,
            refuted_us: 0.0,
            told: false,
        }
    }

    /// The same lag after a new start at an arrival of device time `x` and host time `h`.
    pub(super) fn moved(&self, x: f64, h: f64) -> Self {
        let late_us = h - self.before.host_us(x);
        Self {
            before: Line {
                offset_us: -late_us,
                ..self.before
            },
            first_us: self.first_us.max(late_us),
            ..*self
        }
    }

    /// How much later than before arrivals on `line` come at device time `x`, microseconds.
    pub(super) fn us(&self, line: &Line, x: f64) -> f64 {
        (line.host_us(x) - self.before.host_us(x)).max(0.0)
    }

    /// Takes the shortest round trip since the start; how far ahead the clock was set, once most of the lag turns out to be
    /// that, microseconds.
    pub(super) fn bound(&mut self, line: &Line, x: f64, shortest_us: f64) -> Option<f64> {
        let most_us = (shortest_us - self.usual_us).max(0.0);
        let refuted_us = (self.us(line, x) - most_us).max(0.0);
        self.before.offset_us += refuted_us;
        self.refuted_us += refuted_us;
        if self.told || self.refuted_us < MOST * self.first_us {
            return None;
        }
        self.told = true;
        Some(-self.refuted_us)
    }

    /// Whether most of it was the clock's.
    pub(super) fn told(&self) -> bool {
        self.told
    }
}

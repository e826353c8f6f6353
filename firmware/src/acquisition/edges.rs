//! Index and time of scans that say themselves when they are ready.

use super::FOLLOW_DIVISOR;
use crate::afe::Edge;

/// Fractions of a tick or microsecond are kept in 8 bits.
const FRACTION: u32 = 8;
/// Edges over which the period is averaged: the first is believed whole, the n-th to its n-th part, down to this.
const LEARN_EDGES: i64 = 32;
/// How far the converter's oscillator may be off, as `1 / n`: 3 %; the ADS129x's is good to 2.5 %.
const OSCILLATOR_DIVISOR: u64 = 33;
/// After a longer gap the converter may have been restarted, at another phase: the time is taken as it is.
const RESYNC_PERIODS: u64 = 8;

/// Index and time of one scan.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Stamp {
    /// Number of the period; a jump is a gap.
    pub index: u32,
    /// Device time of the data-ready edge, us.
    pub acquired_us: u64,
    /// Scans lost since the one before.
    pub lost: u32,
}

#[derive(Clone, Copy, Debug)]
struct Last {
    captured: u32,
    index: u32,
    /// us, with a fraction.
    acquired: u64,
}

/// Counts the periods between data-ready edges, so that a missed edge is a gap and never shifts a scan.
///
/// The converter's oscillator may be off by 3 % and drift; the period is learnt from the edges, to some 10 parts per
/// million within a second, so that even a gap of seconds is counted exactly. The device clock (32 kHz, steps of 30 us)
/// is followed as [`super::ScanClock`] follows it: times are evenly spaced, and off by about one step at most.
#[derive(Clone, Debug)]
pub struct EdgeClock {
    ticks_per_us: u32,
    nominal: u64,
    /// Ticks, with a fraction.
    period: u64,
    learnt_edges: i64,
    last: Option<Last>,
}

impl EdgeClock {
    /// A clock for scans `period_us` apart, by a timer of `ticks_per_us` (1 to 16) ticks a microsecond.
    #[must_use]
    pub const fn new(period_us: u32, ticks_per_us: u32) -> Self {
        let nominal = (period_us as u64 * ticks_per_us as u64) << FRACTION;
        Self {
            ticks_per_us,
            nominal,
            period: nominal,
            learnt_edges: 0,
            last: None,
        }
    }

    /// Takes the edge of one scan. None when it comes less than half a period after the last: that was no new
    /// conversion, but a glitch of the line.
    pub fn edge(&mut self, edge: &Edge) -> Option<Stamp> {
        let age_us = edge.seen.wrapping_sub(edge.captured) / self.ticks_per_us.max(1);
        let observed = edge.seen_us.saturating_sub(u64::from(age_us)) << FRACTION;
        let Some(last) = self.last else {
            return Some(self.stamp(edge.captured, 0, observed, 0));
        };
        let ticks = self.ticks_between(&last, edge.captured, observed);
        let period = self.period.max(1);
        let periods = ticks.saturating_add(period / 2) / period;
        if periods == 0 {
            return None;
        }
        let short = periods <= RESYNC_PERIODS;
        if short {
            self.learn(ticks / periods);
        }
        let advance = periods.saturating_mul(self.period) / u64::from(self.ticks_per_us.max(1));
        let acquired = if short {
            let expected = last.acquired + advance;
            let difference = observed.cast_signed().wrapping_sub(expected.cast_signed());
            expected.saturating_add_signed(difference / FOLLOW_DIVISOR)
        } else {
            observed
        };
        // Whatever the two clocks say, time goes on.
        let acquired = acquired.max(last.acquired + advance / 2);
        let lost = u32::try_from(periods - 1).unwrap_or(u32::MAX);
        let index = last.index.wrapping_add(lost).wrapping_add(1);
        Some(self.stamp(edge.captured, index, acquired, lost))
    }

    fn stamp(&mut self, captured: u32, index: u32, acquired: u64, lost: u32) -> Stamp {
        self.last = Some(Last {
            captured,
            index,
            acquired,
        });
        Stamp {
            index,
            acquired_us: acquired >> FRACTION,
            lost,
        }
    }

    /// Ticks since the last edge, with a fraction. The timer says so exactly while it has not wrapped since;
    /// beyond half its range the device clock does.
    fn ticks_between(&self, last: &Last, captured: u32, observed: u64) -> u64 {
        let by_clock = observed
            .saturating_sub(last.acquired)
            .saturating_mul(u64::from(self.ticks_per_us));
        if by_clock >> FRACTION > u64::from(u32::MAX / 2) {
            by_clock
        } else {
            u64::from(captured.wrapping_sub(last.captured)) << FRACTION
        }
    }

    fn learn(&mut self, measured: u64) {
        let difference = measured.cast_signed() - self.period.cast_signed();
        let slack = self.nominal / OSCILLATOR_DIVISOR;
        self.learnt_edges = LEARN_EDGES.min(self.learnt_edges + 1);
        self.period = self
            .period
            .saturating_add_signed(difference / self.learnt_edges)
            .clamp(self.nominal - slack, self.nominal + slack);
    }
}

#[cfg(test)]
mod tests;

//! Pings there and back.

use std::collections::VecDeque;

use super::counter::signed_difference;
use super::floor::Line;
use super::health::ClockError;

/// Round trips that are kept, the newest.
const KEPT: usize = 32;
/// What the device may seem to have taken longer than the whole trip: clocks of a thousandth apart, and a step of the
/// counters, in parts and microseconds.
const SLACK: (f64, f64) = (0.001, 10.0);

/// The four times of a ping: packet 6 of the wire and its arrival.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct RoundTrip {
    /// Host time at which the request left, microseconds.
    pub requested_us: u64,
    /// Device time at which it came, microseconds.
    pub received_us: u64,
    /// Device time at which the reply left, microseconds.
    pub replied_us: u64,
    /// Host time at which that came, microseconds.
    pub arrived_us: u64,
}

impl RoundTrip {
    /// The device cannot have kept it longer than it was away.
    pub(super) fn check(&self, counter_bits: u32) -> Result<(), ClockError> {
        let held_us = signed_difference(self.replied_us, self.received_us, counter_bits);
        let impossible = Err(ClockError::Impossible {
            trip: *self,
            held_us,
        });
        let Some(away_us) = self.arrived_us.checked_sub(self.requested_us) else {
            return impossible;
        };
        if held_us < 0 || held_us as f64 > away_us as f64 * (1.0 + SLACK.0) + SLACK.1 {
            return impossible;
        }
        Ok(())
    }
}

/// The newest requests: device time of coming, host time of leaving, both relative.
#[derive(Debug, Clone, Default)]
pub(super) struct RoundTrips {
    requests: VecDeque<(f64, f64)>,
}

impl RoundTrips {
    pub(super) fn push(&mut self, received: f64, requested: f64) {
        if self.requests.len() == KEPT {
            self.requests.pop_front();
        }
        self.requests.push_back((received, requested));
    }

    /// The shortest way there and the shortest way back together, microseconds: the line is late by the way back, a
    /// request's coming on it is late by the way there as well.
    pub(super) fn shortest_us(&self, line: &Line) -> Option<f64> {
        self.shortest_until_us(line, f64::INFINITY)
    }

    /// The same of those that left before host time `until`.
    pub(super) fn shortest_until_us(&self, line: &Line, until: f64) -> Option<f64> {
        self.requests
            .iter()
            .filter(|(_, requested)| *requested < until)
            .map(|(received, requested)| line.host_us(*received) - requested)
            .min_by(f64::total_cmp)
    }
}

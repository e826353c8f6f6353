//! When a frame's picture was taken, by its number and its time stamp.

use crate::clock::{ClockConfig, DeviceClock, Notice};

use super::follower::Refusal;

/// Host time after a start of the service before any frame is trusted: those that waited have come by then, and
/// those that did not show by how much the others are late.
const SETTLE_US: u64 = 250_000;
/// Frames in that time at least.
const SETTLE_FRAMES: u32 = 10;
/// So many frames in a row that follow each other, all behind the newest, are of a service that began again.
const BEHIND_CONFIRMATIONS: u32 = 10;
/// A frame later than this teaches nothing of the clock: were it counted in, a service that lags for long would pass for
/// one whose clock was set back, microseconds. Before the rate is known, frames of all delays but such are needed.
const LATE_US: u64 = 10_000;
const LATE_AT_FIRST_US: u64 = 100_000;
/// After so long without any frame, clocks may have parted by half the age limit, microseconds. Until then a service that
/// restarted unseen and has meanwhile counted beyond the old one passes for lagging: no hand rather than a stale one.
const FORGET_US: u64 = 600_000_000;
/// Rounding of the two clocks, microseconds.
const ROUNDING_US: u64 = 1_000;
/// The service is the only one on its connection.
const ONLY: u32 = 0;

/// Follows the numbers and time stamps of one service.
#[derive(Debug, Clone)]
pub(super) struct Age {
    transport_us: u32,
    started: Option<Started>,
}

#[derive(Debug, Clone)]
struct Started {
    clock: DeviceClock,
    at_us: u64,
    frames: u32,
    last_us: u64,
    newest: Stamp,
    behind: Option<(Stamp, u32)>,
}

impl Started {
    /// Counts a frame in that follows all before it.
    fn advance(&mut self, stamp: Stamp, now_us: u64, transport_us: u32) {
        self.behind = None;
        self.newest = stamp;
        self.frames = self.frames.saturating_add(1);
        let known = self.clock.health().is_some_and(|health| health.settled);
        let late_us = if known { LATE_US } else { LATE_AT_FIRST_US };
        let latest_us = now_us.saturating_sub(late_us + u64::from(transport_us));
        let expected = self.clock.host_us(ONLY, stamp.clock_us);
        if expected.is_ok_and(|expected| expected.at_us < latest_us) {
            return;
        }
        let notice = self.clock.arrived(ONLY, stamp.clock_us, now_us);
        if matches!(
            notice,
            Some(Notice::Stepped { .. } | Notice::Resumed { .. })
        ) {
            (self.at_us, self.frames) = (now_us, 1);
        }
    }
}

/// Number and time of a frame by the service's count.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) struct Stamp {
    pub(super) id: i64,
    pub(super) timestamp_us: u64,
    /// The newest time that the service's clock is known to have shown: when the frame came, or its time stamp.
    pub(super) clock_us: u64,
}

impl Stamp {
    fn follows(&self, other: &Self) -> bool {
        self.id > other.id && self.timestamp_us > other.timestamp_us
    }
}

/// When, in host time, a picture was taken.
#[derive(Debug, Clone, Copy)]
pub(super) struct Exposed {
    pub(super) at_us: u64,
    pub(super) uncertainty_us: f64,
}

impl Age {
    pub(super) fn new(transport_us: u32) -> Self {
        Self {
            transport_us,
            started: None,
        }
    }

    /// Places a frame that came at `now_us`.
    ///
    /// # Errors
    /// `Settling`, `Repeated` or `Impossible`: it says nothing about now.
    pub(super) fn place(&mut self, stamp: Stamp, now_us: u64) -> Result<Exposed, Refusal> {
        let silence_us = |started: &Started| now_us.saturating_sub(started.last_us);
        let Some(started) = self.started.as_mut().filter(|s| silence_us(s) < FORGET_US) else {
            return self.start(stamp, now_us);
        };
        started.last_us = now_us;
        if !stamp.follows(&started.newest) {
            let count = match started.behind {
                Some((last, count)) if stamp.follows(&last) => count + 1,
                _ => 1,
            };
            started.behind = Some((stamp, count));
            if count >= BEHIND_CONFIRMATIONS {
                return self.start(stamp, now_us);
            }
            return Err(Refusal::Repeated {
                newest_id: started.newest.id,
                got_id: stamp.id,
            });
        }
        started.advance(stamp, now_us, self.transport_us);
        let settled =
            now_us.saturating_sub(started.at_us) >= SETTLE_US && started.frames >= SETTLE_FRAMES;
        if !settled {
            return Err(Refusal::Settling);
        }
        match started.clock.host_us(ONLY, stamp.timestamp_us) {
            Ok(mapped) if mapped.at_us <= now_us + ROUNDING_US => Ok(Exposed {
                at_us: mapped.at_us.min(now_us),
                uncertainty_us: mapped.uncertainty_us,
            }),
            _ => Err(Refusal::Impossible {
                timestamp_us: stamp.timestamp_us,
            }),
        }
    }

    fn start(&mut self, stamp: Stamp, now_us: u64) -> Result<Exposed, Refusal> {
        let config = ClockConfig {
            transport_us: self.transport_us,
            ..ClockConfig::default()
        };
        // A counter of 64 bits is never refused.
        if let Ok(mut clock) = DeviceClock::new(config) {
            clock.arrived(ONLY, stamp.clock_us, now_us);
            self.started = Some(Started {
                clock,
                at_us: now_us,
                frames: 1,
                last_us: now_us,
                newest: stamp,
                behind: None,
            });
        }
        Err(Refusal::Settling)
    }
}

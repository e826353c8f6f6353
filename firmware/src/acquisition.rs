//! When each scan was taken, and how many were lost.
//!
//! The chip's own converter fills one buffer after another by itself, paced by a timer on the crystal oscillator;
//! the processor only sees each buffer's end, a little late. [`ScanClock`] turns those ends into an
//! evenly spaced index and time for every scan.
//!
//! A converter beside the chip has a clock of its own and says when each scan is ready. Its edges capture a timer,
//! and [`EdgeClock`] counts the periods between them; [`acquire`] reads the scans and mends what fails.

mod converter;
mod edges;
mod queue;

pub use converter::{ATTEMPTS, Event, acquire};
pub use edges::{EdgeClock, Stamp};
pub use queue::EventQueue;

use tonus_shared::{sample::Scan, wire::Muscle};

/// Channels that are converted.
pub const CHANNELS: usize = 4;
/// Where each channel's electrode pair sits, until a calibration says otherwise.
pub const MUSCLES: [Muscle; CHANNELS] = [
    Muscle::BicepsShort,
    Muscle::BicepsLong,
    Muscle::TricepsLateral,
    Muscle::TricepsLong,
];
/// Scans per second.
pub const RATE_HZ: u32 = 1000;
/// Time between two scans in microseconds.
pub const PERIOD_US: u32 = 1_000_000 / RATE_HZ;
/// Scans per buffer: half of a stream period, so that a stream packet waits for at most 5 ms.
pub const BUFFER_SCANS: usize = 5;

/// Share of the difference between a buffer's observed and expected end that moves the clock.
///
/// The scan timer and the device clock run from two crystals some tens of parts per million apart, so
/// the difference must be followed; wake-up jitter of some tens of microseconds must not.
const FOLLOW_DIVISOR: i64 = 16;

/// Index and time of the scans in one buffer.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Block {
    /// Index of the first scan; a jump against the block before is a gap of that many scans.
    pub first_index: u32,
    /// Device time of the first scan in microseconds.
    pub first_acquired_us: u64,
    /// Scans lost between the block before and this one.
    pub lost: u32,
}

impl Block {
    /// The scans of a buffer that this block places in time, `period_us` apart.
    pub fn scans<const C: usize>(
        self,
        period_us: u32,
        buffer: impl IntoIterator<Item = [i16; C]>,
    ) -> impl Iterator<Item = Scan<C>> {
        (0_u32..).zip(buffer).map(move |(number, counts)| Scan {
            index: self.first_index.wrapping_add(number),
            acquired_us: self.first_acquired_us + u64::from(number * period_us),
            counts: counts.map(i32::from),
        })
    }
}

/// Gives index and device time to scans that arrive in buffers of a fixed length.
#[derive(Clone, Debug)]
pub struct ScanClock {
    period_us: u32,
    scans: u32,
    next_index: u32,
    expected_end_us: Option<u64>,
}

impl ScanClock {
    /// A clock for buffers of `scans` scans, `period_us` microseconds apart.
    #[must_use]
    pub const fn new(period_us: u32, scans: u32) -> Self {
        Self {
            period_us,
            scans,
            next_index: 0,
            expected_end_us: None,
        }
    }

    /// Takes the device time in microseconds at which a buffer was seen to be full.
    ///
    /// An end that is late by more than half a buffer means that whole buffers were overwritten before
    /// the processor looked: they are skipped in the index and reported in [`Block::lost`].
    pub fn buffer_full(&mut self, seen_us: u64) -> Block {
        let buffer_us = u64::from(self.period_us) * u64::from(self.scans);
        let expected_us = self.expected_end_us.unwrap_or(seen_us);
        let late_us = seen_us.saturating_sub(expected_us);
        let lost_buffers = (late_us + buffer_us / 2) / buffer_us.max(1);
        let lost = u32::try_from(lost_buffers * u64::from(self.scans)).unwrap_or(u32::MAX);

        let resumed_us = expected_us + lost_buffers * buffer_us;
        let end_us = resumed_us.saturating_add_signed(follow(resumed_us, seen_us));
        let first_index = self.next_index.wrapping_add(lost);
        self.next_index = first_index.wrapping_add(self.scans);
        self.expected_end_us = Some(end_us + buffer_us);
        Block {
            first_index,
            first_acquired_us: end_us.saturating_sub(buffer_us - u64::from(self.period_us)),
            lost,
        }
    }
}

/// How far the clock moves towards what was seen, in microseconds.
fn follow(expected_us: u64, seen_us: u64) -> i64 {
    seen_us
        .cast_signed()
        .wrapping_sub(expected_us.cast_signed())
        / FOLLOW_DIVISOR
}

#[cfg(test)]
mod tests;

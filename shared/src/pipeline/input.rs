//! What comes in, placed in device time: scans, hand, attitude of the upper arm.

use crate::wire::{QUATERNION_SLACK, ResetReason, StatusFlags};

use super::heading::Heading;

/// A hand or attitude older than this counts as not seen, us.
pub(super) const MAX_AGE_US: u64 = 100_000;
/// How far ahead of the newest scan a hand or attitude may be: more is a clock that is not aligned, us.
const MAX_AHEAD_US: u64 = 100_000;
/// A gap longer than this restarts the filters: what they remember is of another movement, us.
const LONG_GAP_US: u64 = 100_000;

/// Why an input was refused. It changed nothing.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum InputError {
    /// The scan repeats or precedes one already taken.
    #[error(
        "scan {index} is not newer than scan {newest}: push scans in the order of their indices"
    )]
    ScanNotNewer {
        /// Index of the scan.
        index: u32,
        /// Newest index so far.
        newest: u32,
    },
    /// Device time does not go on.
    #[error("device time {acquired_us} us is not after {newest_us} us: the last value stands")]
    TimeNotNewer {
        /// Time given.
        acquired_us: u64,
        /// Newest time of the same input so far.
        newest_us: u64,
    },
    /// Later than the wearable's own present.
    #[error(
        "device time {acquired_us} us is ahead of the newest scan at {newest_us} us: align the clocks by ping first"
    )]
    Ahead {
        /// Time given.
        acquired_us: u64,
        /// Time of the newest scan.
        newest_us: u64,
    },
    /// There is no scan yet, so that nothing tells whether a time is plausible.
    #[error("no scan yet: push one before hands and attitudes")]
    NoScanYet,
    /// NaN or infinity.
    #[error("a value is not finite: drop the sample where it was measured")]
    NonFinite,
    /// Not a rotation.
    #[error("quaternion of norm {norm}: normalise it (x, y, z, w)")]
    NotUnit {
        /// The norm.
        norm: f32,
    },
}

/// What only the board knows of itself, all counted since it started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Health {
    /// Battery, mV; none when not measured.
    pub battery_mv: Option<u16>,
    /// Why it last started.
    pub reset_reason: ResetReason,
    /// What is wrong, or awaits the host.
    pub flags: StatusFlags,
    /// Scans not processed in time.
    pub overruns: u32,
    /// Packets replaced by newer ones after the pipeline had given them away.
    pub dropped_packets: u32,
    /// Reports that found no room to wait in.
    pub lost_reports: u32,
    /// Hypotheses that recognition dropped under load.
    pub dropped_hypotheses: u32,
    /// Requests of a host that were refused.
    pub refused_requests: u32,
    /// Times that a host connected.
    pub links: u16,
}

/// Where a scan stands among the others.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Placement {
    /// Scans missing before it.
    pub(super) missed: u32,
    /// So long since the last one that the filters must start anew.
    pub(super) long_gap: bool,
}

/// The row of scans.
#[derive(Clone, Copy, Debug)]
pub(super) struct Scans {
    newest: Option<(u32, u64)>,
    started_us: u64,
    memory_us: u64,
    forgotten_us: u64,
    settled_us: u64,
    pub(super) gaps: u32,
    pub(super) missed: u32,
}

impl Scans {
    /// `memory_us`: how long a gap shows in the envelopes.
    pub(super) fn new(memory_us: u32) -> Self {
        Self {
            newest: None,
            started_us: 0,
            memory_us: u64::from(memory_us),
            forgotten_us: 0,
            settled_us: 0,
            gaps: 0,
            missed: 0,
        }
    }

    pub(super) fn place(&mut self, index: u32, acquired_us: u64) -> Result<Placement, InputError> {
        let Some((newest, newest_us)) = self.newest else {
            self.started_us = acquired_us;
            self.newest = Some((index, acquired_us));
            return Ok(Placement {
                missed: 0,
                long_gap: false,
            });
        };
        let ahead = index.wrapping_sub(newest);
        if ahead == 0 || ahead > u32::MAX / 2 {
            return Err(InputError::ScanNotNewer { index, newest });
        }
        if acquired_us <= newest_us {
            return Err(InputError::TimeNotNewer {
                acquired_us,
                newest_us,
            });
        }
        let missed = ahead - 1;
        // Time is believed, whatever the index says: a board may lose scans without noticing.
        let long_gap = acquired_us - newest_us > LONG_GAP_US;
        if missed > 0 || long_gap {
            self.gaps = self.gaps.wrapping_add(1);
            self.missed = self.missed.wrapping_add(missed);
            self.forgotten_us = acquired_us.saturating_add(self.memory_us);
        }
        if long_gap {
            self.settled_us = self.forgotten_us;
        }
        self.newest = Some((index, acquired_us));
        Ok(Placement { missed, long_gap })
    }

    /// The filters start anew and remember a disturbance for `memory_us`: what comes is marked as after a long gap,
    /// but no gap is counted.
    pub(super) fn restart(&mut self, memory_us: u32) {
        self.memory_us = u64::from(memory_us);
        if let Some(now_us) = self.newest_us() {
            self.settled_us = now_us.saturating_add(self.memory_us);
        }
    }

    /// Device time of the newest scan.
    pub(super) fn newest_us(&self) -> Option<u64> {
        self.newest.map(|(_, newest_us)| newest_us)
    }

    /// Whether the filters still remember a gap.
    pub(super) fn gap_remembered(&self) -> bool {
        self.newest_us()
            .is_some_and(|now_us| now_us < self.forgotten_us)
    }

    /// Whether the filters started anew after a long gap and have not settled.
    pub(super) fn settling(&self) -> bool {
        self.newest_us()
            .is_some_and(|now_us| now_us < self.settled_us)
    }

    pub(super) fn uptime_s(&self) -> u32 {
        let up_us = self
            .newest_us()
            .unwrap_or_default()
            .saturating_sub(self.started_us);
        u32::try_from(up_us / 1_000_000).unwrap_or(u32::MAX)
    }
}

/// Newest value of an input that comes at its own times; `None` when it was measured to be absent.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Latest<const N: usize> {
    newest: Option<(Option<[f32; N]>, u64)>,
}

impl<const N: usize> Latest<N> {
    pub(super) fn set(
        &mut self,
        value: Option<[f32; N]>,
        acquired_us: u64,
        scan_us: Option<u64>,
    ) -> Result<(), InputError> {
        let scan_us = scan_us.ok_or(InputError::NoScanYet)?;
        if !value.iter().flatten().all(|value| value.is_finite()) {
            return Err(InputError::NonFinite);
        }
        if acquired_us > scan_us.saturating_add(MAX_AHEAD_US) {
            return Err(InputError::Ahead {
                acquired_us,
                newest_us: scan_us,
            });
        }
        if let Some((_, newest_us)) = self.newest
            && acquired_us <= newest_us
        {
            return Err(InputError::TimeNotNewer {
                acquired_us,
                newest_us,
            });
        }
        self.newest = Some((value, acquired_us));
        Ok(())
    }

    /// The value, if it is recent enough.
    pub(super) fn recent(&self, now_us: u64) -> Option<[f32; N]> {
        let (value, acquired_us) = self.newest?;
        value.filter(|_| now_us.saturating_sub(acquired_us) <= MAX_AGE_US)
    }
}

/// Inputs beside the scans, and how many inputs of any sort were refused.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Inputs {
    pub(super) hand: Latest<3>,
    pub(super) orientation: Latest<4>,
    pub(super) heading: Heading,
    pub(super) refused: u32,
}

/// Refuses what is no unit quaternion.
pub(super) fn checked_quaternion(xyzw: [f32; 4]) -> Result<(), InputError> {
    let norm = libm::sqrtf(xyzw.iter().map(|value| value * value).sum());
    if !norm.is_finite() {
        return Err(InputError::NonFinite);
    }
    // The wire's own comparison, or its rounding could refuse what was accepted here.
    if !(1.0 - QUATERNION_SLACK..=1.0 + QUATERNION_SLACK).contains(&norm) {
        return Err(InputError::NotUnit { norm });
    }
    Ok(())
}

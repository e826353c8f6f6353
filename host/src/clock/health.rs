//! What a comparison says of itself.

use thiserror::Error;

use super::RoundTrip;

/// An instant on the other clock.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Mapped {
    /// When, microseconds.
    pub at_us: u64,
    /// How far it may be off beside the transport's constant delay, microseconds; of 20 instants 19 are nearer.
    pub uncertainty_us: f64,
}

/// How a comparison stands.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Health {
    /// Boot id of the clock that is followed.
    pub boot_id: u32,
    /// Host time minus device time at the newest arrival, microseconds.
    pub offset_us: f64,
    /// How much faster host time runs than device time, parts per million.
    pub rate_ppm: f64,
    /// How far the earliest arrivals of every two seconds lie above the line, root mean square, microseconds.
    pub residual_us: f64,
    /// As [`Mapped::uncertainty_us`] at the newest arrival.
    pub uncertainty_us: f64,
    /// Device time between the oldest and the newest arrival that the line rests on, microseconds.
    pub span_us: f64,
    /// Shortest way there and back of the newest pings, microseconds: the transport's delay is between 0 and this. None
    /// without a ping.
    pub round_trip_us: Option<f64>,
    /// How much later arrivals come than before the last [`Notice::Late`], as far as round trips do not refute it,
    /// microseconds: instants are mapped as so much older.
    pub late_us: f64,
    /// Whether there is enough to tell a rate; before, that of the former start is taken, or none.
    pub settled: bool,
}

/// What became of arrivals.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Counted in.
    pub taken: u64,
    /// Before their time, of another boot, out of order or impossible.
    pub refused: u64,
    /// New starts, the first included.
    pub starts: u64,
}

/// The comparison began anew; what was mapped before is not what is mapped now.
#[derive(Debug, Clone, Copy, PartialEq)]
pub enum Notice {
    /// The first arrival of all.
    Started {
        /// Boot id of the clock.
        boot_id: u32,
    },
    /// The device restarted, and so did its clock.
    Rebooted {
        /// Its new boot id.
        boot_id: u32,
    },
    /// The clock was set, or the shortest delay changed: nobody on this side can tell which.
    Stepped {
        /// How far ahead the device's clock is of where it was expected, microseconds; negative when behind.
        by_us: f64,
    },
    /// Of a device that answers pings: arrivals come later than they did by so much in all, or in time again at 0. What is
    /// mapped is as before; if round trips show that the clock was set back, [`Notice::Stepped`] follows.
    Late {
        /// How much, microseconds.
        by_us: f64,
    },
    /// Nothing came for so long that the old line says nothing.
    Resumed {
        /// How long, microseconds.
        silence_us: u64,
    },
}

/// What a comparison refuses.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
pub enum ClockError {
    /// No such counter.
    #[error("a counter of {got} bits: give 8 to 64")]
    CounterBits {
        /// Bits asked for.
        got: u32,
    },
    /// Not the clock that is followed.
    #[error("boot {got:#010x} is not followed (yet): wait for its next packets")]
    UnknownBoot {
        /// Boot id asked for.
        got: u32,
    },
    /// Before the host's time begins, or beyond where it ends.
    #[error("{got_us} us is no instant on the other clock")]
    OutOfRange {
        /// The instant asked for.
        got_us: u64,
    },
    /// Times of a ping that contradict each other.
    #[error(
        "a ping held by the device for {held_us} us left at {} us and came back at {} us of host time: impossible, and not used",
        trip.requested_us, trip.arrived_us
    )]
    Impossible {
        /// Its times.
        trip: RoundTrip,
        /// How long the device says it held it, microseconds.
        held_us: i64,
    },
}

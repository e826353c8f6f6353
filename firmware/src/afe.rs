//! Analogue front ends: what turns electrode voltages into counts, and how many volts a count is.
//!
//! Words: a *front end* is converter and amplifier together; its *data-ready edge* is the moment at which a
//! conversion of all channels is complete.

pub mod ads129x;

use core::future::Future;

/// A data-ready edge, as the chip saw it.
///
/// The edge itself captures a free-running timer, so that it does not matter how late the processor looks.
/// Timer and device clock are read together then, which places the edge in device time.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Edge {
    /// Count of the timer that the edge captured; wraps at 32 bits.
    pub captured: u32,
    /// Count of the same timer when the processor looked.
    pub seen: u32,
    /// Device time when the processor looked, us.
    pub seen_us: u64,
}

/// The data-ready line of a front end.
pub trait DataReady {
    /// Waits for an edge. One that came while nobody waited counts; of several, the newest.
    fn edge(&mut self) -> impl Future<Output = Edge>;

    /// Forgets an edge that came while nobody waited.
    fn clear(&mut self);
}

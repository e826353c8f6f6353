//! Reads an ADS129x for ever, and mends what fails.
//!
//! | fault | what happens |
//! |---|---|
//! | one edge missed | the index jumps: a gap of one scan |
//! | no edge for two periods | set up again; the index jumps by the time that took |
//! | frame does not begin with 1100 | that scan is dropped, the index jumps; three in a row: set up again |
//! | bus fails or hangs, register does not hold, other id | set up again |
//! | set up in vain [`ATTEMPTS`] times | [`Event::Failed`]; tried again every second |
//! | count at a rail, electrode off | goes on with the scan; `shared` judges the channel |

use core::convert::Infallible;

use embedded_hal::digital::OutputPin;
use embedded_hal_async::{delay::DelayNs, spi::SpiDevice};
use tonus_shared::sample::Scan;

use super::EdgeClock;
use crate::afe::{
    DataReady,
    ads129x::{Ads129x, Ads129xError},
};

/// Faults in a row after which the front end counts as failed.
pub const ATTEMPTS: u32 = 5;
/// Good scans after which faults before them are forgotten: 0.1 s at 1 kHz.
const HEALTHY_SCANS: u32 = 100;
/// Frames in a row that may be refused before the chip is set up again.
const BAD_FRAMES: u32 = 3;
/// Between a fault and the next attempt.
const SOON_MS: u32 = 10;
/// Between attempts of a front end that failed.
const LATER_MS: u32 = 1_000;

/// What comes from the front end.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Event<const C: usize> {
    /// A scan, and whether an electrode of each channel is off.
    Scan {
        /// Its index jumps where scans were lost.
        scan: Scan<C>,
        /// Per channel.
        lead_off: [bool; C],
    },
    /// Something went wrong; it is being mended.
    Fault(Ads129xError),
    /// Mending did not help [`ATTEMPTS`] times in a row. It is tried, and told, every second.
    Failed(Ads129xError),
}

/// Acquires for ever; `sink` takes what comes, and must be short.
///
/// **Budget.** One period from edge to edge, of which a frame at 4 MHz takes 30 us (four channels) or 54 us
/// (eight). What `sink` cannot do in the rest belongs behind an [`super::EventQueue`].
pub async fn acquire<const C: usize, S, R, T, D>(
    converter: &mut Ads129x<C, S, R, T, D>,
    edges: &mut impl DataReady,
    delay: &mut impl DelayNs,
    clock: &mut EdgeClock,
    mut sink: impl FnMut(Event<C>),
) -> !
where
    S: SpiDevice,
    R: OutputPin<Error = Infallible>,
    T: OutputPin<Error = Infallible>,
    D: DelayNs,
{
    let mut faults = 0_u32;
    let mut set_up = converter.power_up().await;
    loop {
        let error = match set_up {
            Ok(()) => stream(converter, edges, clock, &mut faults, &mut sink).await,
            Err(error) => error,
        };
        faults = faults.saturating_add(1);
        if faults < ATTEMPTS {
            sink(Event::Fault(error));
            delay.delay_ms(SOON_MS).await;
        } else {
            sink(Event::Failed(error));
            delay.delay_ms(LATER_MS).await;
        }
        // A chip that lost its supply needs the whole wait; one that only lost count does not.
        set_up = match error {
            Ads129xError::WrongId { .. } | Ads129xError::ReadBack { .. } => {
                converter.power_up().await
            }
            _ => converter.initialise().await,
        };
    }
}

/// Reads scans until the chip has to be set up again, and says why.
async fn stream<const C: usize, S, R, T, D>(
    converter: &mut Ads129x<C, S, R, T, D>,
    edges: &mut impl DataReady,
    clock: &mut EdgeClock,
    faults: &mut u32,
    sink: &mut impl FnMut(Event<C>),
) -> Ads129xError
where
    S: SpiDevice,
    R: OutputPin<Error = Infallible>,
    T: OutputPin<Error = Infallible>,
    D: DelayNs,
{
    let (mut good, mut bad) = (0_u32, 0_u32);
    loop {
        let (edge, conversion) = match converter.next(edges).await {
            Ok(read) => read,
            Err(error @ Ads129xError::Header { .. }) if bad + 1 < BAD_FRAMES => {
                bad += 1;
                sink(Event::Fault(error));
                continue;
            }
            Err(error) => return error,
        };
        bad = 0;
        good = good.saturating_add(1);
        if good == HEALTHY_SCANS {
            *faults = 0;
        }
        let Some(stamp) = clock.edge(&edge) else {
            continue; // No new conversion: a glitch of the line.
        };
        sink(Event::Scan {
            scan: Scan {
                index: stamp.index,
                acquired_us: stamp.acquired_us,
                counts: conversion.counts,
            },
            lead_off: conversion.lead_off,
        });
    }
}

#[cfg(test)]
mod tests;

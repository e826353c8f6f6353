//! Sends the newest frames, where a link carries them whole and in time.

use embassy_time::Duration;
use tonus_shared::wire::MIN_ATT_MTU;
use trouble_host::Error;

use super::{Notice, link::Host};

/// Longest connection interval that frames are sent over: a notification may wait for just over two of them.
const INTERVAL_LIMIT: Duration = Duration::from_millis(20);
/// A notification's operation code and handle, which share the attribute MTU with the frame.
const NOTIFICATION_BYTES: usize = 3;

/// Why a frame stayed on the wearable.
#[derive(Clone, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Withheld {
    /// The host did not raise the attribute MTU; the frame would be cut short.
    MtuTooSmall {
        /// Bytes needed.
        needed: u16,
        /// Bytes negotiated.
        negotiated: u16,
    },
    /// Frames would arrive too old to act on.
    IntervalTooLong {
        /// Longest connection interval accepted, in microseconds.
        limit_us: u64,
        /// The link's interval in microseconds.
        actual_us: u64,
    },
    /// The stack refused it.
    NotSent(Error),
}

impl<R: Fn(Notice)> Host<'_, '_, '_, R> {
    /// Notifies each newest frame that the host subscribed to; never returns. A reason to withhold is
    /// reported when it changes, not per frame.
    ///
    /// A frame waits here for the link, not in a queue: meanwhile the outbox replaces its successors.
    pub(super) async fn send(&self) {
        let mut last = Ok(());
        loop {
            let frame = self.ports.outbox.take().await;
            if !self.is_authenticated() {
                continue;
            }
            let characteristic = self.attributes.notified(&frame);
            if !characteristic.should_notify(self.link) {
                continue;
            }
            let raw = self.link.raw();
            let outcome = match admit(frame.len(), raw.att_mtu(), raw.params().conn_interval) {
                Ok(()) => characteristic
                    .notify_raw(self.link, &frame, false)
                    .await
                    .map_err(Withheld::NotSent),
                refused => refused,
            };
            if outcome != last {
                if let Err(reason) = &outcome {
                    (self.report)(Notice::Withheld(reason.clone()));
                }
                last = outcome;
            }
        }
    }
}

/// Whether a link carries a frame of `length` bytes whole and in time.
pub(super) fn admit(length: usize, att_mtu: u16, interval: Duration) -> Result<(), Withheld> {
    let needed = u16::try_from(length + NOTIFICATION_BYTES)
        .unwrap_or(u16::MAX)
        .max(MIN_ATT_MTU);
    if att_mtu < needed {
        return Err(Withheld::MtuTooSmall {
            needed,
            negotiated: att_mtu,
        });
    }
    if interval > INTERVAL_LIMIT {
        return Err(Withheld::IntervalTooLong {
            limit_us: INTERVAL_LIMIT.as_micros(),
            actual_us: interval.as_micros(),
        });
    }
    Ok(())
}

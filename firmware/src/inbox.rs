//! What a host sent and nobody has handled yet: checked frames in a short queue, whatever transport they
//! came by.
//!
//! Everything a host can do wrong ends here, with a reason and a count: a frame is decoded, its kind
//! compared with what the place allows, its rate limited, and a full queue refuses instead of growing.
//! Nothing of a refused frame changes anything.

use core::cell::RefCell;

use embassy_sync::{
    blocking_mutex::{Mutex, raw::CriticalSectionRawMutex},
    channel::Channel,
};
use embassy_time::{Duration, Instant};
use tonus_shared::wire::{self, Frame, Kind, WireError};

/// Frames that wait: a host's burst of hand positions and pings within one connection interval.
pub const PLACES: usize = 4;
/// Frames accepted in a burst before the rate counts.
const BURST: u32 = 64;
/// One more frame is accepted per this time: twice the fastest that a host has reason to send (hand
/// positions at 100 Hz beside a model's pieces at 150 Hz).
const REFILL: Duration = Duration::from_millis(2);

/// Why a host's frame was not taken.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Refusal {
    /// The bytes are no frame.
    #[error(transparent)]
    Malformed(#[from] WireError),
    /// A whole frame of a kind that this place does not take.
    #[error("{got} frame where {expected} is expected: write it to its own characteristic")]
    OutOfPlace {
        /// The kind that belongs here.
        expected: Kind,
        /// The kind that came.
        got: Kind,
    },
    /// A whole frame of a kind that only a wearable sends.
    #[error("{got} frame from a host: only a wearable sends these")]
    NotFromHost {
        /// The kind that came.
        got: Kind,
    },
    /// More frames than a wearable has to handle.
    #[error("frames come faster than one per {} ms: send slower", REFILL.as_millis())]
    TooFast,
    /// The frames before are not handled yet.
    #[error("{PLACES} frames wait already: send this one again")]
    Full,
}

/// From the transports to whoever handles requests.
pub struct Inbox {
    frames: Channel<CriticalSectionRawMutex, Frame, PLACES>,
    state: Mutex<CriticalSectionRawMutex, RefCell<State>>,
}

#[derive(Clone, Copy)]
struct State {
    refused: u32,
    credit: u32,
    credited: Instant,
}

impl Inbox {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            frames: Channel::new(),
            state: Mutex::new(RefCell::new(State {
                refused: 0,
                credit: BURST,
                credited: Instant::MIN,
            })),
        }
    }

    /// Takes the bytes of one frame that came at `now` and should be of kind `expected`.
    ///
    /// # Errors
    /// [`Refusal`]; it is counted, and nothing else happens.
    pub fn offer(&self, now: Instant, expected: Kind, bytes: &[u8]) -> Result<(), Refusal> {
        self.counted(self.admit(now, bytes, |got| {
            let right = got == expected;
            right
                .then_some(())
                .ok_or(Refusal::OutOfPlace { expected, got })
        }))
    }

    /// As [`Self::offer`], where one place takes all that a host sends.
    ///
    /// # Errors
    /// [`Refusal`]; it is counted, and nothing else happens.
    pub fn offer_any(&self, now: Instant, bytes: &[u8]) -> Result<(), Refusal> {
        self.counted(self.admit(now, bytes, |got| match got {
            Kind::HandPosition
            | Kind::Ping
            | Kind::Control
            | Kind::Calibration
            | Kind::ModelUpload => Ok(()),
            Kind::Configuration
            | Kind::Stream
            | Kind::RawSemg
            | Kind::Orientation
            | Kind::Inference
            | Kind::Status
            | Kind::ModelState
            | Kind::Reply
            | Kind::LastWords => Err(Refusal::NotFromHost { got }),
        }))
    }

    fn counted(&self, outcome: Result<(), Refusal>) -> Result<(), Refusal> {
        if outcome.is_err() {
            self.state.lock(|state| {
                let mut state = state.borrow_mut();
                state.refused = state.refused.wrapping_add(1);
            });
        }
        outcome
    }

    fn admit(
        &self,
        now: Instant,
        bytes: &[u8],
        belongs: impl FnOnce(Kind) -> Result<(), Refusal>,
    ) -> Result<(), Refusal> {
        let frame = wire::decode(bytes)?;
        belongs(frame.packet.kind())?;
        if !self.state.lock(|state| state.borrow_mut().spend(now)) {
            return Err(Refusal::TooFast);
        }
        self.frames.try_send(frame).map_err(|_| Refusal::Full)
    }

    /// Waits for the next frame, the oldest first.
    pub async fn take(&self) -> Frame {
        self.frames.receive().await
    }

    /// The next frame if one waits, the oldest first.
    pub fn try_take(&self) -> Option<Frame> {
        self.frames.try_receive().ok()
    }

    /// Frames refused since start; wraps.
    pub fn refused(&self) -> u32 {
        self.state.lock(|state| state.borrow().refused)
    }
}

impl Default for Inbox {
    fn default() -> Self {
        Self::new()
    }
}

impl State {
    /// Whether one more frame may come at `now`.
    fn spend(&mut self, now: Instant) -> bool {
        let earned = now.saturating_duration_since(self.credited).as_ticks() / REFILL.as_ticks();
        if earned > 0 {
            let earned = u32::try_from(earned).unwrap_or(u32::MAX);
            self.credit = self.credit.saturating_add(earned).min(BURST);
            self.credited = if self.credit == BURST {
                now
            } else {
                self.credited + REFILL * earned
            };
        }
        let Some(left) = self.credit.checked_sub(1) else {
            return false;
        };
        self.credit = left;
        true
    }
}

#[cfg(test)]
mod tests {
    use embassy_futures::{block_on, poll_once};
    use tonus_shared::wire::{Header, MAX_FRAME_BYTES, Packet, Ping};

    use super::*;

    fn ping(id: u32) -> heapless::Vec<u8, MAX_FRAME_BYTES> {
        let header = Header {
            boot_id: 1,
            sequence: id,
            device_us: 0,
        };
        let packet = Packet::Ping(Ping::Request {
            id,
            requested_us: 0,
        });
        let mut bytes = [0; MAX_FRAME_BYTES];
        let length = wire::encode(&header, &packet, &mut bytes).unwrap();
        heapless::Vec::from_slice(&bytes[..length]).unwrap()
    }

    fn at(time_ms: u64) -> Instant {
        Instant::from_millis(time_ms)
    }

    #[test]
    fn a_frame_comes_out_as_it_went_in() {
        let inbox = Inbox::new();
        inbox.offer(at(0), Kind::Ping, &ping(7)).unwrap();
        assert_eq!(block_on(inbox.take()).header.sequence, 7);
        assert!(poll_once(inbox.take()).is_pending());
        assert_eq!(inbox.refused(), 0);
    }

    #[test]
    fn what_is_no_frame_or_out_of_place_is_refused_and_counted() {
        let inbox = Inbox::new();
        let mut flipped = ping(7);
        flipped[20] ^= 1;
        assert!(matches!(
            inbox.offer(at(0), Kind::Ping, &flipped),
            Err(Refusal::Malformed(WireError::BadCrc { .. }))
        ));
        assert!(matches!(
            inbox.offer(at(0), Kind::Ping, &[]),
            Err(Refusal::Malformed(_))
        ));
        assert_eq!(
            inbox.offer(at(0), Kind::HandPosition, &ping(7)),
            Err(Refusal::OutOfPlace {
                expected: Kind::HandPosition,
                got: Kind::Ping
            })
        );
        assert_eq!(inbox.refused(), 3);
        assert!(poll_once(inbox.take()).is_pending(), "nothing came through");
    }

    #[test]
    fn a_full_inbox_refuses_and_keeps_what_waits() {
        let inbox = Inbox::new();
        for id in 0..4 {
            inbox.offer(at(0), Kind::Ping, &ping(id)).unwrap();
        }
        assert_eq!(inbox.offer(at(0), Kind::Ping, &ping(4)), Err(Refusal::Full));
        for id in 0..4 {
            assert_eq!(block_on(inbox.take()).header.sequence, id);
        }
    }

    #[test]
    fn a_flood_is_held_to_one_frame_per_two_milliseconds() {
        let inbox = Inbox::new();
        let mut taken = 0;
        for time_ms in 1_000..2_000 {
            for _ in 0..10 {
                if inbox.offer(at(time_ms), Kind::Ping, &ping(0)).is_ok() {
                    taken += 1;
                    block_on(inbox.take());
                }
            }
        }
        // The burst, and one every 2 ms of the second: 64 + 499.
        assert_eq!(taken, 563);
        assert_eq!(inbox.refused(), 10_000 - 563);
    }
}

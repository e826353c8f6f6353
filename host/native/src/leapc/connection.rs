//! A connection to the service, and what comes out of it.

use std::ffi::c_void;
use std::ptr;
use std::time::Duration;

use thiserror::Error;

use super::functions::{
    BACKGROUND_FRAMES, HANDSHAKE_INCOMPLETE, Handle, NOT_AVAILABLE, NOT_CONNECTED, OPTIMIZE_HMD,
    SUCCESS, TIMEOUT, UNEXPECTED_CLOSED,
};
use super::layout::{self, Message, Tracking};
use super::{LeapC, LeapCError};

/// No frame has more hands: what the library counts is not trusted.
const MOST_HANDS: u32 = 8;

/// A connection, which is ended when it is dropped.
#[derive(Debug)]
pub struct Connection {
    leapc: LeapC,
    handle: Handle,
}

// SAFETY: LeapC ties a connection to no thread, and `poll` borrows it alone, as the library asks.
unsafe impl Send for Connection {}

/// What happened.
#[derive(Clone, Debug, PartialEq)]
pub enum Event {
    /// The service answers.
    Connected,
    /// The service is gone. A connection is made again by a new [`Connection`].
    ConnectionLost,
    /// A tracker is there.
    DeviceFound,
    /// The tracker was unplugged, or sends no more.
    DeviceLost,
    /// The tracker does not work.
    DeviceFailed {
        /// Of `eLeapDeviceStatus`, as the header writes it.
        status: u32,
    },
    /// A picture's worth.
    Frame(Frame),
    /// A frame that says what none can.
    Unreadable(Unreadable),
    /// What nobody here asked for.
    Other,
}

/// One picture's worth.
#[derive(Clone, Debug, PartialEq)]
pub struct Frame {
    /// Counts up while the service runs.
    pub id: i64,
    /// When the picture was taken, by [`LeapC::now_us`].
    pub timestamp_us: i64,
    /// That clock when the frame was handed over.
    pub now_us: i64,
    /// Hands in view.
    pub hands: Vec<Hand>,
}

/// One hand of a frame; every number is finite.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Hand {
    /// Its number for as long as it stays in view.
    pub id: u32,
    /// Left or right.
    pub side: Option<Side>,
    /// For how long it has been in view, microseconds.
    pub visible_us: u64,
    /// How well it fits what is seen, 0 to 1.
    pub confidence: f32,
    /// 0 open, 1 a fist.
    pub grab: f32,
    /// 0 open, 1 thumb and finger together.
    pub pinch: f32,
    /// Middle of the palm in the tracker's frame, millimetres.
    pub palm_mm: [f32; 3],
    /// Its velocity, millimetres per second.
    pub velocity_mm_per_s: [f32; 3],
    /// Unit vector out of the palm.
    pub palm_normal: [f32; 3],
    /// Unit vector from the palm to the fingers.
    pub direction: [f32; 3],
}

/// Which hand.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Side {
    /// The left one.
    Left,
    /// The right one.
    Right,
}

/// Why a frame is none.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum Unreadable {
    /// A message without what it tells of.
    #[error("a message of LeapC without its frame")]
    NoFrame,
    /// Hands that are counted but not there.
    #[error("a frame of LeapC counts {count} hands and has none")]
    NoHands {
        /// The count.
        count: u32,
    },
    /// More hands than can be.
    #[error("a frame of LeapC counts {count} hands, at most {MOST_HANDS} are possible")]
    TooManyHands {
        /// The count.
        count: u32,
    },
    /// A number that is none.
    #[error("a hand's {field} is not finite")]
    NotFinite {
        /// The header's name of the field.
        field: &'static str,
    },
}

impl Connection {
    pub(super) fn open(leapc: &LeapC) -> Result<Self, LeapCError> {
        let mut handle = ptr::null_mut();
        // SAFETY: null asks for the usual configuration; `handle` outlives the call.
        let code = unsafe { (leapc.0.create)(ptr::null(), &raw mut handle) };
        check("LeapCreateConnection", code)?;
        if handle.is_null() {
            return Err(LeapCError::NotConnected);
        }
        let this = Self {
            leapc: leapc.clone(),
            handle,
        };
        // SAFETY: the connection is live.
        let code = unsafe { (leapc.0.open)(handle) };
        check("LeapOpenConnection", code)?;
        Ok(this)
    }

    /// What happens next, or none within `limit`.
    ///
    /// # Errors
    /// [`LeapCError::NotConnected`], maybe at once, while there is no service; [`LeapCError::Failed`].
    pub fn poll(&mut self, limit: Duration) -> Result<Option<Event>, LeapCError> {
        let limit_ms = u32::try_from(limit.as_micros().div_ceil(1_000)).unwrap_or(u32::MAX);
        let mut message = Message {
            size: 0,
            kind: 0,
            event: ptr::null(),
            device_id: 0,
        };
        // SAFETY: the connection is live and polled by nobody else; `message` is as large as the library writes.
        let code = unsafe { (self.leapc.0.poll)(self.handle, limit_ms, &raw mut message) };
        if code == TIMEOUT {
            return Ok(None);
        }
        check("LeapPollConnection", code)?;
        let event = message.event;
        Ok(Some(match message.kind {
            layout::CONNECTION => {
                self.ask_for_frames()?;
                Event::Connected
            }
            layout::CONNECTION_LOST => Event::ConnectionLost,
            layout::DEVICE => Event::DeviceFound,
            layout::DEVICE_LOST => Event::DeviceLost,
            layout::DEVICE_FAILURE => Event::DeviceFailed {
                // SAFETY: of this kind is what the library points at, until the next poll.
                status: unsafe { copy::<layout::DeviceFailure>(event) }
                    .map_or(0, |told| told.status),
            },
            // SAFETY: as above.
            layout::TRACKING => match unsafe { frame(event, self.leapc.now_us()) } {
                Ok(frame) => Event::Frame(frame),
                Err(unreadable) => Event::Unreadable(unreadable),
            },
            _ => Event::Other,
        }))
    }

    /// As the WebSocket's client does: frames without the focus, of a tracker on the table.
    fn ask_for_frames(&self) -> Result<(), LeapCError> {
        // SAFETY: the connection is live.
        let code =
            unsafe { (self.leapc.0.set_policy)(self.handle, BACKGROUND_FRAMES, OPTIMIZE_HMD) };
        check("LeapSetPolicyFlags", code)
    }
}

impl Drop for Connection {
    fn drop(&mut self) {
        // SAFETY: the connection is live, is this value's own, and not used after.
        unsafe { (self.leapc.0.destroy)(self.handle) };
    }
}

/// A copy of what an event points at; none where it points nowhere.
///
/// # Safety
/// Null, or a `T` that lives during the call; no alignment is needed.
unsafe fn copy<T: Copy>(event: *const c_void) -> Option<T> {
    // SAFETY: not null, and the caller vouches for the rest.
    (!event.is_null()).then(|| unsafe { event.cast::<T>().read_unaligned() })
}

/// The frame that a message of tracking points at.
///
/// # Safety
/// Null, or a `Tracking` that lives during the call and points at the hands it counts, or at null.
unsafe fn frame(event: *const c_void, now_us: i64) -> Result<Frame, Unreadable> {
    // SAFETY: as the caller vouches.
    let told: Tracking = unsafe { copy(event) }.ok_or(Unreadable::NoFrame)?;
    let (count, hands) = (told.hand_count, told.hands);
    if count > MOST_HANDS {
        return Err(Unreadable::TooManyHands { count });
    }
    if count > 0 && hands.is_null() {
        return Err(Unreadable::NoHands { count });
    }
    let mut read = Vec::new();
    for at in 0..count {
        // No overflow: at most eight hands that lie in one piece of memory.
        let one = hands.wrapping_add(at as usize);
        // SAFETY: not null, one of the hands counted, which live during the call.
        read.push(hand(&unsafe { one.read_unaligned() })?);
    }
    Ok(Frame {
        id: told.tracking_frame_id,
        timestamp_us: told.timestamp_us,
        now_us,
        hands: read,
    })
}

fn hand(told: &layout::Hand) -> Result<Hand, Unreadable> {
    let palm = told.palm;
    Ok(Hand {
        id: told.id,
        side: match told.kind {
            layout::LEFT => Some(Side::Left),
            layout::RIGHT => Some(Side::Right),
            _ => None,
        },
        visible_us: told.visible_us,
        confidence: finite("confidence", [told.confidence])?[0],
        grab: finite("grab_strength", [told.grab_strength])?[0],
        pinch: finite("pinch_strength", [told.pinch_strength])?[0],
        palm_mm: finite("palm.position", palm.position)?,
        velocity_mm_per_s: finite("palm.velocity", palm.velocity)?,
        palm_normal: finite("palm.normal", palm.normal)?,
        direction: finite("palm.direction", palm.direction)?,
    })
}

fn finite<const N: usize>(field: &'static str, numbers: [f32; N]) -> Result<[f32; N], Unreadable> {
    if numbers.iter().all(|number| number.is_finite()) {
        Ok(numbers)
    } else {
        Err(Unreadable::NotFinite { field })
    }
}

fn check(call: &'static str, code: u32) -> Result<(), LeapCError> {
    match code {
        SUCCESS => Ok(()),
        NOT_CONNECTED | NOT_AVAILABLE | HANDSHAKE_INCOMPLETE | UNEXPECTED_CLOSED => {
            Err(LeapCError::NotConnected)
        }
        code => Err(LeapCError::Failed { call, code }),
    }
}

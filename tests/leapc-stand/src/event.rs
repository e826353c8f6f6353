//! An event as C sees it.

use std::ffi::c_void;
use std::ptr;

use leap_sys::{
    LEAP_CONNECTION_EVENT, LEAP_CONNECTION_MESSAGE, LEAP_DEVICE_EVENT, LEAP_DEVICE_FAILURE_EVENT,
    LEAP_HAND, LEAP_TRACKING_EVENT, LEAP_VECTOR,
};

use crate::script::{Act, Frame, Hand};

/// What a message points at, for as long as it may be looked at.
pub(crate) struct Told {
    kind: leap_sys::eLeapEventType,
    body: Body,
}

enum Body {
    None,
    Flags(Box<LEAP_CONNECTION_EVENT>),
    Device(Box<LEAP_DEVICE_EVENT>),
    Failure(Box<LEAP_DEVICE_FAILURE_EVENT>),
    Frame(Box<LEAP_TRACKING_EVENT>, Vec<LEAP_HAND>),
}

/// A struct of the header.
///
/// # Safety
/// Numbers and pointers alone.
unsafe trait Plain: Copy {}

// SAFETY: as the header says.
unsafe impl Plain for LEAP_CONNECTION_EVENT {}
// SAFETY: as above.
unsafe impl Plain for LEAP_CONNECTION_MESSAGE {}
// SAFETY: as above.
unsafe impl Plain for LEAP_DEVICE_EVENT {}
// SAFETY: as above.
unsafe impl Plain for LEAP_DEVICE_FAILURE_EVENT {}
// SAFETY: as above.
unsafe impl Plain for LEAP_HAND {}
// SAFETY: as above.
unsafe impl Plain for LEAP_TRACKING_EVENT {}
// SAFETY: as above.
unsafe impl Plain for LEAP_VECTOR {}

/// With every byte 0.
fn zeroed<T: Plain>() -> T {
    // SAFETY: zero is a value of numbers and pointers.
    unsafe { std::mem::zeroed() }
}

/// A message that tells nothing.
pub(crate) fn none() -> LEAP_CONNECTION_MESSAGE {
    let mut message: LEAP_CONNECTION_MESSAGE = zeroed();
    message.size = u32::try_from(size_of::<LEAP_CONNECTION_MESSAGE>()).unwrap();
    message.type_ = leap_sys::_eLeapEventType_eLeapEventType_None;
    message
}

impl Told {
    pub(crate) fn new(act: Act, clock_us: i64) -> Self {
        use leap_sys::{
            _eLeapEventType_eLeapEventType_Connection as CONNECTION,
            _eLeapEventType_eLeapEventType_ConnectionLost as CONNECTION_LOST,
            _eLeapEventType_eLeapEventType_Device as DEVICE,
            _eLeapEventType_eLeapEventType_DeviceFailure as DEVICE_FAILURE,
            _eLeapEventType_eLeapEventType_DeviceLost as DEVICE_LOST,
            _eLeapEventType_eLeapEventType_Tracking as TRACKING,
        };
        let (kind, body) = match act {
            Act::Connection => (CONNECTION, Body::Flags(Box::new(zeroed()))),
            Act::ConnectionLost => (CONNECTION_LOST, Body::Flags(Box::new(zeroed()))),
            Act::Device => (DEVICE, Body::Device(Box::new(zeroed()))),
            Act::DeviceLost => (DEVICE_LOST, Body::Device(Box::new(zeroed()))),
            Act::DeviceFailure(status) => {
                let mut failure: LEAP_DEVICE_FAILURE_EVENT = zeroed();
                failure.status = status.cast_signed();
                (DEVICE_FAILURE, Body::Failure(Box::new(failure)))
            }
            Act::NoFrame => (TRACKING, Body::None),
            Act::Frame(frame) => (TRACKING, tracking(&frame, clock_us)),
            Act::Code(_) | Act::Recording(_) => unreachable!("no events"),
        };
        Self { kind, body }
    }

    pub(crate) fn message(&self) -> LEAP_CONNECTION_MESSAGE {
        let mut message = none();
        message.type_ = self.kind;
        message.device_id = 1;
        message.__bindgen_anon_1.pointer = match &self.body {
            Body::None => ptr::null(),
            Body::Flags(event) => address(&**event),
            Body::Device(event) => address(&**event),
            Body::Failure(event) => address(&**event),
            Body::Frame(event, _) => address(&**event),
        };
        message
    }

    /// Overwrites what nobody may look at any more.
    pub(crate) fn spoil(&mut self) {
        if let Body::Frame(event, hands) = &mut self.body {
            let count = hands.len();
            // SAFETY: the whole of the hands, for which any bytes are a value.
            unsafe { hands.as_mut_ptr().write_bytes(0xFF, count) };
            // SAFETY: the whole of the event, likewise.
            unsafe { ptr::from_mut(&mut **event).write_bytes(0xFF, 1) };
        }
    }
}

fn address<T>(event: &T) -> *const c_void {
    ptr::from_ref(event).cast()
}

fn tracking(frame: &Frame, clock_us: i64) -> Body {
    let mut hands: Vec<LEAP_HAND> = frame.hands.iter().map(hand).collect();
    let mut event: LEAP_TRACKING_EVENT = zeroed();
    event.tracking_frame_id = frame.id;
    event.info.frame_id = 7 * frame.id + 1_000_000;
    event.info.timestamp = frame.timestamp + if frame.absolute { 0 } else { clock_us };
    event.nHands = frame.count.unwrap_or(u32::try_from(hands.len()).unwrap());
    event.pHands = if frame.no_hands {
        ptr::null_mut()
    } else {
        hands.as_mut_ptr()
    };
    event.framerate = 110.0;
    Body::Frame(Box::new(event), hands)
}

fn hand(told: &Hand) -> LEAP_HAND {
    let mut hand: LEAP_HAND = zeroed();
    hand.id = told.id;
    hand.type_ = match told.side.as_str() {
        "left" => leap_sys::_eLeapHandType_eLeapHandType_Left,
        _ => leap_sys::_eLeapHandType_eLeapHandType_Right,
    };
    hand.confidence = told.confidence;
    hand.grab_strength = told.grab_strength;
    hand.pinch_strength = told.pinch_strength;
    hand.palm.position = vector(told.palm_position);
    // Nobody should take one for the other.
    hand.palm.stabilized_position = vector([Some(-999.0); 3]);
    hand.palm.velocity = vector(told.palm_velocity);
    hand.palm.normal = vector(told.palm_normal);
    hand.palm.direction = vector(told.direction);
    hand.palm.width = 85.0;
    hand
}

#[allow(
    clippy::cast_possible_truncation,
    reason = "the library's own precision"
)]
fn vector(numbers: [Option<f64>; 3]) -> LEAP_VECTOR {
    let mut vector: LEAP_VECTOR = zeroed();
    vector.__bindgen_anon_1.v =
        numbers.map(|number| number.map_or(f32::NAN, |number| number as f32));
    vector
}

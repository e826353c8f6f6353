//! Sizes, places and numbers against `leap-sys`, which bindgen made out of LeapC.h.

use std::mem::{align_of, offset_of, size_of};

use super::super::functions;
use super::{Bone, DeviceFailure, Digit, Hand, Message, Palm, Tracking};

/// Expects the size, the alignment and the place of every field of ours to be theirs.
macro_rules! alike {
    ($ours:ty, $theirs:ty: $($own:ident = $($field:ident).+),* $(,)?) => {{
        let sizes = (size_of::<$ours>(), align_of::<$ours>());
        assert_eq!(sizes, (size_of::<$theirs>(), align_of::<$theirs>()), stringify!($ours));
        $(assert_eq!(
            offset_of!($ours, $own),
            offset_of!($theirs, $($field).+),
            concat!(stringify!($ours), "::", stringify!($own))
        );)*
    }};
}

#[test]
fn structs_lie_as_in_the_header() {
    alike!(Message, leap_sys::LEAP_CONNECTION_MESSAGE:
        size = size, kind = type_, event = __bindgen_anon_1, device_id = device_id);
    alike!(Tracking, leap_sys::LEAP_TRACKING_EVENT:
        reserved = info.reserved, frame_id = info.frame_id, timestamp_us = info.timestamp,
        tracking_frame_id = tracking_frame_id, hand_count = nHands, hands = pHands, rate_hz = framerate);
    alike!(Hand, leap_sys::LEAP_HAND:
        id = id, flags = flags, kind = type_, confidence = confidence, visible_us = visible_time,
        pinch_distance = pinch_distance, grab_angle = grab_angle, pinch_strength = pinch_strength,
        grab_strength = grab_strength, palm = palm, digits = __bindgen_anon_1, arm = arm);
    alike!(Palm, leap_sys::LEAP_PALM:
        position = position, stabilized_position = stabilized_position, velocity = velocity, normal = normal,
        width = width, direction = direction, orientation = orientation);
    alike!(Digit, leap_sys::LEAP_DIGIT:
        id = finger_id, bones = __bindgen_anon_1, is_extended = is_extended);
    alike!(Bone, leap_sys::LEAP_BONE:
        from = prev_joint, to = next_joint, width = width, rotation = rotation);
    alike!(DeviceFailure, leap_sys::LEAP_DEVICE_FAILURE_EVENT:
        status = status, device = hDevice);
}

#[test]
fn numbers_are_those_of_the_header() {
    let numbers = [
        (
            super::CONNECTION,
            leap_sys::_eLeapEventType_eLeapEventType_Connection,
        ),
        (
            super::CONNECTION_LOST,
            leap_sys::_eLeapEventType_eLeapEventType_ConnectionLost,
        ),
        (
            super::DEVICE,
            leap_sys::_eLeapEventType_eLeapEventType_Device,
        ),
        (
            super::DEVICE_FAILURE,
            leap_sys::_eLeapEventType_eLeapEventType_DeviceFailure,
        ),
        (
            super::TRACKING,
            leap_sys::_eLeapEventType_eLeapEventType_Tracking,
        ),
        (
            super::DEVICE_LOST,
            leap_sys::_eLeapEventType_eLeapEventType_DeviceLost,
        ),
        (super::LEFT, leap_sys::_eLeapHandType_eLeapHandType_Left),
        (super::RIGHT, leap_sys::_eLeapHandType_eLeapHandType_Right),
        (functions::SUCCESS, leap_sys::_eLeapRS_eLeapRS_Success),
        (functions::TIMEOUT, leap_sys::_eLeapRS_eLeapRS_Timeout),
        (
            functions::NOT_CONNECTED,
            leap_sys::_eLeapRS_eLeapRS_NotConnected,
        ),
        (
            functions::HANDSHAKE_INCOMPLETE,
            leap_sys::_eLeapRS_eLeapRS_HandshakeIncomplete,
        ),
        (
            functions::UNEXPECTED_CLOSED,
            leap_sys::_eLeapRS_eLeapRS_UnexpectedClosed,
        ),
        (
            functions::NOT_AVAILABLE,
            leap_sys::_eLeapRS_eLeapRS_NotAvailable,
        ),
    ];
    for (ours, theirs) in numbers {
        assert_eq!(ours, theirs.cast_unsigned());
    }
    let background = leap_sys::_eLeapPolicyFlag_eLeapPolicyFlag_BackgroundFrames;
    let worn = leap_sys::_eLeapPolicyFlag_eLeapPolicyFlag_OptimizeHMD;
    let theirs = [background, worn].map(i64::from).map(i64::cast_unsigned);
    assert_eq!(
        [functions::BACKGROUND_FRAMES, functions::OPTIMIZE_HMD],
        theirs
    );
}

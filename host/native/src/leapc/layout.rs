//! What lies where in the library's messages: the structs of LeapC.h under its `#pragma pack(1)`, millimetres and
//! microseconds.

use std::ffi::c_void;

/// `LEAP_CONNECTION_MESSAGE`. Version 3 writes no device.
#[repr(C, packed)]
pub(super) struct Message {
    pub(super) size: u32,
    pub(super) kind: u32,
    /// To what `kind` says; null where there is no more to say. Good until the next poll.
    pub(super) event: *const c_void,
    pub(super) device_id: u32,
}

/// Values of `eLeapEventType`.
pub(super) const CONNECTION: u32 = 1;
pub(super) const CONNECTION_LOST: u32 = 2;
pub(super) const DEVICE: u32 = 3;
pub(super) const DEVICE_FAILURE: u32 = 4;
pub(super) const TRACKING: u32 = 0x100;
pub(super) const DEVICE_LOST: u32 = 0x104;

/// Values of `eLeapHandType`.
pub(super) const LEFT: u32 = 0;
pub(super) const RIGHT: u32 = 1;

/// `LEAP_TRACKING_EVENT` with its `LEAP_FRAME_HEADER`.
#[repr(C, packed)]
#[derive(Clone, Copy)]
pub(super) struct Tracking {
    pub(super) reserved: *const c_void,
    /// Of the picture.
    pub(super) frame_id: i64,
    pub(super) timestamp_us: i64,
    /// Of what was made of it.
    pub(super) tracking_frame_id: i64,
    pub(super) hand_count: u32,
    pub(super) hands: *const Hand,
    pub(super) rate_hz: f32,
}

/// `LEAP_HAND`.
#[repr(C, packed)]
#[derive(Clone, Copy)]
pub(super) struct Hand {
    pub(super) id: u32,
    pub(super) flags: u32,
    pub(super) kind: u32,
    pub(super) confidence: f32,
    pub(super) visible_us: u64,
    pub(super) pinch_distance: f32,
    pub(super) grab_angle: f32,
    pub(super) pinch_strength: f32,
    pub(super) grab_strength: f32,
    pub(super) palm: Palm,
    pub(super) digits: [Digit; 5],
    pub(super) arm: Bone,
}

/// `LEAP_PALM`.
#[repr(C, packed)]
#[derive(Clone, Copy)]
pub(super) struct Palm {
    pub(super) position: [f32; 3],
    pub(super) stabilized_position: [f32; 3],
    pub(super) velocity: [f32; 3],
    pub(super) normal: [f32; 3],
    pub(super) width: f32,
    pub(super) direction: [f32; 3],
    pub(super) orientation: [f32; 4],
}

/// `LEAP_DIGIT`.
#[repr(C, packed)]
#[derive(Clone, Copy)]
pub(super) struct Digit {
    pub(super) id: i32,
    pub(super) bones: [Bone; 4],
    pub(super) is_extended: u32,
}

/// `LEAP_BONE`.
#[repr(C, packed)]
#[derive(Clone, Copy)]
pub(super) struct Bone {
    pub(super) from: [f32; 3],
    pub(super) to: [f32; 3],
    pub(super) width: f32,
    pub(super) rotation: [f32; 4],
}

/// `LEAP_DEVICE_FAILURE_EVENT`.
#[repr(C, packed)]
#[derive(Clone, Copy)]
pub(super) struct DeviceFailure {
    pub(super) status: u32,
    pub(super) device: *const c_void,
}

#[cfg(test)]
mod tests;

//! The frame that a host reads, where it does not wait for one to be notified.

use core::cell::RefCell;

use embassy_sync::blocking_mutex::{Mutex, raw::CriticalSectionRawMutex};

use tonus_shared::wire::{self, Calibration, Header, MAX_FRAME_BYTES, Packet, WireError};

use super::attributes::Value;

/// The calibration in use, as its encoded frame; empty until one was shown.
pub struct Shown(Mutex<CriticalSectionRawMutex, RefCell<Value>>);

impl Shown {
    /// Nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self(Mutex::new(RefCell::new(Value::new())))
    }

    /// Lets a host read `calibration` from now on, in a frame that counts in no sequence. Show it at start and whenever it
    /// changes.
    ///
    /// # Errors
    /// Values that no frame may hold; what was shown before stands.
    pub fn show(&self, boot_id: u32, calibration: &Calibration) -> Result<(), WireError> {
        let header = Header {
            boot_id,
            sequence: 0,
            device_us: 0,
        };
        let mut frame = [0; MAX_FRAME_BYTES];
        let packet = Packet::Calibration(*calibration);
        let length = wire::encode(&header, &packet, &mut frame)?;
        let mut frame = Value::from_array(frame);
        frame.truncate(length);
        self.0.lock(|shown| *shown.borrow_mut() = frame);
        Ok(())
    }

    pub(super) fn get(&self) -> Value {
        self.0.lock(|shown| shown.borrow().clone())
    }
}

impl Default for Shown {
    fn default() -> Self {
        Self::new()
    }
}

//! The frame that a host reads, where it does not wait for one to be notified.

use core::cell::RefCell;

use embassy_sync::blocking_mutex::{Mutex, raw::CriticalSectionRawMutex};

use super::attributes::Value;

/// The calibration in use, as its encoded frame; empty until one was shown.
pub struct Shown(Mutex<CriticalSectionRawMutex, RefCell<Value>>);

impl Shown {
    /// Nothing yet.
    #[must_use]
    pub const fn new() -> Self {
        Self(Mutex::new(RefCell::new(Value::new())))
    }

    /// Lets a host read `frame` from now on. Show it at start and whenever it changes.
    pub fn show(&self, frame: &Value) {
        self.0.lock(|shown| shown.borrow_mut().clone_from(frame));
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

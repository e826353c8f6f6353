//! The time in which a new host may pair: a person opens it at the wearable, nobody else can.

use core::cell::Cell;

use embassy_sync::{
    blocking_mutex::{Mutex, raw::CriticalSectionRawMutex},
    signal::Signal,
};
use embassy_time::{Duration, Instant};

/// How long a press of the button lets a host pair.
pub const OPEN: Duration = Duration::from_secs(60);

/// Closed until its button is pressed, then open for [`OPEN`] or until one host has paired.
pub struct PairingWindow {
    closes: Mutex<CriticalSectionRawMutex, Cell<Option<Instant>>>,
    opened: Signal<CriticalSectionRawMutex, ()>,
}

impl PairingWindow {
    /// A closed one.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            closes: Mutex::new(Cell::new(None)),
            opened: Signal::new(),
        }
    }

    /// The button was pressed at `now`. Pressed again while open, the time starts anew.
    pub fn press(&self, now: Instant) {
        self.closes.lock(|closes| closes.set(now.checked_add(OPEN)));
        self.opened.signal(());
    }

    /// Whether a new host may pair at `now`.
    pub fn is_open(&self, now: Instant) -> bool {
        self.left(now) > Duration::MIN
    }

    /// Time until it closes.
    pub(super) fn left(&self, now: Instant) -> Duration {
        self.closes.lock(Cell::get).map_or(Duration::MIN, |closes| {
            closes.saturating_duration_since(now)
        })
    }

    /// A host has paired: one press lets in one host.
    pub(super) fn close(&self) {
        self.closes.lock(|closes| closes.set(None));
    }

    /// Waits for the next press.
    pub(super) async fn pressed(&self) {
        self.opened.wait().await;
    }
}

impl Default for PairingWindow {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    fn at(time_ms: u64) -> Instant {
        Instant::from_millis(time_ms)
    }

    #[test]
    fn it_is_closed_until_the_button_is_pressed_and_again_after_a_minute() {
        let window = PairingWindow::new();
        assert!(!window.is_open(at(0)));
        window.press(at(5_000));
        assert!(window.is_open(at(5_000)));
        assert!(window.is_open(at(64_999)));
        assert!(!window.is_open(at(65_000)));
        assert!(!window.is_open(at(u64::MAX / 2_000)));
    }

    #[test]
    fn a_second_press_starts_the_minute_anew() {
        let window = PairingWindow::new();
        window.press(at(0));
        window.press(at(59_000));
        assert!(window.is_open(at(118_999)));
        assert!(!window.is_open(at(119_000)));
    }

    #[test]
    fn one_press_lets_in_one_host() {
        let window = PairingWindow::new();
        window.press(at(0));
        window.close();
        assert!(!window.is_open(at(1)));
    }
}

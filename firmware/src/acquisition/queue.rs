//! Between the reading of scans and the signal path, which now and then computes for longer than a period.

use core::sync::atomic::{AtomicU32, Ordering};

use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, channel::Channel};

use super::Event;

/// At most `N` events that wait. One that finds no place is dropped and counted: a scan's index then jumps, and
/// the signal path sees a gap; a fault that lasts is told again.
pub struct EventQueue<const C: usize, const N: usize> {
    waiting: Channel<CriticalSectionRawMutex, Event<C>, N>,
    overruns: AtomicU32,
}

impl<const C: usize, const N: usize> EventQueue<C, N> {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            waiting: Channel::new(),
            overruns: AtomicU32::new(0),
        }
    }

    /// Leaves an event, if there is a place.
    pub fn put(&self, event: Event<C>) {
        if self.waiting.try_send(event).is_err() {
            self.overruns.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// Waits for the oldest event.
    pub async fn take(&self) -> Event<C> {
        self.waiting.receive().await
    }

    /// Events dropped since the start (wrapping).
    pub fn overruns(&self) -> u32 {
        self.overruns.load(Ordering::Relaxed)
    }
}

impl<const C: usize, const N: usize> Default for EventQueue<C, N> {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use embassy_futures::{block_on, poll_once};
    use tonus_shared::sample::Scan;

    use super::*;

    fn scan(index: u32) -> Event<1> {
        Event::Scan {
            scan: Scan {
                index,
                acquired_us: 0,
                counts: [0],
            },
            lead_off: [false],
        }
    }

    #[test]
    fn what_finds_no_place_is_dropped_and_counted() {
        let queue = EventQueue::<1, 4>::new();
        for index in 0..7 {
            queue.put(scan(index));
        }
        assert_eq!(queue.overruns(), 3);
        for index in 0..4 {
            assert_eq!(block_on(queue.take()), scan(index));
        }
        assert!(poll_once(queue.take()).is_pending());
        queue.put(scan(7));
        assert_eq!(
            block_on(queue.take()),
            scan(7),
            "the jump from 3 is the gap"
        );
        assert_eq!(queue.overruns(), 3);
    }
}

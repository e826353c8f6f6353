//! What waits for a transport: the newest frame of each measurement, and a short queue of reports.

use core::cell::RefCell;

use embassy_sync::{
    blocking_mutex::{Mutex, raw::CriticalSectionRawMutex},
    signal::Signal,
};
use heapless::{Deque, Vec};
use tonus_shared::wire::{Kind, MAX_FRAME_BYTES};

/// One encoded packet.
pub type EncodedFrame = Vec<u8, MAX_FRAME_BYTES>;

/// Reports that may wait at once: a configuration, a status, and the answers to a burst of requests.
pub const REPORTS: usize = 8;

/// From the signal path to the transport.
///
/// Of stream, raw sEMG, orientation and inference the newest waits, each in a place of its own: over a stalled link the
/// newest measurement goes out when it recovers, not the oldest. Everything else is a report. Reports wait in a queue,
/// since a reply that was replaced would be lost without notice; when the queue is full a new one is refused and
/// counted. Of configuration and status, which come again and again, the queue holds one each.
///
/// Frames leave in the order in which they were numbered: a host takes nothing for new that is numbered before what it
/// has seen. One transport takes at a time.
pub struct Outbox {
    waiting: Mutex<CriticalSectionRawMutex, RefCell<Waiting>>,
    arrived: Signal<CriticalSectionRawMutex, ()>,
}

/// What did not leave, since the start; wraps.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct OutboxCounts {
    /// Frames replaced by newer ones of their kind.
    pub replaced: u32,
    /// Reports that found the queue full.
    pub refused: u32,
}

/// The queue is full: the report was not taken.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("{REPORTS} reports wait already: let the transport take some first")]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct QueueFull;

/// A frame and how many were put before it.
struct Numbered {
    order: u32,
    frame: EncodedFrame,
}

struct Waiting {
    stream: Option<Numbered>,
    raw: Option<Numbered>,
    orientation: Option<Numbered>,
    inference: Option<Numbered>,
    reports: Deque<(Kind, Numbered), REPORTS>,
    put: u32,
    counts: OutboxCounts,
}

impl Outbox {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            waiting: Mutex::new(RefCell::new(Waiting::new())),
            arrived: Signal::new(),
        }
    }

    /// Leaves a frame of this kind. Call it in the order of the sequence numbers.
    ///
    /// # Errors
    /// [`QueueFull`] for a report that finds no room; it is counted.
    pub fn put(&self, kind: Kind, frame: EncodedFrame) -> Result<(), QueueFull> {
        self.waiting
            .lock(|waiting| waiting.borrow_mut().put(kind, frame))?;
        self.arrived.signal(());
        Ok(())
    }

    /// Waits for a frame; of several the one that was put first.
    pub async fn take(&self) -> EncodedFrame {
        loop {
            if let Some(frame) = self.waiting.lock(|waiting| waiting.borrow_mut().take()) {
                return frame;
            }
            self.arrived.wait().await;
        }
    }

    /// Forgets what waits, so that a new link does not begin with an old measurement. The counts stay.
    pub fn clear(&self) {
        self.waiting.lock(|waiting| waiting.borrow_mut().clear());
        self.arrived.reset();
    }

    /// What did not leave so far; what [`Self::clear`] forgot had nobody to go to and is not counted.
    #[must_use]
    pub fn counts(&self) -> OutboxCounts {
        self.waiting.lock(|waiting| waiting.borrow().counts)
    }
}

impl Default for Outbox {
    fn default() -> Self {
        Self::new()
    }
}

impl Waiting {
    const fn new() -> Self {
        Self {
            stream: None,
            raw: None,
            orientation: None,
            inference: None,
            reports: Deque::new(),
            put: 0,
            counts: OutboxCounts {
                replaced: 0,
                refused: 0,
            },
        }
    }

    fn put(&mut self, kind: Kind, frame: EncodedFrame) -> Result<(), QueueFull> {
        let order = self.put;
        self.put = order.wrapping_add(1);
        let numbered = Numbered { order, frame };
        let place = match kind {
            Kind::Stream => &mut self.stream,
            Kind::RawSemg => &mut self.raw,
            Kind::Orientation => &mut self.orientation,
            Kind::Inference => &mut self.inference,
            Kind::Configuration
            | Kind::HandPosition
            | Kind::Ping
            | Kind::Status
            | Kind::Control
            | Kind::Calibration
            | Kind::ModelUpload
            | Kind::ModelState
            | Kind::Reply
            | Kind::LastWords => return self.report(kind, numbered),
        };
        if place.replace(numbered).is_some() {
            self.counts.replaced = self.counts.replaced.wrapping_add(1);
        }
        Ok(())
    }

    fn report(&mut self, kind: Kind, report: Numbered) -> Result<(), QueueFull> {
        if matches!(kind, Kind::Configuration | Kind::Status) {
            let before = self.reports.len();
            self.reports.retain(|(waiting, _)| *waiting != kind);
            let replaced = (before - self.reports.len()) as u32;
            self.counts.replaced = self.counts.replaced.wrapping_add(replaced);
        }
        self.reports.push_back((kind, report)).map_err(|_| {
            self.counts.refused = self.counts.refused.wrapping_add(1);
            QueueFull
        })
    }

    /// The oldest of all. Orders wrap, so they are compared by how long ago they were given.
    fn take(&mut self) -> Option<EncodedFrame> {
        let put = self.put;
        let age = |numbered: &Numbered| put.wrapping_sub(numbered.order);
        let report = self.reports.front().map_or(0, |(_, report)| age(report));
        let mut oldest = report;
        let mut place = None;
        for measured in [
            &mut self.stream,
            &mut self.raw,
            &mut self.orientation,
            &mut self.inference,
        ] {
            let waited = measured.as_ref().map_or(0, age);
            if waited > oldest {
                oldest = waited;
                place = Some(measured);
            }
        }
        match place {
            Some(place) => place.take().map(|numbered| numbered.frame),
            None => self.reports.pop_front().map(|(_, report)| report.frame),
        }
    }

    fn clear(&mut self) {
        self.stream = None;
        self.raw = None;
        self.orientation = None;
        self.inference = None;
        self.reports.clear();
    }
}

#[cfg(test)]
mod tests {
    use std::vec::Vec;

    use embassy_futures::{block_on, poll_once};

    use super::*;

    fn frame(byte: u8) -> EncodedFrame {
        EncodedFrame::from_slice(&[byte]).unwrap()
    }

    /// All that waits, in the order in which it leaves.
    fn drain(outbox: &Outbox) -> Vec<u8> {
        let mut left = Vec::new();
        while poll_once(async { left.push(outbox.take().await[0]) }).is_ready() {}
        left
    }

    #[test]
    fn the_newest_of_each_measurement_waits_and_the_rest_is_counted() {
        let outbox = Outbox::new();
        let kinds = [
            Kind::Stream,
            Kind::RawSemg,
            Kind::Orientation,
            Kind::Inference,
        ];
        for byte in 0..20 {
            outbox
                .put(kinds[usize::from(byte % 4)], frame(byte))
                .unwrap();
        }
        assert_eq!(drain(&outbox), [16, 17, 18, 19]);
        let counts = OutboxCounts {
            replaced: 16,
            refused: 0,
        };
        assert_eq!(outbox.counts(), counts);
    }

    #[test]
    fn frames_leave_in_the_order_in_which_they_came() {
        let outbox = Outbox::new();
        outbox.put(Kind::Stream, frame(0)).unwrap();
        outbox.put(Kind::Reply, frame(1)).unwrap();
        outbox.put(Kind::Orientation, frame(2)).unwrap();
        outbox.put(Kind::Status, frame(3)).unwrap();
        outbox.put(Kind::Stream, frame(4)).unwrap();
        assert_eq!(drain(&outbox), [1, 2, 3, 4]);
    }

    #[test]
    fn a_full_queue_refuses_replies_and_keeps_those_that_wait() {
        let outbox = Outbox::new();
        for byte in 0..REPORTS as u8 {
            outbox.put(Kind::Reply, frame(byte)).unwrap();
        }
        assert_eq!(outbox.put(Kind::Reply, frame(100)), Err(QueueFull));
        assert_eq!(outbox.put(Kind::Status, frame(101)), Err(QueueFull));
        outbox.put(Kind::Stream, frame(102)).unwrap();
        assert_eq!(outbox.counts().refused, 2);
        assert_eq!(drain(&outbox), [0, 1, 2, 3, 4, 5, 6, 7, 102]);
        outbox.put(Kind::Reply, frame(103)).unwrap();
        assert_eq!(drain(&outbox), [103], "there is room again");
    }

    #[test]
    fn configuration_and_status_do_not_fill_the_queue() {
        let outbox = Outbox::new();
        outbox.put(Kind::Reply, frame(0)).unwrap();
        for byte in 1..=100 {
            let kind = [Kind::Status, Kind::Configuration][usize::from(byte % 2)];
            outbox.put(kind, frame(byte)).unwrap();
        }
        assert_eq!(drain(&outbox), [0, 99, 100]);
        assert_eq!(outbox.counts().replaced, 98);
    }

    #[test]
    fn the_order_outlasts_the_wrap_of_its_numbers() {
        let outbox = Outbox::new();
        outbox
            .waiting
            .lock(|waiting| waiting.borrow_mut().put = u32::MAX - 1);
        outbox.put(Kind::Reply, frame(0)).unwrap();
        outbox.put(Kind::Stream, frame(1)).unwrap();
        outbox.put(Kind::Reply, frame(2)).unwrap();
        outbox.put(Kind::Inference, frame(3)).unwrap();
        assert_eq!(drain(&outbox), [0, 1, 2, 3]);
    }

    #[test]
    fn a_frame_of_the_largest_size_passes_whole() {
        let outbox = Outbox::new();
        let largest = EncodedFrame::from_slice(&[7; MAX_FRAME_BYTES]).unwrap();
        outbox.put(Kind::RawSemg, largest.clone()).unwrap();
        assert_eq!(block_on(outbox.take()), largest);
    }

    #[test]
    fn a_cleared_outbox_waits() {
        let outbox = Outbox::new();
        outbox.put(Kind::Stream, frame(1)).unwrap();
        outbox.put(Kind::Status, frame(2)).unwrap();
        outbox.clear();
        assert!(poll_once(outbox.take()).is_pending());
        assert_eq!(outbox.counts(), OutboxCounts::default());
    }
}

//! What the wearable has sent.

use std::cell::RefCell;

use embassy_sync::{blocking_mutex::raw::NoopRawMutex, signal::Signal};
use tonus_shared::wire::{Packet, SequenceTracker, decode};

/// Frames as they came.
#[derive(Default)]
pub(crate) struct Seen {
    pub(crate) tracker: SequenceTracker,
    /// Device times of the first stream packet and of the newest, us.
    pub(crate) stream_us: Option<(u64, u64)>,
    pub(crate) stream_packets: u64,
    pub(crate) unreadable: u64,
    /// Everything but the stream.
    pub(crate) reports: Vec<Packet>,
}

impl Seen {
    /// What the stream packets' numbers and times say, once there are so many.
    pub(crate) fn counted(&self, wanted: u64) -> Option<String> {
        let (first_us, newest_us) = self.stream_us?;
        let counts = self.tracker.counts();
        (self.stream_packets >= wanted).then(|| {
            format!(
                "stream {} lost {} duplicate {} stale {} boots {} unreadable {} in {} us",
                self.stream_packets,
                counts.lost,
                counts.duplicate,
                counts.stale,
                counts.boots,
                self.unreadable,
                newest_us - first_us
            )
        })
    }
}

/// [`Seen`], for those who wait for something in it.
pub(crate) struct Arrivals {
    seen: RefCell<Seen>,
    news: Signal<NoopRawMutex, ()>,
}

impl Arrivals {
    pub(crate) fn new() -> Self {
        Self {
            seen: RefCell::default(),
            news: Signal::new(),
        }
    }

    /// Takes the value of one notification.
    pub(crate) fn take(&self, bytes: &[u8]) {
        let mut seen = self.seen.borrow_mut();
        match decode(bytes) {
            Err(error) => {
                println!("unreadable {error}");
                seen.unreadable += 1;
            }
            Ok(frame) => {
                let header = frame.header;
                seen.tracker.observe(header.boot_id, header.sequence);
                if let Packet::Stream(_) = frame.packet {
                    let (first, _) = seen.stream_us.unwrap_or((header.device_us, 0));
                    seen.stream_us = Some((first, header.device_us));
                    seen.stream_packets += 1;
                } else {
                    seen.reports.push(frame.packet);
                }
            }
        }
        drop(seen);
        self.news.signal(());
    }

    /// Forgets everything; what comes next is the first.
    pub(crate) fn forget(&self) {
        self.seen.take();
    }

    /// As [`Seen::counted`].
    pub(crate) fn counted(&self, wanted: u64) -> Option<String> {
        self.seen.borrow().counted(wanted)
    }

    /// Takes what came beside the stream.
    pub(crate) fn reports(&self) -> Vec<Packet> {
        std::mem::take(&mut self.seen.borrow_mut().reports)
    }

    /// Waits until `found` finds something. One may wait at a time.
    pub(crate) async fn until<T>(&self, found: impl Fn(&Seen) -> Option<T>) -> T {
        loop {
            if let Some(found) = found(&self.seen.borrow()) {
                return found;
            }
            self.news.wait().await;
        }
    }
}

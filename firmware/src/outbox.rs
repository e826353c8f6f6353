//! What waits for the radio: the newest frame of each pace, never a queue.

use embassy_futures::select::{Either, select};
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, signal::Signal};
use heapless::Vec;
use tonus_shared::wire::{Kind, STREAM_FRAME_BYTES};

/// One encoded packet. Its kinds (stream, configuration, status, orientation) all fit the stream's size.
pub type EncodedFrame = Vec<u8, STREAM_FRAME_BYTES>;

type Place = Signal<CriticalSectionRawMutex, EncodedFrame>;

/// From the signal path to the radio. A frame that still waits when its successor comes is replaced: over
/// a stalled link the newest measurement goes out first when it recovers, not the oldest.
///
/// Configuration and status, half a second apart, have a place of their own: 100 stream frames a second
/// would otherwise push them out.
pub struct Outbox {
    stream: Place,
    slow: Place,
}

impl Outbox {
    /// An empty one.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            stream: Signal::new(),
            slow: Signal::new(),
        }
    }

    /// Leaves a frame, in place of the one of its pace that waited.
    pub fn put(&self, kind: Kind, frame: EncodedFrame) {
        match kind {
            Kind::Stream => self.stream.signal(frame),
            _ => self.slow.signal(frame),
        }
    }

    /// Waits for a frame; of two that wait, configuration or status goes first.
    pub async fn take(&self) -> EncodedFrame {
        match select(self.slow.wait(), self.stream.wait()).await {
            Either::First(frame) | Either::Second(frame) => frame,
        }
    }

    /// Forgets what waits, so that a new link does not begin with an old measurement.
    pub fn clear(&self) {
        self.stream.reset();
        self.slow.reset();
    }
}

impl Default for Outbox {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use embassy_futures::{block_on, poll_once};

    use super::*;

    fn frame(byte: u8) -> EncodedFrame {
        EncodedFrame::from_slice(&[byte]).unwrap()
    }

    #[test]
    fn a_waiting_stream_frame_is_replaced_by_the_newest() {
        let outbox = Outbox::new();
        outbox.put(Kind::Stream, frame(1));
        outbox.put(Kind::Stream, frame(2));
        assert_eq!(block_on(outbox.take()), frame(2));
        assert!(poll_once(outbox.take()).is_pending());
    }

    #[test]
    fn stream_frames_do_not_push_out_the_configuration() {
        let outbox = Outbox::new();
        outbox.put(Kind::Configuration, frame(7));
        for byte in 0..100 {
            outbox.put(Kind::Stream, frame(byte));
        }
        assert_eq!(block_on(outbox.take()), frame(7));
        assert_eq!(block_on(outbox.take()), frame(99));
    }

    #[test]
    fn a_cleared_outbox_waits() {
        let outbox = Outbox::new();
        outbox.put(Kind::Stream, frame(1));
        outbox.put(Kind::Status, frame(2));
        outbox.clear();
        assert!(poll_once(outbox.take()).is_pending());
    }
}

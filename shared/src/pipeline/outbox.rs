//! Packets that wait to be taken. One place for each kind: the latest wins.

use heapless::Vec;

use crate::sample::Scan;
use crate::wire::{MAX_RAW_COUNTS, Orientation, Packet, RawSemg, Stream};

/// A packet and the device time of the newest measurement in it.
#[derive(Clone, Debug)]
pub(super) struct Timed<P> {
    pub(super) value: P,
    pub(super) device_us: u64,
}

/// What waits.
#[derive(Clone, Debug)]
pub(super) struct Outbox {
    pub(super) configuration: bool,
    pub(super) status: bool,
    /// Packets replaced before they were taken.
    pub(super) dropped: u32,
    raw_wanted: bool,
    stream: Option<Timed<Stream>>,
    orientation: Option<Timed<Orientation>>,
    raw_filling: Timed<RawSemg>,
    raw_full: Option<Timed<RawSemg>>,
}

impl Outbox {
    pub(super) fn new(raw_wanted: bool) -> Self {
        Self {
            configuration: false,
            status: false,
            dropped: 0,
            raw_wanted,
            stream: None,
            orientation: None,
            raw_filling: Timed {
                value: RawSemg {
                    first_index: 0,
                    channels: 0,
                    counts: Vec::new(),
                },
                device_us: 0,
            },
            raw_full: None,
        }
    }

    pub(super) fn stream(&mut self, stream: Timed<Stream>) {
        replace(&mut self.stream, stream, &mut self.dropped);
    }

    pub(super) fn orientation(&mut self, orientation: Timed<Orientation>) {
        replace(&mut self.orientation, orientation, &mut self.dropped);
    }

    /// Raw packets, or none; one that was filling is forgotten with the wish for it.
    pub(super) fn set_raw(&mut self, wanted: bool) {
        self.raw_wanted = wanted;
        if !wanted {
            self.raw_filling.value.counts.clear();
            self.raw_full = None;
        }
    }

    /// Adds a scan to the raw packet that fills up; a gap or the packet's end closes it.
    pub(super) fn raw<const C: usize>(&mut self, scan: &Scan<C>, after_gap: bool) {
        if !self.raw_wanted {
            return;
        }
        if after_gap {
            self.close_raw();
        }
        let filling = &mut self.raw_filling;
        if filling.value.counts.is_empty() {
            filling.value.first_index = scan.index;
            filling.value.channels = C as u8;
        }
        filling.device_us = scan.acquired_us;
        // A scan always fits: a packet without room for another was closed after the last.
        if filling
            .value
            .counts
            .extend_from_slice(&scan.counts)
            .is_err()
        {
            self.dropped = self.dropped.wrapping_add(1);
        }
        if self.raw_filling.value.counts.len() + C > MAX_RAW_COUNTS {
            self.close_raw();
        }
    }

    fn close_raw(&mut self) {
        if self.raw_filling.value.counts.is_empty() {
            return;
        }
        let full = self.raw_filling.clone();
        replace(&mut self.raw_full, full, &mut self.dropped);
        self.raw_filling.value.counts.clear();
    }

    /// The next packet with measurements, and its device time.
    pub(super) fn take(&mut self) -> Option<(Packet, u64)> {
        if let Some(Timed { value, device_us }) = self.stream.take() {
            return Some((Packet::Stream(value), device_us));
        }
        if let Some(Timed { value, device_us }) = self.orientation.take() {
            return Some((Packet::Orientation(value), device_us));
        }
        let Timed { value, device_us } = self.raw_full.take()?;
        Some((Packet::RawSemg(value), device_us))
    }
}

fn replace<P>(place: &mut Option<P>, packet: P, dropped: &mut u32) {
    if place.replace(packet).is_some() {
        *dropped = dropped.wrapping_add(1);
    }
}

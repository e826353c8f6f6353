use core::convert::Infallible;
use std::{cell::RefCell, collections::VecDeque, vec, vec::Vec};

use embassy_futures::{block_on, select::select, yield_now};
use embedded_io_async::{ErrorKind, ErrorType};
use tonus_shared::wire::{
    Frame, HandPosition, Header, Kind, MAX_FRAME_BYTES, Packet, Ping, WireError, decode,
};

use super::*;
use crate::inbox::PLACES;
use crate::outbox::EncodedFrame;

/// Gives these pieces one read after another, then says that the line was closed.
struct Pieces(VecDeque<Result<Vec<u8>, ErrorKind>>);

impl ErrorType for Pieces {
    type Error = ErrorKind;
}

impl Read for Pieces {
    async fn read(&mut self, bytes: &mut [u8]) -> Result<usize, ErrorKind> {
        let Some(piece) = self.0.pop_front() else {
            return Ok(0);
        };
        let mut piece = piece?;
        let taken = piece.len().min(bytes.len());
        bytes[..taken].copy_from_slice(&piece[..taken]);
        if taken < piece.len() {
            self.0.push_front(Ok(piece.split_off(taken)));
        }
        Ok(taken)
    }
}

/// Nothing ever comes.
struct Silence;

impl ErrorType for Silence {
    type Error = Infallible;
}

impl Read for Silence {
    async fn read(&mut self, _: &mut [u8]) -> Result<usize, Infallible> {
        core::future::pending().await
    }
}

/// Keeps what is written; `meanwhile` happens during each write.
struct Sink<'a, F: FnMut()> {
    written: &'a RefCell<Vec<u8>>,
    meanwhile: F,
    /// Writes until it fails.
    left: usize,
}

impl<F: FnMut()> ErrorType for Sink<'_, F> {
    type Error = ErrorKind;
}

impl<F: FnMut()> Write for Sink<'_, F> {
    async fn write(&mut self, bytes: &[u8]) -> Result<usize, ErrorKind> {
        let left = self.left.checked_sub(1);
        self.left = left.ok_or(ErrorKind::BrokenPipe)?;
        (self.meanwhile)();
        self.written.borrow_mut().extend_from_slice(bytes);
        Ok(bytes.len())
    }

    async fn flush(&mut self) -> Result<(), ErrorKind> {
        Ok(())
    }
}

fn sink(written: &RefCell<Vec<u8>>) -> Sink<'_, impl FnMut() + use<>> {
    Sink {
        written,
        meanwhile: || {},
        left: usize::MAX,
    }
}

fn hand(sequence: u32) -> Frame {
    Frame {
        header: Header {
            boot_id: 0xB007,
            sequence,
            device_us: 1000 * u64::from(sequence),
        },
        packet: Packet::HandPosition(HandPosition {
            position_m: Some([0.25, 0.0, -0.5]),
        }),
    }
}

fn encoded(frame: &Frame) -> EncodedFrame {
    let mut bytes = [0; MAX_FRAME_BYTES];
    let length = frame.encode(&mut bytes).unwrap();
    EncodedFrame::from_slice(&bytes[..length]).unwrap()
}

fn block(frame: &Frame) -> Vec<u8> {
    let mut bytes = [0; MAX_BLOCK_BYTES];
    let length = enclose(&encoded(frame), &mut bytes).unwrap();
    bytes[..length].to_vec()
}

/// The frames in what was written.
fn frames(written: &[u8]) -> Vec<Frame> {
    let mut unframer: Unframer = Unframer::new();
    written
        .iter()
        .filter_map(|byte| {
            unframer
                .push(*byte)
                .unwrap()
                .map(|bytes| decode(bytes).unwrap())
        })
        .collect()
}

/// Sequence numbers that reached the inbox, what was dropped, how it ended.
fn received(
    pieces: Vec<Result<Vec<u8>, ErrorKind>>,
) -> (
    Vec<u32>,
    Vec<Dropped>,
    DropCounts,
    LineError<ErrorKind, ErrorKind>,
) {
    let (outbox, inbox, written) = (Outbox::new(), Inbox::new(), RefCell::default());
    let (mut dropped, mut counts) = (Vec::new(), DropCounts::default());
    let report = |why, so_far| {
        dropped.push(why);
        counts = so_far;
    };
    let reader = Pieces(pieces.into());
    let ended = block_on(run(reader, sink(&written), &outbox, &inbox, report)).unwrap_err();
    let mut numbers = Vec::new();
    while let Some(frame) = inbox.try_take() {
        numbers.push(frame.header.sequence);
    }
    (numbers, dropped, counts, ended)
}

#[test]
fn a_block_ends_what_stood_on_the_line_and_carries_the_frame() {
    let (outbox, inbox, written) = (Outbox::new(), Inbox::new(), RefCell::default());
    let serving = run(Silence, sink(&written), &outbox, &inbox, |_, _| {});
    let producing = async {
        yield_now().await;
        outbox.put(Kind::Status, encoded(&hand(1))).unwrap();
        yield_now().await;
        outbox.put(Kind::Stream, encoded(&hand(2))).unwrap();
        yield_now().await;
        yield_now().await;
    };
    block_on(select(serving, producing));
    let written = written.into_inner();
    assert_eq!(written[0], DELIMITER);
    assert_eq!(
        written[1..].to_vec(),
        [block(&hand(1)), block(&hand(2))].concat()
    );
}

#[test]
fn over_a_slow_line_the_newest_measurement_goes_out_not_the_oldest() {
    let (outbox, inbox, written) = (Outbox::new(), Inbox::new(), RefCell::default());
    let mut sequence = 0;
    let slow = Sink {
        written: &written,
        meanwhile: || {
            for _ in 0..10 {
                sequence += 1;
                outbox.put(Kind::Stream, encoded(&hand(sequence))).unwrap();
            }
        },
        left: 4,
    };
    let ended = block_on(run(Silence, slow, &outbox, &inbox, |_, _| {}));
    assert_eq!(ended, Err(LineError::Write(ErrorKind::BrokenPipe)));
    let numbers: Vec<u32> = frames(&written.borrow())
        .iter()
        .map(|frame| frame.header.sequence)
        .collect();
    assert_eq!(numbers, [10, 20, 30]);
}

#[test]
fn what_waited_before_the_line_opened_is_not_sent() {
    let (outbox, inbox, written) = (Outbox::new(), Inbox::new(), RefCell::default());
    outbox.put(Kind::Stream, encoded(&hand(1))).unwrap();
    let serving = run(Silence, sink(&written), &outbox, &inbox, |_, _| {});
    block_on(select(serving, async {
        yield_now().await;
        yield_now().await;
    }));
    assert_eq!(written.into_inner(), [DELIMITER]);
}

#[test]
fn frames_reach_the_inbox_however_they_are_cut_into_reads() {
    let line = [block(&hand(1)), block(&hand(2)), block(&hand(3))].concat();
    for piece in [1, 2, 7, 64, 1000] {
        let pieces = line.chunks(piece).map(|bytes| Ok(bytes.to_vec())).collect();
        let (numbers, dropped, _, ended) = received(pieces);
        assert_eq!(numbers, [1, 2, 3]);
        assert_eq!(dropped, []);
        assert_eq!(ended, LineError::Closed);
    }
}

#[test]
fn garbage_is_counted_and_the_next_block_is_taken() {
    let mut changed = block(&hand(2));
    // The second byte of the boot id, which is no length.
    changed[4] ^= 0x40;
    let too_long = vec![0xFF; 3 * MAX_BLOCK_BYTES];
    let line = [
        &b"boot: ok\r\n\0"[..],
        &block(&hand(1)),
        &changed,
        &too_long,
        &[DELIMITER],
        &block(&hand(3)),
    ]
    .concat();
    let (numbers, dropped, counts, _) = received(vec![Ok(line)]);
    assert_eq!(numbers, [1, 3]);
    assert!(matches!(
        dropped[0],
        Dropped::Block(BlockError::CutShort { .. })
    ));
    assert!(matches!(
        dropped[1],
        Dropped::Refused(Refusal::Malformed(WireError::BadCrc { .. }))
    ));
    assert_eq!(
        dropped[2],
        Dropped::Block(BlockError::TooLong {
            limit: MAX_FRAME_BYTES
        })
    );
    let expected = DropCounts {
        blocks: 2,
        refused: 1,
        ..DropCounts::default()
    };
    assert_eq!((dropped.len(), counts), (3, expected));
}

#[test]
fn a_full_inbox_keeps_the_oldest_and_counts_the_rest() {
    let line = (0..PLACES as u32 + 3)
        .flat_map(|number| block(&hand(number)))
        .collect();
    let (numbers, dropped, counts, _) = received(vec![Ok(line)]);
    assert!(numbers.into_iter().eq(0..PLACES as u32));
    assert_eq!(dropped, [Dropped::Refused(Refusal::Full); 3]);
    assert_eq!(counts.refused, 3);
}

#[test]
fn after_an_overrun_the_rest_of_that_block_is_skipped() {
    // The first half of one block and the second half of another could, without a skip, make a whole one.
    let (first, second) = (block(&hand(1)), block(&hand(1)));
    let (numbers, dropped, counts, _) = received(vec![
        Ok(first[..10].to_vec()),
        Err(ErrorKind::OutOfMemory),
        Ok([&second[10..], &block(&hand(2))].concat()),
    ]);
    assert_eq!(numbers, [2]);
    assert_eq!(dropped, [Dropped::BytesLost]);
    assert_eq!(counts.bytes_lost, 1);
}

#[test]
fn a_line_that_always_fails_is_given_up() {
    let (_, dropped, _, ended) = received(vec![Err(ErrorKind::Other); 100]);
    assert_eq!(ended, LineError::Read(ErrorKind::Other));
    assert_eq!(dropped.len(), 15);
    let (outbox, inbox, written) = (Outbox::new(), Inbox::new(), RefCell::default());
    let broken = Sink {
        left: 0,
        ..sink(&written)
    };
    let ended = block_on(run(Silence, broken, &outbox, &inbox, |_, _| {}));
    assert_eq!(ended, Err(LineError::Write(ErrorKind::BrokenPipe)));
}

#[test]
fn a_ping_survives_its_zeros() {
    let frame = Frame {
        packet: Packet::Ping(Ping::Request {
            id: 0,
            requested_us: 0,
        }),
        ..hand(0)
    };
    let (numbers, dropped, ..) = received(vec![Ok(block(&frame))]);
    assert_eq!((numbers.len(), dropped.len()), (1, 0));
}

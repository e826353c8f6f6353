use sha2::{Digest, Sha256};

use super::flash::Step;
use super::*;

/// Bytes of a model upload's piece: a frame of 244 bytes less header, offset and checksum, on purpose no
/// multiple of a word.
const PIECE: usize = 219;
/// A model of three skills at rank 16, and a little so that it ends within a word.
pub(super) const LENGTH: usize = 76_656 + 3;

#[derive(Clone)]
pub(super) struct Sent {
    pub(super) bytes: std::vec::Vec<u8>,
    pub(super) sha256: [u8; 32],
}

pub(super) fn model(seed: u64, length: usize) -> Sent {
    let bytes = Random(seed).bytes(length);
    let sha256 = Sha256::digest(&bytes).into();
    Sent { bytes, sha256 }
}

pub(super) fn begin(storage: &mut Opened<'_>, model: &Sent) -> Result<Announced, Error> {
    block_on(storage.begin_upload(model.bytes.len() as u32, model.sha256))
}

/// Sends the rest of a model from `offset` on, and finishes.
pub(super) fn send_from(storage: &mut Opened<'_>, model: &Sent, offset: u32) -> Result<(), Error> {
    let mut offset = offset as usize;
    while offset < model.bytes.len() {
        let end = model.bytes.len().min(offset + PIECE);
        block_on(storage.receive_piece(offset as u32, &model.bytes[offset..end]))?;
        offset = end;
    }
    block_on(storage.finish_upload(|_| true))
}

pub(super) fn upload(storage: &mut Opened<'_>, model: &Sent) -> Result<(), Error> {
    match begin(storage, model)? {
        Announced::SendFrom(offset) => send_from(storage, model, offset),
        Announced::InUse => Ok(()),
    }
}

/// A flash to which these models were uploaded in this order.
pub(super) fn with(models: &[&Sent]) -> FakeFlash {
    let mut flash = FakeFlash::new();
    for model in models {
        upload(&mut open(&mut flash), model).unwrap();
    }
    flash
}

/// The model in use after a start, as it lies in the flash.
pub(super) fn in_use(flash: &mut FakeFlash) -> Option<std::vec::Vec<u8>> {
    let model = open(flash).model()?;
    let bytes = flash.slice(model.start, model.length).to_vec();
    assert_eq!(model.sha256, <[u8; 32]>::from(Sha256::digest(&bytes)));
    Some(bytes)
}

/// The bytes in the flash, worked out by hand: hash and checksum are those of Python's `hashlib` and `zlib`.
#[test]
fn a_slot_in_the_flash_is_what_the_documentation_says() {
    let sha256 = [
        0x3d, 0xdf, 0x9c, 0x2b, 0x74, 0x25, 0x68, 0xc2, 0x90, 0xa7, 0x82, 0xb9, 0xfc, 0x59, 0xe3,
        0xea, 0x25, 0x03, 0x11, 0x45, 0x92, 0x84, 0xe8, 0x9d, 0x20, 0x93, 0x8f, 0x04, 0x82, 0x57,
        0x54, 0x22,
    ];
    let bytes = b"tonus".to_vec();
    let mut flash = with(&[&Sent { bytes, sha256 }]);
    let start = DK.models[0].start;
    let mut description = b"TNM1\x01\0\0\0\x05\0\0\0".to_vec();
    description.extend(sha256);
    description.extend(0xd321_3861_u32.to_le_bytes());
    description.extend([0; 8]); // whole, and its only page written
    description.extend([0xff; 4]);
    assert_eq!(flash.slice(start, 60), description);
    assert_eq!(flash.slice(start + PAGE_BYTES, 8), b"tonus\xff\xff\xff");
    assert_eq!(in_use(&mut flash), Some(b"tonus".to_vec()));
}

#[test]
fn a_model_lies_contiguous_in_the_flash_and_survives_a_restart() {
    for length in [1, 2, 3, 4, 5, 4095, 4096, 4097, 77_824] {
        let model = model(1, length);
        assert_eq!(in_use(&mut with(&[&model])), Some(model.bytes));
    }
}

#[test]
fn uploads_take_turns_and_the_newest_is_in_use() {
    let models: std::vec::Vec<Sent> = (0..5).map(|seed| model(seed, 9000)).collect();
    let mut flash = FakeFlash::new();
    for (count, model) in models.iter().enumerate() {
        upload(&mut open(&mut flash), model).unwrap();
        assert_eq!(in_use(&mut flash).as_ref(), Some(&model.bytes));
        let slot = DK.models[count % 2].start + PAGE_BYTES;
        assert_eq!(open(&mut flash).model().unwrap().start, slot);
    }
    assert_eq!(
        begin(&mut open(&mut flash), &models[4]),
        Ok(Announced::InUse)
    );
}

/// The old model can be read while the new one comes in, to the very end.
#[test]
fn the_old_model_stays_in_use_until_the_new_one_is_whole() {
    let (old, new) = (model(1, 10_000), model(2, LENGTH));
    let mut flash = with(&[&old]);
    let mut storage = open(&mut flash);
    let before = storage.model();
    begin(&mut storage, &new).unwrap();
    for (number, piece) in new.bytes.chunks(PIECE).enumerate() {
        block_on(storage.receive_piece((number * PIECE) as u32, piece)).unwrap();
        assert_eq!(storage.model(), before);
    }
    assert_eq!(storage.upload().unwrap().received, LENGTH as u32);
    block_on(storage.finish_upload(|_| true)).unwrap();
    assert_eq!(storage.upload(), None);
    assert_eq!(storage.model().unwrap().sha256, new.sha256);
    let before = before.unwrap();
    assert_eq!(flash.slice(before.start, before.length), old.bytes);
}

/// Where power is cut: every erase, every word of the first page of the slot, the first and the last word of
/// every page of the model, and 20 places in between.
fn places(base: &FakeFlash, new: &Sent) -> std::vec::Vec<u64> {
    let mut flash = base.clone();
    flash.trace = Some(vec![]);
    upload(&mut open(&mut flash), new).unwrap();
    let trace = flash.trace.unwrap();
    let starts = DK.models.map(|slot| slot.start);
    let mut places: std::vec::Vec<u64> = (0_u64..)
        .zip(&trace)
        .filter(|(_, step)| match **step {
            Step::Erase(_) => true,
            Step::Write(at) => {
                let state = starts
                    .iter()
                    .any(|&start| (start..start + PAGE_BYTES).contains(&at));
                let within = at % PAGE_BYTES;
                state || within == 0 || within == PAGE_BYTES - 4
            }
        })
        .map(|(number, _)| number)
        .collect();
    let mut random = Random(20);
    places.extend((0..20).map(|_| random.below(trace.len() as u64)));
    places.push(trace.len() as u64 - 1);
    places
}

/// Cuts an upload of `new` and starts again: `old` is in use or `new`, and the upload goes on to its end.
fn cut_upload(base: &FakeFlash, old: Option<&Sent>, new: &Sent, cut: Cut) {
    let mut flash = base.clone();
    flash.cut(cut);
    let mut acknowledged = 0;
    let outcome = (|| {
        let mut storage = open(&mut flash);
        begin(&mut storage, new)?;
        for (number, piece) in new.bytes.chunks(PIECE).enumerate() {
            let offset = (number * PIECE) as u32;
            block_on(storage.receive_piece(offset, piece))?;
            acknowledged = offset + piece.len() as u32;
        }
        block_on(storage.finish_upload(|_| true))
    })();
    assert!(power_was_cut(outcome), "{cut:?} was not reached");
    flash.restart();

    let found = in_use(&mut flash);
    let switched = found.as_ref() == Some(&new.bytes);
    if !switched {
        assert_eq!(found.as_ref(), old.map(|old| &old.bytes), "{cut:?}");
    }
    let mut storage = open(&mut flash);
    match begin(&mut storage, new).unwrap() {
        Announced::InUse => assert!(switched),
        Announced::SendFrom(offset) => {
            assert!(!switched);
            assert!(offset.is_multiple_of(PAGE_BYTES) || offset == LENGTH as u32);
            // What was acknowledged in whole pages is never sent again.
            assert!(offset >= acknowledged / PAGE_BYTES * PAGE_BYTES, "{cut:?}");
            assert!(offset <= acknowledged + PIECE as u32);
            send_from(&mut storage, new, offset).unwrap();
        }
    }
    assert_eq!(in_use(&mut flash).as_ref(), Some(&new.bytes));
}

#[test]
fn an_upload_cut_anywhere_leaves_a_working_model_and_goes_on() {
    let (older, old, new) = (model(1, 70_000), model(2, LENGTH), model(3, LENGTH));
    let mut count = 0;
    for (base, old) in [(with(&[]), None), (with(&[&older, &old]), Some(&old))] {
        for (number, step) in places(&base, &new).into_iter().enumerate() {
            let seed = number as u64;
            for how in [How::Before, How::After, How::Within { seed }] {
                cut_upload(&base, old, &new, Cut { step, how });
                count += 1;
            }
        }
    }
    println!("model upload: cut {count} times");
    assert!(count > 400);
}

/// The words that decide: each cut in 40 ways.
#[test]
fn a_cut_within_the_last_word_switches_wholly_or_not_at_all() {
    let (old, new) = (model(2, LENGTH), model(3, LENGTH));
    let base = with(&[&old]);
    let mut flash = base.clone();
    upload(&mut open(&mut flash), &new).unwrap();
    let step = flash.steps - base.steps - 1;
    for seed in 0..40 {
        let how = How::Within { seed };
        cut_upload(&base, Some(&old), &new, Cut { step, how });
    }
}

/// Without a restart the flash may fail too: what is asked for next is what is missing.
#[test]
fn an_upload_goes_on_after_the_flash_was_busy() {
    let (old, new) = (model(1, 5000), model(2, 20_000));
    let mut random = Random(5);
    for _ in 0..300 {
        let mut flash = with(&[&old]);
        flash.cut(Cut {
            step: random.below(5100),
            how: How::Busy,
        });
        let mut storage = open(&mut flash);
        let busy = |error| {
            matches!(
                error,
                StorageError::Flash {
                    error: FakeError::Busy,
                    ..
                }
            )
        };
        let mut failures = 0;
        loop {
            match upload(&mut storage, &new) {
                Ok(()) => break,
                Err(error) => assert!(busy(error), "{error}"),
            }
            failures += 1;
        }
        assert!(failures <= 1);
        assert_eq!(in_use(&mut flash).as_ref(), Some(&new.bytes));
    }
}

#[test]
fn another_model_takes_the_place_of_one_half_received() {
    let (old, half, new) = (model(1, 300), model(2, 9000), model(3, 8000));
    let mut flash = with(&[&old]);
    let mut storage = open(&mut flash);
    begin(&mut storage, &half).unwrap();
    block_on(storage.receive_piece(0, &half.bytes[..8500])).unwrap();
    assert_eq!(begin(&mut storage, &half), Ok(Announced::SendFrom(8500)));
    assert_eq!(
        begin(&mut open(&mut flash), &half),
        Ok(Announced::SendFrom(8192)),
        "after a restart: whole pages"
    );
    upload(&mut open(&mut flash), &new).unwrap();
    assert_eq!(in_use(&mut flash), Some(new.bytes));
}

#[test]
fn an_abandoned_upload_leaves_the_model_in_use() {
    let (old, half) = (model(1, 300), model(2, 9000));
    let mut flash = with(&[&old]);
    let mut storage = open(&mut flash);
    begin(&mut storage, &half).unwrap();
    block_on(storage.receive_piece(0, &half.bytes[..5000])).unwrap();
    block_on(storage.abandon_upload()).unwrap();
    assert_eq!(
        block_on(storage.abandon_upload()),
        Err(StorageError::NotReceiving)
    );
    assert_eq!(open(&mut flash).upload(), None);
    assert_eq!(in_use(&mut flash), Some(old.bytes));
}

/// Nothing outside the model slots, the calibration and the bonds is ever touched.
#[test]
fn the_running_image_is_never_written() {
    let mut flash = with(&[&model(1, 77_824), &model(2, 77_824), &model(3, 77_824)]);
    let pages = &flash.erases[..(DK.models[0].start / PAGE_BYTES) as usize];
    assert!(pages.iter().all(|&erases| erases == 0));
    assert_eq!(block_on(open(&mut flash).bonds()), Ok(None));
    assert_eq!(block_on(open(&mut flash).calibration()), Ok(None));
    let image = flash.slice(0, DK.models[0].start);
    assert!(image.iter().all(|&byte| byte == 0xff));
}

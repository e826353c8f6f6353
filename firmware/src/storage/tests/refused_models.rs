use sha2::{Digest, Sha256};

use super::models::{LENGTH, begin, in_use, model, send_from, upload, with};
use super::*;

#[test]
fn rot_in_the_model_in_use_brings_back_the_other_one() {
    let (old, new) = (model(1, LENGTH), model(2, LENGTH));
    let base = with(&[&old, &new]);
    let slot = DK.models[1];
    let mut random = Random(11);
    for _ in 0..200 {
        let mut flash = base.clone();
        let address = slot.start + PAGE_BYTES + random.below(LENGTH as u64) as u32;
        flash.flip(address, random.below(8) as u32);
        assert_eq!(in_use(&mut flash).as_ref(), Some(&old.bytes));
        let storage = open(&mut flash);
        let expected = u32::from_be_bytes(new.sha256[..4].try_into().unwrap());
        let Some(&StorageError::Damaged {
            partition: Name::Model,
            offset,
            expected: announced,
            got,
        }) = storage.model_damage()
        else {
            panic!("{:?}", storage.model_damage());
        };
        assert_eq!((offset, announced), (slot.start + PAGE_BYTES, expected));
        assert_ne!(got, expected);
        upload(&mut open(&mut flash), &new).unwrap();
        assert_eq!(in_use(&mut flash).as_ref(), Some(&new.bytes));
        assert_eq!(open(&mut flash).model_damage(), None);
    }
}

/// Every bit of what describes the model: found, or without effect.
#[test]
fn rot_in_the_description_is_found_or_without_effect() {
    let (old, new) = (model(1, 300), model(2, 5000));
    let base = with(&[&old, &new]);
    for offset in 0..180 {
        for bit in 0..8 {
            let mut flash = base.clone();
            flash.flip(DK.models[1].start + offset, bit);
            let found = in_use(&mut flash);
            let storage = open(&mut flash);
            if offset < 48 {
                assert_eq!(found.as_ref(), Some(&old.bytes), "byte {offset} bit {bit}");
                assert!(matches!(
                    storage.model_damage(),
                    Some(StorageError::Damaged { .. })
                ));
            } else {
                assert_eq!(found.as_ref(), Some(&new.bytes), "byte {offset} bit {bit}");
                assert_eq!(storage.model_damage(), None);
            }
        }
    }
}

#[test]
fn with_both_models_rotten_none_is_in_use_and_the_next_upload_works() {
    let (old, new) = (model(1, 300), model(2, 5000));
    let mut flash = with(&[&old, &new]);
    for slot in DK.models {
        flash.flip(slot.start + PAGE_BYTES + 7, 3);
    }
    assert_eq!(in_use(&mut flash), None);
    upload(&mut open(&mut flash), &new).unwrap();
    assert_eq!(in_use(&mut flash), Some(new.bytes));
}

#[test]
fn bytes_that_are_not_those_announced_are_refused_and_forgotten() {
    let (old, new) = (model(1, 300), model(2, 5000));
    let mut flash = with(&[&old]);
    let mut storage = open(&mut flash);
    let mut wrong = new.clone();
    wrong.bytes[4999] ^= 0x10;
    let got: [u8; 32] = Sha256::digest(&wrong.bytes).into();
    let head = |hash: [u8; 32]| u32::from_be_bytes(hash[..4].try_into().unwrap());
    assert_eq!(
        upload(&mut storage, &wrong),
        Err(StorageError::HashMismatch {
            expected: head(new.sha256),
            got: head(got),
        })
    );
    assert_eq!(storage.upload(), None);
    assert_eq!(storage.model().unwrap().sha256, old.sha256);
    assert_eq!(begin(&mut storage, &new), Ok(Announced::SendFrom(0)));
}

#[test]
fn what_does_not_belong_to_an_upload_changes_nothing() {
    let model = model(1, 1000);
    let mut flash = FakeFlash::new();
    let mut storage = open(&mut flash);
    let piece = |storage: &mut Opened<'_>, offset, length| {
        block_on(storage.receive_piece(offset, &model.bytes[..length]))
    };
    assert_eq!(piece(&mut storage, 0, 10), Err(StorageError::NotReceiving));
    assert_eq!(
        block_on(storage.finish_upload(|_| true)),
        Err(StorageError::NotReceiving)
    );
    for got in [0, 77_825, u32::MAX] {
        let refused = block_on(storage.begin_upload(got, model.sha256));
        let (partition, expected) = (Name::Model, 77_824);
        assert_eq!(
            refused,
            Err(StorageError::WrongLength {
                partition,
                expected,
                got
            })
        );
    }
    begin(&mut storage, &model).unwrap();
    piece(&mut storage, 0, 10).unwrap();
    for got in [0, 9, 11, u32::MAX] {
        let expected = 10;
        assert_eq!(
            piece(&mut storage, got, 10),
            Err(StorageError::WrongOffset { expected, got })
        );
    }
    assert_eq!(
        piece(&mut storage, 10, 991),
        Err(StorageError::TooMuch {
            expected: 1000,
            got: 1001
        })
    );
    assert_eq!(
        block_on(storage.finish_upload(|_| true)),
        Err(StorageError::Incomplete {
            expected: 1000,
            got: 10
        })
    );
    send_from(&mut storage, &model, 10).unwrap();
    assert_eq!(in_use(&mut flash), Some(model.bytes));
}

#[test]
fn a_whole_model_that_does_not_fit_is_forgotten_and_the_old_one_stays() {
    let (old, new) = (model(1, 5_000), model(2, 6_000));
    let mut flash = with(&[&old]);
    let mut storage = open(&mut flash);
    begin(&mut storage, &new).unwrap();
    block_on(storage.receive_piece(0, &new.bytes)).unwrap();
    let mut asked = None;
    let refused = block_on(storage.finish_upload(|model| {
        asked = Some((model.length, model.sha256));
        false
    }));
    assert_eq!(refused, Err(StorageError::NotFitting));
    assert_eq!(asked, Some((6_000, new.sha256)));
    assert_eq!(storage.upload(), None);
    assert_eq!(in_use(&mut flash), Some(old.bytes));
}

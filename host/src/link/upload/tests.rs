use tonus_shared::wire::{ActiveModel, Reception};

use super::*;

/// Built by another program: tests/golden/model_image.py.
const GOLDEN: &str = include_str!("../../../../tests/golden/model_image.txt");

fn image() -> Vec<u8> {
    let digits = GOLDEN.trim().as_bytes().chunks_exact(2);
    let byte = |pair: &[u8]| u8::from_str_radix(std::str::from_utf8(pair).unwrap(), 16);
    digits.map(|pair| byte(pair).unwrap()).collect()
}

fn upload() -> Upload {
    let mut upload = Upload::new(image()).unwrap();
    upload.up(None);
    upload
}

fn holding(active: Option<[u8; 8]>, receiving: Option<Reception>) -> Packet {
    Packet::ModelState(ModelState {
        active: active.map(|hash| ActiveModel {
            hash,
            skills: 2,
            dofs: 6,
            functions: 4,
            rank: 3,
        }),
        receiving,
        capacity_bytes: 163_840,
    })
}

fn reply(sequence: u32, outcome: Result<(), Refusal>, detail: u32) -> Packet {
    Packet::Reply(Reply {
        answered: Kind::ModelUpload,
        sequence,
        outcome,
        detail,
    })
}

fn hash(upload: &Upload) -> [u8; 8] {
    *upload.sha256().first_chunk().unwrap()
}

/// The step asked for, as the next frame.
fn step(upload: &mut Upload, sequence: u32, now_us: u64) -> ModelUpload {
    match upload.next(sequence, now_us).unwrap() {
        Some(Packet::ModelUpload(step)) => step,
        other => panic!("{other:?}"),
    }
}

fn asks(upload: &mut Upload, sequence: u32, now_us: u64) {
    let asked = upload.next(sequence, now_us).unwrap();
    assert_eq!(asked, Some(Packet::Control(Control::SendModelState)));
}

/// Up to the first piece.
fn begun(upload: &mut Upload) {
    asks(upload, 0, 0);
    upload.take(&holding(None, None), 10).unwrap();
    let begin = step(upload, 1, 20);
    let expected = ModelUpload::Begin {
        total_bytes: image().len() as u32,
        sha256: upload.sha256(),
    };
    assert_eq!(begin, expected);
    upload.take(&reply(1, Ok(()), 0), 30).unwrap();
}

#[test]
fn every_byte_goes_once_and_in_order_and_one_request_at_a_time() {
    let mut upload = upload();
    begun(&mut upload);
    let (all, mut sent, mut sequence) = (image(), Vec::new(), 2);
    while sent.len() < all.len() {
        let ModelUpload::Piece {
            offset_bytes,
            bytes,
        } = step(&mut upload, sequence, 100)
        else {
            panic!("a piece");
        };
        assert_eq!(offset_bytes as usize, sent.len());
        sent.extend_from_slice(&bytes);
        assert_eq!(upload.next(sequence + 1, 101), Ok(None), "it waits");
        // Somebody else's answer is not this one's.
        upload.take(&reply(sequence + 7, Ok(()), 0), 102).unwrap();
        assert_eq!(upload.next(sequence + 1, 103), Ok(None));
        let answer = reply(sequence, Ok(()), sent.len() as u32);
        upload.take(&answer, 104).unwrap();
        sequence += 1;
    }
    assert_eq!(sent, all);
    assert_eq!(step(&mut upload, sequence, 200), ModelUpload::Finish);
    upload.take(&reply(sequence, Ok(()), 0), 300).unwrap();
    assert!(!upload.done(), "nothing shows yet that it is used");
    asks(&mut upload, sequence + 1, 400);
    let ours = hash(&upload);
    upload.take(&holding(Some(ours), None), 500).unwrap();
    assert!(upload.done() && !upload.was_there());
    assert_eq!(upload.next(sequence + 2, 600), Ok(None));
}

#[test]
fn it_goes_on_where_the_wearable_stopped_and_a_model_that_is_there_is_not_sent() {
    let mut upload = upload();
    asks(&mut upload, 0, 0);
    let receiving = Reception {
        hash: hash(&upload),
        received_bytes: 300,
        total_bytes: image().len() as u32,
    };
    upload.take(&holding(None, Some(receiving)), 1).unwrap();
    assert!(matches!(step(&mut upload, 1, 2), ModelUpload::Begin { .. }));
    upload.take(&reply(1, Ok(()), 0), 3).unwrap();
    let ModelUpload::Piece { offset_bytes, .. } = step(&mut upload, 2, 4) else {
        panic!("a piece");
    };
    assert_eq!(offset_bytes, 300);
    assert_eq!(upload.progress(), (300, image().len()));
    // The link breaks: whoever is there then is asked again.
    upload.up(Some(100));
    asks(&mut upload, 3, 5);
    let ours = hash(&upload);
    upload.take(&holding(Some(ours), None), 6).unwrap();
    assert!(upload.done());
}

#[test]
fn pieces_fit_the_links_packets() {
    let mut upload = upload();
    upload.up(Some(100));
    begun(&mut upload);
    let ModelUpload::Piece { bytes, .. } = step(&mut upload, 2, 100) else {
        panic!("a piece");
    };
    // The frame around it has 27 bytes, an attribute write leaves 97 of 100, and flash is written in words.
    assert_eq!(bytes.len(), 68);
}

#[test]
fn silence_restarts_and_busy_waits() {
    let mut upload = upload();
    begun(&mut upload);
    let _lost = step(&mut upload, 2, 100);
    assert_eq!(upload.next(3, 100 + ANSWER_WITHIN_US - 1), Ok(None));
    asks(&mut upload, 3, 100 + ANSWER_WITHIN_US);
    let mut now_us = 100 + ANSWER_WITHIN_US;
    for sequence in 4..4 + SETBACKS - 2 {
        now_us += ANSWER_WITHIN_US;
        asks(&mut upload, sequence, now_us);
    }
    now_us += ANSWER_WITHIN_US;
    assert_eq!(upload.next(9, now_us), Err(UploadError::Silent));

    let mut upload = self::upload();
    begun(&mut upload);
    let first = step(&mut upload, 2, 100);
    upload.take(&reply(2, Err(Refusal::Busy), 0), 200).unwrap();
    assert_eq!(upload.next(3, 200 + BUSY_US - 1), Ok(None));
    assert_eq!(step(&mut upload, 3, 200 + BUSY_US), first);
}

#[test]
fn what_the_wearable_cannot_take_ends_it_with_what_to_do() {
    let ends = |refusal, detail| {
        let mut upload = upload();
        begun(&mut upload);
        let _piece = step(&mut upload, 2, 100);
        upload.take(&reply(2, Err(refusal), detail), 200)
    };
    let bytes = image().len();
    for (refusal, error) in [
        (Refusal::HashMismatch, UploadError::Changed),
        (Refusal::StorageFailed, UploadError::Flash),
        (Refusal::NotFitting, UploadError::NotFitting),
        (
            Refusal::TooLarge,
            UploadError::TooLarge {
                bytes,
                capacity_bytes: 77,
            },
        ),
        (
            Refusal::OutOfRange,
            UploadError::Refused(Refusal::OutOfRange),
        ),
    ] {
        assert_eq!(ends(refusal, 77), Err(error));
    }
    // One that takes pieces and has none of them is given up, as one is that restarts again and again.
    let mut idle = upload();
    let mut outcome = Ok(());
    for round in 0..SETBACKS {
        let sequence = 10 * round;
        asks(&mut idle, sequence, 0);
        idle.take(&holding(None, None), 1).unwrap();
        let _begin = step(&mut idle, sequence + 1, 2);
        idle.take(&reply(sequence + 1, Ok(()), 0), 3).unwrap();
        let _piece = step(&mut idle, sequence + 2, 4);
        outcome = idle.take(&reply(sequence + 2, Ok(()), 0), 5);
    }
    assert_eq!(outcome, Err(UploadError::Changed));
    let mut upload = upload();
    let mut last = Ok(());
    for round in 0..SETBACKS {
        let sequence = 10 * round;
        asks(&mut upload, sequence, 0);
        upload.take(&holding(None, None), 1).unwrap();
        let _begin = step(&mut upload, sequence + 1, 2);
        upload.take(&reply(sequence + 1, Ok(()), 0), 3).unwrap();
        let _piece = step(&mut upload, sequence + 2, 4);
        last = upload.take(&reply(sequence + 2, Err(Refusal::WrongState), 0), 5);
    }
    assert_eq!(last, Err(UploadError::Refused(Refusal::WrongState)));

    let small = |capacity_bytes| {
        let mut upload = Upload::new(image()).unwrap();
        upload.up(None);
        asks(&mut upload, 0, 0);
        let state = ModelState {
            active: None,
            receiving: None,
            capacity_bytes,
        };
        upload.take(&Packet::ModelState(state), 1)
    };
    assert_eq!(small(0), Err(UploadError::KeepsNone));
    assert_eq!(
        small(100),
        Err(UploadError::TooLarge {
            bytes,
            capacity_bytes: 100
        })
    );
}

#[test]
fn what_is_no_image_is_refused_before_anything_is_sent() {
    let endless = Upload::read(std::io::repeat(0)).unwrap_err();
    assert!(endless.to_string().contains("tonus export"), "{endless}");
    let mut changed = image();
    changed[100] ^= 1;
    for bytes in [Vec::new(), b"label,trial".to_vec(), changed] {
        let error = Upload::new(bytes).unwrap_err();
        assert!(error.to_string().contains("tonus export"), "{error}");
    }
}

use std::{boxed::Box, vec::Vec};

use embassy_futures::block_on;
use sha2::{Digest, Sha256};
use tonus_shared::{
    pipeline::illustrative,
    recognition::Storage as Hypotheses,
    wire::{Kind, Reply},
};

use super::*;
use crate::{
    acquisition::{MUSCLES, RATE_HZ},
    storage::{
        partitions::DK,
        tests::flash::{Cut, FakeFlash, How},
    },
};

type Fake<'f> = Flash<&'f mut FakeFlash>;

/// A small model that this build can run, made by a script that knows only the page on the format.
fn golden() -> Vec<u8> {
    let hex = include_str!("../../../tests/golden/model_image.txt").trim();
    let pairs = (0..hex.len()).step_by(2);
    pairs
        .map(|at| u8::from_str_radix(&hex[at..at + 2], 16).unwrap())
        .collect()
}

fn open(flash: &mut FakeFlash) -> Fake<'_> {
    Flash::new(block_on(Storage::open(flash, DK)).unwrap())
}

fn wanted(revision: u32) -> Calibration {
    Calibration {
        revision,
        ..illustrative(MUSCLES, RATE_HZ)
    }
}

fn job(sequence: u32, work: Work) -> Job {
    let kind = match work {
        Work::Calibrate(_) => Kind::Calibration,
        Work::Upload(_) => Kind::ModelUpload,
        Work::ModelState => Kind::Control,
    };
    let asked = Asked { kind, sequence };
    Job { asked, work }
}

/// What the keeper has to say to these jobs, while recognition uses whatever model there is. `sent` are the models that
/// may lie in the flash.
fn told(flash: &mut FakeFlash, sent: &[&'static [u8]], work: &[Work]) -> Vec<Word> {
    let shared = open(flash);
    let (recognition, words) = (recognition::Inbox::new(), Words::new());
    let mapped = |model: Model| {
        let whole = |bytes: &&&[u8]| <[u8; 32]>::from(Sha256::digest(bytes)) == model.sha256;
        *sent.iter().find(whole).unwrap()
    };
    let keeper = Keeper {
        flash: &shared,
        mapped,
        recognition: &recognition,
        words: &words,
    };
    let mut said = Vec::new();
    let working = async {
        for (sequence, work) in (0..).zip(work) {
            keeper.work(job(sequence, work.clone())).await;
            while let Ok(word) = words.try_receive() {
                said.push(word);
            }
        }
    };
    let mut hypotheses = Box::new(Hypotheses::new());
    let model = async || shared.lock().await.model().map(mapped);
    let serving = recognition::serve(
        model,
        &mut hypotheses,
        &recognition,
        || 0,
        |_, _| {},
        |_| {},
    );
    block_on(select(working, serving));
    said
}

fn answer(word: &Word) -> (Result<(), Refusal>, u32) {
    match word {
        Word::Say(Packet::Reply(Reply {
            outcome, detail, ..
        })) => (*outcome, *detail),
        other => panic!("{other:?} is no reply"),
    }
}

fn begin(model: &[u8]) -> Work {
    Work::Upload(ModelUpload::Begin {
        total_bytes: model.len() as u32,
        sha256: Sha256::digest(model).into(),
    })
}

fn piece(model: &[u8], from: usize, to: usize) -> Work {
    Work::Upload(ModelUpload::Piece {
        offset_bytes: from as u32,
        bytes: heapless::Vec::from_slice(&model[from..to]).unwrap(),
    })
}

/// All the steps of sending a model.
fn upload(model: &[u8]) -> Vec<Work> {
    let mut steps = Vec::from([begin(model)]);
    for from in (0..model.len()).step_by(200) {
        steps.push(piece(model, from, model.len().min(from + 200)));
    }
    steps.push(Work::Upload(ModelUpload::Finish));
    steps
}

fn leaked(bytes: Vec<u8>) -> &'static [u8] {
    Box::leak(bytes.into_boxed_slice())
}

fn state(flash: &mut FakeFlash, sent: &[&'static [u8]]) -> ModelState {
    let said = told(flash, sent, &[Work::ModelState]);
    assert_eq!(answer(&said[1]), (Ok(()), 0));
    match &said[0] {
        Word::Say(Packet::ModelState(state)) => *state,
        other => panic!("{other:?}"),
    }
}

fn kept(flash: &mut FakeFlash) -> Option<Calibration> {
    let mut storage = block_on(Storage::open(flash, DK)).unwrap();
    block_on(calibration(&mut storage)).unwrap()
}

#[test]
fn a_calibration_is_kept_before_it_is_said_to_be() {
    let mut flash = FakeFlash::new();
    assert_eq!(kept(&mut flash), None);
    for revision in 1..20 {
        let said = told(&mut flash, &[], &[Work::Calibrate(wanted(revision))]);
        let asked = Asked {
            kind: Kind::Calibration,
            sequence: 0,
        };
        assert_eq!(said, [Word::Calibrated(wanted(revision), asked)]);
        assert_eq!(kept(&mut flash), Some(wanted(revision)));
    }
}

#[test]
fn a_flash_that_fails_leaves_the_calibration_before_and_says_so() {
    let mut flash = FakeFlash::new();
    told(&mut flash, &[], &[Work::Calibrate(wanted(1))]);
    flash.cut(Cut {
        step: 3,
        how: How::Busy,
    });
    let said = told(&mut flash, &[], &[Work::Calibrate(wanted(2))]);
    assert_eq!(answer(&said[0]), (Err(Refusal::StorageFailed), 0));
    assert_eq!(kept(&mut flash), Some(wanted(1)));
    told(&mut flash, &[], &[Work::Calibrate(wanted(3))]);
    assert_eq!(kept(&mut flash), Some(wanted(3)));
}

#[test]
fn a_model_is_received_piece_by_piece_and_goes_on_after_a_restart() {
    let model = leaked(golden());
    let mut flash = FakeFlash::new();
    assert_eq!(
        state(&mut flash, &[model]),
        ModelState {
            active: None,
            receiving: None,
            capacity_bytes: 77_824
        }
    );
    let steps = upload(model);
    let said = told(&mut flash, &[model], &steps[..2]);
    assert_eq!(answer(&said[0]), (Ok(()), 0));
    assert_eq!(answer(&said[1]), (Ok(()), 200));
    // Within a page, so that a restart begins it anew.
    let receiving = state(&mut flash, &[model]).receiving.unwrap();
    assert_eq!(receiving.received_bytes, 0);
    assert_eq!(receiving.total_bytes, model.len() as u32);
    let said = told(&mut flash, &[model], &steps);
    let last = said.last().map(answer);
    assert_eq!(last, Some((Ok(()), 0)));
    let received: Vec<u32> = said.iter().map(|word| answer(word).1).collect();
    assert!(received[1..received.len() - 1].is_sorted());
    assert_eq!(received[received.len() - 2], model.len() as u32);
    // What the page on the format says of the golden model.
    let active = state(&mut flash, &[model]).active.unwrap();
    assert_eq!(active.hash[..], Sha256::digest(model)[..8]);
    let image = ModelImage::parse(model, &WEARABLE).unwrap();
    assert_eq!(usize::from(active.skills), image.skills().len());
    assert_eq!(usize::from(active.dofs), image.dofs().len());
}

#[test]
fn what_is_wrong_with_an_upload_is_named_and_the_model_in_use_stays() {
    let model = leaked(golden());
    let noise = leaked((0..1000_u32).map(|byte| (byte * 7) as u8).collect());
    let sent = [model, noise];
    let mut flash = FakeFlash::new();
    told(&mut flash, &sent, &upload(model));
    let before = state(&mut flash, &sent).active;
    assert!(before.is_some());

    let finish = Work::Upload(ModelUpload::Finish);
    let steps = [
        finish.clone(),
        begin(noise),
        piece(noise, 0, 100),
        piece(noise, 200, 300),
        finish.clone(),
        Work::Upload(ModelUpload::Begin {
            total_bytes: 100_000,
            sha256: [0; 32],
        }),
        Work::Upload(ModelUpload::Abandon),
        Work::Upload(ModelUpload::Abandon),
    ];
    let said = told(&mut flash, &sent, &steps);
    let answers: Vec<_> = said.iter().map(answer).collect();
    assert_eq!(
        answers,
        [
            (Err(Refusal::WrongState), 0),
            (Ok(()), 0),
            (Ok(()), 100),
            (Err(Refusal::WrongOffset), 100),
            (Err(Refusal::WrongState), 0),
            (Err(Refusal::TooLarge), 77_824),
            (Ok(()), 0),
            (Err(Refusal::WrongState), 0),
        ]
    );
    // Whole, as announced, and no model at all.
    let said = told(&mut flash, &sent, &upload(noise));
    let last = said.last().map(answer);
    assert_eq!(last, Some((Err(Refusal::NotFitting), 0)));
    // Other bytes than those announced.
    let mut steps = upload(noise);
    steps[0] = Work::Upload(ModelUpload::Begin {
        total_bytes: 1000,
        sha256: [7; 32],
    });
    let said = told(&mut flash, &sent, &steps);
    let last = said.last().map(answer);
    assert_eq!(last, Some((Err(Refusal::HashMismatch), 0)));
    assert_eq!(state(&mut flash, &sent).active, before);
}

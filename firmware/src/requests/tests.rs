use std::vec::Vec;

use embassy_futures::poll_once;
use tonus_shared::{
    pipeline::illustrative,
    sample::Scan,
    wire::{Calibration, HandPosition, Header, StreamFlags, decode},
};

use super::*;
use crate::{
    acquisition::{CHANNELS, MUSCLES, RATE_HZ},
    afe::saadc,
};

fn path() -> SignalPath<CHANNELS> {
    let calibration = illustrative(MUSCLES, RATE_HZ);
    SignalPath::new(saadc::board(0xB007).unwrap(), &calibration).unwrap()
}

/// What stands at the desk.
struct Office {
    outbox: Outbox,
    jobs: Jobs,
    recognition: recognition::Inbox,
    last_words: LastWords,
}

impl Office {
    fn new() -> Self {
        Self {
            outbox: Outbox::new(),
            jobs: Jobs::new(),
            recognition: recognition::Inbox::new(),
            last_words: LastWords::from_bytes(b"out of bounds"),
        }
    }

    fn desk(&self) -> Desk<'_> {
        Desk {
            outbox: &self.outbox,
            jobs: &self.jobs,
            recognition: &self.recognition,
            last_words: &self.last_words,
        }
    }
}

fn asked(sequence: u32, device_us: u64, packet: Packet) -> Frame {
    Frame {
        header: Header {
            boot_id: 1,
            sequence,
            device_us,
        },
        packet,
    }
}

fn sent(outbox: &Outbox) -> Vec<Packet> {
    let mut packets = Vec::new();
    while poll_once(async { packets.push(decode(&outbox.take().await).unwrap().packet) }).is_ready()
    {
    }
    packets
}

/// What is sent in answer to one packet, and what else is to be done.
fn told(path: &mut SignalPath<CHANNELS>, packet: Packet) -> (Effect, Vec<Packet>) {
    let office = Office::new();
    let effect = handle(path, asked(9, 0, packet), 1_000, office.desk());
    assert!(office.jobs.is_empty(), "nothing for the keeper");
    (effect, sent(&office.outbox))
}

fn reply(answered: Kind, outcome: Result<(), Refusal>) -> Packet {
    Packet::Reply(Reply {
        answered,
        sequence: 9,
        outcome,
        detail: 0,
    })
}

#[test]
fn a_ping_is_answered_with_both_times() {
    let request = Ping::Request {
        id: 3,
        requested_us: 77,
    };
    let (effect, packets) = told(&mut path(), Packet::Ping(request));
    let expected = Ping::Reply {
        id: 3,
        requested_us: 77,
        received_us: 1_000,
        replied_us: 1_000,
    };
    assert_eq!(
        (effect, packets),
        (Effect::None, [Packet::Ping(expected)].into())
    );
}

#[test]
fn a_calibration_is_handed_over_when_the_board_can_work_with_it_and_else_refused() {
    let mut path = path();
    let before = *path.calibration();
    let wanted = Calibration {
        revision: 12,
        ..before
    };
    let office = Office::new();
    let frame = asked(9, 0, Packet::Calibration(wanted));
    assert_eq!(handle(&mut path, frame, 1_000, office.desk()), Effect::None);
    let expected = Job {
        asked: Asked {
            kind: Kind::Calibration,
            sequence: 9,
        },
        work: Work::Calibrate(wanted),
    };
    assert_eq!(office.jobs.try_receive(), Ok(expected));
    assert_eq!(sent(&office.outbox), [], "the keeper answers");
    assert_eq!(*path.calibration(), before, "until it is kept");

    // This board converts four channels.
    let impossible = Calibration {
        channels: 2,
        ..wanted
    };
    let (effect, packets) = told(&mut path, Packet::Calibration(impossible));
    assert_eq!(effect, Effect::None);
    assert_eq!(
        packets,
        [reply(Kind::Calibration, Err(Refusal::OutOfRange))]
    );
}

#[test]
fn what_needs_the_flash_is_handed_over_until_the_keeper_is_busy() {
    let mut path = path();
    let office = Office::new();
    let upload = |sequence| asked(sequence, 0, Packet::ModelUpload(ModelUpload::Finish));
    for sequence in 0..JOBS as u32 {
        handle(&mut path, upload(sequence), 0, office.desk());
    }
    assert_eq!(sent(&office.outbox), []);
    handle(&mut path, upload(9), 0, office.desk());
    assert_eq!(
        sent(&office.outbox),
        [reply(Kind::ModelUpload, Err(Refusal::Busy))]
    );
    for sequence in 0..JOBS as u32 {
        let job = office.jobs.try_receive().unwrap();
        assert_eq!(job.asked.sequence, sequence);
        assert_eq!(job.work, Work::Upload(ModelUpload::Finish));
    }
    let state = Packet::Control(Control::SendModelState);
    handle(&mut path, asked(5, 0, state), 0, office.desk());
    assert_eq!(office.jobs.try_receive().unwrap().work, Work::ModelState);
}

#[test]
fn the_calibration_in_use_and_the_last_words_are_sent_when_asked_for() {
    let mut path = path();
    let (_, packets) = told(&mut path, Packet::Control(Control::SendCalibration));
    let in_use = Packet::Calibration(*path.calibration());
    assert_eq!(packets, [in_use, reply(Kind::Control, Ok(()))]);
    let (_, packets) = told(&mut path, Packet::Control(Control::SendLastWords));
    let words = Packet::LastWords(LastWords::from_bytes(b"out of bounds"));
    assert_eq!(packets, [words, reply(Kind::Control, Ok(()))]);
}

/// Pushes scans for half a second from `first` on, with attitudes between them if there are any.
fn half_a_second(
    path: &mut SignalPath<CHANNELS>,
    first: u32,
    xyzw: Option<[f32; 4]>,
) -> (u64, StreamFlags) {
    let office = Office::new();
    let mut flags = StreamFlags::default();
    let mut now_us = 0;
    for index in first..first + 500 {
        now_us = 1_000_000 + u64::from(index) * 1_000;
        let scan = Scan {
            index,
            acquired_us: now_us,
            counts: [1877; CHANNELS],
        };
        path.push_scan(&scan, &office.outbox).unwrap();
        if let Some(xyzw) = xyzw {
            path.set_attitude(xyzw, now_us).unwrap();
        }
        for packet in sent(&office.outbox) {
            if let Packet::Stream(stream) = packet {
                flags = stream.flags;
            }
        }
    }
    (now_us, flags)
}

#[test]
fn forward_is_where_a_hanging_arm_is_asked_to_face() {
    let mut path = path();
    let face = || Packet::Control(Control::FaceForward);
    let refused = |why| (Effect::None, [reply(Kind::Control, Err(why))].into());
    assert_eq!(told(&mut path, face()), refused(Refusal::WrongState));
    let (_, flags) = half_a_second(&mut path, 0, None);
    assert_eq!(told(&mut path, face()), refused(Refusal::WrongState));
    assert!(!flags.contains(StreamFlags::ORIENTATION_SEEN));
    // Raised by 60 degrees, then hanging; turned by 90 degrees about the vertical from wherever the sensor began.
    let raised = [0.0, -0.5, 0.0, 0.866_025_4];
    let (_, flags) = half_a_second(&mut path, 500, Some(raised));
    assert_eq!(told(&mut path, face()), refused(Refusal::OutOfRange));
    assert!(!flags.contains(StreamFlags::ORIENTATION_SEEN));
    let half = core::f32::consts::FRAC_1_SQRT_2;
    let hanging = [0.0, 0.0, half, half];
    let (_, flags) = half_a_second(&mut path, 1_000, Some(hanging));
    assert!(!flags.contains(StreamFlags::ORIENTATION_SEEN));
    let done = (Effect::None, [reply(Kind::Control, Ok(()))].into());
    assert_eq!(told(&mut path, face()), done);
    let (_, flags) = half_a_second(&mut path, 1_500, Some(hanging));
    assert!(flags.contains(StreamFlags::ORIENTATION_SEEN));
    assert!(!flags.contains(StreamFlags::STIFFNESS_HELD));
}

#[test]
fn a_hand_that_is_seen_shows_in_the_stream() {
    let mut path = path();
    let mut seen = Vec::new();
    for index in 1..=200_u32 {
        let office = Office::new();
        let now_us = 1_000_000 + u64::from(index) * 1_000;
        if index >= 100 {
            let hand = HandPosition {
                position_m: Some([0.3, 0.1, -0.3]),
            };
            let frame = asked(index, now_us - 6_000, Packet::HandPosition(hand));
            assert_eq!(
                handle(&mut path, frame, now_us, office.desk()),
                Effect::None
            );
        }
        let scan = Scan {
            index,
            acquired_us: now_us,
            counts: [1877; CHANNELS],
        };
        path.push_scan(&scan, &office.outbox).unwrap();
        let streams = sent(&office.outbox).into_iter();
        seen.extend(streams.filter_map(|packet| match packet {
            Packet::Stream(stream) => Some(stream.flags.contains(StreamFlags::HAND_SEEN)),
            _ => None,
        }));
    }
    assert!(!seen[0] && seen.last() == Some(&true), "{seen:?}");
}

#[test]
fn a_restart_is_granted_for_this_boot_and_no_other() {
    let mut path = path();
    for (boot_id, effect, outcome) in [
        (0xB007, Effect::Restart, Ok(())),
        (0xB008, Effect::None, Err(Refusal::WrongState)),
    ] {
        let restart = Packet::Control(Control::Restart { boot_id });
        let answer = [reply(Kind::Control, outcome)].into();
        assert_eq!(told(&mut path, restart), (effect, answer));
    }
}

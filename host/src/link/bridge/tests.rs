use tonus_shared::pipeline::illustrative;
use tonus_shared::sample::AdcScale;
use tonus_shared::wire::{HandPosition, Header, Kind, Muscle, StreamFlags, encode};

use super::*;

const MUSCLES: [Muscle; 2] = [Muscle::BicepsLong, Muscle::TricepsLong];

fn bridge() -> Bridge<2> {
    let board = Board {
        boot_id: 0xB007,
        firmware_hash: [0; 8],
        adc: AdcScale::new(1e-6, 0, -128, 127).unwrap(),
        rates_hz: &[200],
    };
    Bridge::new(board, &illustrative(MUSCLES, 200)).unwrap()
}

fn bytes(sequence: u32, device_us: u64, packet: &Packet) -> Vec<u8> {
    let header = Header {
        boot_id: 1,
        sequence,
        device_us,
    };
    let mut bytes = [0; MAX_FRAME_BYTES];
    let length = encode(&header, packet, &mut bytes).unwrap();
    bytes[..length].to_vec()
}

/// What one scan makes leave; scan `index` is taken at `index` * 5 ms.
fn scan(bridge: &mut Bridge<2>, index: u32) -> Vec<Frame> {
    let mut left = Vec::new();
    let scan = Scan {
        index,
        acquired_us: u64::from(index) * 5_000,
        counts: [if index.is_multiple_of(2) { 40 } else { -40 }, 3],
    };
    let pushed = bridge.push_scan(&scan, |bytes| left.push(decode(bytes).unwrap()));
    pushed.unwrap();
    left
}

/// What one request makes leave, at 1 s.
fn ask(bridge: &mut Bridge<2>, packet: &Packet) -> Vec<Packet> {
    let mut left = Vec::new();
    bridge.request(&bytes(9, 0, packet), 1_000_000, |bytes| {
        left.push(decode(bytes).unwrap().packet);
    });
    left
}

fn reply(answered: Kind, outcome: Result<(), Refusal>) -> Packet {
    Packet::Reply(Reply {
        answered,
        sequence: 9,
        outcome,
        detail: 0,
    })
}

fn status(bridge: &mut Bridge<2>, from: u32) -> tonus_shared::wire::Status {
    let packets = (from..from + 200).flat_map(|index| scan(bridge, index));
    let mut found = packets.filter_map(|frame| match frame.packet {
        Packet::Status(status) => Some(status),
        _ => None,
    });
    found.next().unwrap()
}

#[test]
fn every_other_scan_of_200_a_second_makes_a_stream_packet_and_all_are_numbered() {
    let mut bridge = bridge();
    let frames: Vec<Frame> = (0..400)
        .flat_map(|index| scan(&mut bridge, index))
        .collect();
    for (frame, number) in frames.iter().zip(0..) {
        assert_eq!(
            (frame.header.boot_id, frame.header.sequence),
            (0xB007, number)
        );
    }
    let count = |kind| frames.iter().filter(|it| it.packet.kind() == kind).count();
    assert_eq!(count(Kind::Stream), 200);
    assert_eq!((count(Kind::Configuration), count(Kind::Status)), (2, 2));
    let Packet::Configuration(told) = frames[0].packet else {
        panic!("the configuration comes first");
    };
    assert_eq!((told.semg_hz, told.channels), (200.0, 2));
}

#[test]
fn a_ping_and_a_wish_for_anything_kept_are_answered() {
    let mut bridge = bridge();
    let request = Ping::Request {
        id: 3,
        requested_us: 77,
    };
    let expected = Ping::Reply {
        id: 3,
        requested_us: 77,
        received_us: 1_000_000,
        replied_us: 1_000_000,
    };
    assert_eq!(
        ask(&mut bridge, &Packet::Ping(request)),
        [Packet::Ping(expected)]
    );
    let in_use = Packet::Calibration(illustrative(MUSCLES, 200));
    let nothing = Packet::ModelState(ModelState {
        active: None,
        receiving: None,
        capacity_bytes: 0,
    });
    let silent = Packet::LastWords(LastWords::default());
    for (control, told) in [
        (Control::SendCalibration, in_use),
        (Control::SendModelState, nothing),
        (Control::SendLastWords, silent),
    ] {
        let answer = ask(&mut bridge, &Packet::Control(control));
        assert_eq!(answer, [told, reply(Kind::Control, Ok(()))]);
    }
}

#[test]
fn a_calibration_is_used_and_said_to_be_or_refused_and_nothing_changes() {
    let mut bridge = bridge();
    assert!(
        status(&mut bridge, 0)
            .flags
            .contains(StatusFlags::NOT_CALIBRATED)
    );
    let wanted = Calibration {
        revision: 12,
        ..*bridge.calibration()
    };
    let impossible = Calibration {
        semg_hz: 1_000.0,
        ..wanted
    };
    assert_eq!(
        ask(&mut bridge, &Packet::Calibration(impossible)),
        [reply(Kind::Calibration, Err(Refusal::OutOfRange))]
    );
    assert_eq!(bridge.calibration().revision, 0);
    assert_eq!(
        ask(&mut bridge, &Packet::Calibration(wanted)),
        [reply(Kind::Calibration, Ok(()))]
    );
    assert_eq!(bridge.calibration(), &wanted);
    let flags = status(&mut bridge, 200).flags;
    assert!(!flags.contains(StatusFlags::NOT_CALIBRATED));
    assert!(flags.contains(StatusFlags::NO_MODEL));
}

#[test]
fn raw_semg_leaves_as_it_came_while_it_is_wanted() {
    let mut bridge = bridge();
    let raw = |bridge: &mut Bridge<2>, from| -> Vec<i32> {
        let frames = (from..from + 72).flat_map(|index| scan(bridge, index));
        let counts = frames.filter_map(|frame| match frame.packet {
            Packet::RawSemg(raw) => Some(raw.counts.to_vec()),
            _ => None,
        });
        counts.flatten().collect()
    };
    assert!(raw(&mut bridge, 0).is_empty());
    let on = ask(&mut bridge, &Packet::Control(Control::Raw(true)));
    assert_eq!(on, [reply(Kind::Control, Ok(()))]);
    let expected: Vec<i32> = (0..72)
        .flat_map(|index: u32| [if index.is_multiple_of(2) { 40 } else { -40 }, 3])
        .collect();
    assert_eq!(raw(&mut bridge, 72), expected);
    ask(&mut bridge, &Packet::Control(Control::Raw(false)));
    assert!(raw(&mut bridge, 144).is_empty());
}

#[test]
fn a_hand_is_seen_from_the_next_tick_on() {
    let mut bridge = bridge();
    scan(&mut bridge, 0);
    let hand = Packet::HandPosition(HandPosition {
        position_m: Some([0.3, 0.0, -0.3]),
    });
    bridge.request(&bytes(1, 4_000, &hand), 5_000, |_| panic!("no answer"));
    scan(&mut bridge, 1);
    let Packet::Stream(stream) = scan(&mut bridge, 2)[0].packet else {
        panic!("a tick");
    };
    assert!(stream.flags.contains(StreamFlags::HAND_SEEN));
}

#[test]
fn a_restart_is_another_boot_with_the_same_calibration_and_is_granted_to_this_boot_alone() {
    let mut bridge = bridge();
    let calibrated = Calibration {
        revision: 5,
        ..*bridge.calibration()
    };
    ask(&mut bridge, &Packet::Calibration(calibrated));
    let restart = |boot_id| Packet::Control(Control::Restart { boot_id });
    assert_eq!(
        ask(&mut bridge, &restart(0xB006)),
        [reply(Kind::Control, Err(Refusal::WrongState))]
    );
    assert_eq!(
        ask(&mut bridge, &restart(0xB007)),
        [reply(Kind::Control, Ok(()))]
    );
    let frames = scan(&mut bridge, 400);
    assert_eq!(frames[0].header.boot_id, 0xB008);
    assert_eq!(frames[0].header.sequence, 0);
    assert_eq!(bridge.calibration(), &calibrated);
    assert_eq!(status(&mut bridge, 401).reset_reason, ResetReason::Software);
}

#[test]
fn models_find_no_room_and_what_no_host_sends_is_counted() {
    let mut bridge = bridge();
    let begin = ModelUpload::Begin {
        total_bytes: 10,
        sha256: [0; 32],
    };
    assert_eq!(
        ask(&mut bridge, &Packet::ModelUpload(begin)),
        [reply(Kind::ModelUpload, Err(Refusal::TooLarge))]
    );
    assert_eq!(
        ask(&mut bridge, &Packet::ModelUpload(ModelUpload::Finish)),
        [reply(Kind::ModelUpload, Err(Refusal::WrongState))]
    );
    bridge.request(b"hello", 0, |_| panic!("no answer"));
    let orientation = tonus_shared::wire::Orientation {
        xyzw: [0.0, 0.0, 0.0, 1.0],
    };
    assert_eq!(ask(&mut bridge, &Packet::Orientation(orientation)), []);
    assert_eq!(status(&mut bridge, 0).refused_requests, 2);
}

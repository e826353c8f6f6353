use std::vec::Vec;

use embassy_futures::poll_once;
use tonus_shared::pipeline::illustrative;
use tonus_shared::wire::{Calibration, HandPosition, Kind, StreamFlags, decode};

use super::*;
use crate::acquisition::{BUFFER_SCANS, CHANNELS, PERIOD_US, RATE_HZ, ScanClock};
use crate::afe::saadc;

fn path() -> SignalPath<CHANNELS> {
    let calibration = illustrative(saadc::MUSCLES, RATE_HZ);
    SignalPath::new(saadc::board(0xB007).unwrap(), &calibration).unwrap()
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

/// What is sent in answer to one packet, and what else it changed.
fn told(path: &mut SignalPath<CHANNELS>, packet: Packet) -> (Effect, Vec<Packet>) {
    let outbox = Outbox::new();
    let effect = handle(path, asked(9, 0, packet), 1_000, &outbox);
    (effect, sent(&outbox))
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
fn a_calibration_is_taken_read_back_or_refused_and_then_changes_nothing() {
    let mut path = path();
    let mut wanted = *path.calibration();
    wanted.revision = 12;
    wanted.mvc_v[0] = 2e-3;
    let (effect, packets) = told(&mut path, Packet::Calibration(wanted));
    assert_eq!(effect, Effect::Recalibrated);
    assert_eq!(packets, [reply(Kind::Calibration, Ok(()))]);

    let (_, packets) = told(&mut path, Packet::Control(Control::SendCalibration));
    let expected = [Packet::Calibration(wanted), reply(Kind::Control, Ok(()))];
    assert_eq!(packets, expected);

    // This board converts one channel.
    let impossible = Calibration {
        channels: 2,
        revision: 13,
        ..wanted
    };
    let (effect, packets) = told(&mut path, Packet::Calibration(impossible));
    assert_eq!(effect, Effect::None);
    assert_eq!(
        packets,
        [reply(Kind::Calibration, Err(Refusal::OutOfRange))]
    );
    assert_eq!(*path.calibration(), wanted);
}

#[test]
fn a_hand_that_is_seen_shows_in_the_stream() {
    let mut path = path();
    let mut clock = ScanClock::new(PERIOD_US, BUFFER_SCANS as u32);
    let mut seen = Vec::new();
    for number in 1..=40_u64 {
        let outbox = Outbox::new();
        let now_us = 1_000_000 + number * 5_000;
        if number >= 20 {
            let hand = HandPosition {
                position_m: Some([0.3, 0.1, -0.3]),
            };
            let frame = asked(number as u32, now_us - 6_000, Packet::HandPosition(hand));
            assert_eq!(handle(&mut path, frame, now_us, &outbox), Effect::None);
        }
        let block = clock.buffer_full(now_us);
        let buffer = [[1877; CHANNELS]; BUFFER_SCANS];
        path.buffer_full(block, PERIOD_US, &buffer, &outbox)
            .unwrap();
        seen.extend(sent(&outbox).into_iter().filter_map(|packet| match packet {
            Packet::Stream(stream) => Some(stream.flags.contains(StreamFlags::HAND_SEEN)),
            _ => None,
        }));
    }
    assert!(!seen[0] && seen.last() == Some(&true), "{seen:?}");
}

#[test]
fn what_cannot_be_done_yet_is_refused_by_name() {
    let mut path = path();
    for (packet, why) in [
        (
            Packet::Control(Control::Restart { boot_id: 0xB007 }),
            Refusal::WrongState,
        ),
        (Packet::Control(Control::SendLastWords), Refusal::WrongState),
    ] {
        let answered = packet.kind();
        let (effect, packets) = told(&mut path, packet);
        assert_eq!(effect, Effect::None);
        assert_eq!(packets, [reply(answered, Err(why))]);
    }
}

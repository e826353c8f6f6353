//! A host on the serial line.

use tonus_emulated::Machine;
use tonus_shared::wire::cobs::{MAX_BLOCK_BYTES, enclose};
use tonus_shared::wire::{
    Calibration, Control, Frame, Header, Kind, MAX_FRAME_BYTES, Packet, Refusal,
};

use super::frames_since;

/// How long a host waits for an answer; erasing the twenty pages of a model may stand in its way.
const PATIENCE_US: u64 = 3_000_000;
/// What it looks at in one go.
const LOOK_US: u64 = 5_000;

/// A packet as it goes over the line.
pub(crate) fn enclosed(sequence: u32, packet: Packet) -> Vec<u8> {
    dated(sequence, 0, packet)
}

/// The same, of a time of the wearable's clock.
pub(crate) fn dated(sequence: u32, device_us: u64, packet: Packet) -> Vec<u8> {
    let frame = Frame {
        header: Header {
            boot_id: 7,
            sequence,
            device_us,
        },
        packet,
    };
    let (mut bytes, mut block) = ([0; MAX_FRAME_BYTES], [0; MAX_BLOCK_BYTES]);
    let length = frame.encode(&mut bytes).unwrap();
    let length = enclose(&bytes[..length], &mut block).unwrap();
    block[..length].to_vec()
}

/// Sends a packet and gives what came until it was answered: the outcome, and other packets.
///
/// The frame that is on the line when it is sent is left out.
pub(crate) fn ask(
    machine: &mut Machine,
    sequence: u32,
    packet: Packet,
) -> Option<(Result<(), Refusal>, Vec<Packet>)> {
    let from_us = idle_line(machine);
    machine.send(&enclosed(sequence, packet));
    let end_us = machine.now_us() + PATIENCE_US;
    while machine.now_us() < end_us {
        let now_us = machine.now_us();
        machine.run_through(now_us + LOOK_US).unwrap();
        let came: Vec<Packet> = frames_since(machine, from_us)
            .into_iter()
            .map(|(_, frame)| frame.packet)
            .collect();
        let outcome = came.iter().find_map(|packet| match packet {
            Packet::Reply(reply) if reply.sequence == sequence => Some(reply.outcome),
            _ => None,
        });
        if let Some(outcome) = outcome {
            return Some((outcome, came));
        }
    }
    None
}

/// Waits for a time at which nothing is on the line, and gives it in microseconds.
pub(crate) fn idle_line(machine: &mut Machine) -> u64 {
    loop {
        let sent = &machine.world().unwrap().serial.sent;
        let (last_us, end) = sent
            .last()
            .map_or((0, true), |(cycle, byte)| (cycle / 64, *byte == 0));
        let now_us = machine.now_us();
        if end && now_us > last_us + 20 {
            return last_us + 1;
        }
        machine.run_through(now_us + 25).unwrap();
    }
}

pub(crate) fn calibration(machine: &mut Machine) -> Calibration {
    let asked = Packet::Control(Control::SendCalibration);
    let (outcome, came) = ask(machine, 900, asked).expect("an answer");
    assert_eq!(outcome, Ok(()));
    came.into_iter()
        .find_map(|packet| match packet {
            Packet::Calibration(calibration) => Some(calibration),
            _ => None,
        })
        .expect("a calibration")
}

/// What the last panic said.
pub(crate) fn last_words(machine: &mut Machine) -> String {
    let asked = Packet::Control(Control::SendLastWords);
    let (outcome, came) = ask(machine, 901, asked).expect("an answer");
    assert_eq!(outcome, Ok(()));
    let words = came.into_iter().find_map(|packet| match packet {
        Packet::LastWords(words) => Some(words.words.as_str().to_owned()),
        _ => None,
    });
    words.unwrap_or_else(|| panic!("no {:?}", Kind::LastWords))
}

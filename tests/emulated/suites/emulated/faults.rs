//! What the machine refuses, and what the image does when things go wrong.

use tonus_emulated::error::Access;
use tonus_emulated::{Image, Machine, MachineError, Stop};
use tonus_shared::wire::{Packet, StreamFlags};

use super::{STARTED_US, frames, image, last_status, recording, started, wearer};

#[test]
fn the_image_starts_and_logs_nothing_bad() {
    let machine = started();
    assert!(!frames(&machine).is_empty());
    let bad: Vec<&String> = machine
        .log()
        .iter()
        .filter(|line| line.starts_with("warn") || line.starts_with("error"))
        .collect();
    assert!(bad.is_empty(), "{bad:?}");
}

#[test]
fn a_register_that_no_model_has_is_an_error_that_names_it() {
    let mut machine = started();
    let copy = machine.image().symbol("memcpy").unwrap();
    // The memory watch unit, which the image does not use.
    machine.jump(copy, &[0x2001_8000, 0x4002_0000, 4]).unwrap();
    let Err(MachineError::Unmodelled {
        access,
        address,
        function,
        ..
    }) = machine.run_until(STARTED_US + 1_000)
    else {
        panic!("the access went unnoticed");
    };
    assert_eq!((access, address & !3), (Access::Read, 0x4002_0000));
    assert!(function.contains("memcpy"), "{function}");
}

#[test]
fn a_write_to_flash_without_the_controller_is_an_error() {
    let mut machine = started();
    let copy = machine.image().symbol("memcpy").unwrap();
    machine.jump(copy, &[0x0008_0000, 0x2001_0000, 4]).unwrap();
    let outcome = machine.run_until(STARTED_US + 1_000);
    assert!(
        matches!(
            outcome,
            Err(MachineError::Unmodelled {
                access: Access::Write(_),
                address: 0x8_0000,
                ..
            })
        ),
        "{outcome:?}"
    );
}

#[test]
fn an_image_with_the_radio_is_not_executed() {
    // The name of a function, changed in the file into one of the closed library's.
    let mut elf = image().elf;
    let (name, instead) = (b"DefaultHandler_", b"mpsl_init_radio");
    for at in 0..elf.len() - name.len() {
        if elf[at..].starts_with(name) {
            elf[at..at + name.len()].copy_from_slice(instead);
        }
    }
    assert_eq!(
        Image::read(elf).unwrap_err(),
        MachineError::RadioLibrary {
            symbol: "mpsl_init_radio".to_owned()
        }
    );
    assert!(matches!(
        Image::read(vec![0; 100]),
        Err(MachineError::NotAnImage { .. })
    ));
}

#[test]
fn a_processor_that_is_too_slow_for_a_second_loses_scans_and_says_so() {
    let mut machine = Machine::new(image(), wearer(recording::lift())).unwrap();
    assert_eq!(machine.run_until(STARTED_US), Ok(Stop::Time));
    // While it lasts nothing is sent either: the signal path takes all the time there is.
    machine.slow_down(SLOWER);
    assert_eq!(machine.run_until(SLOW_UNTIL_US), Ok(Stop::Time));
    machine.slow_down(1);
    assert_eq!(machine.run_until(4_000_000), Ok(Stop::Time));
    let sent = frames(&machine);
    let status = last_status(&sent);
    assert!(status.missed_scans > 100, "{status:?}");
    assert!(status.gaps > 0, "{status:?}");
    let flagged = sent
        .iter()
        .any(|(_, frame)| matches!(&frame.packet, Packet::Stream(stream) if stream.flags.contains(StreamFlags::GAP)));
    assert!(flagged);
}

/// Cycles per instruction of the slow processor.
const SLOWER: u64 = 60;
const SLOW_UNTIL_US: u64 = 1_600_000;

use tonus_shared::wire::{Frame, HandPosition, Header, MAX_FRAME_BYTES, Packet, Ping, decode};

use super::*;

const SOON: Duration = Duration::from_millis(50);

/// The host's end, and the wearable's.
fn line() -> (SerialLink, SerialPort) {
    let (host, mut wearable) = SerialPort::pair().unwrap();
    wearable.set_read_timeout(SOON).unwrap();
    (SerialLink::over(host, Path::new("pair")).unwrap(), wearable)
}

fn frame(sequence: u32) -> Vec<u8> {
    let packet = if sequence.is_multiple_of(2) {
        Packet::HandPosition(HandPosition {
            position_m: Some([0.0, 0.5, -0.25]),
        })
    } else {
        Packet::Ping(Ping::Request {
            id: sequence,
            requested_us: 0,
        })
    };
    let header = Header {
        boot_id: 0,
        sequence,
        device_us: 0,
    };
    let mut bytes = [0; MAX_FRAME_BYTES];
    let length = Frame { header, packet }.encode(&mut bytes).unwrap();
    bytes[..length].to_vec()
}

fn block(sequence: u32) -> Vec<u8> {
    let mut block = [0; MAX_BLOCK_BYTES];
    let length = enclose(&frame(sequence), &mut block).unwrap();
    block[..length].to_vec()
}

/// Sequence numbers of all frames that come until the line is silent.
fn numbers(link: &mut SerialLink) -> Vec<u32> {
    let mut numbers = Vec::new();
    while let Some(bytes) = link.receive(SOON).unwrap() {
        if let Ok(frame) = decode(&bytes) {
            numbers.push(frame.header.sequence);
        }
    }
    numbers
}

#[test]
fn frames_come_whole_however_they_are_written() {
    let (mut link, wearable) = line();
    for sequence in 0..40 {
        for piece in block(sequence).chunks(1 + sequence as usize) {
            wearable.write_all(piece).unwrap();
        }
        assert_eq!(link.receive(SOON).unwrap(), Some(frame(sequence)));
    }
    assert_eq!(link.receive(Duration::from_millis(1)).unwrap(), None);
    assert_eq!(link.counters().blocks, 40);
    assert_eq!(link.counters().refused, 0);
}

#[test]
fn garbage_and_cuts_cost_the_frames_that_they_hit() {
    let (mut link, wearable) = line();
    // Every byte: with other settings the line would change line ends, or stop at control characters.
    let every: Vec<u8> = (0..=255).collect();
    let mut cut = block(2);
    cut.drain(5..12);
    let bytes = [&every[..], &[DELIMITER], &block(1), &cut, &block(3)].concat();
    wearable.write_all(&bytes).unwrap();
    assert_eq!(numbers(&mut link), [1, 3]);
    let counters = link.counters();
    assert_eq!(counters.bytes, bytes.len() as u64);
    assert_eq!(counters.blocks + counters.refused, 4);
}

#[test]
fn what_is_sent_can_be_read_by_the_wearable() {
    let (mut link, wearable) = line();
    link.send(&frame(4)).unwrap();
    let mut bytes = [0; 200];
    let came = wearable.read(&mut bytes).unwrap();
    assert_eq!(bytes[..came], [&[DELIMITER][..], &block(4)].concat());
    assert!(matches!(
        link.send(&[1; MAX_FRAME_BYTES + 3]),
        Err(SerialError::Frame(WireError::BufferTooSmall { .. }))
    ));
}

#[test]
fn an_unplugged_wearable_is_said_to_be_after_its_last_frame() {
    let (mut link, wearable) = line();
    wearable.write_all(&[block(1), block(2)].concat()).unwrap();
    assert_eq!(link.receive(SOON).unwrap(), Some(frame(1)));
    drop(wearable);
    assert_eq!(link.receive(SOON).unwrap(), Some(frame(2)));
    let ended = link.receive(SOON).unwrap_err();
    assert!(matches!(ended, SerialError::Unplugged { .. }), "{ended}");
}

#[test]
fn a_port_that_does_not_exist_is_refused_by_name() {
    let error = SerialLink::open(Path::new("/dev/no-such-port")).unwrap_err();
    assert!(matches!(error, SerialError::Open { .. }));
    assert!(
        error
            .to_string()
            .starts_with("/dev/no-such-port: cannot be opened at 1000000 baud")
    );
}

#[test]
fn a_wearable_that_reads_nothing_is_no_hang() {
    let (mut link, _wearable) = line();
    let full = (0..10_000).find_map(|sequence| link.send(&frame(sequence)).err());
    assert!(matches!(full, Some(SerialError::Write { .. })), "{full:?}");
}

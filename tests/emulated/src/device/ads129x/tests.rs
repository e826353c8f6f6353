use super::*;

const WIRES: Wires = Wires {
    bus: [31, 30, 29],
    select: 28,
    ready: 27,
    start: None,
    reset: None,
};

fn device() -> Ads129x {
    let mut device = Ads129x::new(
        WIRES,
        vec![vec![1, -2], vec![0x7F_FFFF], vec![-0x80_0000], vec![]],
    );
    device.pins(false, true, true, 0);
    device
}

fn exchange(device: &mut Ads129x, bytes: &[u8]) -> Vec<u8> {
    bytes.iter().map(|byte| device.exchange(*byte, 0)).collect()
}

#[test]
fn identity_is_read_only_after_continuous_mode_is_left() {
    let mut device = device();
    assert_eq!(exchange(&mut device, &[0x20, 0x00, 0x00])[2], 0);
    exchange(&mut device, &[0x11]);
    assert_eq!(exchange(&mut device, &[0x20, 0x00, 0x00])[2], 0x90);
}

#[test]
fn registers_are_written_and_read_in_rows() {
    let mut device = device();
    exchange(&mut device, &[0x11, 0x41, 0x02, 0x85, 0x10, 0xC0]);
    assert_eq!(
        exchange(&mut device, &[0x20, 0x03, 0, 0, 0, 0])[2..],
        [0x90, 0x85, 0x10, 0xC0]
    );
    assert_eq!(device.rate_hz(), 1000);
    // Reset values by the register map.
    exchange(&mut device, &[0x06, 0x11]);
    assert_eq!(
        exchange(&mut device, &[0x20, 0x03, 0, 0, 0, 0])[2..],
        [0x90, 0x06, 0x40, 0x40]
    );
    assert_eq!(device.rate_hz(), 250);
}

#[test]
fn a_conversion_pulls_ready_down_and_the_first_clock_puts_it_up() {
    let mut device = device();
    exchange(&mut device, &[0x11, 0x41, 0x00, 0x85, 0x10, 0x08]);
    let first = device.deadline().unwrap();
    assert_eq!(first, 4 * 64_000);
    device.fire(first);
    assert!(!device.ready_level());
    let frame = exchange(&mut device, &[0; 15]);
    assert_eq!(
        frame,
        [0xC0, 0, 0, 0, 0, 1, 0x7F, 0xFF, 0xFF, 0x80, 0, 0, 0, 0, 0]
    );
    assert!(device.ready_level());
    let second = device.deadline().unwrap();
    assert_eq!(second - first, 64_000);
    device.fire(second);
    assert_eq!(exchange(&mut device, &[0; 6])[3..], [0xFF, 0xFF, 0xFE]);
}

#[test]
fn an_unread_conversion_makes_a_new_edge_all_the_same() {
    let mut device = device();
    exchange(&mut device, &[0x08]);
    let first = device.deadline().unwrap();
    device.fire(first);
    let rises = device.deadline().unwrap();
    device.fire(rises);
    assert!(device.ready_level());
    let falls = device.deadline().unwrap();
    assert_eq!((falls - rises, falls - first), (READY_HIGH_CYCLES, 256_000));
    device.fire(falls);
    assert!(!device.ready_level());
}

#[test]
fn faults_are_made_as_asked() {
    let mut device = device();
    exchange(&mut device, &[0x11, 0x4F, 0x01, 0x0F, 0x0F, 0x10, 0x08]);
    device.lead_off = [0b0010, 0b1001];
    device.missed_edges = vec![1];
    let first = device.deadline().unwrap();
    device.fire(first);
    // Status: 1100, eight positive, eight negative inputs, four pins.
    assert_eq!(exchange(&mut device, &[0; 3]), [0xC0, 0x20, 0x90]);
    let second = device.deadline().unwrap();
    device.fire(second);
    assert!(device.ready_level());
    device.dead = Some(true);
    assert_eq!(exchange(&mut device, &[0; 2]), [0xFF, 0xFF]);
}

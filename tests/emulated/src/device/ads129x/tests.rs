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

/// One that converts continuously, 1000 times a second.
fn running() -> Ads129x {
    let mut device = device();
    exchange(&mut device, &[0x11, 0x41, 0x00, 0x85, 0x10, 0x08]);
    device
}

/// Runs until the next conversion.
fn convert(device: &mut Ads129x) {
    let before = device.converted.len();
    while device.converted.len() == before {
        let at = device.deadline().unwrap();
        device.fire(at);
    }
}

#[test]
fn conversions_are_recorded_with_their_cycle_and_counts() {
    let mut device = running();
    for _ in 0..3 {
        convert(&mut device);
    }
    let first = 4 * 64_000;
    let counts = |first: i32| [first, 0x7F_FFFF, -0x80_0000, 0, 0, 0, 0, 0];
    let expected = [(first, 1), (first + 64_000, -2), (first + 128_000, 1)];
    assert_eq!(
        device.converted,
        expected.map(|(at, count)| Conversion {
            at,
            counts: counts(count)
        })
    );
}

#[test]
fn lost_edges_lose_no_conversion() {
    let mut device = running();
    device.missed_edges = (1..4).collect();
    let levels: Vec<bool> = (0..5)
        .map(|_| {
            convert(&mut device);
            device.ready_level()
        })
        .collect();
    assert_eq!(levels, [false, true, true, true, false]);
    assert_eq!(device.converted.len(), 5);
    // The fifth is the first signal's first again.
    assert_eq!(exchange(&mut device, &[0; 6])[3..], [0, 0, 1]);
}

#[test]
fn a_held_ready_line_does_not_move() {
    for level in [false, true] {
        let mut device = running();
        device.stuck_ready = Some(level);
        for _ in 0..3 {
            convert(&mut device);
            assert_eq!(device.ready_level(), level);
            exchange(&mut device, &[0; 15]);
            assert_eq!(device.ready_level(), level);
        }
    }
}

#[test]
fn a_slip_shifts_one_frame_by_its_bits() {
    let mut device = running();
    device.slipped = vec![(1, 1), (2, 9)];
    convert(&mut device);
    assert_eq!(exchange(&mut device, &[0; 3]), [0xC0, 0, 0]);
    device.pins(false, true, false, 0);
    device.pins(false, true, true, 0);
    convert(&mut device);
    // 0xC00000 FFFFFE 7FFFFF 800000, by one bit: the header is 1000, no longer 1100.
    assert_eq!(
        exchange(&mut device, &[0; 12]),
        [0x80, 0, 1, 0xFF, 0xFF, 0xFC, 0xFF, 0xFF, 0xFF, 0, 0, 0]
    );
    device.pins(false, true, false, 0);
    device.pins(false, true, true, 0);
    convert(&mut device);
    // 0xC00000 000001 7FFFFF by nine.
    assert_eq!(exchange(&mut device, &[0; 6]), [0, 0, 0, 0, 0x02, 0xFF]);
}

#[test]
fn a_wrong_identity_is_read_alone_and_in_a_row() {
    let mut device = device();
    device.wrong_identity = Some(0xFF);
    exchange(&mut device, &[0x11]);
    assert_eq!(exchange(&mut device, &[0x20, 0, 0])[2], 0xFF);
    assert_eq!(exchange(&mut device, &[0x20, 1, 0, 0])[2..], [0xFF, 0x06]);
    assert_eq!(exchange(&mut device, &[0x21, 0, 0])[2], 0x06);
}

#[test]
fn power_takes_its_registers_and_leaves_its_faults() {
    let mut device = running();
    convert(&mut device);
    device.dead = Some(false);
    device.cycle_power();
    assert_eq!((device.rate_hz(), device.deadline()), (250, None));
    assert_eq!(device.converted.len(), 1);
    assert_eq!(exchange(&mut device, &[0]), [0]);
    assert_eq!(device.dead, Some(false));
}

#[test]
fn conversions_begin_again_after_a_reset_if_start_is_high() {
    let mut device = device();
    device.pins(true, true, true, 0);
    let period = 256_000;
    assert_eq!(device.deadline(), Some(4 * period));
    // By command, at cycle 0; by pin, which holds it as long as it is low.
    exchange(&mut device, &[0x06]);
    assert_eq!(device.deadline(), Some(4 * period));
    device.pins(true, false, true, 500);
    assert_eq!(device.deadline(), None);
    device.pins(true, true, true, 1_000);
    assert_eq!(device.deadline(), Some(1_000 + 4 * period));
}

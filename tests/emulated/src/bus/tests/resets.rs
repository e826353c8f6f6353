use super::*;
use crate::chip::slow_to_cycles;
use crate::device::lsm6dso::Lsm6dso;

const REASONS: u32 = clock::BASE + 0x400;
/// GPREGRET.
const KEPT: u32 = clock::BASE + 0x51C;

#[test]
fn a_watchdog_that_one_handle_does_not_feed_resets_the_chip() {
    let dog = watchdog::BASE;
    let mut bench = Bench::new(World::default());
    // One second; two handles; an interrupt before the reset.
    bench.write(dog + 0x304, 1);
    bench.write(dog + 0x504, 32_767);
    bench.write(dog + 0x508, 0b11);
    bench.write(dog, 1);
    let feed = |bench: &mut Bench, handle: u32| bench.write(dog + 0x600 + 4 * handle, 0x6E52_4635);
    bench.now = 64_000_000 / 2;
    feed(&mut bench, 0);
    feed(&mut bench, 1);
    assert_eq!(bench.bus.next(), Some(64_000_000 * 3 / 2));
    bench.now = 64_000_000;
    feed(&mut bench, 0);
    bench.bus.advance(64_000_000 * 3 / 2, &mut bench.memory);
    assert_eq!(bench.bus.effects.reset, None);
    // Two periods of 32,768 Hz later, 3906.25 cycles.
    assert_eq!(bench.bus.next(), Some(64_000_000 * 3 / 2 + 3907));
    bench.bus.advance(64_000_000 * 2, &mut bench.memory);
    assert_eq!(bench.bus.effects.reset, Some(Reset::Watchdog));
}

/// One that expires after a second, fed by all eight handles.
fn guarded() -> Bench {
    let mut bench = Bench::new(World::default());
    let dog = watchdog::BASE;
    for (register, value) in [(0x504, 32_767), (0x508, 0xFF), (0x000, 1)] {
        bench.write(dog + register, value);
    }
    bench
}

fn feed(bench: &mut Bench, handles: std::ops::Range<u32>) {
    for handle in handles {
        bench.write(watchdog::BASE + 0x600 + 4 * handle, 0x6E52_4635);
    }
}

#[test]
fn without_its_interrupt_a_watchdog_resets_at_once() {
    let mut bench = guarded();
    bench.go_to(slow_to_cycles(32_768) - 1);
    assert_eq!(bench.bus.effects.reset, None);
    bench.go_to(slow_to_cycles(32_768));
    assert_eq!(bench.bus.effects.reset, Some(Reset::Watchdog));
}

#[test]
fn only_all_handles_together_and_the_right_word_reload_a_watchdog() {
    let mut bench = guarded();
    bench.go_to(32_000_000);
    feed(&mut bench, 0..7);
    // REQSTATUS: the eighth is waited for; RUNSTATUS.
    assert_eq!(bench.read(watchdog::BASE + 0x404), 0x80);
    assert_eq!(bench.read(watchdog::BASE + 0x400), 1);
    bench.write(watchdog::BASE + 0x61C, 0x6E52_4636);
    assert_eq!(bench.bus.next(), Some(64_000_000));
    feed(&mut bench, 7..8);
    assert_eq!(bench.bus.next(), Some(96_000_000));
    assert_eq!(bench.read(watchdog::BASE + 0x404), 0xFF);
}

#[test]
fn nothing_stops_or_changes_a_watchdog_that_runs() {
    let mut bench = guarded();
    for (register, value) in [(0x504, 1_000_000), (0x508, 1), (0x50C, 0)] {
        bench.write(watchdog::BASE + register, value);
    }
    assert_eq!(bench.read(watchdog::BASE + 0x504), 32_767);
    assert_eq!(bench.read(watchdog::BASE + 0x508), 0xFF);
    assert_eq!(bench.read(watchdog::BASE + 0x50C), 1);
    // There is no task to stop it.
    assert!(bench.refuses(watchdog::BASE + 0x004, 1));
    for reset in [Reset::Software, Reset::Lockup] {
        bench.reset(reset);
        assert_eq!(bench.bus.next(), Some(64_000_000), "{reset:?}");
    }
    for reset in [Reset::Pin, Reset::Watchdog, Reset::Power] {
        let mut bench = guarded();
        bench.reset(reset);
        assert_eq!(bench.read(watchdog::BASE + 0x400), 0, "{reset:?}");
        assert_eq!(bench.bus.next(), None);
    }
}

#[test]
fn reasons_add_up_until_they_are_cleared_or_power_goes() {
    let mut bench = Bench::new(World::default());
    assert_eq!(bench.read(REASONS), 0);
    bench.reset(Reset::Pin);
    assert_eq!(bench.read(REASONS), 0b0001);
    bench.reset(Reset::Watchdog);
    assert_eq!(bench.read(REASONS), 0b0011);
    bench.reset(Reset::Software);
    bench.reset(Reset::Lockup);
    assert_eq!(bench.read(REASONS), 0b1111);
    // Ones clear.
    bench.write(REASONS, 0b0101);
    assert_eq!(bench.read(REASONS), 0b1010);
    bench.reset(Reset::Power);
    assert_eq!(bench.read(REASONS), 0);
}

#[test]
fn the_retained_register_outlasts_a_reset_by_software_only() {
    let mut bench = Bench::new(World::default());
    bench.write(KEPT, 0xA5);
    bench.reset(Reset::Software);
    assert_eq!(bench.read(KEPT), 0xA5);
    bench.reset(Reset::Watchdog);
    assert_eq!(bench.read(KEPT), 0);
}

#[test]
fn the_processor_asks_for_a_reset_by_the_key_and_the_bit_alone() {
    let mut bench = Bench::new(World::default());
    // AIRCR: without the key, and with it but without SYSRESETREQ.
    for value in [0x0000_0004, 0x05FA_0000] {
        bench.write(system::BASE + 0xD0C, value);
        assert_eq!(bench.bus.effects.reset, None, "{value:#x}");
    }
    // PRIGROUP may be written along.
    bench.write(system::BASE + 0xD0C, 0x05FA_0304);
    assert_eq!(bench.bus.effects.reset, Some(Reset::Software));
}

#[test]
fn a_reset_lets_go_of_pins_and_interrupts() {
    let mut bench = Bench::new(World::default());
    bench.write(gpio::BASE + 0x508, 1 << 5);
    bench.write(gpio::BASE + 0x518, 1 << 5);
    bench.write(system::BASE + 0x100, 1 << 7);
    bench.write(system::BASE + 0x200, 1 << 7);
    assert_eq!(bench.read(gpio::BASE + 0x510), 1 << 5);
    bench.bus.system_mut().enter(7);
    bench.reset(Reset::Software);
    assert_eq!(bench.read(gpio::BASE + 0x510), 0);
    assert_eq!(bench.bus.system().deliverable(), None);
    assert!(!bench.bus.system().in_handler());
}

#[test]
fn noise_is_other_noise_after_a_reset() {
    let mut bench = Bench::new(World::default());
    let mut drawn = Vec::new();
    for _ in 0..3 {
        bench.write(rng::BASE, 1);
        let mut bytes = Vec::new();
        for _ in 0..8 {
            bench.wait(rng::BASE + 0x100);
            bytes.push(bench.read(rng::BASE + 0x508));
        }
        drawn.push(bytes);
        bench.reset(Reset::Software);
    }
    assert!(drawn[0] != drawn[1] && drawn[1] != drawn[2] && drawn[0] != drawn[2]);
}

#[test]
fn devices_lose_their_registers_with_power_only() {
    let mut bench = Bench::new(World {
        imu: Some(Lsm6dso::new(0x6A, [11, 12])),
        ..World::default()
    });
    let rate = |bench: &Bench| bench.bus.world.imu.as_ref().map(|imu| imu.register(0x10));
    if let Some(imu) = &mut bench.bus.world.imu {
        imu.write(&[0x10, 0x58], 0);
    }
    bench.reset(Reset::Watchdog);
    assert_eq!(rate(&bench), Some(0x58));
    bench.reset(Reset::Power);
    assert_eq!(rate(&bench), Some(0));
}

#[test]
fn a_hard_fault_goes_before_everything_and_does_not_nest() {
    let mut system = System::default();
    assert_eq!(system.write(0x100, 1 << 7, 4), Some(()));
    assert_eq!(system.write(0x200, 1 << 7, 4), Some(()));
    assert_eq!(system.deliverable(), Some(7));
    // UNDEFINSTR; exception 3.
    assert_eq!(system.enter_fault(1 << 16), Some(4 * 3));
    assert_eq!((system.deliverable(), system.enter_fault(0)), (None, None));
    assert_eq!(system.read(0xD28, 4), Some(1 << 16));
    assert_eq!(system.read(0xD2C, 4), Some(1 << 30));
    assert_eq!(system.read(0xD04, 4), Some(3));
    system.leave();
    assert_eq!(system.deliverable(), Some(7));
}

use super::*;
use crate::chip::slow_to_cycles;

#[test]
fn a_timer_on_ppi_samples_exactly_every_millisecond() {
    let mut world = World::default();
    world.converter.signals = vec![(1, vec![10, 20, 30])];
    let mut bench = Bench::new(world);
    // SAADC: AIN0, 10 us of acquisition; three results at a time.
    for (register, value) in [
        (0x500, 1),
        (0x510, 1),
        (0x518, 0x2_0000),
        (0x62C, RAM),
        (0x630, 3),
    ] {
        bench.write(saadc::BASE + register, value);
    }
    // TIMER1: 1 MHz, clears itself at 1000; its compare samples, the converter's end starts it again.
    let timer = TIMERS[1].0;
    for (register, value) in [(0x508, 3), (0x510, 4), (0x540, 1000), (0x200, 1)] {
        bench.write(timer + register, value);
    }
    let channels = [
        (timer + 0x140, saadc::BASE + 0x004),
        (saadc::BASE + 0x104, saadc::BASE),
    ];
    for (number, (event, task)) in (0..).zip(channels) {
        bench.write(ppi::BASE + 0x510 + 8 * number, event);
        bench.write(ppi::BASE + 0x514 + 8 * number, task);
    }
    bench.write(ppi::BASE + 0x504, 0b11);
    bench.write(saadc::BASE, 1);
    bench.write(timer, 1);
    let ends: Vec<u64> = (0..4).map(|_| bench.wait(saadc::BASE + 0x104)).collect();
    // 10 us of acquisition and 2 us of conversion behind each third millisecond.
    assert_eq!(ends, [3, 6, 9, 12].map(|ms| (ms * 1000 + 12) * 64));
    assert_eq!(bench.memory.ram[..6], [10, 0, 20, 0, 30, 0]);
    assert_eq!(bench.bus.world.converter.missed, 0);
}

#[test]
fn a_real_time_compare_follows_the_rule_of_two_and_the_counter_overflows() {
    let rtc = COUNTERS[1].0;
    let mut bench = Bench::new(World::default());
    bench.write(rtc + 0x304, 0x1_0002);
    bench.write(rtc, 1);
    // Compare 0 at two periods is the first that is sure to match.
    bench.write(rtc + 0x540, 2);
    assert_eq!(bench.wait(rtc + 0x140), slow_to_cycles(2));
    assert_eq!(bench.read(rtc + 0x504), 2);
    // One period ahead does not match before the counter has gone round: 512 s.
    bench.write(rtc + 0x540, 3);
    assert_eq!(bench.wait(rtc + 0x104), slow_to_cycles(1 << 24));
    assert_eq!(bench.read(rtc + 0x504), 0);
    assert_eq!(bench.wait(rtc + 0x140), slow_to_cycles((1 << 24) + 3));
}

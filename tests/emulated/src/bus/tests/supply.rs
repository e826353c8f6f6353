use super::*;
use crate::world::Supply;

/// One conversion of an input, as embassy's one-shot `sample` does it: START and SAMPLE, END, STOP.
fn sample(bench: &mut Bench, input: u32, configuration: u32, resolution: u32) -> (i16, u64) {
    let settings = [
        (0x500, 1),
        (0x5F0, resolution),
        (0x510, input),
        (0x518, configuration),
        (0x62C, RAM),
        (0x630, 1),
        (0x000, 1),
        (0x004, 1),
    ];
    for (register, value) in settings {
        bench.write(saadc::BASE + register, value);
    }
    let started = bench.now;
    let ended = bench.wait(saadc::BASE + 0x104);
    assert_eq!(bench.read(saadc::BASE + 0x634), 1, "RESULT.AMOUNT");
    bench.write(saadc::BASE + 0x008, 1);
    bench.wait(saadc::BASE + 0x114);
    let count = i16::from_le_bytes([bench.memory.ram[0], bench.memory.ram[1]]);
    (count, ended - started)
}

/// GAIN and TACQ of CONFIG: 10 us, single-ended, internal reference of 0.6 V.
const fn gain(code: u32) -> u32 {
    code << 8 | 2 << 16
}

const VDD: u32 = 9;
const VDDH_BY_5: u32 = 13;

#[test]
fn supplies_are_measured_by_the_specification_s_formula() {
    let mut bench = Bench::new(World::default());
    bench.bus.world.converter.supply = Supply {
        vdd_mv: 3000,
        vddh_mv: 3700,
    };
    // Gain 1/6: 3.0 / 6 / 0.6 of 2^12 = 3413.3.
    assert_eq!(
        sample(&mut bench, VDD, gain(0), 2),
        (3413, (10 + 2) * 64),
        "12 us"
    );
    // Gain 1/2: 0.74 / 2 / 0.6 of 2^12 = 2525.9, of 2^10 = 631.5.
    assert_eq!(sample(&mut bench, VDDH_BY_5, gain(4), 2).0, 2525);
    assert_eq!(sample(&mut bench, VDDH_BY_5, gain(4), 1).0, 631);
    // Of 2^14, gain 1/6: 0.74 / 6 / 0.6 = 3367.8.
    assert_eq!(sample(&mut bench, VDDH_BY_5, gain(0), 3).0, 3367);
    // A quarter of VDD as reference, gain 1/4: VDD is the whole range, which ends at 4095.
    assert_eq!(sample(&mut bench, VDD, gain(2) | 1 << 12, 2).0, 4095);
    // Beyond the range: 3.0 / 2 / 0.6.
    assert_eq!(sample(&mut bench, VDD, gain(4), 2).0, 4095);
}

#[test]
fn an_average_in_a_burst_is_one_result_and_takes_its_time() {
    let mut bench = Bench::new(World::default());
    // OVERSAMPLE 3: eight samples; BURST.
    bench.write(saadc::BASE + 0x5F4, 3);
    let (count, cycles) = sample(&mut bench, VDD, gain(0) | 1 << 24, 2);
    assert_eq!((count, cycles), (3413, 8 * 12 * 64));
}

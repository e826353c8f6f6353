use super::*;
use crate::device::{
    ads129x::{Ads129x, Wires},
    lsm6dso::Lsm6dso,
};

const ADS: Wires = Wires {
    bus: [31, 30, 29],
    select: 28,
    ready: 27,
    start: None,
    reset: None,
};
const IMU_WIRES: [u32; 2] = [11, 12];

#[test]
fn a_converter_on_spi_is_read_when_it_says_that_it_is_ready() {
    let world = World {
        ads: Some(Ads129x::new(ADS, vec![vec![5], vec![-5], vec![], vec![]])),
        ..World::default()
    };
    let mut bench = Bench::new(world);
    let spim = spim::BASE;
    let wires = [(0x508, 31), (0x50C, 30), (0x510, 29)];
    // 8 MHz, mode 1.
    let settings = [(0x524, 0x8000_0000), (0x554, 0b010), (0x500, 7)];
    for (register, value) in wires.into_iter().chain(settings) {
        bench.write(spim + register, value);
    }
    let gpio = gpio::BASE;
    bench.write(gpio + 0x508, 1 << 28);
    bench.write(gpio + 0x518, 1 << 28);
    // GPIOTE channel 0: falling edge of the ready line.
    bench.write(gpiote::BASE + 0x510, 1 | 27 << 8 | 2 << 16);
    let exchange = |bench: &mut Bench, sent: &[u8], received: u32| {
        bench.memory.ram[..sent.len()].copy_from_slice(sent);
        bench.write(gpio + 0x50C, 1 << 28);
        let transfer = [
            (0x544, RAM),
            (0x548, sent.len() as u32),
            (0x534, RAM + 64),
            (0x538, received),
            (0x010, 1),
        ];
        for (register, value) in transfer {
            bench.write(spim + register, value);
        }
        let started = bench.now;
        let ended = bench.wait(spim + 0x118);
        bench.write(gpio + 0x508, 1 << 28);
        (
            ended - started,
            bench.memory.ram[64..64 + received as usize].to_vec(),
        )
    };
    // SDATAC; 1 kHz; START: bytes at 8 MHz take 64 cycles each.
    let (cycles, _) = exchange(&mut bench, &[0x11, 0x41, 0x00, 0x85, 0x10, 0x08], 0);
    assert_eq!(cycles, 6 * 64);
    let first = bench.wait(gpiote::BASE + 0x100);
    let (_, frame) = exchange(&mut bench, &[], 15);
    assert_eq!(
        frame,
        [0xC0, 0, 0, 0, 0, 5, 0xFF, 0xFF, 0xFB, 0, 0, 0, 0, 0, 0]
    );
    let second = bench.wait(gpiote::BASE + 0x100);
    assert_eq!(second - first, 64_000);
}

#[test]
fn a_motion_sensor_on_i2c_answers_at_its_address_only() {
    let mut imu = Lsm6dso::new(0x6A, IMU_WIRES);
    imu.measure([1, -2, 3, 4, 5, 16_384]);
    let mut bench = Bench::new(World {
        imu: Some(imu),
        ..World::default()
    });
    let twim = twim::BASE;
    let settings = [
        (0x508, 11),
        (0x50C, 12),
        (0x524, 0x0640_0000),
        (0x500, 6),
        (0x588, 0x6A),
    ];
    for (register, value) in settings {
        bench.write(twim + register, value);
    }
    // CTRL1_XL and CTRL2_G: 208 Hz; then one measurement's time.
    bench.memory.ram[..3].copy_from_slice(&[0x10, 0x58, 0x58]);
    for (register, value) in [(0x544, RAM), (0x548, 3), (0x200, 1 << 9), (0x008, 1)] {
        bench.write(twim + register, value);
    }
    bench.wait(twim + 0x104);
    bench.go_to(bench.now + 64_000_000 / 207);
    // Write the register's number, read twelve bytes, stop.
    bench.memory.ram[0] = 0x22;
    let transfer = [
        (0x544, RAM),
        (0x548, 1),
        (0x534, RAM + 16),
        (0x538, 12),
        (0x200, 1 << 7 | 1 << 12),
        (0x008, 1),
    ];
    for (register, value) in transfer {
        bench.write(twim + register, value);
    }
    bench.wait(twim + 0x104);
    let expected: Vec<u8> = [1_i16, -2, 3, 4, 5, 16_384]
        .into_iter()
        .flat_map(i16::to_le_bytes)
        .collect();
    assert_eq!(bench.memory.ram[16..28], expected);
    bench.write(twim + 0x588, 0x6B);
    bench.write(twim + 0x008, 1);
    bench.wait(twim + 0x124);
    assert_eq!(bench.read(twim + 0x4C4), 0b10);
    bench.write(twim + 0x4C4, 0b10);
    assert_eq!(bench.read(twim + 0x4C4), 0);
}

#[test]
fn a_receiver_without_a_buffer_overruns_behind_its_fifo() {
    let mut bench = Bench::new(World::default());
    let port = uarte::BASE;
    // 1 Mbaud.
    bench.write(port + 0x524, 0x1000_0000);
    bench.bus.send(&[1, 2, 3, 4, 5], 0, &mut bench.memory);
    assert_eq!(bench.wait(port + 0x124), 5 * 640);
    assert_eq!(bench.read(port + 0x480), 1);
    bench.write(port + 0x534, RAM);
    bench.write(port + 0x538, 4);
    bench.write(port, 1);
    bench.wait(port + 0x110);
    assert_eq!(bench.memory.ram[..4], [1, 2, 3, 4]);
}

/// A controller that is set up, with a motion sensor on its wires.
fn on_i2c(imu: Lsm6dso) -> Bench {
    let mut bench = Bench::new(World {
        imu: Some(imu),
        ..World::default()
    });
    let settings = [(0x508, 11), (0x50C, 12), (0x524, 0x0640_0000), (0x500, 6)];
    for (register, value) in settings {
        bench.write(twim::BASE + register, value);
    }
    bench.write(twim::BASE + 0x588, 0x6A);
    // One byte out, then stop.
    for (register, value) in [(0x544, RAM), (0x548, 1), (0x200, 1 << 9), (0x008, 1)] {
        bench.write(twim::BASE + register, value);
    }
    bench
}

#[test]
fn a_motion_sensor_that_is_absent_refuses_its_address() {
    let mut imu = Lsm6dso::new(0x6A, IMU_WIRES);
    imu.absent = true;
    let mut bench = on_i2c(imu);
    bench.wait(twim::BASE + 0x124);
    // ERRORSRC: ANACK.
    assert_eq!(bench.read(twim::BASE + 0x4C4), 0b10);
}

#[test]
fn a_held_clock_lets_nothing_on_the_bus_end_until_it_is_let_go() {
    let mut imu = Lsm6dso::new(0x6A, IMU_WIRES);
    imu.stalls = true;
    let mut bench = on_i2c(imu);
    bench.go_to(64_000_000);
    // A stop does not come through either.
    bench.write(twim::BASE + 0x014, 1);
    bench.go_to(2 * 64_000_000);
    for event in [0x104, 0x124, 0x160] {
        assert_eq!(bench.read(twim::BASE + event), 0);
    }
    if let Some(imu) = &mut bench.bus.world.imu {
        imu.stalls = false;
    }
    bench.wait(twim::BASE + 0x104);
    assert!(bench.now < 2 * 64_000_000 + 64_000);
}

#[test]
fn a_data_ready_edge_is_dated_by_a_timer_without_the_processor() {
    let wires = Wires {
        start: Some(26),
        ..ADS
    };
    let world = World {
        ads: Some(Ads129x::new(wires, vec![vec![1]; 4])),
        ..World::default()
    };
    let mut bench = Bench::new(world);
    // GPIOTE channel 0: falling edge of P0.27; PPI channel 0 captures TIMER1, 1 MHz and 32 bits, in register 0.
    let timer = TIMERS[1].0;
    let settings = [
        (gpiote::BASE + 0x510, 1 | 27 << 8 | 2 << 16),
        (ppi::BASE + 0x510, gpiote::BASE + 0x100),
        (ppi::BASE + 0x514, timer + 0x040),
        (ppi::BASE + 0x504, 1),
        (timer + 0x508, 3),
        (timer + 0x510, 4),
        (timer, 1),
    ];
    for (register, value) in settings {
        bench.write(register, value);
    }
    // START goes high.
    bench.write(gpio::BASE + 0x508, 1 << 26);
    bench.write(gpio::BASE + 0x518, 1 << 26);
    let mut dates = Vec::new();
    for _ in 0..3 {
        bench.wait(gpiote::BASE + 0x100);
        dates.push(bench.read(timer + 0x540));
    }
    // 250 Hz after reset; the first after four periods.
    assert_eq!(dates, [16_000, 20_000, 24_000]);
}

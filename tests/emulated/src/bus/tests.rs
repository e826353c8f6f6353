use super::*;
use crate::chip::slow_to_cycles;
use crate::device::{
    ads129x::{Ads129x, Wires},
    lsm6dso::Lsm6dso,
};

const RAM: u32 = 0x2000_0000;
const ADS: Wires = Wires {
    bus: [31, 30, 29],
    select: 28,
    ready: 27,
    start: None,
    reset: None,
};
const IMU_WIRES: [u32; 2] = [11, 12];

struct Ram(Vec<u8>);

impl Ram {
    fn slice(&mut self, address: u32, length: usize) -> Result<&mut [u8], MachineError> {
        let outside = MachineError::DmaOutsideRam { address, length };
        let at = address.checked_sub(RAM).ok_or(outside.clone())? as usize;
        self.0.get_mut(at..at + length).ok_or(outside)
    }
}

impl Memory for Ram {
    fn load(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        bytes.copy_from_slice(self.slice(address, bytes.len())?);
        Ok(())
    }

    fn store(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        self.slice(address, bytes.len())?.copy_from_slice(bytes);
        Ok(())
    }

    fn erase(&mut self, _: u32, _: usize) -> Result<(), MachineError> {
        Ok(())
    }

    fn open_flash(&mut self, _: bool) -> Result<(), MachineError> {
        Ok(())
    }
}

/// The chip without its processor.
struct Bench {
    bus: Bus,
    ram: Ram,
    now: u64,
}

impl Bench {
    fn new(world: World) -> Self {
        Self {
            bus: Bus::new(world, None),
            ram: Ram(vec![0; 4096]),
            now: 0,
        }
    }

    fn write(&mut self, address: u32, value: u32) {
        self.bus.write(address, value, 4, self.now, &mut self.ram);
        assert_eq!(self.bus.effects.fault, None);
    }

    fn read(&mut self, address: u32) -> u32 {
        let value = self.bus.read(address, 4, self.now, &mut self.ram);
        assert_eq!(self.bus.effects.fault, None);
        value
    }

    /// Runs until an event register reads 1, and clears it; gives the cycle.
    fn wait(&mut self, event: u32) -> u64 {
        while self.read(event) == 0 {
            self.now = self.bus.next().expect("something is under way");
            self.bus.advance(self.now, &mut self.ram);
            assert_eq!(self.bus.effects.reset, None);
        }
        self.write(event, 0);
        self.now
    }
}

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
    assert_eq!(bench.ram.0[..6], [10, 0, 20, 0, 30, 0]);
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

#[test]
fn a_watchdog_that_one_handle_does_not_feed_resets_the_chip() {
    let dog = watchdog::BASE;
    let mut bench = Bench::new(World::default());
    // One second; two handles.
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
    bench.bus.advance(64_000_000 * 3 / 2, &mut bench.ram);
    assert_eq!(bench.bus.effects.reset, None);
    // Two periods of 32,768 Hz later, 3906.25 cycles.
    assert_eq!(bench.bus.next(), Some(64_000_000 * 3 / 2 + 3907));
    bench.bus.advance(64_000_000 * 2, &mut bench.ram);
    assert_eq!(bench.bus.effects.reset, Some(Reset::Watchdog));
}

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
        bench.ram.0[..sent.len()].copy_from_slice(sent);
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
            bench.ram.0[64..64 + received as usize].to_vec(),
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
    // Write the register's number, read twelve bytes, stop.
    bench.ram.0[0] = 0x22;
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
    assert_eq!(bench.ram.0[16..28], expected);
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
    bench.bus.send(&[1, 2, 3, 4, 5], 0, &mut bench.ram);
    assert_eq!(bench.wait(port + 0x124), 5 * 640);
    assert_eq!(bench.read(port + 0x480), 1);
    bench.write(port + 0x534, RAM);
    bench.write(port + 0x538, 4);
    bench.write(port, 1);
    bench.wait(port + 0x110);
    assert_eq!(bench.ram.0[..4], [1, 2, 3, 4]);
}

#[test]
fn interrupts_are_served_by_priority_and_not_twice() {
    let mut bench = Bench::new(World::default());
    let system = system::BASE;
    bench.write(system + 0x100, 1 << 7 | 1 << 21);
    bench.bus.write(system + 0x407, 0x60, 1, 0, &mut bench.ram);
    bench.bus.write(system + 0x415, 0xC0, 1, 0, &mut bench.ram);
    bench.write(system + 0x200, 1 << 21);
    assert_eq!(bench.bus.system().deliverable(), Some(21));
    assert_eq!(bench.bus.system_mut().enter(21), 4 * (16 + 21));
    assert_eq!(bench.bus.system().deliverable(), None);
    // The more urgent one interrupts it; the other way round it waits.
    bench.write(system + 0x200, 1 << 7 | 1 << 21);
    assert_eq!(bench.bus.system().deliverable(), Some(7));
    bench.bus.system_mut().enter(7);
    assert_eq!(bench.bus.system().deliverable(), None);
    bench.bus.system_mut().leave();
    bench.bus.system_mut().leave();
    assert_eq!(bench.bus.system().deliverable(), Some(21));
}

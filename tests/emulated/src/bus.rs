//! All peripherals together: addresses, interrupt numbers, and what follows from what.

use crate::chip::{
    Around, Effects, Memory, Peripheral, Reset,
    clock::{self, Clock},
    gpio::{self, Gpio},
    gpiote::{self, Gpiote},
    information::{FACTORY, Factory, TEMPERATURE, Temperature, USER, User},
    nvmc::{self, Nvmc},
    ppi::{self, Ppi},
    rng::{self, Rng},
    rtc::Rtc,
    saadc::{self, Saadc},
    spim::{self, Spim},
    timer::Timer,
    twim::{self, Twim},
    uarte::{self, Uarte},
    watchdog::{self, Watchdog},
};
use crate::error::{Access, MachineError};
use crate::system::{self, System};
use crate::world::World;

/// Addresses of the timers and counters (PS 4.2, "Instantiation"), and their interrupts.
const TIMERS: [(u32, u32); 5] = [
    (0x4000_8000, 8),
    (0x4000_9000, 9),
    (0x4000_A000, 10),
    (0x4001_A000, 26),
    (0x4001_B000, 27),
];
const COUNTERS: [(u32, u32); 3] = [(0x4000_B000, 11), (0x4001_1000, 17), (0x4002_4000, 36)];
/// Page of a peripheral.
const PAGE: u32 = 0xFFFF_F000;
/// Not an interrupt.
const NONE: u32 = 63;
/// A chain of events longer than this goes in a circle.
const LONGEST_CHAIN: usize = 1000;

/// The chip around the processor.
pub struct Bus {
    system: System,
    ppi: Ppi,
    gpio: Gpio,
    gpiote: Gpiote,
    uarte: Uarte,
    /// Address, interrupt, model.
    others: Vec<(u32, u32, Box<dyn Peripheral>)>,
    /// What is outside.
    pub world: World,
    /// What the last access or deadline led to; the machine takes it.
    pub effects: Effects,
    next: Option<u64>,
}

impl Bus {
    /// As after a reset for `reset`, or after power came.
    #[must_use]
    pub fn new(world: World, reset: Option<Reset>) -> Self {
        // PS 5.3, register RESETREAS: DOG is bit 1, SREQ bit 2.
        let reasons = match reset {
            None => 0,
            Some(Reset::Watchdog) => 2,
            Some(Reset::Software) => 4,
        };
        let mut others: Vec<(u32, u32, Box<dyn Peripheral>)> = vec![
            (clock::BASE, 0, Box::new(Clock::new(reasons))),
            (twim::BASE, 3, Box::new(Twim::default())),
            (spim::BASE, 47, Box::new(Spim::default())),
            (saadc::BASE, 7, Box::new(Saadc::default())),
            (TEMPERATURE, 12, Box::new(Temperature::default())),
            (rng::BASE, 13, Box::new(Rng::new(world.seed))),
            (watchdog::BASE, 16, Box::new(Watchdog::default())),
            (nvmc::BASE, NONE, Box::new(Nvmc::default())),
            (FACTORY, NONE, Box::new(Factory::new(world.seed))),
            (USER, NONE, Box::new(User::default())),
        ];
        for (base, interrupt) in TIMERS {
            others.push((base, interrupt, Box::new(Timer::new(base))));
        }
        for (base, interrupt) in COUNTERS {
            others.push((base, interrupt, Box::new(Rtc::new(base))));
        }
        Self {
            system: System::default(),
            ppi: Ppi::default(),
            gpio: Gpio::default(),
            gpiote: Gpiote::default(),
            uarte: Uarte::default(),
            others,
            world,
            effects: Effects::default(),
            next: None,
        }
    }

    /// Cycle of the next thing that happens by itself.
    #[must_use]
    pub fn next(&self) -> Option<u64> {
        self.next
    }

    /// The interrupt controller.
    #[must_use]
    pub fn system(&self) -> &System {
        &self.system
    }

    /// The interrupt controller, to enter and leave exceptions.
    pub fn system_mut(&mut self) -> &mut System {
        &mut self.system
    }

    /// The model at an address, with what it may touch.
    fn at<'a>(
        &'a mut self,
        address: u32,
        memory: &'a mut dyn Memory,
    ) -> Option<(&'a mut dyn Peripheral, Around<'a>)> {
        let around = Around {
            memory,
            world: &mut self.world,
            effects: &mut self.effects,
        };
        let peripheral: &mut dyn Peripheral = match address & PAGE {
            ppi::BASE => &mut self.ppi,
            gpio::BASE => &mut self.gpio,
            gpiote::BASE => &mut self.gpiote,
            uarte::BASE => &mut self.uarte,
            page => {
                let (.., found) = self.others.iter_mut().find(|(base, ..)| *base == page)?;
                found.as_mut()
            }
        };
        Some((peripheral, around))
    }

    /// A load by the processor.
    pub fn read(&mut self, address: u32, size: usize, now: u64, memory: &mut dyn Memory) -> u32 {
        let offset = address & !PAGE;
        let value = if address & PAGE == system::BASE {
            self.system.read(offset, size)
        } else if let Some((peripheral, mut around)) = self.at(address, memory) {
            peripheral.read(offset, now, &mut around)
        } else {
            None
        };
        if value.is_none() {
            self.unmodelled(Access::Read, address);
        }
        value.unwrap_or_default()
    }

    /// A store by the processor.
    pub fn write(
        &mut self,
        address: u32,
        value: u32,
        size: usize,
        now: u64,
        memory: &mut dyn Memory,
    ) {
        if address & PAGE == system::BASE {
            if self.system.write(address & !PAGE, value, size).is_none() {
                self.unmodelled(Access::Write(value), address);
            }
            if self.system.reset_requested {
                self.effects.reset = Some(Reset::Software);
            }
            return;
        }
        self.store(Access::Write(value), address, value, now, memory);
        self.settle(now, memory);
    }

    fn store(
        &mut self,
        access: Access,
        address: u32,
        value: u32,
        now: u64,
        memory: &mut dyn Memory,
    ) {
        let done = self
            .at(address, memory)
            .and_then(|(peripheral, mut around)| {
                peripheral.write(address & !PAGE, value, now, &mut around)
            });
        if done.is_none() {
            self.unmodelled(access, address);
        }
        if matches!(address & PAGE, gpio::BASE | gpiote::BASE) {
            self.pins_changed(now, memory);
        }
    }

    /// Lets every event that has been raised trigger what PPI connects it to, and looks at what comes next.
    fn settle(&mut self, now: u64, memory: &mut dyn Memory) {
        let mut done = 0;
        while let Some(event) = self.effects.raised.get(done).copied() {
            done += 1;
            let tasks: Vec<u32> = self.ppi.tasks(event).collect();
            for task in tasks {
                self.store(Access::Task, task, 1, now, memory);
            }
            if done > LONGEST_CHAIN {
                self.unmodelled(Access::Task, event);
                break;
            }
        }
        self.effects.raised.clear();
        let common = [
            (6, self.gpiote.line(), self.gpiote.deadline()),
            (2, self.uarte.line(), self.uarte.deadline()),
        ];
        let others = self.others.iter().map(|(_, interrupt, peripheral)| {
            (*interrupt, peripheral.line(), peripheral.deadline())
        });
        let (mut lines, mut next) = (0, None::<u64>);
        for (interrupt, line, deadline) in others.chain(common) {
            lines |= u64::from(line) << interrupt;
            next = [next, deadline].into_iter().flatten().min();
        }
        self.system.lines = lines;
        self.next = [next, self.world.deadline()].into_iter().flatten().min();
    }

    /// Lets happen everything that is due up to and at `now`, each at its own time.
    pub fn advance(&mut self, now: u64, memory: &mut dyn Memory) {
        while let Some(at) = self.next.filter(|at| *at <= now) {
            let Self {
                uarte,
                others,
                world,
                effects,
                ..
            } = self;
            let mut around = Around {
                memory: &mut *memory,
                world,
                effects,
            };
            let models = others
                .iter_mut()
                .map(|(.., peripheral)| peripheral.as_mut());
            for peripheral in models.chain([uarte as &mut dyn Peripheral]) {
                if peripheral.deadline() == Some(at) {
                    peripheral.fire(at, &mut around);
                }
            }
            if self.world.deadline() == Some(at) {
                self.world.fire(at);
            }
            // Devices change pins when their time has come, and when they are spoken to.
            if self.world.has_devices() {
                self.pins_changed(at, memory);
            }
            self.settle(at, memory);
            if self.effects.reset.is_some() || self.effects.fault.is_some() {
                return;
            }
        }
    }

    fn pins_changed(&mut self, now: u64, memory: &mut dyn Memory) {
        let mut around = Around {
            memory,
            world: &mut self.world,
            effects: &mut self.effects,
        };
        self.gpio.settle(now, &mut around);
        self.gpiote.look(&mut around);
    }

    /// The world drives a pin.
    pub fn set_pin(&mut self, pin: u32, high: bool, now: u64, memory: &mut dyn Memory) {
        self.world.pins.set(pin, high);
        self.pins_changed(now, memory);
        self.settle(now, memory);
    }

    /// The host sends bytes on the serial line, from now on.
    pub fn send(&mut self, bytes: &[u8], now: u64, memory: &mut dyn Memory) {
        self.world.serial.to_send.extend(bytes);
        self.uarte.line_taken(now);
        self.settle(now, memory);
    }

    fn unmodelled(&mut self, access: Access, address: u32) {
        let fault = MachineError::Unmodelled {
            access,
            address,
            pc: 0,
            function: String::new(),
        };
        self.effects.fault.get_or_insert(fault);
    }
}

#[cfg(test)]
mod tests;

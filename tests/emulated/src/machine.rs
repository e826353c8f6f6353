//! The processor, its clock, and the loop that brings interrupts to it.

mod damage;
mod hooks;
mod memory;
mod processor;
mod state;

use unicorn_engine::{Arch, ArmCpuModel, Mode, RegisterARM, Unicorn, uc_error};

pub use damage::Damage;
pub(crate) use state::Engine;

use crate::bus::Bus;
use crate::chip::{CYCLES_PER_US, Memory, Reset};
use crate::error::MachineError;
use crate::flash::{Flash, Operation, PAGE_BYTES};
use crate::image::{FLASH_BYTES, Image};
use crate::log::Log;
use crate::world::World;
use state::{State, engine_error, with_bus};

/// CPACR-independent switch of the emulator: FPEXC.EN.
const FLOATS_ON: u64 = 1 << 30;
/// How often the log's ring is emptied.
const LOG_CYCLES: u64 = 1000 * CYCLES_PER_US;

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The time is over.
    Time,
    /// The chip was reset; the next run goes on from the reset vector.
    Reset(Reset),
}

/// The chip with its image.
pub struct Machine {
    engine: Engine<'static>,
    image: Image,
    log: Log,
    log_due: u64,
    pc: u32,
    asleep: bool,
    serves_faults: bool,
    /// Bytes of the image that were damaged, by address, as they were.
    damaged: Vec<(u32, Vec<u8>)>,
    resets: Vec<(u64, Reset)>,
}

impl Machine {
    /// The chip as after power came, with the image in its flash and `world` around it.
    ///
    /// # Errors
    /// The emulator's own, and an image without a log.
    pub fn new(image: Image, world: World) -> Result<Self, MachineError> {
        let seed = world.seed;
        let log = Log::new(&image)?;
        let state = State::new(Bus::new(world), &image.flash, seed);
        let mut engine = Unicorn::new_with_data(Arch::ARM, Mode::THUMB | Mode::MCLASS, state)
            .map_err(engine_error)?;
        let mapped = engine
            .ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)
            .and_then(|()| memory::map(&mut engine, &image.flash, seed))
            .and_then(|()| hooks::set(&mut engine, &image));
        mapped.map_err(engine_error)?;
        let mut machine = Self {
            engine,
            image,
            log,
            log_due: 0,
            pc: 0,
            asleep: false,
            serves_faults: false,
            damaged: Vec::new(),
            resets: Vec::new(),
        };
        machine.start().map_err(engine_error)?;
        Ok(machine)
    }

    /// Stack pointer and program counter from the vector table.
    fn start(&mut self) -> Result<(), uc_error> {
        let stack = self.image.word(0).unwrap_or_default();
        self.engine.reg_write(RegisterARM::SP, u64::from(stack))?;
        self.engine.reg_write(RegisterARM::FPEXC, FLOATS_ON)?;
        self.engine.reg_write(RegisterARM::PRIMASK, 0)?;
        // Thumb state, and no IT block that the reset came into.
        self.engine.reg_write(RegisterARM::XPSR, 1 << 24)?;
        self.pc = self.image.word(4).unwrap_or_default() & !1;
        self.asleep = false;
        Ok(())
    }

    /// Virtual time since power came, in microseconds.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        self.engine.get_data().cycle / CYCLES_PER_US
    }

    /// Instructions executed so far.
    #[must_use]
    pub fn instructions(&self) -> u64 {
        self.engine.get_data().instructions
    }

    /// Lines that the image has logged.
    #[must_use]
    pub fn log(&self) -> &[String] {
        &self.log.lines
    }

    /// The image.
    #[must_use]
    pub fn image(&self) -> &Image {
        &self.image
    }

    /// What is outside the chip; nothing while a hook has it, which no caller sees.
    #[must_use]
    pub fn world(&self) -> Option<&World> {
        self.engine.get_data().bus.as_ref().map(|bus| &bus.world)
    }

    /// What is outside the chip, to change it between runs.
    pub fn world_mut(&mut self) -> Option<&mut World> {
        self.engine
            .get_data_mut()
            .bus
            .as_mut()
            .map(|bus| &mut bus.world)
    }

    /// The host sends bytes on the serial line, from now on.
    pub fn send(&mut self, bytes: &[u8]) {
        with_bus(&mut self.engine, |bus, cycle, memory| {
            bus.send(bytes, cycle, memory)
        });
    }

    /// The world drives a pin (32 and up are port 1).
    pub fn set_pin(&mut self, pin: u32, high: bool) {
        with_bus(&mut self.engine, |bus, cycle, memory| {
            bus.set_pin(pin, high, cycle, memory)
        });
    }

    /// Breaks the image: it goes on at `address` with these values in its first registers.
    ///
    /// # Errors
    /// The emulator's.
    pub fn jump(&mut self, address: u32, arguments: &[u32]) -> Result<(), MachineError> {
        for (register, value) in [
            RegisterARM::R0,
            RegisterARM::R1,
            RegisterARM::R2,
            RegisterARM::R3,
        ]
        .into_iter()
        .zip(arguments)
        {
            self.engine
                .reg_write(register, u64::from(*value))
                .map_err(engine_error)?;
        }
        self.pc = address & !1;
        self.asleep = false;
        Ok(())
    }

    /// Hard faults reach the image's handler from now on, instead of ending the run with an error.
    pub fn serve_faults(&mut self) {
        self.serves_faults = true;
    }

    /// Makes every instruction take this many cycles from now on, instead of one.
    pub fn slow_down(&mut self, cycles_per_instruction: u64) {
        self.engine.get_data_mut().cycles_per_instruction = cycles_per_instruction.max(1);
    }

    /// Every reset so far: when, in microseconds, and why.
    #[must_use]
    pub fn resets(&self) -> &[(u64, Reset)] {
        &self.resets
    }

    /// Someone presses the reset button.
    ///
    /// # Errors
    /// The emulator's.
    pub fn press_reset(&mut self) -> Result<(), MachineError> {
        self.reset(Reset::Pin)
    }

    /// Power goes and comes back, to the chip and all that is connected to it.
    ///
    /// # Errors
    /// The emulator's.
    pub fn cycle_power(&mut self) -> Result<(), MachineError> {
        self.reset(Reset::Power)
    }

    /// Power will go, and come back, in the middle of an operation on the flash: the first from now on is 0.
    pub fn cut_power_at(&mut self, operation: usize) {
        let flash = &mut self.engine.get_data_mut().flash;
        flash.cut_at = Some(flash.operations.len() + operation);
    }

    /// What was done to the flash so far.
    #[must_use]
    pub fn flash_operations(&self) -> &[Operation] {
        &self.engine.get_data().flash.operations
    }

    /// What the flash holds.
    ///
    /// # Errors
    /// The emulator's.
    pub fn flash(&self) -> Result<Vec<u8>, MachineError> {
        self.bytes(0, FLASH_BYTES)
    }

    /// What flash or RAM holds.
    ///
    /// # Errors
    /// The emulator's, where neither is.
    pub fn bytes(&self, address: u32, length: usize) -> Result<Vec<u8>, MachineError> {
        let mut bytes = vec![0; length];
        let read = self.engine.mem_read(u64::from(address), &mut bytes);
        read.map(|()| bytes).map_err(engine_error)
    }

    /// Takes power, changes what the flash holds, and gives power again: as if other operations had come before.
    ///
    /// # Errors
    /// The emulator's.
    pub fn start_with_flash(&mut self, content: &[u8]) -> Result<(), MachineError> {
        let now = self.flash()?;
        let seed = self.engine.get_data().cycle;
        let pages = now.chunks(PAGE_BYTES).zip(content.chunks(PAGE_BYTES));
        for (number, (_, page)) in pages.enumerate().filter(|(_, (old, new))| old != new) {
            let at = (number * PAGE_BYTES) as u64;
            self.engine.mem_write(at, page).map_err(engine_error)?;
        }
        self.engine.get_data_mut().flash = Flash::new(content, seed);
        self.cycle_power()
    }

    /// Runs until a virtual time since power came first, in microseconds, through whatever resets come.
    ///
    /// # Errors
    /// As [`Self::run_until`].
    pub fn run_through(&mut self, end_us: u64) -> Result<(), MachineError> {
        while self.run_until(end_us)? != Stop::Time {}
        Ok(())
    }

    /// Runs until a virtual time since power came first, in microseconds, or until a reset.
    ///
    /// # Errors
    /// Whatever the image did that it must not; the machine is not to be used afterwards.
    pub fn run_until(&mut self, end_us: u64) -> Result<Stop, MachineError> {
        self.engine.get_data_mut().end = end_us * CYCLES_PER_US;
        let outcome = self.run();
        self.log.collect(&mut self.engine);
        outcome.map_err(|fault| self.explain(fault))
    }

    fn run(&mut self) -> Result<Stop, MachineError> {
        loop {
            with_bus(&mut self.engine, |bus, cycle, memory| {
                bus.advance(cycle, memory)
            });
            let state = self.engine.get_data_mut();
            if let Some(fault) = state.fault.take() {
                match fault {
                    MachineError::Unmodelled { address, .. }
                        if self.serves_faults && memory::is_nothing(address) =>
                    {
                        self.hard_fault(processor::NO_MEMORY)?;
                        continue;
                    }
                    other => return Err(other),
                }
            }
            let (cycle, end, next) = (state.cycle, state.end, state.next());
            if let Some(bus) = &mut state.bus
                && let Some(reset) = bus.effects.reset.take()
            {
                self.reset(reset)?;
                return Ok(Stop::Reset(reset));
            }
            if cycle >= self.log_due {
                self.log_due = cycle + LOG_CYCLES;
                self.log.collect(&mut self.engine);
            }
            if cycle >= end {
                return Ok(Stop::Time);
            }
            if self.interrupted()? {
                continue;
            }
            if self.asleep {
                if next == u64::MAX {
                    return Err(MachineError::AsleepForEver { pc: self.pc });
                }
                self.engine.get_data_mut().cycle = next.max(cycle);
                continue;
            }
            self.execute()?;
        }
    }

    /// Starts the chip again; time goes on.
    fn reset(&mut self, reset: Reset) -> Result<(), MachineError> {
        self.log.collect(&mut self.engine);
        self.log.begin_anew();
        if !reset.spares_ram() {
            self.engine.get_data_mut().flash.restore_power();
        }
        with_bus(&mut self.engine, |bus, cycle, memory| {
            bus.reset(reset, cycle, memory);
            memory.open_flash(false)
        })
        .transpose()?;
        let state = self.engine.get_data_mut();
        state.written.clear();
        state.event = false;
        if !reset.spares_ram() {
            let seed = state.cycle;
            memory::scramble_ram(&mut self.engine, seed).map_err(engine_error)?;
        }
        self.resets.push((self.now_us(), reset));
        self.start().map_err(engine_error)
    }

    /// Says where a fault happened.
    fn explain(&mut self, fault: MachineError) -> MachineError {
        let at = self.pc;
        match fault {
            MachineError::Unmodelled {
                access, address, ..
            } => MachineError::Unmodelled {
                access,
                address,
                pc: at,
                function: self.image.function(at).to_owned(),
            },
            MachineError::Undefined { pc, .. } => MachineError::Undefined {
                pc,
                function: self.image.function(pc).to_owned(),
                log: self.log.lines.last().cloned().unwrap_or_default(),
            },
            other => other,
        }
    }
}

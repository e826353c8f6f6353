//! The processor, its clock, and the loop that brings interrupts to it.

use unicorn_engine::{Arch, ArmCpuModel, HookType, Mode, Prot, RegisterARM, Unicorn, uc_error};

use crate::bus::Bus;
use crate::chip::{CYCLES_PER_US, Memory, Reset, nvmc::WRITE_CYCLES};
use crate::error::MachineError;
use crate::exception;
use crate::image::{FLASH_BYTES, Image};
use crate::instructions::Counts;
use crate::log::Log;
use crate::system;
use crate::world::World;

/// RAM (PS 4.2).
const RAM: std::ops::Range<u32> = 0x2000_0000..0x2004_0000;
const SEV: u16 = 0xBF40;
const WFE: [u8; 2] = [0x20, 0xBF];
const WFI: [u8; 2] = [0x30, 0xBF];
/// CPSR bits of an open IT block.
const IN_IT_BLOCK: u64 = 0x0600_FC00;
/// CPACR-independent switch of the emulator: FPEXC.EN.
const FLOATS_ON: u64 = 1 << 30;
/// How often the log's ring is emptied.
const LOG_CYCLES: u64 = 1000 * CYCLES_PER_US;
/// Offsets in the log's control block (RTT): the first ring's address, size, and places of writer and reader.
const LOG_RING: u32 = 24 + 4;

/// The emulator of the processor.
pub(crate) type Engine<'a> = Unicorn<'a, State>;

/// What the hooks of the emulator see.
pub(crate) struct State {
    /// Taken out while it works on memory through the emulator.
    bus: Option<Box<Bus>>,
    flash: Vec<u8>,
    counts: Counts,
    cycle: u64,
    /// Cycle at which the run is to end.
    end: u64,
    /// Instructions executed.
    instructions: u64,
    cycles_per_instruction: u64,
    /// Event register of the processor.
    event: bool,
    /// Block before which the emulator was stopped.
    stopped_before: Option<u32>,
    fault: Option<MachineError>,
    /// Flash words as they were before the image wrote to them.
    overwritten: Vec<(u32, u32)>,
}

/// Why a run ended.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Stop {
    /// The time is over.
    Time,
    /// The chip was reset; the next run starts from the reset vector, RAM kept.
    Reset(Reset),
}

/// The chip with its image.
pub struct Machine {
    engine: Engine<'static>,
    image: Image,
    log: Log,
    log_block: Option<u32>,
    log_due: u64,
    pc: u32,
    asleep: bool,
}

/// Access to RAM and flash past the processor.
struct Direct<'a, 'b>(&'a mut Engine<'b>);

impl Direct<'_, '_> {
    fn in_ram(address: u32, length: usize) -> Result<u64, MachineError> {
        let inside = RAM.contains(&address) && address as usize + length <= RAM.end as usize;
        inside
            .then_some(u64::from(address))
            .ok_or(MachineError::DmaOutsideRam { address, length })
    }
}

impl Memory for Direct<'_, '_> {
    fn load(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        let at = Self::in_ram(address, bytes.len())?;
        self.0.mem_read(at, bytes).map_err(engine_error)
    }

    fn store(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        let at = Self::in_ram(address, bytes.len())?;
        self.0.mem_write(at, bytes).map_err(engine_error)
    }

    fn erase(&mut self, address: u32, length: usize) -> Result<(), MachineError> {
        let erased = vec![0xFF; length];
        self.0
            .mem_write(u64::from(address), &erased)
            .map_err(engine_error)
    }

    fn open_flash(&mut self, writable: bool) -> Result<(), MachineError> {
        let access = if writable {
            Prot::ALL
        } else {
            Prot::READ | Prot::EXEC
        };
        self.0
            .mem_protect(0, FLASH_BYTES as u64, access)
            .map_err(engine_error)
    }
}

fn engine_error(error: uc_error) -> MachineError {
    MachineError::Engine(format!("{error:?}"))
}

/// Runs `work` on the bus, with the memory; then takes what it led to.
fn with_bus<R>(
    engine: &mut Engine<'_>,
    work: impl FnOnce(&mut Bus, u64, &mut Direct<'_, '_>) -> R,
) -> Option<R> {
    let cycle = engine.get_data().cycle;
    let mut bus = engine.get_data_mut().bus.take()?;
    let result = work(&mut bus, cycle, &mut Direct(engine));
    let stall_cycles = std::mem::take(&mut bus.effects.stall_cycles);
    let fault = bus.effects.fault.take();
    let state = engine.get_data_mut();
    state.cycle += stall_cycles;
    if state.fault.is_none() {
        state.fault = fault;
    }
    state.bus = Some(bus);
    Some(result)
}

impl State {
    fn next(&self) -> u64 {
        let next = self.bus.as_ref().and_then(|bus| bus.next());
        next.unwrap_or(u64::MAX).min(self.end)
    }

    /// Whether the loop has something to do before the next block.
    fn must_stop(&self) -> bool {
        self.fault.is_some()
            || self.cycle >= self.end
            || self.bus.as_ref().is_some_and(|bus| {
                bus.effects.reset.is_some() || bus.system().deliverable().is_some()
            })
    }
}

/// Before each block: lets peripherals act, stops for interrupts, counts.
fn before_block(engine: &mut Engine<'_>, address: u64, size: u32) {
    restore_zeros(engine);
    if engine.get_data().cycle >= engine.get_data().next() {
        with_bus(engine, |bus, cycle, memory| bus.advance(cycle, memory));
    }
    if engine.get_data().must_stop() {
        let open = engine.reg_read(RegisterARM::CPSR).unwrap_or_default() & IN_IT_BLOCK != 0;
        let masked = engine.reg_read(RegisterARM::PRIMASK).unwrap_or_default() & 1 == 1;
        let state = engine.get_data();
        let at_once = state.fault.is_some() || state.cycle >= state.end;
        if !open && (at_once || !masked) {
            engine.get_data_mut().stopped_before = Some(address as u32);
            if let Err(error) = engine.emu_stop() {
                engine.get_data_mut().fault = Some(engine_error(error));
            }
            return;
        }
    }
    let state = engine.get_data_mut();
    let count = state.counts.of(&state.flash, address as u32, size);
    state.cycle += count * state.cycles_per_instruction;
    state.instructions += count;
}

/// Flash bits can be cleared by writing, not set: PS 4.3, "Writing to flash".
fn restore_zeros(engine: &mut Engine<'_>) {
    if engine.get_data().overwritten.is_empty() {
        return;
    }
    for (address, before) in std::mem::take(&mut engine.get_data_mut().overwritten) {
        let mut word = [0; 4];
        let at = u64::from(address);
        let done = engine.mem_read(at, &mut word).and_then(|()| {
            let both = u32::from_le_bytes(word) & before;
            engine.mem_write(at, &both.to_le_bytes())
        });
        engine.get_data_mut().cycle += WRITE_CYCLES;
        if let Err(error) = done {
            engine.get_data_mut().fault = Some(engine_error(error));
        }
    }
}

impl Machine {
    /// The chip as after power came, with the image in its flash and `world` around it.
    ///
    /// # Errors
    /// The emulator's own, and an image without a log.
    pub fn new(image: Image, world: World) -> Result<Self, MachineError> {
        let state = State {
            bus: Some(Box::new(Bus::new(world, None))),
            flash: image.flash.clone(),
            counts: Counts::new(),
            cycle: 0,
            end: 0,
            instructions: 0,
            cycles_per_instruction: 1,
            event: false,
            stopped_before: None,
            fault: None,
            overwritten: Vec::new(),
        };
        let log = Log::new(&image.elf)?;
        let engine = Unicorn::new_with_data(Arch::ARM, Mode::THUMB | Mode::MCLASS, state)
            .map_err(engine_error)?;
        let mut machine = Self {
            log_block: image.symbol("_SEGGER_RTT"),
            engine,
            image,
            log,
            log_due: 0,
            pc: 0,
            asleep: false,
        };
        machine.map().map_err(engine_error)?;
        machine.hook().map_err(engine_error)?;
        machine.start().map_err(engine_error)?;
        Ok(machine)
    }

    fn map(&mut self) -> Result<(), uc_error> {
        let engine = &mut self.engine;
        engine.ctl_set_cpu_model(ArmCpuModel::CORTEX_M4 as i32)?;
        engine.mem_map(0, FLASH_BYTES as u64, Prot::ALL)?;
        engine.mem_write(0, &self.image.flash)?;
        engine.mem_protect(0, FLASH_BYTES as u64, Prot::READ | Prot::EXEC)?;
        engine.mem_map(
            u64::from(RAM.start),
            u64::from(RAM.end - RAM.start),
            Prot::READ | Prot::WRITE,
        )?;
        for (base, size) in [
            (0x1000_0000_u32, 0x2000_u64),
            (0x4000_0000, 0x4_0000),
            (0x5000_0000, 0x1000),
            (system::BASE, 0x1000),
        ] {
            engine.mmio_map(
                u64::from(base),
                size,
                Some(move |engine: &mut Engine<'_>, offset: u64, size: usize| {
                    let address = base + offset as u32;
                    let value = with_bus(engine, |bus, cycle, memory| {
                        bus.advance(cycle, memory);
                        bus.read(address, size, cycle, memory)
                    });
                    stop_on_fault(engine);
                    u64::from(value.unwrap_or_default())
                }),
                Some(
                    move |engine: &mut Engine<'_>, offset: u64, size: usize, value: u64| {
                        let address = base + offset as u32;
                        with_bus(engine, |bus, cycle, memory| {
                            bus.advance(cycle, memory);
                            bus.write(address, value as u32, size, cycle, memory);
                        });
                        stop_on_fault(engine);
                    },
                ),
            )?;
        }
        Ok(())
    }

    fn hook(&mut self) -> Result<(), uc_error> {
        let engine = &mut self.engine;
        engine.add_block_hook(1, 0, before_block)?;
        for address in self.image.halfwords(SEV) {
            let at = u64::from(address);
            engine.add_code_hook(at, at, |engine, _, _| engine.get_data_mut().event = true)?;
        }
        engine.add_mem_hook(
            HookType::MEM_WRITE,
            0,
            FLASH_BYTES as u64 - 1,
            |engine, _, at, _, _| {
                let word_at = at & !3;
                let mut word = [0; 4];
                let read = engine.mem_read(word_at, &mut word).is_ok();
                let before = u32::from_le_bytes(word);
                engine
                    .get_data_mut()
                    .overwritten
                    .push((word_at as u32, before));
                read
            },
        )?;
        engine.add_mem_hook(
            HookType::MEM_UNMAPPED | HookType::MEM_WRITE_PROT,
            1,
            0,
            |engine, kind, address, _, value| {
                use crate::error::Access;
                use unicorn_engine::MemType;
                let access = match kind {
                    MemType::WRITE_UNMAPPED | MemType::WRITE_PROT => Access::Write(value as u32),
                    _ => Access::Read,
                };
                // A fetch from here is an exception's return, which the loop sees.
                if address < u64::from(exception::RETURNS) {
                    engine.get_data_mut().fault = Some(MachineError::Unmodelled {
                        access,
                        address: address as u32,
                        pc: 0,
                        function: String::new(),
                    });
                }
                false
            },
        )?;
        Ok(())
    }

    /// Stack pointer and program counter from the vector table.
    fn start(&mut self) -> Result<(), uc_error> {
        let stack = self.image.word(0).unwrap_or_default();
        self.engine.reg_write(RegisterARM::SP, u64::from(stack))?;
        self.engine.reg_write(RegisterARM::FPEXC, FLOATS_ON)?;
        self.engine.reg_write(RegisterARM::PRIMASK, 0)?;
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

    /// Makes every instruction take this many cycles from now on, instead of one.
    pub fn slow_down(&mut self, cycles_per_instruction: u64) {
        self.engine.get_data_mut().cycles_per_instruction = cycles_per_instruction.max(1);
    }

    /// Runs until a virtual time since power came, in microseconds, or until a reset.
    ///
    /// # Errors
    /// Whatever the image did that it must not; the machine is not to be used afterwards.
    pub fn run_until(&mut self, end_us: u64) -> Result<Stop, MachineError> {
        self.engine.get_data_mut().end = end_us * CYCLES_PER_US;
        let outcome = self.run();
        self.read_log();
        outcome.map_err(|fault| self.explain(fault))
    }

    fn run(&mut self) -> Result<Stop, MachineError> {
        loop {
            with_bus(&mut self.engine, |bus, cycle, memory| {
                bus.advance(cycle, memory)
            });
            let state = self.engine.get_data_mut();
            if let Some(fault) = state.fault.take() {
                return Err(fault);
            }
            let (cycle, end, next) = (state.cycle, state.end, state.next());
            if let Some(bus) = &mut state.bus
                && let Some(reset) = bus.effects.reset.take()
            {
                return self.reset(reset);
            }
            if cycle >= self.log_due {
                self.log_due = cycle + LOG_CYCLES;
                self.read_log();
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

    /// Enters the handler of an interrupt that is due, if none is masked.
    fn interrupted(&mut self) -> Result<bool, MachineError> {
        let masked = self
            .engine
            .reg_read(RegisterARM::PRIMASK)
            .map_err(engine_error)?
            & 1
            == 1;
        let Some(bus) = &mut self.engine.get_data_mut().bus else {
            return Ok(false);
        };
        let Some(interrupt) = bus.system().deliverable() else {
            return Ok(false);
        };
        if masked {
            // A wait for an interrupt ends although it is masked.
            let woken = self.asleep;
            self.asleep = false;
            return Ok(woken);
        }
        let nested = bus.system().in_handler();
        let vector = bus.system_mut().enter(interrupt);
        self.pc =
            exception::enter(&mut self.engine, self.pc, vector, nested).map_err(engine_error)?;
        self.asleep = false;
        self.engine.get_data_mut().event = true;
        Ok(true)
    }

    /// Lets the emulator run until a hook stops it or an instruction needs the loop.
    fn execute(&mut self) -> Result<(), MachineError> {
        self.engine.get_data_mut().stopped_before = None;
        let outcome = self.engine.emu_start(u64::from(self.pc | 1), 0, 0, 0);
        let pc = self
            .engine
            .reg_read(RegisterARM::PC)
            .map_err(engine_error)? as u32
            & !1;
        self.pc = pc;
        let state = self.engine.get_data_mut();
        if state.fault.is_some() {
            return Ok(());
        }
        if let Some(block) = state.stopped_before {
            return if block == pc {
                Ok(())
            } else {
                Err(MachineError::Engine(format!(
                    "stopped before {block:#x} and is at {pc:#x}"
                )))
            };
        }
        if pc >= exception::RETURNS {
            self.pc = exception::leave(&mut self.engine).map_err(engine_error)?;
            let state = self.engine.get_data_mut();
            state.event = true;
            if let Some(bus) = &mut state.bus {
                bus.system_mut().leave();
            }
            return Ok(());
        }
        match (outcome, self.halfword_before(pc)) {
            (_, Some(WFI)) => self.asleep = true,
            (_, Some(WFE)) => {
                let state = self.engine.get_data_mut();
                self.asleep = !std::mem::take(&mut state.event);
            }
            (Err(uc_error::INSN_INVALID | uc_error::EXCEPTION), _) => {
                return Err(MachineError::Undefined {
                    pc,
                    function: String::new(),
                    log: String::new(),
                });
            }
            (Err(error), _) => return Err(MachineError::Engine(format!("{error:?} at {pc:#x}"))),
            (Ok(()), _) => {}
        }
        Ok(())
    }

    fn halfword_before(&self, pc: u32) -> Option<[u8; 2]> {
        let at = pc.checked_sub(2)? as usize;
        self.image
            .flash
            .get(at..)
            .and_then(|bytes| bytes.first_chunk())
            .copied()
    }

    /// Starts the chip anew: peripherals as after a reset, RAM, flash and time kept.
    fn reset(&mut self, reset: Reset) -> Result<Stop, MachineError> {
        let state = self.engine.get_data_mut();
        if let Some(bus) = state.bus.take() {
            state.bus = Some(Box::new(Bus::new(bus.world, Some(reset))));
        }
        self.start().map_err(engine_error)?;
        Ok(Stop::Reset(reset))
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

    /// Takes what waits in the log's ring, as a debugger would.
    fn read_log(&mut self) {
        let Some(block) = self.log_block else {
            return;
        };
        let word = |engine: &Engine<'_>, at: u32| {
            let mut bytes = [0; 4];
            let read = engine.mem_read(u64::from(at), &mut bytes);
            read.map(|()| u32::from_le_bytes(bytes)).unwrap_or_default()
        };
        let ring = block + LOG_RING;
        let [buffer, size, written, read] =
            [0, 4, 8, 12].map(|offset| word(&self.engine, ring + offset));
        if size == 0 || written >= size || read >= size || written == read {
            return;
        }
        let parts = if written > read {
            [read..written, 0..0]
        } else {
            [read..size, 0..written]
        };
        for part in parts {
            let mut bytes = vec![0; part.len()];
            if self
                .engine
                .mem_read(u64::from(buffer + part.start), &mut bytes)
                .is_ok()
            {
                self.log.take(&bytes);
            }
        }
        // A failure shows as the same lines again.
        let _ = self
            .engine
            .mem_write(u64::from(ring + 12), &written.to_le_bytes());
    }
}

/// After an access that led to a fault or a reset nothing more is executed.
fn stop_on_fault(engine: &mut Engine<'_>) {
    let state = engine.get_data();
    let reset = state
        .bus
        .as_ref()
        .is_some_and(|bus| bus.effects.reset.is_some());
    if (reset || state.fault.is_some())
        && let Err(error) = engine.emu_stop()
    {
        engine.get_data_mut().fault = Some(engine_error(error));
    }
}

//! Executing, sleeping, and bringing interrupts to the processor.

use unicorn_engine::{RegisterARM, uc_error};

use super::state::engine_error;
use super::{Machine, MachineError};
use crate::chip::Reset;
use crate::exception;

/// CFSR: UNDEFINSTR; PRECISERR.
const UNDEFINED: u32 = 1 << 16;
pub(super) const NO_MEMORY: u32 = 1 << 9;
const WFE: [u8; 2] = [0x20, 0xBF];
const WFI: [u8; 2] = [0x30, 0xBF];

impl Machine {
    /// Enters the handler of an interrupt that is due, if none is masked.
    pub(super) fn interrupted(&mut self) -> Result<bool, MachineError> {
        let masked = self.engine.reg_read(RegisterARM::PRIMASK);
        let masked = masked.map_err(engine_error)? & 1 == 1;
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
    pub(super) fn execute(&mut self) -> Result<(), MachineError> {
        self.engine.get_data_mut().stopped_before = None;
        let outcome = self.engine.emu_start(u64::from(self.pc | 1), 0, 0, 0);
        let pc = self
            .engine
            .reg_read(RegisterARM::PC)
            .map_err(engine_error)? as u32
            & !1;
        self.pc = pc;
        let state = self.engine.get_data_mut();
        if state.broken_off() {
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
                if self.serves_faults {
                    return self.hard_fault(UNDEFINED);
                }
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

    /// Enters the handler of hard faults; a fault of that handler, or a frame that does not fit on the stack, is a
    /// lockup (Armv7-M architecture reference manual, B1.5.15), which resets the chip.
    pub(super) fn hard_fault(&mut self, cause: u32) -> Result<(), MachineError> {
        let Some(bus) = &mut self.engine.get_data_mut().bus else {
            return Ok(());
        };
        let nested = bus.system().in_handler();
        let vector = bus.system_mut().enter_fault(cause);
        let handler = vector
            .and_then(|vector| exception::enter(&mut self.engine, self.pc, vector, nested).ok());
        match handler {
            Some(pc) => self.pc = pc,
            None => {
                if let Some(bus) = &mut self.engine.get_data_mut().bus {
                    bus.effects.reset = Some(Reset::Lockup);
                }
            }
        }
        self.asleep = false;
        Ok(())
    }

    fn halfword_before(&self, pc: u32) -> Option<[u8; 2]> {
        let at = pc.checked_sub(2)? as usize;
        let code = self.engine.get_data().code.get(at..)?;
        code.first_chunk().copied()
    }
}

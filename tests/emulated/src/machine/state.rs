//! What the hooks of the processor's emulator see.

use unicorn_engine::{Unicorn, uc_error};

use super::memory::Direct;
use crate::bus::Bus;
use crate::chip::Reset;
use crate::error::MachineError;
use crate::flash::Flash;
use crate::instructions::Counts;

/// The emulator of the processor.
pub(crate) type Engine<'a> = Unicorn<'a, State>;

pub(crate) struct State {
    /// Taken out while it works on memory through the emulator.
    pub(super) bus: Option<Box<Bus>>,
    pub(super) flash: Flash,
    /// What is executed: the flash's content when the machine was made, and patches.
    pub(super) code: Vec<u8>,
    pub(super) counts: Counts,
    pub(super) cycle: u64,
    /// Cycle at which the run is to end.
    pub(super) end: u64,
    /// Instructions executed.
    pub(super) instructions: u64,
    pub(super) cycles_per_instruction: u64,
    /// Event register of the processor.
    pub(super) event: bool,
    /// Block before which the emulator was stopped.
    pub(super) stopped_before: Option<u32>,
    pub(super) fault: Option<MachineError>,
    /// Words that the image wrote to flash in this block: address, content before, value.
    pub(super) written: Vec<(u32, u32, u32)>,
}

impl State {
    pub(super) fn new(bus: Bus, content: &[u8], seed: u64) -> Self {
        Self {
            bus: Some(Box::new(bus)),
            flash: Flash::new(content, seed),
            code: content.to_vec(),
            counts: Counts::new(),
            cycle: 0,
            end: 0,
            instructions: 0,
            cycles_per_instruction: 1,
            event: false,
            stopped_before: None,
            fault: None,
            written: Vec::new(),
        }
    }

    /// Cycle of the next thing to do besides executing.
    pub(super) fn next(&self) -> u64 {
        let next = self.bus.as_ref().and_then(|bus| bus.next());
        next.unwrap_or(u64::MAX).min(self.end)
    }

    /// Whether what was executed so far is the last of it.
    pub(super) fn broken_off(&self) -> bool {
        let bus = self.bus.as_ref();
        self.fault.is_some() || bus.is_some_and(|bus| bus.effects.reset.is_some())
    }

    /// Whether an interrupt waits that is more urgent than what runs.
    pub(super) fn interrupted(&self) -> bool {
        let bus = self.bus.as_ref();
        bus.is_some_and(|bus| bus.system().deliverable().is_some())
    }
}

pub(crate) fn engine_error(error: uc_error) -> MachineError {
    MachineError::Engine(format!("{error:?}"))
}

/// Runs `work` on the bus, with the memory; then takes what it led to.
pub(super) fn with_bus<R>(
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
    if state.flash.cut {
        bus.effects.reset = Some(Reset::Power);
    }
    state.bus = Some(bus);
    Some(result)
}

mod buses;
mod flash;
mod resets;
mod supply;
mod time;

use super::*;
use crate::flash::{Flash, Operation};
use crate::image::FLASH_BYTES;

const RAM: u32 = 0x2000_0000;

struct Store {
    ram: Vec<u8>,
    flash: Vec<u8>,
    worn: Flash,
    writable: bool,
}

impl Store {
    fn slice(&mut self, address: u32, length: usize) -> Result<&mut [u8], MachineError> {
        let outside = MachineError::DmaOutsideRam { address, length };
        let at = address.checked_sub(RAM).ok_or(outside.clone())? as usize;
        self.ram.get_mut(at..at + length).ok_or(outside)
    }
}

impl Memory for Store {
    fn load(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), MachineError> {
        bytes.copy_from_slice(self.slice(address, bytes.len())?);
        Ok(())
    }

    fn store(&mut self, address: u32, bytes: &[u8]) -> Result<(), MachineError> {
        self.slice(address, bytes.len())?.copy_from_slice(bytes);
        Ok(())
    }

    fn flash(&mut self, operation: Operation) -> Result<(), MachineError> {
        let (address, length) = operation.extent();
        let bytes = &mut self.flash[address as usize..][..length];
        self.worn.perform(operation, bytes)
    }

    fn open_flash(&mut self, writable: bool) -> Result<(), MachineError> {
        self.writable = writable;
        Ok(())
    }
}

/// The chip without its processor.
struct Bench {
    bus: Bus,
    memory: Store,
    now: u64,
}

impl Bench {
    fn new(world: World) -> Self {
        Self {
            bus: Bus::new(world),
            memory: Store {
                ram: vec![0; 4096],
                flash: vec![0; FLASH_BYTES],
                worn: Flash::new(&[], 1),
                writable: false,
            },
            now: 0,
        }
    }

    fn write(&mut self, address: u32, value: u32) {
        self.bus
            .write(address, value, 4, self.now, &mut self.memory);
        assert_eq!(self.bus.effects.fault, None);
    }

    fn read(&mut self, address: u32) -> u32 {
        let value = self.bus.read(address, 4, self.now, &mut self.memory);
        assert_eq!(self.bus.effects.fault, None);
        value
    }

    /// Whether a store is to a register that no model has, or not allowed now.
    fn refuses(&mut self, address: u32, value: u32) -> bool {
        self.bus
            .write(address, value, 4, self.now, &mut self.memory);
        self.bus.effects.fault.take().is_some()
    }

    fn reset(&mut self, reset: Reset) {
        self.bus.reset(reset, self.now, &mut self.memory);
    }

    /// Lets everything happen that is due until a cycle.
    fn go_to(&mut self, cycle: u64) {
        self.now = cycle;
        self.bus.advance(cycle, &mut self.memory);
    }

    /// Runs until an event register reads 1, and clears it; gives the cycle.
    fn wait(&mut self, event: u32) -> u64 {
        while self.read(event) == 0 {
            self.now = self.bus.next().expect("something is under way");
            self.bus.advance(self.now, &mut self.memory);
            assert_eq!(self.bus.effects.reset, None);
        }
        self.write(event, 0);
        self.now
    }
}

#[test]
fn interrupts_are_served_by_priority_and_not_twice() {
    let mut bench = Bench::new(World::default());
    let system = system::BASE;
    bench.write(system + 0x100, 1 << 7 | 1 << 21);
    bench
        .bus
        .write(system + 0x407, 0x60, 1, 0, &mut bench.memory);
    bench
        .bus
        .write(system + 0x415, 0xC0, 1, 0, &mut bench.memory);
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

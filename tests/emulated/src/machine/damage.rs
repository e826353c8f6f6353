//! Breaking functions of the image while it runs: the image needs no door for it.

use super::hooks::ENDLESS_LOOP;
use super::state::engine_error;
use super::{Machine, MachineError};
use crate::image::Function;

/// `udf #0`.
const UNDEFINED: u16 = 0xDE00;
/// `ldr r0, message; ldr r1, length; ldr r2, place; ldr r3, function; bx r3; nop`: the four words follow.
const CALL: [u16; 6] = [0x4802, 0x4903, 0x4A03, 0x4B04, 0x4718, 0xBF00];

/// What a function does from its next call on, instead of its work.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Damage {
    /// It never returns.
    Hang,
    /// It executes an instruction that does not exist.
    Undefined,
    /// It panics, with the message and the place that [`crate::image::Image::panic_place`] names.
    Panic,
}

impl Machine {
    /// Breaks every function whose (mangled) name holds these parts in this order, also where the compiler put it into
    /// others, until [`Self::mend`]; resets do not mend it. Gives the names.
    ///
    /// # Errors
    /// `NoFunction` for no such name, and for a panic in an image that cannot panic; the emulator's.
    pub fn damage(&mut self, parts: &[&str], damage: Damage) -> Result<Vec<String>, MachineError> {
        let functions = self.image.functions_named(parts)?;
        let stub = match damage {
            Damage::Panic => Some(self.put_panic()?),
            _ => None,
        };
        for Function { start, end, .. } in &functions {
            let code = match (damage, stub) {
                (Damage::Hang, _) => ENDLESS_LOOP.to_le_bytes().to_vec(),
                (_, Some(stub)) => branch(*start, stub).to_vec(),
                (_, None) => UNDEFINED.to_le_bytes().to_vec(),
            };
            // A place too small for it belongs to a function with other places.
            if code.len() <= (end - start) as usize {
                self.overwrite(*start, &code)?;
            }
        }
        let mut names: Vec<String> = functions
            .into_iter()
            .map(|function| function.name)
            .collect();
        names.sort();
        names.dedup();
        Ok(names)
    }

    /// Puts everything right again.
    ///
    /// # Errors
    /// The emulator's.
    pub fn mend(&mut self) -> Result<(), MachineError> {
        while let Some((address, code)) = self.damaged.pop() {
            self.put_code(address, &code)?;
        }
        Ok(())
    }

    /// Puts a call of `panic(message, place)` behind the image and gives its address.
    fn put_panic(&mut self) -> Result<u32, MachineError> {
        let place = self.image.panic_place()?;
        let panic = self.image.functions_named(&["core", "9panicking5panic"])?;
        let stub = self.image.end();
        let function = panic.first().map_or(0, |panic| panic.start | 1);
        let words = [place.name, place.length, place.address, function];
        let mut code: Vec<u8> = CALL.into_iter().flat_map(u16::to_le_bytes).collect();
        code.extend(words.into_iter().flat_map(u32::to_le_bytes));
        self.overwrite(stub, &code)?;
        Ok(stub)
    }

    fn overwrite(&mut self, address: u32, code: &[u8]) -> Result<(), MachineError> {
        let before = self.bytes(address, code.len())?;
        self.damaged.push((address, before));
        self.put_code(address, code)
    }

    fn put_code(&mut self, address: u32, code: &[u8]) -> Result<(), MachineError> {
        let (at, end) = (u64::from(address), u64::from(address) + code.len() as u64);
        let put = self.engine.mem_write(at, code);
        put.and_then(|()| self.engine.ctl_remove_cache(at, end))
            .map_err(engine_error)?;
        let state = self.engine.get_data_mut();
        if let Some(place) = state.code.get_mut(at as usize..end as usize) {
            place.copy_from_slice(code);
        }
        state.counts.forget();
        Ok(())
    }
}

/// `b.w` from one address to another: Armv7-M architecture reference manual, A7.7.12, encoding T4.
fn branch(from: u32, to: u32) -> [u8; 4] {
    let offset = to.wrapping_sub(from.wrapping_add(4));
    let bit = |number: u32| offset >> number & 1;
    let sign = offset >> 31;
    let (j1, j2) = (1 ^ bit(23) ^ sign, 1 ^ bit(22) ^ sign);
    let high = 0xF000 | sign << 10 | offset >> 12 & 0x3FF;
    let low = 0x9000 | j1 << 13 | j2 << 11 | offset >> 1 & 0x7FF;
    let [high, low] = [high as u16, low as u16].map(u16::to_le_bytes);
    [high[0], high[1], low[0], low[1]]
}

#[cfg(test)]
mod tests {
    use super::branch;

    #[test]
    fn branches_are_encoded_as_the_assembler_does() {
        // GNU as 2.40: b.w .+0x1234 and b.w .-0x1000 at 0x8000.
        assert_eq!(branch(0x8000, 0x9234), [0x01, 0xF0, 0x18, 0xB9]);
        assert_eq!(branch(0x8000, 0x7000), [0xFE, 0xF7, 0xFE, 0xBF]);
    }
}

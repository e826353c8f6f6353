//! What the factory and the programmer wrote: FICR (PS 4.4), UICR (PS 4.5), and the trim of TEMP (PS 6.28).

use super::{Around, Kept, Peripheral};

/// Address of FICR.
pub const FACTORY: u32 = 0x1000_0000;
/// Address of UICR.
pub const USER: u32 = 0x1000_1000;
/// Address of TEMP.
pub const TEMPERATURE: u32 = 0x4000_C000;

/// "AAF0": a chip of build code F, whose access port is opened by software too (PS 4.8, "Access port protection").
const VARIANT: u32 = 0x4141_4630;

/// Read-only words.
#[derive(Clone, Debug)]
pub struct Factory(Kept);

impl Factory {
    /// An nRF52840 with this device number.
    #[must_use]
    pub fn new(device: u64) -> Self {
        let (low, high) = (device as u32, (device >> 32) as u32);
        let mut words = vec![
            (0x010, 4096), // CODEPAGESIZE
            (0x014, 256),  // CODESIZE
            (0x060, low),
            (0x064, high),
            (0x0A0, 1),
            (0x0A4, !low),
            (0x0A8, !high),
            (0x100, 0x52840), // INFO.PART
            (0x104, VARIANT),
            (0x110, 256),  // INFO.FLASH, kB
            (0x10C, 1024), // INFO.RAM, kB
        ];
        // TEMP.A0 to T4: slopes, offsets and ends of the temperature's segments.
        words.extend(
            (0x404..0x448)
                .step_by(4)
                .map(|offset| (offset, 0x100 + offset)),
        );
        Self(Kept::new(&words))
    }
}

impl Peripheral for Factory {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        self.0.get(offset)
    }

    fn write(
        &mut self,
        _offset: u32,
        _value: u32,
        _now: u64,
        _around: &mut Around<'_>,
    ) -> Option<()> {
        None
    }
}

/// User configuration as a programmed board has it; the image that wants something else would have to write it,
/// which no model allows.
#[derive(Clone, Debug)]
pub struct User(Kept);

impl Default for User {
    fn default() -> Self {
        Self(Kept::new(&[
            (0x200, 18),       // PSELRESET[0]: P0.18
            (0x204, 18),       // PSELRESET[1]
            (0x208, 0x5A),     // APPROTECT: opened
            (0x20C, u32::MAX), // NFCPINS
            (0x210, u32::MAX), // DEBUGCTRL
            (0x304, u32::MAX), // REGOUT0
        ]))
    }
}

impl Peripheral for User {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        self.0.get(offset)
    }

    fn write(
        &mut self,
        _offset: u32,
        _value: u32,
        _now: u64,
        _around: &mut Around<'_>,
    ) -> Option<()> {
        None
    }
}

/// The temperature sensor's trim; it measures nothing here.
#[derive(Clone, Debug)]
pub struct Temperature(Kept);

impl Default for Temperature {
    fn default() -> Self {
        let trims = (0x520..0x538).chain(0x540..0x558).chain(0x560..0x574);
        let words: Vec<(u32, u32)> = trims.step_by(4).map(|offset| (offset, 0)).collect();
        Self(Kept::new(&words))
    }
}

impl Peripheral for Temperature {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        self.0.get(offset)
    }

    fn write(
        &mut self,
        offset: u32,
        value: u32,
        _now: u64,
        _around: &mut Around<'_>,
    ) -> Option<()> {
        self.0.set(offset, value)
    }
}

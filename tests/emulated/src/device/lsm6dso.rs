//! ST LSM6DSO on I2C: its registers (datasheet DS12140 revision 3, sections 5.1 and 8).

/// WHO_AM_I and its value: section 9.11 of the datasheet.
const IDENTITY: (u8, u8) = (0x0F, 0x6C);
/// STATUS_REG: both measurements new.
const STATUS: (u8, u8) = (0x1E, 0b11);
/// OUTX_L_G: three rates, then three accelerations, 16 bits each.
const OUTPUTS: u8 = 0x22;
/// CTRL3_C: IF_INC, on after reset, and SW_RESET.
const CONTROL: u8 = 0x12;
const INCREMENTS: u8 = 1 << 2;
const RESETS: u8 = 1;

/// One device at an address.
#[derive(Clone, Debug)]
pub struct Lsm6dso {
    /// Seven bits: 0x6A or 0x6B by the level of SA0.
    pub address: u8,
    /// SCL and SDA, as PSEL names pins.
    pub wires: [u32; 2],
    registers: [u8; 256],
    pointer: u8,
}

impl Lsm6dso {
    /// As after a reset.
    #[must_use]
    pub fn new(address: u8, wires: [u32; 2]) -> Self {
        let mut registers = [0; 256];
        for (register, value) in [IDENTITY, STATUS, (CONTROL, INCREMENTS)] {
            registers[usize::from(register)] = value;
        }
        Self {
            address,
            wires,
            registers,
            pointer: 0,
        }
    }

    /// What it measures from now on: rates about x, y, z, then accelerations, in counts.
    pub fn measure(&mut self, counts: [i16; 6]) {
        let bytes = counts.into_iter().flat_map(i16::to_le_bytes);
        for (register, byte) in self.registers[usize::from(OUTPUTS)..].iter_mut().zip(bytes) {
            *register = byte;
        }
    }

    /// A register, as the chip left it.
    #[must_use]
    pub fn register(&self, number: u8) -> u8 {
        self.registers[usize::from(number)]
    }

    fn advance(&mut self) {
        if self.registers[usize::from(CONTROL)] & INCREMENTS != 0 {
            self.pointer = self.pointer.wrapping_add(1);
        }
    }

    /// The first byte is a register's number, what follows goes into it and the next ones.
    pub fn write(&mut self, bytes: &[u8]) {
        let Some((pointer, values)) = bytes.split_first() else {
            return;
        };
        self.pointer = *pointer;
        for value in values {
            if self.pointer == CONTROL && value & RESETS != 0 {
                *self = Self::new(self.address, self.wires);
                return;
            }
            // Identity, status and outputs are read-only.
            let read_only = self.pointer == IDENTITY.0 || (STATUS.0..0x2E).contains(&self.pointer);
            if !read_only {
                self.registers[usize::from(self.pointer)] = *value;
            }
            self.advance();
        }
    }

    /// Registers from the one that was named last.
    pub fn read(&mut self, bytes: &mut [u8]) {
        for byte in bytes {
            *byte = self.registers[usize::from(self.pointer)];
            self.advance();
        }
    }
}

//! The image: what goes to flash, and which function is where.

use goblin::elf::{Elf, program_header::PT_LOAD, sym::STT_FUNC};

use crate::error::MachineError;

/// Bytes of flash: nRF52840 product specification 1.7, section 4.2.
pub const FLASH_BYTES: usize = 0x10_0000;
/// What the radio's closed libraries begin their names with.
const RADIO_LIBRARIES: [&str; 3] = ["mpsl_", "sdc_", "hci_internal_"];

/// An image that may be executed here.
#[derive(Clone, Debug)]
pub struct Image {
    /// The whole flash; erased where the image has nothing.
    pub flash: Vec<u8>,
    /// The file itself: its log strings are not in the flash.
    pub elf: Vec<u8>,
    /// Start, end and name of every function, by start.
    functions: Vec<(u32, u32, String)>,
    symbols: Vec<(String, u32)>,
}

impl Image {
    /// Reads an ELF file.
    ///
    /// # Errors
    /// `NotAnImage`, and `RadioLibrary` for an image that holds Nordic's libraries: their licence allows their
    /// use on Nordic's chips only.
    pub fn read(elf: Vec<u8>) -> Result<Self, MachineError> {
        let refuse = |reason: String| MachineError::NotAnImage { reason };
        let parsed = Elf::parse(&elf).map_err(|error| refuse(error.to_string()))?;
        let mut flash = vec![0xFF; FLASH_BYTES];
        for segment in parsed
            .program_headers
            .iter()
            .filter(|segment| segment.p_type == PT_LOAD && segment.p_filesz > 0)
        {
            let (at, from) = (segment.p_paddr as usize, segment.p_offset as usize);
            let length = segment.p_filesz as usize;
            let to = flash
                .get_mut(at..at.saturating_add(length))
                .ok_or_else(|| {
                    refuse(format!(
                        "a segment of {length} bytes at {at:#x} is not in flash"
                    ))
                })?;
            let bytes = elf
                .get(from..from.saturating_add(length))
                .ok_or_else(|| refuse("a segment lies behind the end of the file".to_owned()))?;
            to.copy_from_slice(bytes);
        }
        let mut functions = Vec::new();
        let mut symbols = Vec::new();
        for symbol in &parsed.syms {
            let Some(name) = parsed.strtab.get_at(symbol.st_name) else {
                continue;
            };
            if RADIO_LIBRARIES
                .iter()
                .any(|prefix| name.starts_with(prefix))
            {
                return Err(MachineError::RadioLibrary {
                    symbol: name.to_owned(),
                });
            }
            let start = symbol.st_value as u32;
            if symbol.st_type() == STT_FUNC {
                let start = start & !1;
                functions.push((start, start + symbol.st_size as u32, name.to_owned()));
            }
            symbols.push((name.to_owned(), start));
        }
        if functions.is_empty() {
            return Err(refuse("the file names no functions".to_owned()));
        }
        functions.sort();
        Ok(Self {
            flash,
            elf,
            functions,
            symbols,
        })
    }

    /// Name of the function around an address.
    #[must_use]
    pub fn function(&self, pc: u32) -> &str {
        let behind = self.functions.partition_point(|(start, ..)| *start <= pc);
        behind
            .checked_sub(1)
            .and_then(|place| self.functions.get(place))
            .filter(|(_, end, _)| pc < *end)
            .map_or("no function", |(.., name)| name)
    }

    /// Value of the first symbol whose name holds `part`.
    #[must_use]
    pub fn symbol(&self, part: &str) -> Option<u32> {
        self.symbols
            .iter()
            .find(|(name, _)| name.contains(part))
            .map(|(_, value)| *value)
    }

    /// The word of the flash at a multiple of four.
    #[must_use]
    pub fn word(&self, address: u32) -> Option<u32> {
        self.flash
            .get(address as usize..)
            .and_then(|bytes| bytes.first_chunk())
            .map(|word| u32::from_le_bytes(*word))
    }

    /// Addresses of every halfword of this value, code or not.
    pub fn halfwords(&self, value: u16) -> impl Iterator<Item = u32> {
        self.flash
            .chunks_exact(2)
            .enumerate()
            .filter(move |(_, pair)| *pair == value.to_le_bytes())
            .map(|(place, _)| place as u32 * 2)
    }
}

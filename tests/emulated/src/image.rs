//! The image: what goes to flash, and which function is where.

mod inlined;

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
    /// By start.
    functions: Vec<Function>,
    symbols: Vec<(String, u32)>,
}

/// Code of a function.
#[derive(Clone, Debug, PartialEq, Eq, PartialOrd, Ord)]
pub struct Function {
    /// Address of its first instruction.
    pub start: u32,
    /// Address behind its last one.
    pub end: u32,
    /// Name as the linker knows it: mangled.
    pub name: String,
}

/// A place in source code, in the image.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct PanicPlace {
    /// Of its `core::panic::Location`.
    pub address: u32,
    /// Address of the file's name.
    pub name: u32,
    /// Bytes of the file's name.
    pub length: u32,
    /// File, line and column as a panic prints them.
    pub text: String,
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
                functions.push(Function {
                    start,
                    end: start + symbol.st_size as u32,
                    name: name.to_owned(),
                });
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

    /// Bare code that begins with its vector table, without names and without a log: to try the machine itself.
    #[must_use]
    pub fn of_code(code: &[u8]) -> Self {
        let mut flash = code.to_vec();
        flash.resize(FLASH_BYTES, 0xFF);
        Self {
            flash,
            elf: Vec::new(),
            functions: Vec::new(),
            symbols: Vec::new(),
        }
    }

    /// Name of the function around an address.
    #[must_use]
    pub fn function(&self, pc: u32) -> &str {
        let behind = self
            .functions
            .partition_point(|function| function.start <= pc);
        behind
            .checked_sub(1)
            .and_then(|place| self.functions.get(place))
            .filter(|function| pc < function.end)
            .map_or("no function", |function| &function.name)
    }

    /// Every function whose name holds these parts in this order, and every place that the compiler put such a
    /// function into.
    ///
    /// # Errors
    /// `NoFunction`; `NotAnImage` for debug information that cannot be read.
    pub fn functions_named(&self, parts: &[&str]) -> Result<Vec<Function>, MachineError> {
        let refuse = |reason: String| MachineError::NotAnImage { reason };
        let elf = Elf::parse(&self.elf).map_err(|error| refuse(error.to_string()))?;
        let inlined = inlined::functions(&elf, &self.elf);
        let inlined = inlined.map_err(|error| refuse(error.to_string()))?;
        let all = self.functions.iter().cloned().chain(inlined);
        let found: Vec<Function> = all
            .filter(|function| holds(&function.name, parts))
            .collect();
        if found.is_empty() {
            return Err(MachineError::NoFunction {
                parts: parts.iter().map(|part| (*part).to_owned()).collect(),
            });
        }
        Ok(found)
    }

    /// First address behind everything that the image holds, a multiple of 16.
    #[must_use]
    pub fn end(&self) -> u32 {
        let used = self.flash.iter().rposition(|byte| *byte != 0xFF);
        used.map_or(0, |last| (last as u32 / 16 + 1) * 16)
    }

    /// A place in source code at which the image can panic.
    ///
    /// # Errors
    /// `NotAnImage` when there is none.
    pub fn panic_place(&self) -> Result<PanicPlace, MachineError> {
        (0..self.end())
            .step_by(4)
            .find_map(|address| self.panic_place_at(address))
            .ok_or_else(|| MachineError::NotAnImage {
                reason: "no function in the file can panic".to_owned(),
            })
    }

    /// As the compiler lays `core::panic::Location` out: name, its length, line, column.
    fn panic_place_at(&self, address: u32) -> Option<PanicPlace> {
        let word = |field: u32| self.word(address + 4 * field);
        let (name, length, line, column) = (word(0)?, word(1)?, word(2)?, word(3)?);
        let end = (name as usize).checked_add(length as usize)?;
        let text = std::str::from_utf8(self.flash.get(name as usize..end)?).ok()?;
        let plausible =
            text.ends_with(".rs") && (1..5000).contains(&line) && (1..200).contains(&column);
        plausible.then(|| PanicPlace {
            address,
            name,
            length,
            text: format!("{text}:{line}:{column}"),
        })
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

/// Whether a text holds these parts in this order.
fn holds(text: &str, parts: &[&str]) -> bool {
    let mut rest = text;
    parts.iter().all(|part| {
        let behind = rest.find(part).and_then(|at| rest.get(at + part.len()..));
        rest = behind.unwrap_or_default();
        behind.is_some()
    })
}

//! What of a linked image goes into the flash, and where.

use object::{
    LittleEndian,
    elf::{EM_ARM, FileHeader32, PT_LOAD},
    read::elf::{FileHeader, ProgramHeader},
};
use tonus_firmware::storage::partitions::Partition;

use crate::error::Uf2Error;

/// A run of bytes at its address in the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) struct Part<'data> {
    /// Address of its first byte.
    pub(crate) start: u32,
    /// At least one.
    pub(crate) bytes: &'data [u8],
}

impl Part<'_> {
    /// Address behind its last byte; parts lie in the flash, so this does not overflow.
    pub(crate) fn end(&self) -> u32 {
        self.start + self.bytes.len() as u32
    }
}

/// Everything that goes into the flash: at least one part, by address, without overlaps.
#[derive(Debug, PartialEq, Eq)]
pub(crate) struct Image<'data> {
    pub(crate) parts: Vec<Part<'data>>,
}

impl<'data> Image<'data> {
    /// The parts of an ELF file that are loaded, each at its load address: what is initial data in RAM lies behind
    /// the code in the flash.
    ///
    /// # Errors
    /// When it is no 32-bit Arm image, is not wholly in `place`, or does not begin where `place` begins.
    pub(crate) fn read(elf: &'data [u8], place: &Partition) -> Result<Self, Uf2Error> {
        let broken = |source| Uf2Error::NotAnImage { source };
        let header = FileHeader32::<LittleEndian>::parse(elf).map_err(broken)?;
        let endian = header.endian().map_err(broken)?;
        let got = header.e_machine(endian);
        if got != EM_ARM {
            return Err(Uf2Error::Processor {
                expected: EM_ARM,
                got,
            });
        }
        let mut parts = Vec::new();
        for segment in header.program_headers(endian, elf).map_err(broken)? {
            if segment.p_type(endian) != PT_LOAD || segment.p_filesz(endian) == 0 {
                continue;
            }
            let start = segment.p_paddr(endian);
            let end = u64::from(start) + u64::from(segment.p_filesz(endian));
            if start < place.start || end > u64::from(place.end()) {
                return Err(Uf2Error::Outside {
                    start: start.into(),
                    end,
                    expected_start: place.start,
                    expected_end: place.end(),
                });
            }
            let bytes = segment
                .data(endian, elf)
                .map_err(|()| Uf2Error::Cut { start })?;
            parts.push(Part { start, bytes });
        }
        parts.sort_by_key(|part| part.start);
        let first = parts.first().ok_or(Uf2Error::Empty)?;
        if first.start != place.start {
            return Err(Uf2Error::Start {
                expected: place.start,
                got: first.start,
            });
        }
        match parts.windows(2).find(|two| two[1].start < two[0].end()) {
            Some(two) => Err(Uf2Error::Overlap { at: two[1].start }),
            None => Ok(Self { parts }),
        }
    }
}

//! The image's log: defmt frames in a ring in RAM (SEGGER's RTT), decoded with the strings in the ELF.

use defmt_decoder::{DecodeError, Table};

use crate::error::MachineError;

/// Decodes what the image logs.
pub struct Log {
    table: Table,
    /// Bytes of a frame that is not complete.
    rest: Vec<u8>,
    /// Lines so far.
    pub lines: Vec<String>,
}

impl Log {
    /// For an image's ELF file.
    ///
    /// # Errors
    /// `NotAnImage` when it has no log strings.
    pub fn new(elf: &[u8]) -> Result<Self, MachineError> {
        let refuse = |reason: String| MachineError::NotAnImage { reason };
        let table = Table::parse(elf)
            .map_err(|error| refuse(error.to_string()))?
            .ok_or_else(|| refuse("the file has no log strings".to_owned()))?;
        Ok(Self {
            table,
            rest: Vec::new(),
            lines: Vec::new(),
        })
    }

    /// Takes bytes from the ring.
    pub fn take(&mut self, bytes: &[u8]) {
        self.rest.extend_from_slice(bytes);
        let Some(whole) = self.rest.iter().rposition(|byte| *byte == 0) else {
            return;
        };
        let mut decoder = self.table.new_stream_decoder();
        decoder.received(&self.rest[..=whole]);
        self.rest.drain(..=whole);
        loop {
            match decoder.decode() {
                Ok(frame) => {
                    let level = frame.level().map_or("", |level| level.as_str());
                    self.lines
                        .push(format!("{level} {}", frame.display_message()));
                }
                Err(DecodeError::UnexpectedEof) => return,
                Err(DecodeError::Malformed) => self.lines.push("a log frame is damaged".to_owned()),
            }
        }
    }
}

//! The image's log: defmt frames in a ring in RAM (SEGGER's RTT), decoded with the strings in the ELF.

use defmt_decoder::{DecodeError, Table};

use crate::error::MachineError;
use crate::image::Image;
use crate::machine::Engine;

/// What the log's control block begins with; before the image has started it holds anything.
const BLOCK: &[u8] = b"SEGGER RTT\0";
/// Offset in the control block of the first ring's address, size, and places of writer and reader.
const RING: u32 = 24 + 4;

/// Decodes what the image logs.
pub struct Log {
    /// None for bare code.
    table: Option<Table>,
    /// Address of the control block.
    block: Option<u32>,
    /// Bytes of a frame that is not complete.
    rest: Vec<u8>,
    /// Lines so far.
    pub lines: Vec<String>,
}

impl Log {
    /// For an image.
    ///
    /// # Errors
    /// `NotAnImage` when it has no log strings.
    pub fn new(image: &Image) -> Result<Self, MachineError> {
        if image.elf.is_empty() {
            return Ok(Self {
                table: None,
                block: None,
                rest: Vec::new(),
                lines: Vec::new(),
            });
        }
        let refuse = |reason: String| MachineError::NotAnImage { reason };
        let table = Table::parse(&image.elf)
            .map_err(|error| refuse(error.to_string()))?
            .ok_or_else(|| refuse("the file has no log strings".to_owned()))?;
        Ok(Self {
            table: Some(table),
            block: image.symbol("_SEGGER_RTT"),
            rest: Vec::new(),
            lines: Vec::new(),
        })
    }

    /// Forgets a frame that is not complete: the image starts again.
    pub fn begin_anew(&mut self) {
        self.rest.clear();
    }

    /// Takes what waits in the ring, as a debugger would.
    pub(crate) fn collect(&mut self, engine: &mut Engine<'_>) {
        let Some(block) = self.block else {
            return;
        };
        let bytes = |engine: &Engine<'_>, from: u32, length: usize| {
            let mut bytes = vec![0; length];
            let read = engine.mem_read(u64::from(from), &mut bytes);
            read.map(|()| bytes).unwrap_or_default()
        };
        if bytes(engine, block, BLOCK.len()) != BLOCK {
            return;
        }
        let words = bytes(engine, block + RING, 16);
        let mut words = words
            .chunks_exact(4)
            .filter_map(|word| word.first_chunk())
            .map(|word| u32::from_le_bytes(*word));
        let mut word = || words.next().unwrap_or_default();
        let (ring, size, written, read) = (word(), word(), word(), word());
        if written >= size || read >= size || written == read {
            return;
        }
        let parts = if written > read {
            [read..written, 0..0]
        } else {
            [read..size, 0..written]
        };
        for part in parts {
            let taken = bytes(engine, ring + part.start, part.len());
            self.take(&taken);
        }
        // A failure shows as the same lines again.
        let _ = engine.mem_write(u64::from(block + RING + 12), &written.to_le_bytes());
    }

    /// Takes bytes from the ring.
    fn take(&mut self, bytes: &[u8]) {
        self.rest.extend_from_slice(bytes);
        let Some(whole) = self.rest.iter().rposition(|byte| *byte == 0) else {
            return;
        };
        let Some(table) = &self.table else {
            return;
        };
        let mut decoder = table.new_stream_decoder();
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

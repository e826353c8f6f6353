//! A wearable on a serial port: the frames that a radio would bring, each in a COBS block.
//!
//! A board's debugger shows the port as `/dev/ttyACM0` or `COM3`. What is no frame is counted and skipped; the next
//! delimiter puts the reader right again.

use std::collections::VecDeque;
use std::io::ErrorKind;
use std::path::{Path, PathBuf};
use std::time::{Duration, Instant};

use serial2::SerialPort;
use thiserror::Error;
use tonus_shared::wire::{
    WireError,
    cobs::{BAUD, DELIMITER, MAX_BLOCK_BYTES, Unframer, enclose},
};

/// Bytes taken at once: 4 ms of a full line.
const PIECE_BYTES: usize = 512;
/// A line that takes nothing for so long is not read at the other end.
const SEND_LIMIT: Duration = Duration::from_millis(500);

/// What came over the line so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct SerialCounters {
    /// Bytes of any sort.
    pub bytes: u64,
    /// Blocks that held bytes of a frame's length; whether they are frames, `wire::decode` says.
    pub blocks: u64,
    /// Runs of bytes between two delimiters that were no block.
    pub refused: u64,
}

/// Why a port serves no longer.
#[derive(Debug, Error)]
pub enum SerialError {
    /// It cannot be used as the wearable's line.
    #[error(
        "{}: cannot be opened at {BAUD} baud: {source}; check the name, and that no other program has it",
        port.display()
    )]
    Open {
        /// Its name.
        port: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// The other end is gone.
    #[error("{}: unplugged: connect it and start again", port.display())]
    Unplugged {
        /// Its name.
        port: PathBuf,
    },
    /// It cannot be read.
    #[error("{}: cannot be read: {source}", port.display())]
    Read {
        /// Its name.
        port: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// It takes nothing more.
    #[error("{}: cannot be written: {source}; check that the wearable runs", port.display())]
    Write {
        /// Its name.
        port: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// More bytes than any frame has.
    #[error(transparent)]
    Frame(#[from] WireError),
}

/// One end of a serial line.
#[derive(Debug)]
pub struct SerialLink {
    port: SerialPort,
    name: PathBuf,
    unframer: Unframer,
    waiting: VecDeque<Vec<u8>>,
    counters: SerialCounters,
}

impl SerialLink {
    /// Opens a port by its name.
    ///
    /// # Errors
    /// [`SerialError::Open`].
    pub fn open(name: &Path) -> Result<Self, SerialError> {
        match SerialPort::open(name, BAUD) {
            Ok(port) => Self::over(port, name),
            Err(source) => Err(SerialError::Open {
                port: name.to_owned(),
                source,
            }),
        }
    }

    /// Takes a port that is open; `name` is for messages.
    fn over(mut port: SerialPort, name: &Path) -> Result<Self, SerialError> {
        port.set_write_timeout(SEND_LIMIT)
            .map_err(|source| SerialError::Open {
                port: name.to_owned(),
                source,
            })?;
        Ok(Self {
            port,
            name: name.to_owned(),
            unframer: Unframer::new(),
            waiting: VecDeque::new(),
            counters: SerialCounters::default(),
        })
    }

    /// What came so far.
    #[must_use]
    pub fn counters(&self) -> SerialCounters {
        self.counters
    }

    /// The bytes of the next frame, unchecked, or none within `limit`.
    ///
    /// # Errors
    /// `Unplugged` or `Read`; frames that came before are given out first.
    pub fn receive(&mut self, limit: Duration) -> Result<Option<Vec<u8>>, SerialError> {
        let until = Instant::now() + limit;
        loop {
            if let Some(frame) = self.waiting.pop_front() {
                return Ok(Some(frame));
            }
            let left = until.saturating_duration_since(Instant::now());
            if !self.take(left)? || left.is_zero() {
                return Ok(self.waiting.pop_front());
            }
        }
    }

    /// Takes what comes within `limit`; whether anything did.
    fn take(&mut self, limit: Duration) -> Result<bool, SerialError> {
        let set = self.port.set_read_timeout(limit);
        set.map_err(|source| self.unreadable(source))?;
        let mut piece = [0; PIECE_BYTES];
        let came = match self.port.read(&mut piece) {
            Ok(0) => {
                return Err(SerialError::Unplugged {
                    port: self.name.clone(),
                });
            }
            Ok(came) => came,
            Err(error) if error.kind() == ErrorKind::TimedOut => return Ok(false),
            Err(error) => return Err(self.unreadable(error)),
        };
        self.counters.bytes += came as u64;
        for byte in piece.iter().take(came) {
            match self.unframer.push(*byte) {
                Ok(None) => {}
                Ok(Some(frame)) => {
                    self.counters.blocks += 1;
                    self.waiting.push_back(frame.to_vec());
                }
                Err(_) => self.counters.refused += 1,
            }
        }
        Ok(true)
    }

    /// Sends one encoded frame.
    ///
    /// # Errors
    /// `Frame` for bytes longer than any frame, `Unplugged` or `Write` when the line does not take them.
    pub fn send(&mut self, frame: &[u8]) -> Result<(), SerialError> {
        // In front as well, so that whatever noise the line made is no part of this block.
        let mut block = [DELIMITER; 1 + MAX_BLOCK_BYTES];
        let length = enclose(frame, &mut block[1..])?;
        let sent = self.port.write_all(&block[..=length]);
        sent.map_err(|source| {
            let port = self.name.clone();
            if gone(&source) {
                SerialError::Unplugged { port }
            } else {
                SerialError::Write { port, source }
            }
        })
    }

    fn unreadable(&self, source: std::io::Error) -> SerialError {
        let port = self.name.clone();
        if gone(&source) {
            SerialError::Unplugged { port }
        } else {
            SerialError::Read { port, source }
        }
    }
}

/// A line whose other end is gone says so in one way or another: by an input or output error on Linux, by a missing
/// device elsewhere.
fn gone(error: &std::io::Error) -> bool {
    const EIO: i32 = 5;
    let kind = matches!(
        error.kind(),
        ErrorKind::NotFound | ErrorKind::BrokenPipe | ErrorKind::PermissionDenied
    );
    kind || error.raw_os_error() == Some(EIO)
}

#[cfg(test)]
mod tests;

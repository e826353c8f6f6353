//! Frames on a serial line: consistent overhead byte stuffing (COBS; Cheshire and Baker, 1999, section 3).
//!
//! A *block* is one frame without zero bytes, followed by one zero, the *delimiter*. Every run of bytes up to
//! a zero is preceded by its length plus one, and the zero left out; a run of 254 without a zero is preceded
//! by 255. A receiver that lost its place finds it again at the next delimiter.

use super::error::WireError;
use super::table::MAX_FRAME_BYTES;

/// Bits per second of the wearable's serial port; 8 data bits, no parity, one stop bit, no flow control. The stream
/// and everything beside it need a tenth of it.
pub const BAUD: u32 = 1_000_000;
/// Ends every block, and is found nowhere else.
pub const DELIMITER: u8 = 0;
/// Longest run that one length byte announces.
const LONGEST_RUN: usize = 254;
/// Longest block, with its delimiter.
pub const MAX_BLOCK_BYTES: usize = block_bytes(MAX_FRAME_BYTES);

/// Most bytes that the block of a frame of `frame` bytes may take: a length for each started run, and the delimiter.
const fn block_bytes(frame: usize) -> usize {
    let runs = frame.div_ceil(LONGEST_RUN);
    frame + if runs == 0 { 1 } else { runs } + 1
}

/// Writes the block of a frame, delimiter included, at the start of `out` and gives its length.
///
/// # Errors
/// `BufferTooSmall` if `out` does not hold the longest block of so many bytes ([`MAX_BLOCK_BYTES`] always
/// suffices for a frame).
pub fn enclose(frame: &[u8], out: &mut [u8]) -> Result<usize, WireError> {
    let too_small = WireError::BufferTooSmall {
        needed: block_bytes(frame.len()),
        got: out.len(),
    };
    let out = out.get_mut(..block_bytes(frame.len())).ok_or(too_small)?;
    let (mut length_at, mut end) = (0, 1);
    for (place, byte) in frame.iter().enumerate() {
        if *byte != DELIMITER {
            out[end] = *byte;
            end += 1;
        }
        let run_full = end - length_at > LONGEST_RUN && place + 1 < frame.len();
        if *byte == DELIMITER || run_full {
            out[length_at] = (end - length_at) as u8; // At most 255, by `run_full`.
            length_at = end;
            end += 1;
        }
    }
    out[length_at] = (end - length_at) as u8;
    out[end] = DELIMITER;
    Ok(end + 1)
}

/// Why the bytes between two delimiters hold no frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum BlockError {
    /// More bytes than any frame has.
    #[error("a block of more than {limit} bytes: check that both sides use one baud rate")]
    TooLong {
        /// Bytes of the longest frame.
        limit: usize,
    },
    /// A run was cut short by the delimiter.
    #[error("{missing} bytes were announced and did not come: the line lost bytes")]
    CutShort {
        /// How many.
        missing: u8,
    },
}

/// Takes bytes from a serial line and gives the frames in them, of at most `N` bytes, unchecked: [`super::decode`]
/// judges each.
#[derive(Clone, Debug)]
pub struct Unframer<const N: usize = MAX_FRAME_BYTES> {
    frame: [u8; N],
    state: State,
}

#[derive(Clone, Copy, Debug)]
enum State {
    /// Behind a delimiter.
    Start,
    /// Inside a block.
    Inside {
        /// Bytes of the frame so far.
        length: usize,
        /// Bytes of this run that have not come.
        left: u8,
        /// Whether the frame has a zero between this run and the next.
        zero_behind: bool,
    },
    /// Until the next delimiter, whatever comes is not looked at.
    Lost,
}

impl<const N: usize> Default for Unframer<N> {
    fn default() -> Self {
        Self::new()
    }
}

impl<const N: usize> Unframer<N> {
    /// At the start of a block.
    #[must_use]
    pub const fn new() -> Self {
        Self {
            frame: [0; N],
            state: State::Start,
        }
    }

    /// Skips to the next delimiter: for a receiver that knows it missed bytes.
    pub fn skip(&mut self) {
        self.state = State::Lost;
    }

    /// Takes one byte. A delimiter that ends a whole block gives its frame; an empty block gives nothing.
    ///
    /// # Errors
    /// [`BlockError`], once for each block that holds no frame.
    pub fn push(&mut self, byte: u8) -> Result<Option<&[u8]>, BlockError> {
        if byte == DELIMITER {
            return self.end();
        }
        match self.state {
            State::Lost => {}
            State::Start => self.state = run(0, byte),
            State::Inside {
                length,
                left: 0,
                zero_behind,
            } => {
                let length = if zero_behind {
                    self.put(length, DELIMITER)?
                } else {
                    length
                };
                self.state = run(length, byte);
            }
            State::Inside {
                length,
                left,
                zero_behind,
            } => {
                self.state = State::Inside {
                    length: self.put(length, byte)?,
                    left: left - 1,
                    zero_behind,
                };
            }
        }
        Ok(None)
    }

    fn end(&mut self) -> Result<Option<&[u8]>, BlockError> {
        match core::mem::replace(&mut self.state, State::Start) {
            State::Start | State::Lost => Ok(None),
            State::Inside {
                length, left: 0, ..
            } => Ok(self.frame.get(..length)),
            State::Inside { left, .. } => Err(BlockError::CutShort { missing: left }),
        }
    }

    /// Adds a byte to the frame and gives its new length.
    fn put(&mut self, length: usize, byte: u8) -> Result<usize, BlockError> {
        let Some(place) = self.frame.get_mut(length) else {
            self.state = State::Lost;
            return Err(BlockError::TooLong { limit: N });
        };
        *place = byte;
        Ok(length + 1)
    }
}

/// Behind the byte that announces a run; it is never zero.
fn run(length: usize, announced: u8) -> State {
    State::Inside {
        length,
        left: announced - 1,
        zero_behind: announced < u8::MAX,
    }
}

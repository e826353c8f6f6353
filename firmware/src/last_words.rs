//! The message of a panic, in memory that a reset leaves alone.
//!
//! A panic writes it and resets the chip; the next start reads it, once. Power that went, a bootloader or a stray write leave
//! something else there, which the checksum tells. Nothing here panics or allocates: it runs when all else has failed.

use core::fmt::{self, Display, Write};

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use tonus_shared::wire::{LastWords, MAX_LAST_WORDS_BYTES};

static CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// Whole words, so that the memory can be copied word by word.
const WORDS: usize = 2 + MAX_LAST_WORDS_BYTES / 4;
const TAG: u32 = u32::from_le_bytes(*b"LAST");

const _: () = assert!(MAX_LAST_WORDS_BYTES.is_multiple_of(4) && MAX_LAST_WORDS_BYTES < 256);

/// What lies in that memory: tag and length, checksum, text. Any bits may stand there.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(transparent)]
pub struct Record([u32; WORDS]);

impl Record {
    /// No words.
    pub const EMPTY: Self = Self([0; WORDS]);

    /// As much of a message as there is room for.
    #[must_use]
    pub fn of(message: &impl Display) -> Self {
        let mut text = Text {
            bytes: [0; MAX_LAST_WORDS_BYTES],
            length: 0,
        };
        // A full text is not an error: the rest is left out.
        let _ = write!(text, "{message}");
        let mut words = [0; WORDS];
        words[0] = TAG ^ (text.length as u32) << 24;
        for (word, bytes) in words[2..].iter_mut().zip(text.bytes.as_chunks().0) {
            *word = u32::from_le_bytes(*bytes);
        }
        words[1] = checksum(&words);
        Self(words)
    }

    /// The message, if one stands here.
    #[must_use]
    pub fn read(&self) -> Option<LastWords> {
        let length = ((self.0[0] ^ TAG) >> 24) as usize;
        let tagged = (self.0[0] ^ TAG).trailing_zeros() >= 24;
        if !tagged || length > MAX_LAST_WORDS_BYTES || self.0[1] != checksum(&self.0) {
            return None;
        }
        let mut bytes = [0; MAX_LAST_WORDS_BYTES];
        for (word, bytes) in self.0[2..].iter().zip(bytes.as_chunks_mut().0) {
            *bytes = word.to_le_bytes();
        }
        Some(LastWords::from_bytes(&bytes[..length]))
    }
}

/// Over all but itself.
fn checksum(words: &[u32; WORDS]) -> u32 {
    let mut digest = CRC.digest();
    digest.update(&words[0].to_le_bytes());
    for word in &words[2..] {
        digest.update(&word.to_le_bytes());
    }
    digest.finalize()
}

struct Text {
    bytes: [u8; MAX_LAST_WORDS_BYTES],
    length: usize,
}

impl Write for Text {
    fn write_str(&mut self, text: &str) -> fmt::Result {
        let room = &mut self.bytes[self.length..];
        let taken = text.len().min(room.len());
        room[..taken].copy_from_slice(&text.as_bytes()[..taken]);
        self.length += taken;
        if taken < text.len() {
            return Err(fmt::Error);
        }
        Ok(())
    }
}

#[cfg(test)]
mod tests {
    use std::{format, string::String};

    use super::*;

    fn words(message: &str) -> Option<String> {
        Record::of(&message)
            .read()
            .map(|last| last.words.as_str().into())
    }

    #[test]
    fn a_message_comes_back_and_a_long_one_is_cut_between_characters() {
        let message = "panicked at firmware/src/main.rs:7:3: index out of bounds";
        assert_eq!(words(message).as_deref(), Some(message));
        assert_eq!(words("").as_deref(), Some(""));
        let long = "0123456789".repeat(20);
        assert_eq!(words(&long).as_deref(), Some(&long[..128]));
        // 127 bytes, then a character of two.
        let split = format!("{}é!", "x".repeat(127));
        assert_eq!(words(&split), Some("x".repeat(127)));
    }

    #[test]
    fn what_no_panic_wrote_is_no_message() {
        assert_eq!(Record::EMPTY.read(), None);
        assert_eq!(Record([u32::MAX; WORDS]).read(), None);
        assert_eq!(Record([0x5555_5555; WORDS]).read(), None);
        let good = Record::of(&"panicked");
        for word in 0..WORDS {
            for bit in 0..32 {
                let mut rotten = good;
                rotten.0[word] ^= 1 << bit;
                assert_eq!(rotten.read(), None, "word {word} bit {bit}");
            }
        }
    }
}

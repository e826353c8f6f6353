//! The wearable's flash as a file: a process that starts with the same file is the same wearable after a reset, and one that is
//! killed lost its power.

use std::{
    fs::{File, OpenOptions},
    io,
    os::unix::fs::FileExt,
    path::Path,
};

use embedded_storage_async::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use tonus_firmware::storage::{
    Model,
    partitions::{FLASH_BYTES, PAGE_BYTES, WORD_BYTES},
};

pub(crate) struct FileFlash {
    file: File,
    /// Words and pages until the power goes in the middle of one.
    steps_left: Option<u32>,
}

/// Exit code of a wearable that lost its power.
const POWER_LOST: i32 = 3;

#[derive(Debug)]
pub(crate) struct FileError(io::Error);

impl FileFlash {
    /// Opens a flash, or makes an erased one. Where `power_steps` are given the power goes after so many words written and
    /// pages erased: the next one is half done, and the process ends.
    pub(crate) fn open(path: &Path, power_steps: Option<u32>) -> io::Result<Self> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)?;
        if file.metadata()?.len() != u64::from(FLASH_BYTES) {
            file.write_all_at(&vec![0xff; FLASH_BYTES as usize], 0)?;
        }
        Ok(Self {
            file,
            steps_left: power_steps,
        })
    }

    /// A copy of a model as it lies in the flash; it is never given back, as the chip's own memory is not.
    pub(crate) fn mapped(&self, model: Model) -> &'static [u8] {
        let mut bytes = vec![0; model.length as usize];
        match self.file.read_exact_at(&mut bytes, u64::from(model.start)) {
            Ok(()) => Box::leak(bytes.into_boxed_slice()),
            Err(_) => &[],
        }
    }

    /// The same flash once more, to read from.
    pub(crate) fn another(&self) -> io::Result<Self> {
        Ok(Self {
            file: self.file.try_clone()?,
            steps_left: None,
        })
    }

    /// Counts a word or a page; whether it is the one that the power goes in.
    fn is_cut(&mut self) -> bool {
        let is_cut = self.steps_left == Some(0);
        self.steps_left = self.steps_left.map(|left| left.saturating_sub(1));
        is_cut
    }
}

impl NorFlashError for FileError {
    fn kind(&self) -> NorFlashErrorKind {
        match self.0.kind() {
            io::ErrorKind::UnexpectedEof => NorFlashErrorKind::OutOfBounds,
            _ => NorFlashErrorKind::Other,
        }
    }
}

impl ErrorType for FileFlash {
    type Error = FileError;
}

impl ReadNorFlash for FileFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), FileError> {
        let read = self.file.read_exact_at(bytes, u64::from(offset));
        read.map_err(FileError)
    }

    fn capacity(&self) -> usize {
        FLASH_BYTES as usize
    }
}

impl NorFlash for FileFlash {
    const WRITE_SIZE: usize = WORD_BYTES as usize;
    const ERASE_SIZE: usize = PAGE_BYTES as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FileError> {
        for page in (from..to).step_by(Self::ERASE_SIZE) {
            let is_cut = self.is_cut();
            let bytes = Self::ERASE_SIZE / if is_cut { 2 } else { 1 };
            let erased = self.file.write_all_at(&vec![0xff; bytes], u64::from(page));
            erased.map_err(FileError)?;
            if is_cut {
                std::process::exit(POWER_LOST);
            }
        }
        Ok(())
    }

    /// Word by word, as the chip does: between any two of them the process may be killed.
    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FileError> {
        for (address, word) in (offset..)
            .step_by(Self::WRITE_SIZE)
            .zip(bytes.chunks(Self::WRITE_SIZE))
        {
            let mut kept = vec![0; word.len()];
            let at = u64::from(address);
            self.file.read_exact_at(&mut kept, at).map_err(FileError)?;
            let is_cut = self.is_cut();
            let bytes = if is_cut { word.len() / 2 } else { word.len() };
            // Bits only clear.
            for (kept, byte) in kept.iter_mut().zip(&word[..bytes]) {
                *kept &= byte;
            }
            self.file.write_all_at(&kept, at).map_err(FileError)?;
            if is_cut {
                std::process::exit(POWER_LOST);
            }
        }
        Ok(())
    }
}

impl MultiwriteNorFlash for FileFlash {}

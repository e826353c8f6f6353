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

pub(crate) struct FileFlash(File);

#[derive(Debug)]
pub(crate) struct FileError(io::Error);

impl FileFlash {
    /// Opens a flash, or makes an erased one.
    pub(crate) fn open(path: &Path) -> io::Result<Self> {
        let file = OpenOptions::new()
            .read(true)
            .write(true)
            .create(true)
            .truncate(false)
            .open(path)?;
        if file.metadata()?.len() != u64::from(FLASH_BYTES) {
            file.write_all_at(&vec![0xff; FLASH_BYTES as usize], 0)?;
        }
        Ok(Self(file))
    }

    /// A copy of a model as it lies in the flash; it is never given back, as the chip's own memory is not.
    pub(crate) fn mapped(&self, model: Model) -> &'static [u8] {
        let mut bytes = vec![0; model.length as usize];
        match self.0.read_exact_at(&mut bytes, u64::from(model.start)) {
            Ok(()) => Box::leak(bytes.into_boxed_slice()),
            Err(_) => &[],
        }
    }

    pub(crate) fn another(&self) -> io::Result<Self> {
        self.0.try_clone().map(Self)
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
        let read = self.0.read_exact_at(bytes, u64::from(offset));
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
        let erased = self
            .0
            .write_all_at(&vec![0xff; (to - from) as usize], u64::from(from));
        erased.map_err(FileError)
    }

    /// Word by word, as the chip does: between any two of them the process may be killed.
    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), FileError> {
        for (address, word) in (offset..)
            .step_by(Self::WRITE_SIZE)
            .zip(bytes.chunks(Self::WRITE_SIZE))
        {
            let mut kept = vec![0; word.len()];
            let at = u64::from(address);
            self.0.read_exact_at(&mut kept, at).map_err(FileError)?;
            // Bits only clear.
            for (kept, byte) in kept.iter_mut().zip(word) {
                *kept &= byte;
            }
            self.0.write_all_at(&kept, at).map_err(FileError)?;
        }
        Ok(())
    }
}

impl MultiwriteNorFlash for FileFlash {}

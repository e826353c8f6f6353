//! The flash, written in the time that the radio's library gives for it.

use embedded_storage_async::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};
use nrf_sdc::mpsl::{Flash, FlashError};

/// The library's flash, and what it does not say of itself: that a word may be written twice between erases.
pub(crate) struct Nvm(Flash<'static>);

impl Nvm {
    pub(crate) const fn new(flash: Flash<'static>) -> Self {
        Self(flash)
    }
}

/// What the library says went wrong.
#[derive(Clone, Copy, Debug, PartialEq, Eq, defmt::Format)]
pub(crate) struct NvmError(FlashError);

impl NorFlashError for NvmError {
    fn kind(&self) -> NorFlashErrorKind {
        match self.0 {
            FlashError::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            FlashError::Unaligned => NorFlashErrorKind::NotAligned,
            FlashError::Mpsl(_) => NorFlashErrorKind::Other,
        }
    }
}

impl ErrorType for Nvm {
    type Error = NvmError;
}

impl ReadNorFlash for Nvm {
    const READ_SIZE: usize = <Flash<'static> as ReadNorFlash>::READ_SIZE;

    async fn read(&mut self, offset: u32, bytes: &mut [u8]) -> Result<(), NvmError> {
        self.0.read(offset, bytes).map_err(NvmError)
    }

    fn capacity(&self) -> usize {
        ReadNorFlash::capacity(&self.0)
    }
}

impl NorFlash for Nvm {
    const WRITE_SIZE: usize = <Flash<'static> as NorFlash>::WRITE_SIZE;
    const ERASE_SIZE: usize = <Flash<'static> as NorFlash>::ERASE_SIZE;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), NvmError> {
        self.0.erase(from, to).await.map_err(NvmError)
    }

    async fn write(&mut self, offset: u32, bytes: &[u8]) -> Result<(), NvmError> {
        self.0.write(offset, bytes).await.map_err(NvmError)
    }
}

/// The nRF52840 allows two writes of a word between erases (product specification, NVMC, `n_WRITE`).
impl MultiwriteNorFlash for Nvm {}

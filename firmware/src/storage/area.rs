//! One partition of the flash, and the words in it.

use embedded_storage_async::nor_flash::MultiwriteNorFlash;

use super::{
    error::StorageError,
    partitions::{PAGE_BYTES, Partition, WORD_BYTES},
};

/// A mark that is set. Erased it is all ones.
const SET: [u8; 4] = [0; 4];

/// Whether a mark word is set.
///
/// A cut while it was written leaves some bits zero, and a bit may rot: the majority decides. Every mark here
/// may be read either way after a cut.
pub(super) const fn is_set(mark: [u8; 4]) -> bool {
    u32::from_le_bytes(mark).count_zeros() >= 16
}

/// Bytes on a word's boundary: the flash is written from memory word by word.
#[derive(Clone, Debug)]
#[repr(align(4))]
pub(super) struct Aligned<const N: usize>(pub(super) [u8; N]);

impl<const N: usize> Aligned<N> {
    /// As after an erase.
    pub(super) const fn blank() -> Self {
        Self([0xff; N])
    }
}

/// One partition. Offsets count from its start; errors carry the flash's own address.
pub(super) struct Area<'f, F> {
    flash: &'f mut F,
    partition: Partition,
}

impl<'f, F: MultiwriteNorFlash> Area<'f, F> {
    pub(super) const fn new(flash: &'f mut F, partition: Partition) -> Self {
        Self { flash, partition }
    }

    pub(super) const fn partition(&self) -> Partition {
        self.partition
    }

    pub(super) async fn read(
        &mut self,
        offset: u32,
        bytes: &mut [u8],
    ) -> Result<(), StorageError<F::Error>> {
        let address = self.address(offset, bytes.len())?;
        let outcome = self.flash.read(address, bytes).await;
        outcome.map_err(|error| self.failed(address, error))
    }

    pub(super) async fn write(
        &mut self,
        offset: u32,
        bytes: &[u8],
    ) -> Result<(), StorageError<F::Error>> {
        let address = self.address(offset, bytes.len())?;
        let outcome = self.flash.write(address, bytes).await;
        outcome.map_err(|error| self.failed(address, error))
    }

    /// Erases the page that begins at `offset`.
    pub(super) async fn erase_page(&mut self, offset: u32) -> Result<(), StorageError<F::Error>> {
        let address = self.address(offset, PAGE_BYTES as usize)?;
        let outcome = self.flash.erase(address, address + PAGE_BYTES).await;
        outcome.map_err(|error| self.failed(address, error))
    }

    /// Sets the mark at `offset` and makes sure of it.
    pub(super) async fn set(&mut self, offset: u32) -> Result<(), StorageError<F::Error>> {
        self.write(offset, &Aligned(SET).0).await?;
        let mut mark = [0xff; WORD_BYTES as usize];
        self.read(offset, &mut mark).await?;
        if mark == SET {
            Ok(())
        } else {
            Err(self.not_kept(offset))
        }
    }

    pub(super) const fn damaged(
        &self,
        offset: u32,
        expected: u32,
        got: u32,
    ) -> StorageError<F::Error> {
        StorageError::Damaged {
            partition: self.partition.name,
            offset: self.partition.start + offset,
            expected,
            got,
        }
    }

    pub(super) const fn not_kept(&self, offset: u32) -> StorageError<F::Error> {
        StorageError::NotKept {
            partition: self.partition.name,
            offset: self.partition.start + offset,
        }
    }

    fn address(&self, offset: u32, length: usize) -> Result<u32, StorageError<F::Error>> {
        let length = u32::try_from(length).unwrap_or(u32::MAX);
        let end = offset.saturating_add(length);
        if end <= self.partition.length {
            return Ok(self.partition.start + offset);
        }
        Err(StorageError::OutsidePartition {
            partition: self.partition.name,
            expected: self.partition.end(),
            got: self.partition.start.saturating_add(end),
        })
    }

    fn failed(&self, offset: u32, error: F::Error) -> StorageError<F::Error> {
        StorageError::Flash {
            partition: self.partition.name,
            offset,
            error,
        }
    }
}

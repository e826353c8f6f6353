//! What the wearable remembers without power: calibration, bonds and models.
//!
//! [`Storage`] alone writes the flash. Power may go at any moment, also within the writing of a word or the
//! erasing of a page: after the next start the old value is there or the new one, whole. What rots later is found
//! by its checksum and refused. [`partitions`] says where everything lies.
//!
//! An upload survives a cut in whole pages: at most the last 4,095 bytes are sent again. Each of its pages is
//! erased once, so the two slots take 20,000 uploads at the 10,000 erases that the nRF52840 is specified for.
//!
//! The flash is any [`MultiwriteNorFlash`]: marks are set in words that a cut may have left half written.

mod area;
mod error;
mod models;
pub mod partitions;
mod records;
mod slot;

use embedded_storage_async::nor_flash::MultiwriteNorFlash;
use heapless::Vec;

use area::Area;
pub use error::StorageError;
use models::Models;
pub use models::{Announced, Model, Progress};
use partitions::{FLASH_BYTES, Layout, Name, PAGE_BYTES, Partition, WORD_BYTES};
use records::Records;

/// Longest [`Record`] in bytes.
pub const RECORD_BYTES: usize = 256;

const _: () = assert!(RECORD_BYTES <= records::PAYLOAD_LIMIT);

/// A calibration, or the bonds, as they were handed in: this module does not look inside.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Record {
    /// Format of the bytes.
    pub version: u16,
    /// At least one.
    pub bytes: Vec<u8, RECORD_BYTES>,
}

/// The one owner of the flash.
#[derive(Debug)]
pub struct Storage<F: MultiwriteNorFlash> {
    flash: F,
    layout: Layout,
    models: Models<F::Error>,
}

impl<F: MultiwriteNorFlash> Storage<F> {
    /// Takes the flash and finds the newest whole model; that hashes both slots, 160 kB.
    ///
    /// # Errors
    /// [`StorageError::WrongFlash`] for a flash with other pages or words, or a smaller one;
    /// [`StorageError::Flash`] when it fails.
    pub async fn open(mut flash: F, layout: Layout) -> Result<Self, StorageError<F::Error>> {
        let expected = [FLASH_BYTES, PAGE_BYTES, WORD_BYTES];
        let number = |value: usize| u32::try_from(value).unwrap_or(u32::MAX);
        let got = [flash.capacity(), F::ERASE_SIZE, F::WRITE_SIZE].map(number);
        if got[0] < expected[0] || got[1..] != expected[1..] {
            return Err(StorageError::WrongFlash { expected, got });
        }
        let models = Models::find(&mut flash, &layout).await?;
        Ok(Self {
            flash,
            layout,
            models,
        })
    }

    /// The calibration, or none when none was ever kept.
    ///
    /// # Errors
    /// [`StorageError::Damaged`] when the newest has rotted: an older one is not given out in its place, because
    /// electrodes move from one wearing to the next. [`StorageError::Flash`] when the flash fails.
    pub async fn calibration(&mut self) -> Result<Option<Record>, StorageError<F::Error>> {
        self.newest(self.layout.calibration).await
    }

    /// Keeps a calibration; when this returns, it is the one that [`Storage::calibration`] gives.
    ///
    /// # Errors
    /// [`StorageError::WrongLength`] when it is empty, [`StorageError::NotKept`] on a worn page,
    /// [`StorageError::Flash`] when the flash fails.
    pub async fn keep_calibration(
        &mut self,
        calibration: &Record,
    ) -> Result<(), StorageError<F::Error>> {
        self.keep(self.layout.calibration, calibration).await
    }

    /// The bonds, or none when none were ever kept.
    ///
    /// # Errors
    /// [`StorageError::Damaged`] when the newest record has rotted: an older one might hold a host whose bond was
    /// taken away. [`StorageError::Flash`] when the flash fails.
    pub async fn bonds(&mut self) -> Result<Option<Record>, StorageError<F::Error>> {
        self.newest(self.layout.bonds).await
    }

    /// Keeps these bonds in place of the ones before, damaged ones too. Old keys stay in the flash until their page's turn to
    /// be erased; only the chip's readback protection, which nothing here switches on, would hide them.
    ///
    /// # Errors
    /// As [`Self::keep_calibration`].
    pub async fn keep_bonds(&mut self, bonds: &Record) -> Result<(), StorageError<F::Error>> {
        self.keep(self.layout.bonds, bonds).await
    }

    /// The model in use. It stays where it is until another upload **after** the one that replaced it begins.
    #[must_use]
    pub fn model(&self) -> Option<Model> {
        self.models.active(&self.layout)
    }

    /// A model that was whole once and no longer is; the other one, if any, is in use. After a cut while an old
    /// model was erased this may speak of that one.
    #[must_use]
    pub const fn model_damage(&self) -> Option<&StorageError<F::Error>> {
        self.models.damage()
    }

    /// How far an upload has come, if one is under way.
    #[must_use]
    pub fn upload(&self) -> Option<Progress> {
        self.models.progress()
    }

    /// Longest model in bytes.
    #[must_use]
    pub const fn model_capacity(&self) -> u32 {
        self.layout.model_capacity()
    }

    /// Announces a model of `length` bytes. The same one goes on where it stopped, also after a power cut; any
    /// other upload that was under way is abandoned.
    ///
    /// # Errors
    /// [`StorageError::WrongLength`] when it is empty or too long, [`StorageError::NotKept`] on a worn page,
    /// [`StorageError::Flash`] when the flash fails.
    pub async fn begin_upload(
        &mut self,
        length: u32,
        sha256: [u8; 32],
    ) -> Result<Announced, StorageError<F::Error>> {
        self.models
            .begin(&mut self.flash, &self.layout, length, sha256)
            .await
    }

    /// Takes the model's bytes from `offset` on; pieces come in order and of any length.
    ///
    /// # Errors
    /// [`StorageError::NotReceiving`], [`StorageError::WrongOffset`], [`StorageError::TooMuch`]: nothing changed.
    /// [`StorageError::Flash`], [`StorageError::NotKept`]: send again from [`Progress::received`] on.
    pub async fn receive_piece(
        &mut self,
        offset: u32,
        bytes: &[u8],
    ) -> Result<(), StorageError<F::Error>> {
        self.models
            .piece(&mut self.flash, &self.layout, offset, bytes)
            .await
    }

    /// Checks the hash of what lies in the flash, asks `fits` whether this build can run it, and puts it into use.
    ///
    /// # Errors
    /// [`StorageError::NotReceiving`], [`StorageError::Incomplete`]: nothing changed.
    /// [`StorageError::HashMismatch`], [`StorageError::NotFitting`]: the upload is abandoned. [`StorageError::Flash`],
    /// [`StorageError::NotKept`]: finish again.
    pub async fn finish_upload(
        &mut self,
        fits: impl FnOnce(Model) -> bool,
    ) -> Result<(), StorageError<F::Error>> {
        self.models
            .finish(&mut self.flash, &self.layout, fits)
            .await
    }

    /// Forgets what was received of a model; the one in use stays.
    ///
    /// # Errors
    /// [`StorageError::NotReceiving`], [`StorageError::Flash`] when the flash fails.
    pub async fn abandon_upload(&mut self) -> Result<(), StorageError<F::Error>> {
        self.models.abandon(&mut self.flash, &self.layout).await
    }

    fn records(&mut self, partition: Partition) -> Records<'_, F> {
        Records::new(Area::new(&mut self.flash, partition))
    }

    async fn newest(
        &mut self,
        partition: Partition,
    ) -> Result<Option<Record>, StorageError<F::Error>> {
        let Some(place) = self.records(partition).newest().await? else {
            return Ok(None);
        };
        let version = place.version();
        match Vec::from_slice(place.payload()) {
            Ok(bytes) => Ok(Some(Record { version, bytes })),
            Err(_) => Err(wrong_length(partition.name, place.payload())),
        }
    }

    async fn keep(
        &mut self,
        partition: Partition,
        record: &Record,
    ) -> Result<(), StorageError<F::Error>> {
        if record.bytes.is_empty() {
            return Err(wrong_length(partition.name, &[]));
        }
        self.records(partition)
            .append(record.version, &record.bytes)
            .await
    }
}

fn wrong_length<E: core::fmt::Debug>(partition: Name, bytes: &[u8]) -> StorageError<E> {
    StorageError::WrongLength {
        partition,
        expected: RECORD_BYTES as u32,
        got: u32::try_from(bytes.len()).unwrap_or(u32::MAX),
    }
}

#[cfg(test)]
pub(crate) mod tests;

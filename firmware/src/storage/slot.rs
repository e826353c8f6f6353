//! One of the two places for a model: a page that describes it, then the model, contiguous for the processor to
//! read in place.
//!
//! ```text
//! 0    tag u32 | sequence u32 | length u32 | SHA-256 (32) | CRC-32 of all before
//! 48   whole mark: the hash was found right over what lies in the flash
//! 52   one mark per page of the model: that page is written
//! ```
//!
//! Numbers are little-endian.

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use embassy_futures::yield_now;
use embedded_storage_async::nor_flash::MultiwriteNorFlash;
use sha2::{Digest, Sha256};

use super::{
    area::{Aligned, Area, is_set},
    error::StorageError,
    partitions::{DK, PAGE_BYTES, XIAO},
};

static CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

/// "TNM1", first byte first.
const TAG: [u8; 4] = *b"TNM1";
const HASH: usize = 12;
const CHECKSUM: usize = HASH + 32;
const WHOLE_MARK: usize = CHECKSUM + 4;
const PAGE_MARKS: usize = WHOLE_MARK + 4;
/// Pages of a model that marks are read for; a slot has fewer.
const MOST_PAGES: usize = 32;
const DESCRIPTION_BYTES: usize = PAGE_MARKS + 4 * MOST_PAGES;

const _: () = assert!(DK.model_capacity() <= MOST_PAGES as u32 * PAGE_BYTES);
const _: () = assert!(XIAO.model_capacity() <= MOST_PAGES as u32 * PAGE_BYTES);

/// A model that is announced or lies in a slot.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) struct Description {
    /// Counts the uploads: of two whole models the higher is the newer.
    pub(super) sequence: u32,
    /// In bytes.
    pub(super) length: u32,
    pub(super) sha256: [u8; 32],
}

/// What a slot holds, by its first page alone.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Content {
    /// Nothing that was ever announced in full.
    Nothing,
    /// A model of which `received` bytes, in whole pages, lie in the flash.
    Receiving {
        description: Description,
        received: u32,
    },
    /// A model whose hash was right once.
    Whole(Description),
    /// A model was whole here, and its description no longer is.
    Damaged { expected: u32, got: u32 },
}

impl Description {
    fn encode(&self) -> Aligned<WHOLE_MARK> {
        let mut bytes = Aligned([0; WHOLE_MARK]);
        bytes.0[..4].copy_from_slice(&TAG);
        bytes.0[4..8].copy_from_slice(&self.sequence.to_le_bytes());
        bytes.0[8..HASH].copy_from_slice(&self.length.to_le_bytes());
        bytes.0[HASH..CHECKSUM].copy_from_slice(&self.sha256);
        let checksum = CRC.checksum(&bytes.0[..CHECKSUM]);
        bytes.0[CHECKSUM..].copy_from_slice(&checksum.to_le_bytes());
        bytes
    }
}

/// One slot.
pub(super) struct Slot<'f, F> {
    area: Area<'f, F>,
}

impl<'f, F: MultiwriteNorFlash> Slot<'f, F> {
    pub(super) const fn new(area: Area<'f, F>) -> Self {
        Self { area }
    }

    /// Reads the description and the marks; the model itself is not looked at.
    pub(super) async fn content(&mut self) -> Result<Content, StorageError<F::Error>> {
        let mut bytes = [0; DESCRIPTION_BYTES];
        self.area.read(0, &mut bytes).await?;
        let word = |at: usize| [bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]];
        let whole = is_set(word(WHOLE_MARK));
        let expected = u32::from_le_bytes(word(CHECKSUM));
        let got = CRC.checksum(&bytes[..CHECKSUM]);
        let length = u32::from_le_bytes(word(8));
        let fits = length > 0 && length <= self.area.partition().length - PAGE_BYTES;
        if expected != got || word(0) != TAG || !fits {
            return Ok(if whole {
                Content::Damaged { expected, got }
            } else {
                Content::Nothing
            });
        }
        let mut sha256 = [0; 32];
        sha256.copy_from_slice(&bytes[HASH..CHECKSUM]);
        let description = Description {
            sequence: u32::from_le_bytes(word(4)),
            length,
            sha256,
        };
        if whole {
            return Ok(Content::Whole(description));
        }
        let pages = (0..MOST_PAGES).take_while(|page| is_set(word(PAGE_MARKS + 4 * page)));
        let received = (pages.count() as u32 * PAGE_BYTES).min(length);
        Ok(Content::Receiving {
            description,
            received,
        })
    }

    /// Announces a model: whatever was here is gone.
    pub(super) async fn describe(
        &mut self,
        description: &Description,
    ) -> Result<(), StorageError<F::Error>> {
        self.clear().await?;
        let written = description.encode();
        self.area.write(0, &written.0).await?;
        let mut kept = [0; WHOLE_MARK];
        self.area.read(0, &mut kept).await?;
        if kept == written.0 {
            Ok(())
        } else {
            Err(self.area.not_kept(0))
        }
    }

    /// Forgets what is here.
    pub(super) async fn clear(&mut self) -> Result<(), StorageError<F::Error>> {
        self.area.erase_page(0).await
    }

    /// Makes room for the page of the model that begins at `offset`.
    pub(super) async fn erase_page(&mut self, offset: u32) -> Result<(), StorageError<F::Error>> {
        self.area.erase_page(PAGE_BYTES + offset).await
    }

    /// Writes whole words of the model.
    pub(super) async fn write(
        &mut self,
        offset: u32,
        bytes: &[u8],
    ) -> Result<(), StorageError<F::Error>> {
        self.area.write(PAGE_BYTES + offset, bytes).await
    }

    /// Notes that the page of the model that holds `offset` is written.
    pub(super) async fn mark_page(&mut self, offset: u32) -> Result<(), StorageError<F::Error>> {
        let mark = PAGE_MARKS as u32 + offset / PAGE_BYTES * 4;
        self.area.set(mark).await
    }

    /// Notes that the model is whole: from here on it counts.
    pub(super) async fn mark_whole(&mut self) -> Result<(), StorageError<F::Error>> {
        self.area.set(WHOLE_MARK as u32).await
    }

    /// SHA-256 of the first `length` bytes, lets others run between pages.
    pub(super) async fn hash(&mut self, length: u32) -> Result<[u8; 32], StorageError<F::Error>> {
        let mut hash = Sha256::new();
        let mut chunk = [0; 256];
        let mut offset = 0;
        while offset < length {
            let wanted = (length - offset).min(chunk.len() as u32);
            let bytes = &mut chunk[..wanted as usize];
            self.area.read(PAGE_BYTES + offset, bytes).await?;
            hash.update(&bytes);
            offset += wanted;
            if offset.is_multiple_of(PAGE_BYTES) {
                yield_now().await;
            }
        }
        Ok(hash.finalize().into())
    }

    pub(super) const fn damaged(
        &self,
        offset: u32,
        expected: u32,
        got: u32,
    ) -> StorageError<F::Error> {
        self.area.damaged(offset, expected, got)
    }
}

/// The first four bytes, in the order they are printed.
pub(super) const fn head(sha256: &[u8; 32]) -> u32 {
    u32::from_be_bytes([sha256[0], sha256[1], sha256[2], sha256[3]])
}

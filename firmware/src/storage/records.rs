//! A short record that always has a newest whole version, in two pages that take turns.
//!
//! ```text
//! page    closed mark, padding (32 bytes), then eight places
//! place   sequence u32 | length u16 | version u16 | CRC-32 | payload, padded with ones | written mark
//! ```
//!
//! A record is written into the next blank place, its mark last, and nothing is ever written over: the record
//! before it stands until then and after. When a page is full the other one is erased, and only then is the full
//! one marked closed; the page that is not closed is the current one. A record without its mark was cut short and was never
//! acknowledged; a record with its mark and a wrong checksum has rotted, and is refused rather than replaced by
//! an older one.
//!
//! **Wear.** One erase for eight records, the two pages in turn. At the 10,000 erases that the nRF52840 is specified for,
//! that is 160,000 records.
//!
//! The crate `sequential-storage` (8.0.2) was weighed for this. Its map passes over a damaged record in silence and
//! gives out the one before it, which here must not happen; and cuts within a record's header can make it lose a
//! record that it acknowledged later (its issue 136, open at the time).

use crc::{CRC_32_ISO_HDLC, Crc, NoTable};
use embedded_storage_async::nor_flash::MultiwriteNorFlash;

use super::{
    area::{Aligned, Area, is_set},
    error::StorageError,
    partitions::PAGE_BYTES,
};

/// Computed without its table of 1 kB: a record is read at start and written by hand.
static CRC: Crc<u32, NoTable> = Crc::<u32, NoTable>::new(&CRC_32_ISO_HDLC);

const PAGES: usize = 2;
/// Places per page: the erases that writing saves.
pub(super) const PLACES: usize = 8;
/// The closed mark, and room up to the first place.
const PAGE_HEADER_BYTES: usize = 32;
const PLACE_BYTES: usize = (PAGE_BYTES as usize - PAGE_HEADER_BYTES) / PLACES;
const MARK_BYTES: usize = 4;
const MARK: usize = PLACE_BYTES - MARK_BYTES;
/// Sequence, length and version: what the checksum begins with.
const HEADER_BYTES: usize = 8;
const PAYLOAD: usize = HEADER_BYTES + 4;
/// Longest payload in bytes.
pub(super) const PAYLOAD_LIMIT: usize = MARK - PAYLOAD;

const _: () = assert!(PLACE_BYTES.is_multiple_of(4) && PAYLOAD.is_multiple_of(4));

/// The bytes of one place, and what they are.
#[derive(Clone, Debug)]
pub(super) struct Place(Aligned<PLACE_BYTES>);

/// What a place holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Content {
    Blank,
    /// Cut short while it was written.
    Interrupted,
    Whole {
        sequence: u32,
    },
    Damaged {
        expected: u32,
        got: u32,
    },
}

impl Place {
    const fn blank() -> Self {
        Self(Aligned::blank())
    }

    /// A place that holds `payload`, of at most [`PAYLOAD_LIMIT`] bytes; its mark is not set.
    fn with(sequence: u32, version: u16, payload: &[u8]) -> Self {
        let mut place = Self::blank();
        let bytes = &mut place.0.0;
        let length = payload.len().min(PAYLOAD_LIMIT);
        bytes[..4].copy_from_slice(&sequence.to_le_bytes());
        bytes[4..6].copy_from_slice(&(length as u16).to_le_bytes());
        bytes[6..8].copy_from_slice(&version.to_le_bytes());
        bytes[PAYLOAD..PAYLOAD + length].copy_from_slice(&payload[..length]);
        let checksum = place.checksum();
        place.0.0[HEADER_BYTES..PAYLOAD].copy_from_slice(&checksum.to_le_bytes());
        place
    }

    fn short(&self, at: usize) -> u16 {
        u16::from_le_bytes([self.0.0[at], self.0.0[at + 1]])
    }

    fn word(&self, at: usize) -> u32 {
        let bytes = &self.0.0;
        u32::from_le_bytes([bytes[at], bytes[at + 1], bytes[at + 2], bytes[at + 3]])
    }

    /// The version of the payload's format, as it was given.
    pub(super) fn version(&self) -> u16 {
        self.short(6)
    }

    pub(super) fn payload(&self) -> &[u8] {
        let length = usize::from(self.short(4)).min(PAYLOAD_LIMIT);
        &self.0.0[PAYLOAD..PAYLOAD + length]
    }

    /// Everything up to the end of the payload in whole words.
    fn written(&self) -> &[u8] {
        let end = PAYLOAD + self.payload().len().next_multiple_of(4);
        &self.0.0[..end]
    }

    fn checksum(&self) -> u32 {
        let mut digest = CRC.digest();
        digest.update(&self.0.0[..HEADER_BYTES]);
        digest.update(self.payload());
        digest.finalize()
    }

    fn content(&self) -> Content {
        let bytes = &self.0.0;
        if bytes.iter().all(|&byte| byte == 0xff) {
            return Content::Blank;
        }
        if !is_set([
            bytes[MARK],
            bytes[MARK + 1],
            bytes[MARK + 2],
            bytes[MARK + 3],
        ]) {
            return Content::Interrupted;
        }
        let (expected, got) = (self.word(HEADER_BYTES), self.checksum());
        if expected == got && usize::from(self.short(4)) <= PAYLOAD_LIMIT {
            Content::Whole {
                sequence: self.word(0),
            }
        } else {
            Content::Damaged { expected, got }
        }
    }
}

/// What one page holds.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
struct Page {
    closed: bool,
    /// Places up to the last that is not blank.
    used: usize,
    /// The last place whose record was finished, whole or damaged by now.
    last: Option<usize>,
    /// The highest sequence of a whole record.
    sequence: Option<u32>,
}

/// The records of one partition.
pub(super) struct Records<'f, F> {
    area: Area<'f, F>,
}

impl<'f, F: MultiwriteNorFlash> Records<'f, F> {
    pub(super) const fn new(area: Area<'f, F>) -> Self {
        Self { area }
    }

    /// The newest record, or none when none was ever finished.
    ///
    /// # Errors
    /// [`StorageError::Damaged`] when the newest record has rotted, [`StorageError::Flash`] when the flash fails.
    pub(super) async fn newest(&mut self) -> Result<Option<Place>, StorageError<F::Error>> {
        let (pages, current) = self.survey().await?;
        for page in [current, 1 - current] {
            let Some(index) = pages[page].last else {
                continue;
            };
            let place = self.place(page, index).await?;
            return match place.content() {
                Content::Damaged { expected, got } => {
                    Err(self.area.damaged(offset(page, index), expected, got))
                }
                _ => Ok(Some(place)),
            };
        }
        Ok(None)
    }

    /// Writes the next record: when this returns, it is the newest; cut short at any point, the one before is, or
    /// this one.
    ///
    /// # Errors
    /// [`StorageError::WrongLength`] for a payload that is empty or beyond [`PAYLOAD_LIMIT`],
    /// [`StorageError::NotKept`] when it reads back differently, [`StorageError::Flash`] when the flash fails.
    pub(super) async fn append(
        &mut self,
        version: u16,
        payload: &[u8],
    ) -> Result<(), StorageError<F::Error>> {
        if payload.is_empty() || payload.len() > PAYLOAD_LIMIT {
            return Err(StorageError::WrongLength {
                partition: self.area.partition().name,
                expected: PAYLOAD_LIMIT as u32,
                got: u32::try_from(payload.len()).unwrap_or(u32::MAX),
            });
        }
        let (pages, current) = self.survey().await?;
        let sequence = pages.iter().filter_map(|page| page.sequence).max();
        let place = Place::with(sequence.unwrap_or(0).wrapping_add(1), version, payload);
        let (page, index) = self.next_place(pages, current).await?;

        let at = offset(page, index);
        self.area.write(at, place.written()).await?;
        let kept = self.place(page, index).await?;
        if kept.0.0 != place.0.0 {
            return Err(self.area.not_kept(at));
        }
        self.area.set(at + MARK as u32).await
    }

    /// Page and index of a blank place, made where there is none.
    async fn next_place(
        &mut self,
        pages: [Page; PAGES],
        current: usize,
    ) -> Result<(usize, usize), StorageError<F::Error>> {
        let page = pages[current];
        if page.used < PLACES {
            return Ok((current, page.used));
        }
        if page.last.is_none() {
            // Nothing but writes cut short: what counts is in the other page.
            self.area.erase_page(offset_of_page(current)).await?;
            return Ok((current, 0));
        }
        let other = 1 - current;
        self.area.erase_page(offset_of_page(other)).await?;
        self.area.set(offset_of_page(current)).await?;
        Ok((other, 0))
    }

    /// Both pages, and which of them is the current one.
    async fn survey(&mut self) -> Result<([Page; PAGES], usize), StorageError<F::Error>> {
        let mut pages = [Page::default(); PAGES];
        for (number, page) in pages.iter_mut().enumerate() {
            let mut mark = [0xff; MARK_BYTES];
            self.area.read(offset_of_page(number), &mut mark).await?;
            page.closed = is_set(mark);
            for index in 0..PLACES {
                let content = self.place(number, index).await?.content();
                if content != Content::Blank {
                    page.used = index + 1;
                }
                match content {
                    Content::Whole { sequence } => {
                        page.last = Some(index);
                        page.sequence = page.sequence.max(Some(sequence));
                    }
                    Content::Damaged { .. } => page.last = Some(index),
                    Content::Blank | Content::Interrupted => {}
                }
            }
        }
        // Neither is closed at the very start, and between the erase of one and the closing of the other.
        let current = match (pages[0].closed, pages[1].closed) {
            (true, false) => 1,
            (false, true) => 0,
            _ => usize::from(pages[1].sequence > pages[0].sequence),
        };
        Ok((pages, current))
    }

    async fn place(&mut self, page: usize, index: usize) -> Result<Place, StorageError<F::Error>> {
        let mut place = Place::blank();
        self.area.read(offset(page, index), &mut place.0.0).await?;
        Ok(place)
    }
}

const fn offset_of_page(page: usize) -> u32 {
    page as u32 * PAGE_BYTES
}

const fn offset(page: usize, index: usize) -> u32 {
    offset_of_page(page) + (PAGE_HEADER_BYTES + index * PLACE_BYTES) as u32
}

//! The model in use and the one that is being received, in two slots that change roles.

use embedded_storage_async::nor_flash::MultiwriteNorFlash;

use super::{
    area::{Aligned, Area},
    error::StorageError,
    partitions::{Layout, Name, PAGE_BYTES, WORD_BYTES},
    slot::{Content, Description, Slot, head},
};

const WORD: usize = WORD_BYTES as usize;
/// Bytes of a piece that are written at once: a whole frame over the air.
const CHUNK_BYTES: usize = 256;

/// A whole model in the flash.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Model {
    /// The flash's address of its first byte; it is contiguous.
    pub start: u32,
    /// Length in bytes.
    pub length: u32,
    /// SHA-256 of those bytes, found right when the wearable started or the upload was finished.
    pub sha256: [u8; 32],
}

/// How far an upload has come.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Progress {
    /// Bytes received: the offset of the next piece.
    pub received: u32,
    /// Bytes announced.
    pub length: u32,
    /// SHA-256 announced.
    pub sha256: [u8; 32],
}

/// What to do after an upload was announced.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Announced {
    /// Send pieces from this offset on; it is not 0 when an upload of the same model goes on.
    SendFrom(u32),
    /// This very model is in use already.
    InUse,
}

#[derive(Clone, Copy, Debug)]
struct Active {
    slot: usize,
    description: Description,
}

#[derive(Clone, Debug)]
struct Incoming {
    slot: usize,
    description: Description,
    /// Bytes accepted, those in `tail` among them.
    received: u32,
    /// The last bytes, which do not fill a word yet, and how many they are.
    tail: [u8; WORD],
    held: usize,
}

/// What the two slots hold; `E` is the flash's error.
#[derive(Debug)]
pub(super) struct Models<E: core::fmt::Debug> {
    active: Option<Active>,
    incoming: Option<Incoming>,
    /// The highest of both slots.
    sequence: u32,
    damage: Option<StorageError<E>>,
}

impl<E: core::fmt::Debug> Models<E> {
    /// Looks at both slots. The newest whole model whose hash is right is in use; one whose hash is not is
    /// damage, and the other is used.
    pub(super) async fn find<F>(flash: &mut F, layout: &Layout) -> Result<Self, StorageError<E>>
    where
        F: MultiwriteNorFlash<Error = E>,
    {
        let mut found = Self {
            active: None,
            incoming: None,
            sequence: 0,
            damage: None,
        };
        for number in 0..2 {
            let mut slot = slot(flash, layout, number);
            match slot.content().await? {
                Content::Nothing => {}
                Content::Damaged { expected, got } => {
                    found.damage = Some(slot.damaged(0, expected, got));
                }
                Content::Receiving {
                    description,
                    received,
                } => {
                    found.sequence = found.sequence.max(description.sequence);
                    found.incoming = Some(Incoming::new(number, description, received));
                }
                Content::Whole(description) => {
                    found.sequence = found.sequence.max(description.sequence);
                    let hash = slot.hash(description.length).await?;
                    let newer = found.active.is_none_or(|active: Active| {
                        active.description.sequence < description.sequence
                    });
                    if hash != description.sha256 {
                        let expected = head(&description.sha256);
                        found.damage = Some(slot.damaged(PAGE_BYTES, expected, head(&hash)));
                    } else if newer {
                        found.active = Some(Active {
                            slot: number,
                            description,
                        });
                    }
                }
            }
        }
        Ok(found)
    }

    pub(super) fn active(&self, layout: &Layout) -> Option<Model> {
        self.active
            .map(|active| model(layout, active.slot, &active.description))
    }

    pub(super) fn progress(&self) -> Option<Progress> {
        self.incoming.as_ref().map(|incoming| Progress {
            received: incoming.received,
            length: incoming.description.length,
            sha256: incoming.description.sha256,
        })
    }

    pub(super) const fn damage(&self) -> Option<&StorageError<E>> {
        self.damage.as_ref()
    }

    /// Announces a model. The same one goes on where it stopped; another one takes its place.
    pub(super) async fn begin<F>(
        &mut self,
        flash: &mut F,
        layout: &Layout,
        length: u32,
        sha256: [u8; 32],
    ) -> Result<Announced, StorageError<E>>
    where
        F: MultiwriteNorFlash<Error = E>,
    {
        if length == 0 || length > layout.model_capacity() {
            return Err(StorageError::WrongLength {
                partition: Name::Model,
                expected: layout.model_capacity(),
                got: length,
            });
        }
        let same = |other: &Description| other.length == length && other.sha256 == sha256;
        if self.active.is_some_and(|active| same(&active.description)) {
            return Ok(Announced::InUse);
        }
        if let Some(incoming) = &self.incoming
            && same(&incoming.description)
        {
            return Ok(Announced::SendFrom(incoming.received));
        }
        let number = match (&self.active, &self.incoming) {
            (Some(active), _) => 1 - active.slot,
            (None, Some(incoming)) => incoming.slot,
            (None, None) => 0,
        };
        let description = Description {
            sequence: self.sequence.wrapping_add(1),
            length,
            sha256,
        };
        self.incoming = None;
        slot(flash, layout, number).describe(&description).await?;
        self.sequence = description.sequence;
        self.incoming = Some(Incoming::new(number, description, 0));
        Ok(Announced::SendFrom(0))
    }

    /// Takes the next piece. When the flash fails, the piece's page is to be sent again.
    pub(super) async fn piece<F>(
        &mut self,
        flash: &mut F,
        layout: &Layout,
        offset: u32,
        bytes: &[u8],
    ) -> Result<(), StorageError<E>>
    where
        F: MultiwriteNorFlash<Error = E>,
    {
        let incoming = self.incoming.as_mut().ok_or(StorageError::NotReceiving)?;
        if offset != incoming.received {
            return Err(StorageError::WrongOffset {
                expected: incoming.received,
                got: offset,
            });
        }
        let end = offset.saturating_add(u32::try_from(bytes.len()).unwrap_or(u32::MAX));
        if end > incoming.description.length {
            return Err(StorageError::TooMuch {
                expected: incoming.description.length,
                got: end,
            });
        }
        let mut slot = slot(flash, layout, incoming.slot);
        let mut rest = bytes;
        while !rest.is_empty() {
            let room = (PAGE_BYTES - incoming.received % PAGE_BYTES) as usize;
            let (now, later) = rest.split_at(rest.len().min(room).min(CHUNK_BYTES));
            let written = incoming.write(&mut slot, now).await;
            if written.is_err() {
                incoming.rewind();
                return written;
            }
            rest = later;
        }
        Ok(())
    }

    /// Compares the hash over the flash, asks whether the model fits, and puts it into use.
    pub(super) async fn finish<F>(
        &mut self,
        flash: &mut F,
        layout: &Layout,
        fits: impl FnOnce(Model) -> bool,
    ) -> Result<(), StorageError<E>>
    where
        F: MultiwriteNorFlash<Error = E>,
    {
        let incoming = self.incoming.as_ref().ok_or(StorageError::NotReceiving)?;
        let Incoming {
            slot: number,
            description,
            received,
            ..
        } = *incoming;
        if received < description.length {
            return Err(StorageError::Incomplete {
                expected: description.length,
                got: received,
            });
        }
        let mut slot = slot(flash, layout, number);
        let hash = slot.hash(description.length).await?;
        if hash != description.sha256 {
            slot.clear().await?;
            self.incoming = None;
            return Err(StorageError::HashMismatch {
                expected: head(&description.sha256),
                got: head(&hash),
            });
        }
        if !fits(model(layout, number, &description)) {
            slot.clear().await?;
            self.incoming = None;
            return Err(StorageError::NotFitting);
        }
        slot.mark_whole().await?;
        self.incoming = None;
        self.damage = None;
        self.active = Some(Active {
            slot: number,
            description,
        });
        Ok(())
    }

    /// Forgets what was received.
    pub(super) async fn abandon<F>(
        &mut self,
        flash: &mut F,
        layout: &Layout,
    ) -> Result<(), StorageError<E>>
    where
        F: MultiwriteNorFlash<Error = E>,
    {
        let incoming = self.incoming.as_ref().ok_or(StorageError::NotReceiving)?;
        slot(flash, layout, incoming.slot).clear().await?;
        self.incoming = None;
        Ok(())
    }
}

impl Incoming {
    const fn new(slot: usize, description: Description, received: u32) -> Self {
        Self {
            slot,
            description,
            received,
            tail: [0; WORD],
            held: 0,
        }
    }

    /// Writes `bytes`, at most [`CHUNK_BYTES`] and within one page.
    async fn write<F: MultiwriteNorFlash>(
        &mut self,
        slot: &mut Slot<'_, F>,
        bytes: &[u8],
    ) -> Result<(), StorageError<F::Error>> {
        if self.received.is_multiple_of(PAGE_BYTES) {
            slot.erase_page(self.received).await?;
        }
        let mut words = Aligned::<{ CHUNK_BYTES + WORD }>::blank();
        let filled = self.held + bytes.len();
        words.0[..self.held].copy_from_slice(&self.tail[..self.held]);
        words.0[self.held..filled].copy_from_slice(bytes);

        let received = self.received + bytes.len() as u32;
        let page_ends = received.is_multiple_of(PAGE_BYTES) || received == self.description.length;
        let whole = if page_ends {
            filled.next_multiple_of(WORD)
        } else {
            filled / WORD * WORD
        };
        if whole > 0 {
            let start = self.received - self.held as u32;
            slot.write(start, &words.0[..whole]).await?;
        }
        if page_ends {
            slot.mark_page(received - 1).await?;
            self.held = 0;
        } else {
            self.tail.copy_from_slice(&words.0[whole..whole + WORD]);
            self.held = filled - whole;
        }
        self.received = received;
        Ok(())
    }

    /// Goes back to the last page boundary: what lies behind it is erased before it is written again.
    fn rewind(&mut self) {
        self.received -= self.received % PAGE_BYTES;
        self.held = 0;
    }
}

const fn model(layout: &Layout, slot: usize, description: &Description) -> Model {
    Model {
        start: layout.models[slot].start + PAGE_BYTES,
        length: description.length,
        sha256: description.sha256,
    }
}

const fn slot<'f, F: MultiwriteNorFlash>(
    flash: &'f mut F,
    layout: &Layout,
    number: usize,
) -> Slot<'f, F> {
    Slot::new(Area::new(flash, layout.models[number]))
}

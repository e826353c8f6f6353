//! A model on its way into a wearable: requests out, answers in, no input or output of its own.
//!
//! ```text
//! ask what it holds -> begin -> piece, piece, ... -> finish -> ask what it holds
//! ```
//!
//! Each request waits for its answer; the next piece begins where the answer says. After a silence, or when the link was lost,
//! it starts over by asking, and goes on where the wearable stopped. The model in use stays until the new one is whole.

use std::io::Read;

use sha2::{Digest, Sha256};
use thiserror::Error;
use tonus_shared::image::{ImageError, ModelImage, WEARABLE};
use tonus_shared::wire::{
    CRC_BYTES, Control, HEADER_BYTES, Kind, MAX_PIECE_BYTES, ModelState, ModelUpload, Packet,
    Refusal, Reply,
};

/// An answer that did not come for so long will not come, microseconds: the longest is that to a beginning, for which twenty pages
/// of flash are erased, 85 ms each and, beside a radio, a little at a time.
const ANSWER_WITHIN_US: u64 = 8_000_000;
/// A wearable that does something else is left alone for so long, microseconds.
const BUSY_US: u64 = 100_000;
/// So many times in a row it begins anew without getting on.
const SETBACKS: u32 = 4;
/// Bytes of a piece's frame besides the piece (step and offset, as docs/wire.md has them), and of the write that carries it
/// (Bluetooth Core Specification, volume 3, part F, 3.4.5).
const AROUND_PIECE: usize = HEADER_BYTES + 1 + 4 + CRC_BYTES + 3;
/// More bytes than any wearable has flash.
const MOST_BYTES: u64 = 1 << 20;

/// Why a model does not get into the wearable. The one that it had is in use as before.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum UploadError {
    /// No model as the wearable keeps it.
    #[error("this is no model for a wearable ({0}): write one with `tonus export MODEL -o IMAGE`")]
    Image(#[from] ImageError),
    /// Far too long.
    #[error("it has more than {MOST_BYTES} bytes: give what `tonus export MODEL -o IMAGE` wrote")]
    TooLong,
    /// It keeps none.
    #[error("this wearable keeps no models: only the firmware of this project does")]
    KeepsNone,
    /// Not enough room.
    #[error(
        "the model has {bytes} bytes, the wearable has room for {capacity_bytes}: export it with a lower --rank, or train fewer basis functions"
    )]
    TooLarge {
        /// Of the model.
        bytes: usize,
        /// Of the wearable's room.
        capacity_bytes: u32,
    },
    /// Too many answers in a row did not come.
    #[error(
        "the wearable does not answer: go nearer, or restart it, and upload again; it goes on where it stopped"
    )]
    Silent,
    /// It arrived otherwise than it was sent, though every piece has a checksum.
    #[error("what arrived is not what was sent: upload it again")]
    Changed,
    /// The wearable's flash.
    #[error(
        "the wearable could not write its flash: restart it and upload again; if that does not help, its flash is worn out"
    )]
    Flash,
    /// The wearable's own check.
    #[error(
        "the wearable cannot run this model: export it with the version of `tonus` that its firmware was built from"
    )]
    NotFitting,
    /// Refused otherwise.
    #[error("the wearable refused ({0:?}): restart it and upload again")]
    Refused(Refusal),
}

/// What is done next, or was asked last.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
enum Step {
    Ask,
    Begin { resume_bytes: u32 },
    Piece { offset_bytes: u32 },
    Finish,
    Verify,
    Done,
}

/// One model on its way.
#[derive(Debug)]
pub struct Upload {
    image: Vec<u8>,
    sha256: [u8; 32],
    piece_bytes: usize,
    step: Step,
    /// Number of the request that waits for its answer, and when it left.
    asked: Option<(u32, u64)>,
    /// Nothing is asked before this time, microseconds.
    not_before_us: u64,
    setbacks: u32,
    /// Whether a beginning was asked for in this upload.
    began: bool,
}

impl Upload {
    /// As [`Upload::new`], of a file or whatever else can be read; no more of it than an image may have.
    ///
    /// # Errors
    /// What reading gives; [`UploadError::TooLong`] and those of [`Upload::new`] among it.
    pub fn read(source: impl Read) -> std::io::Result<Self> {
        let mut image = Vec::new();
        source.take(MOST_BYTES + 1).read_to_end(&mut image)?;
        if image.len() as u64 > MOST_BYTES {
            return Err(std::io::Error::other(UploadError::TooLong));
        }
        Self::new(image).map_err(std::io::Error::other)
    }

    /// Checks the image as the wearable will.
    ///
    /// # Errors
    /// [`UploadError::Image`].
    pub fn new(image: Vec<u8>) -> Result<Self, UploadError> {
        // Where it lies in the flash its numbers are aligned.
        let words: Vec<u32> = bytemuck::pod_collect_to_vec(&image);
        ModelImage::parse(&bytemuck::cast_slice(&words)[..image.len()], &WEARABLE)?;
        Ok(Self {
            sha256: Sha256::digest(&image).into(),
            image,
            piece_bytes: MAX_PIECE_BYTES,
            step: Step::Ask,
            asked: None,
            not_before_us: 0,
            setbacks: 0,
            began: false,
        })
    }

    /// A link is up, anew perhaps; `mtu`: its attribute MTU, if it has one.
    pub fn up(&mut self, mtu: Option<u16>) {
        let room = mtu.map_or(MAX_PIECE_BYTES, |mtu| {
            usize::from(mtu).saturating_sub(AROUND_PIECE)
        });
        // Whole words, as flash is written.
        self.piece_bytes = (room - room % 4).clamp(4, MAX_PIECE_BYTES);
        self.start_over();
    }

    /// Bytes that the wearable has, and all.
    #[must_use]
    pub fn progress(&self) -> (usize, usize) {
        let all = self.image.len();
        let arrived = match self.step {
            Step::Ask => 0,
            Step::Begin { resume_bytes: from } | Step::Piece { offset_bytes: from } => {
                from as usize
            }
            Step::Finish | Step::Verify | Step::Done => all,
        };
        (arrived.min(all), all)
    }

    /// Whether the wearable works with this model.
    #[must_use]
    pub fn done(&self) -> bool {
        self.step == Step::Done
    }

    /// Whether it had it before.
    #[must_use]
    pub fn was_there(&self) -> bool {
        self.done() && !self.began
    }

    /// SHA-256 of the image.
    #[must_use]
    pub fn sha256(&self) -> [u8; 32] {
        self.sha256
    }

    /// The packet to send now, if any, in the frame of this number.
    ///
    /// # Errors
    /// [`UploadError::Silent`].
    pub fn next(&mut self, sequence: u32, now_us: u64) -> Result<Option<Packet>, UploadError> {
        if let Some((_, since_us)) = self.asked {
            if now_us < since_us + ANSWER_WITHIN_US {
                return Ok(None);
            }
            self.set_back(UploadError::Silent)?;
        }
        if now_us < self.not_before_us {
            return Ok(None);
        }
        let packet = match self.step {
            Step::Ask | Step::Verify => Packet::Control(Control::SendModelState),
            Step::Begin { .. } => {
                self.began = true;
                Packet::ModelUpload(ModelUpload::Begin {
                    total_bytes: self.total_bytes(),
                    sha256: self.sha256,
                })
            }
            Step::Piece { offset_bytes } => {
                let rest = &self.image[(offset_bytes as usize).min(self.image.len())..];
                Packet::ModelUpload(ModelUpload::Piece {
                    offset_bytes,
                    bytes: rest.iter().copied().take(self.piece_bytes).collect(),
                })
            }
            Step::Finish => Packet::ModelUpload(ModelUpload::Finish),
            Step::Done => return Ok(None),
        };
        self.asked = Some((sequence, now_us));
        Ok(Some(packet))
    }

    /// Takes whatever the wearable says.
    ///
    /// # Errors
    /// [`UploadError`]: it is over, and the wearable has what it had.
    pub fn take(&mut self, packet: &Packet, now_us: u64) -> Result<(), UploadError> {
        match packet {
            Packet::ModelState(state) => self.told(state),
            Packet::Reply(reply) => {
                let asked = self
                    .asked
                    .is_some_and(|(sequence, _)| sequence == reply.sequence);
                let ours = matches!(reply.answered, Kind::ModelUpload | Kind::Control);
                if asked && ours {
                    self.asked = None;
                    return self.answered(reply, now_us);
                }
                Ok(())
            }
            _ => Ok(()),
        }
    }

    fn told(&mut self, state: &ModelState) -> Result<(), UploadError> {
        let hash: [u8; 8] = std::array::from_fn(|at| self.sha256[at]);
        let active = state.active.is_some_and(|active| active.hash == hash);
        match self.step {
            Step::Ask | Step::Verify if active => self.step = Step::Done,
            Step::Ask if state.capacity_bytes == 0 => return Err(UploadError::KeepsNone),
            Step::Ask if self.image.len() > state.capacity_bytes as usize => {
                return Err(UploadError::TooLarge {
                    bytes: self.image.len(),
                    capacity_bytes: state.capacity_bytes,
                });
            }
            Step::Ask => {
                let same = state.receiving.filter(|receiving| receiving.hash == hash);
                self.step = Step::Begin {
                    resume_bytes: same.map_or(0, |receiving| receiving.received_bytes),
                };
            }
            Step::Verify => return Err(UploadError::Changed),
            _ => return Ok(()),
        }
        // The reply that follows says nothing more.
        self.asked = None;
        Ok(())
    }

    fn answered(&mut self, reply: &Reply, now_us: u64) -> Result<(), UploadError> {
        let total_bytes = self.total_bytes();
        let from = |offset_bytes| {
            if offset_bytes < total_bytes {
                Step::Piece { offset_bytes }
            } else {
                Step::Finish
            }
        };
        match (reply.outcome, self.step) {
            (Ok(()), Step::Begin { resume_bytes }) => self.step = from(resume_bytes),
            (Ok(()), Step::Piece { offset_bytes }) if reply.detail > offset_bytes => {
                self.setbacks = 0;
                self.step = from(reply.detail);
            }
            // Taken, and yet no more of it there than before.
            (Ok(()), Step::Piece { .. }) => self.set_back(UploadError::Changed)?,
            (Err(Refusal::WrongOffset), Step::Piece { .. }) => {
                self.set_back(UploadError::Refused(Refusal::WrongOffset))?;
                self.step = from(reply.detail);
            }
            (Ok(()), Step::Finish) => self.step = Step::Verify,
            // What it holds comes before the reply; where that was lost it is asked for again.
            (Ok(()), Step::Ask | Step::Verify) => {
                self.not_before_us = now_us + BUSY_US;
                self.set_back(UploadError::Silent)?;
            }
            (Err(Refusal::Busy), _) => self.not_before_us = now_us + BUSY_US,
            // It restarted in between.
            (Err(Refusal::WrongState), Step::Piece { .. } | Step::Finish) => {
                self.set_back(UploadError::Refused(Refusal::WrongState))?;
            }
            (Err(Refusal::HashMismatch), _) => return Err(UploadError::Changed),
            (Err(Refusal::StorageFailed), _) => return Err(UploadError::Flash),
            (Err(Refusal::NotFitting), _) => return Err(UploadError::NotFitting),
            (Err(Refusal::TooLarge), _) => {
                return Err(UploadError::TooLarge {
                    bytes: self.image.len(),
                    capacity_bytes: reply.detail,
                });
            }
            (Err(refusal), _) => return Err(UploadError::Refused(refusal)),
            (Ok(()), Step::Done) => {}
        }
        Ok(())
    }

    /// Begins anew, unless it has done so too often.
    fn set_back(&mut self, why: UploadError) -> Result<(), UploadError> {
        self.setbacks += 1;
        if self.setbacks == SETBACKS {
            return Err(why);
        }
        self.start_over();
        Ok(())
    }

    fn start_over(&mut self) {
        self.asked = None;
        if !self.done() {
            self.step = Step::Ask;
        }
    }

    fn total_bytes(&self) -> u32 {
        u32::try_from(self.image.len()).unwrap_or(u32::MAX)
    }
}

#[cfg(test)]
mod tests;

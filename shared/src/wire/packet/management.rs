//! Packets that set the wearable up and tell what became of it.

use heapless::{String, Vec};

use super::Muscle;
use crate::wire::table::{Kind, MAX_CHANNELS, MAX_LAST_WORDS_BYTES, MAX_PIECE_BYTES};

/// What a host asks of the wearable. Each is answered by a [`Reply`].
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Control {
    /// Send raw sEMG, or stop.
    Raw(bool),
    /// Send the calibration in use.
    SendCalibration,
    /// Send the [`ModelState`].
    SendModelState,
    /// Restart. It names the boot that is meant, so that a request repeated late does not restart the next one.
    Restart {
        /// Boot id of the wearable's own frames.
        boot_id: u32,
    },
    /// Send the [`LastWords`].
    SendLastWords,
    /// The upper arm hangs, the elbow is bent forward: from now on that is forward.
    FaceForward,
}

/// What the wearable must know of its person; set by a host, kept over a restart, read back.
///
/// The wire refuses what are no such numbers at all. Whether they make a pipeline on this board is asked by
/// `pipeline::Board::config`, so that a refusal can be answered.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Calibration {
    /// Chosen by whoever calibrates; 0 is the illustrative one that no person was measured for.
    pub revision: u32,
    /// Channels in use, 1 to 8; slots from here on are absent or zero.
    pub channels: u8,
    /// Where each channel sits.
    pub muscles: [Muscle; MAX_CHANNELS],
    /// Mains frequency that the notch removes, 50 or 60 Hz; none without a notch.
    pub mains_hz: Option<u8>,
    /// Scans per second.
    pub semg_hz: f32,
    /// Envelope of each channel at rest, V.
    pub rest_v: [f32; MAX_CHANNELS],
    /// Envelope of each channel at maximum voluntary contraction, V.
    pub mvc_v: [f32; MAX_CHANNELS],
    /// Window of the activation (W of eq. 4), s.
    pub activation_window_s: f32,
    /// Gain of the co-contraction curve (eq. 8), dimensionless.
    pub l1: f32,
    /// Slope of the co-contraction curve (eq. 8), per unit of activation.
    pub l2: f32,
    /// Joint stiffness at rest (the diagonal of `Kbar`, eq. 7), N m/rad: three of the shoulder, elbow.
    pub rest_stiffness_nm_per_rad: [f32; 4],
    /// Body mass, kg; the arm's masses follow from it.
    pub body_mass_kg: f32,
    /// Body height, m; the lengths of the arm's segments follow from it.
    pub body_height_m: f32,
}

/// One step of sending a model to the wearable. The model in use stays until the new one is whole.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum ModelUpload {
    /// Announces a model. One of the same hash that was begun before goes on where it stopped.
    Begin {
        /// Bytes of the model, at least 1.
        total_bytes: u32,
        /// SHA-256 of them.
        sha256: [u8; 32],
    },
    /// Some of its bytes.
    Piece {
        /// How many bytes of the model stand before these.
        offset_bytes: u32,
        /// At least one.
        bytes: Vec<u8, MAX_PIECE_BYTES>,
    },
    /// All pieces are sent: check the hash, and change over.
    Finish,
    /// Forget what was begun.
    Abandon,
}

/// The models that the wearable holds.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ModelState {
    /// The model in use, if there is one.
    pub active: Option<ActiveModel>,
    /// The model on its way, if one was begun.
    pub receiving: Option<Reception>,
    /// Bytes of the largest model that can be taken.
    pub capacity_bytes: u32,
}

/// A model in use.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct ActiveModel {
    /// First eight bytes of its SHA-256.
    pub hash: [u8; 8],
    /// Skills in it.
    pub skills: u8,
    /// Degrees of freedom.
    pub dofs: u8,
    /// Basis functions of a degree of freedom.
    pub functions: u8,
    /// Rank of a skill's latent covariance.
    pub rank: u8,
}

/// A model on its way.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reception {
    /// First eight bytes of its SHA-256.
    pub hash: [u8; 8],
    /// Bytes received so far, all from the beginning: where to go on.
    pub received_bytes: u32,
    /// Bytes of the whole model, at least 1, at most the capacity.
    pub total_bytes: u32,
}

/// What became of a request.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Reply {
    /// Which packet is answered.
    pub answered: Kind,
    /// Its sequence number, by its sender's count.
    pub sequence: u32,
    /// Done, or why not.
    pub outcome: Result<(), Refusal>,
    /// A number that helps: after a piece, and with [`Refusal::WrongOffset`], the bytes received so far; with
    /// [`Refusal::TooLarge`] the capacity, bytes; else 0.
    pub detail: u32,
}

/// Why a request was refused. It changed nothing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
pub enum Refusal {
    /// The frame could not be read.
    Malformed = 1,
    /// A value is not possible here.
    OutOfRange = 2,
    /// Not now: a step before it is missing, or it is meant for another boot.
    WrongState = 3,
    /// More bytes than there is room for.
    TooLarge = 4,
    /// The bytes received are not those announced.
    HashMismatch = 5,
    /// The piece does not follow those before it.
    WrongOffset = 6,
    /// The memory did not take it.
    StorageFailed = 7,
    /// The model is whole, but not one that this build can run.
    NotFitting = 8,
    /// An earlier request is still being done.
    Busy = 9,
}

impl Refusal {
    pub(in crate::wire) const ALL: [Self; 9] = [
        Self::Malformed,
        Self::OutOfRange,
        Self::WrongState,
        Self::TooLarge,
        Self::HashMismatch,
        Self::WrongOffset,
        Self::StorageFailed,
        Self::NotFitting,
        Self::Busy,
    ];
}

/// What the wearable said when it last panicked, kept over the restart.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct LastWords {
    /// The message; empty when none was kept.
    pub words: String<MAX_LAST_WORDS_BYTES>,
}

impl LastWords {
    /// As much of `bytes` as is text and fits: a message may have been cut, even within a character.
    #[must_use]
    pub fn from_bytes(bytes: &[u8]) -> Self {
        let mut words = String::new();
        for chunk in bytes.utf8_chunks().take(1) {
            for character in chunk.valid().chars() {
                if words.push(character).is_err() {
                    break;
                }
            }
        }
        Self { words }
    }
}

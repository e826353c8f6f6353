//! The packets that leave and reach the wearable: one table, one header, one checksum.
//!
//! A *frame* is a header, one packet and a CRC-32, little-endian, of fixed layout; [`TABLE`] lists
//! every kind and `docs/wire.md` every byte. Both directions check the same things: what [`encode`]
//! refuses, [`decode`] refuses too, so a NaN or an impossible stiffness never crosses the air.
//!
//! To add a packet: a variant of [`Kind`] and a row in `table`, a struct in `packet`, its limits in
//! `check`, its bytes in `layout`, a golden line, and a new [`VERSION`].

mod bytes;
mod check;
pub mod cobs;
mod error;
mod frame;
mod layout;
mod packet;
mod sequence;
mod table;

pub(crate) use check::QUATERNION_SLACK;
pub use check::{MAX_CO_CONTRACTION, MAX_ENVELOPE, MAX_STIFFNESS_N_PER_M};
pub use error::WireError;
pub use frame::{Frame, Header, decode, encode};
pub use packet::{
    ActiveModel, Calibration, Configuration, Control, HandPosition, Inference, LastWords,
    ModelState, ModelUpload, Muscle, Orientation, Packet, Ping, RawSemg, Reception, Refusal, Reply,
    ResetReason, SkillPosterior, Status, StatusFlags, Stream, StreamFlags,
};
pub use sequence::{Arrival, SequenceCounts, SequenceTracker};
pub use table::{
    CRC_BYTES, HEADER_BYTES, Kind, MAX_CHANNELS, MAX_FRAME_BYTES, MAX_LAST_WORDS_BYTES,
    MAX_PIECE_BYTES, MAX_RAW_COUNTS, MAX_SKILLS, MIN_ATT_MTU, Row, STREAM_FRAME_BYTES, TABLE,
    VERSION,
};

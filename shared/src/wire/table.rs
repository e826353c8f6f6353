//! The packet table: every kind, its number and its size, checked when the crate is compiled.

/// Protocol version, the first byte of every frame. Any change of layout or meaning raises it.
pub const VERSION: u8 = 2;
/// Version, kind, boot id, sequence, device time.
pub const HEADER_BYTES: usize = 1 + 1 + 4 + 4 + 8;
/// CRC-32 (ISO-HDLC, as in zlib) over everything before it.
pub const CRC_BYTES: usize = 4;
/// Channel slots in every packet that carries channels; unused slots are zero.
pub const MAX_CHANNELS: usize = 8;
/// Converter counts (scans times channels) in one raw packet: 72 divides by 1, 2, 3, 4, 6 and 8.
pub const MAX_RAW_COUNTS: usize = 72;
/// Skills named in one inference packet, the most probable first.
pub const MAX_SKILLS: usize = 4;
/// Bytes of a model in one upload packet: the most that a frame holds in whole words, as flash memory is written.
pub const MAX_PIECE_BYTES: usize = 216;
/// Bytes of the last words.
pub const MAX_LAST_WORDS_BYTES: usize = 128;
/// Smallest attribute MTU over which a stream is sent: a notification adds three bytes to its frame, which must
/// arrive whole.
pub const MIN_ATT_MTU: u16 = 100;
/// Whole stream frame.
pub const STREAM_FRAME_BYTES: usize = whole(row(Kind::Stream).payload_max);
/// Whole frame of the largest kind: the buffer that every sender and receiver needs.
pub const MAX_FRAME_BYTES: usize = whole(row(Kind::RawSemg).payload_max);

/// What a frame carries; the number is the second byte of the frame.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
#[repr(u8)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
pub enum Kind {
    /// Rates, channel map and scales; wearable to host, at start and once a second.
    Configuration = 1,
    /// Envelopes, activation, stiffness at 100 Hz; wearable to host.
    Stream = 2,
    /// Converter counts of consecutive scans; wearable to host, when asked for.
    RawSemg = 3,
    /// Attitude of the upper arm; wearable to host.
    Orientation = 4,
    /// Hand relative to the shoulder; host to wearable.
    HandPosition = 5,
    /// Clock comparison, a request and its reply; both ways.
    Ping = 6,
    /// What skill the person performs; from whichever side infers.
    Inference = 7,
    /// Battery, losses and quality; wearable to host, once a second.
    Status = 8,
    /// What a host asks; host to wearable.
    Control = 9,
    /// The person's levels and arm; host to wearable to set them, wearable to host when asked for.
    Calibration = 10,
    /// A step of sending a model; host to wearable.
    ModelUpload = 11,
    /// The models held; wearable to host, when asked for.
    ModelState = 12,
    /// What became of a request; wearable to host.
    Reply = 13,
    /// The message of the last panic; wearable to host, when asked for.
    LastWords = 14,
}

/// One line of [`TABLE`]; sizes are of the payload, without header and CRC.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Row {
    /// Which packet.
    pub kind: Kind,
    /// Its name in messages and documents.
    pub name: &'static str,
    /// Smallest payload, bytes.
    pub payload_min: usize,
    /// Largest payload, bytes; equal to the smallest unless the packet holds a list.
    pub payload_max: usize,
}

/// Every packet.
#[rustfmt::skip]
pub const TABLE: [Row; 14] = [
    fixed(Kind::Configuration, "configuration", 4 + 4 + 4 + 4 + 4 + 1 + 8 + 1 + 1 + 8),
    fixed(Kind::Stream,        "stream",        4 + 8 * 4 + 4 + 4 + 3 * 4 + 8 + 1 + 2),
    Row { kind: Kind::RawSemg, name: "raw sEMG", payload_min: 4 + 1 + 1 + 3, payload_max: 4 + 1 + 1 + 3 * MAX_RAW_COUNTS },
    fixed(Kind::Orientation,   "orientation",   4 * 4),
    fixed(Kind::HandPosition,  "hand position", 1 + 3 * 4),
    fixed(Kind::Ping,          "ping",          1 + 4 + 8 + 8 + 8),
    fixed(Kind::Inference,     "inference",     1 + 1 + MAX_SKILLS * (1 + 4) + 4 + 3 * 4),
    fixed(Kind::Status,        "status",        4 + 2 + 1 + 4 + 4 + 4 + 4 + 4 + 8 + 1 + 4 + 4 + 2 + 4),
    fixed(Kind::Control,       "control",       1 + 4),
    fixed(Kind::Calibration,   "calibration",   4 + 1 + 8 + 1 + 4 + 8 * 4 + 8 * 4 + 4 + 4 + 4 + 4 * 4 + 4 + 4),
    Row { kind: Kind::ModelUpload, name: "model upload", payload_min: 1, payload_max: 1 + 4 + MAX_PIECE_BYTES },
    fixed(Kind::ModelState,    "model state",   1 + 8 + 1 + 8 + 4 + 4 + 4 + 1 + 1 + 1 + 1),
    fixed(Kind::Reply,         "reply",         1 + 4 + 1 + 1 + 4),
    Row { kind: Kind::LastWords, name: "last words", payload_min: 1, payload_max: 1 + MAX_LAST_WORDS_BYTES },
];

const fn fixed(kind: Kind, name: &'static str, payload: usize) -> Row {
    Row {
        kind,
        name,
        payload_min: payload,
        payload_max: payload,
    }
}

/// The line of one kind.
pub(super) const fn row(kind: Kind) -> Row {
    TABLE[kind as usize - 1]
}

/// Bytes of a whole frame with a payload of `payload` bytes.
pub(super) const fn whole(payload: usize) -> usize {
    HEADER_BYTES + payload + CRC_BYTES
}

const _: () = {
    let mut index = 0;
    while index < TABLE.len() {
        assert!(
            TABLE[index].kind as usize == index + 1,
            "rows stand in the order of their numbers"
        );
        assert!(TABLE[index].payload_min <= TABLE[index].payload_max);
        assert!(whole(TABLE[index].payload_max) <= MAX_FRAME_BYTES);
        index += 1;
    }
    assert!(HEADER_BYTES == 18);
    assert!(STREAM_FRAME_BYTES == 89 && STREAM_FRAME_BYTES + 3 <= MIN_ATT_MTU as usize);
    assert!(
        STREAM_FRAME_BYTES <= 97,
        "what the smallest ATT MTU carries"
    );
    assert!(MAX_FRAME_BYTES <= 244, "one notification at ATT MTU 247");
    assert!(whole(row(Kind::Status).payload_max) == 72);
    assert!(whole(row(Kind::Control).payload_max) == 27);
    assert!(whole(row(Kind::Calibration).payload_max) == 140);
    assert!(whole(row(Kind::ModelUpload).payload_max) == 243);
    assert!(whole(row(Kind::ModelState).payload_max) == 56);
    assert!(whole(row(Kind::Reply).payload_max) == 33);
    assert!(whole(row(Kind::LastWords).payload_max) == 151);
};

impl Kind {
    /// The kind with this number on the wire, if there is one.
    #[must_use]
    pub(super) fn from_number(number: u8) -> Option<Self> {
        TABLE
            .get(usize::from(number).checked_sub(1)?)
            .map(|row| row.kind)
    }

    /// Its name in messages.
    #[must_use]
    pub const fn name(self) -> &'static str {
        row(self).name
    }
}

impl core::fmt::Display for Kind {
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        f.write_str(self.name())
    }
}

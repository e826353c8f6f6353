//! What each packet means. Sizes stand in `table`, bytes in `layout`, limits in `check`.

mod management;

use heapless::Vec;

use crate::semg::quality::Quality;

use super::table::{Kind, MAX_CHANNELS, MAX_RAW_COUNTS, MAX_SKILLS};

pub use management::{
    ActiveModel, Calibration, Control, LastWords, ModelState, ModelUpload, Reception, Refusal,
    Reply,
};

/// One packet of any kind. A receiver matches it exhaustively, so that a new kind stops compiling
/// wherever it must be handled.
#[derive(Clone, Debug, PartialEq)]
pub enum Packet {
    /// Rates, channel map and scales.
    Configuration(Configuration),
    /// Envelopes, activation, stiffness.
    Stream(Stream),
    /// Converter counts.
    RawSemg(RawSemg),
    /// Attitude of the upper arm.
    Orientation(Orientation),
    /// Hand relative to the shoulder.
    HandPosition(HandPosition),
    /// Clock comparison.
    Ping(Ping),
    /// Recognised skill.
    Inference(Inference),
    /// Battery, losses, quality.
    Status(Status),
    /// What a host asks.
    Control(Control),
    /// The person's levels and arm.
    Calibration(Calibration),
    /// A step of sending a model.
    ModelUpload(ModelUpload),
    /// The models held.
    ModelState(ModelState),
    /// What became of a request.
    Reply(Reply),
    /// The message of the last panic.
    LastWords(LastWords),
}

impl Packet {
    /// Which line of the table it is.
    #[must_use]
    pub fn kind(&self) -> Kind {
        match self {
            Self::Configuration(_) => Kind::Configuration,
            Self::Stream(_) => Kind::Stream,
            Self::RawSemg(_) => Kind::RawSemg,
            Self::Orientation(_) => Kind::Orientation,
            Self::HandPosition(_) => Kind::HandPosition,
            Self::Ping(_) => Kind::Ping,
            Self::Inference(_) => Kind::Inference,
            Self::Status(_) => Kind::Status,
            Self::Control(_) => Kind::Control,
            Self::Calibration(_) => Kind::Calibration,
            Self::ModelUpload(_) => Kind::ModelUpload,
            Self::ModelState(_) => Kind::ModelState,
            Self::Reply(_) => Kind::Reply,
            Self::LastWords(_) => Kind::LastWords,
        }
    }
}

/// Where a channel's electrodes sit.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[repr(u8)]
pub enum Muscle {
    /// No channel in this slot.
    #[default]
    Absent = 0,
    /// Biceps brachii, short head.
    BicepsShort = 1,
    /// Biceps brachii, long head.
    BicepsLong = 2,
    /// Triceps brachii, lateral head.
    TricepsLateral = 3,
    /// Triceps brachii, long head.
    TricepsLong = 4,
    /// Any other place: streamed, not counted in the activation.
    Other = 5,
}

impl Muscle {
    /// The place of this [`Muscle::name`]; none for any other text.
    #[must_use]
    pub fn named(name: &str) -> Option<Self> {
        const ALL: [Muscle; 6] = [
            Muscle::Absent,
            Muscle::BicepsShort,
            Muscle::BicepsLong,
            Muscle::TricepsLateral,
            Muscle::TricepsLong,
            Muscle::Other,
        ];
        ALL.into_iter().find(|muscle| muscle.name() == name)
    }

    /// Its name in columns, files and streams.
    #[must_use]
    pub const fn name(self) -> &'static str {
        match self {
            Self::Absent => "absent",
            Self::BicepsShort => "biceps_short",
            Self::BicepsLong => "biceps_long",
            Self::TricepsLateral => "triceps_lateral",
            Self::TricepsLong => "triceps_long",
            Self::Other => "other",
        }
    }
}

/// What the host must know to read the rest; sent at start and once a second, so that a host that
/// joins late needs no question.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Configuration {
    /// Scans per second.
    pub semg_hz: f32,
    /// Stream packets per second.
    pub stream_hz: f32,
    /// Volts at the electrodes per converter count.
    pub volts_per_count: f32,
    /// The count that means zero volts.
    pub offset_counts: i32,
    /// Delay of the envelopes behind the electrodes, us; the stream's own delay adds the activation window.
    pub chain_delay_us: u32,
    /// Channels in use, 1 to 8; slots from here on are absent.
    pub channels: u8,
    /// Where each channel sits.
    pub muscles: [Muscle; MAX_CHANNELS],
    /// Mains frequency that the notch removes, 50 or 60 Hz; none without a notch.
    pub mains_hz: Option<u8>,
    /// Whether raw sEMG packets are sent.
    pub raw: bool,
    /// First eight bytes of the hash of the firmware's source; zero when unknown.
    pub firmware_hash: [u8; 8],
}

/// What the wearable measures, 100 times a second. The header's device time is that of the newest
/// scan in it: age is measured from there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Stream {
    /// Activation, co-contraction and stiffness describe this long before the header's device time, us.
    pub describes_before_us: u32,
    /// Envelope of each channel as a share of its maximum voluntary contraction; describes
    /// [`Configuration::chain_delay_us`] before the header's device time.
    pub envelopes: [f32; MAX_CHANNELS],
    /// Muscle activation, eq. 4.
    pub activation: f32,
    /// Co-contraction factor, eq. 8; at least 1.
    pub co_contraction: f32,
    /// Diagonal of the Cartesian stiffness of the hand in the shoulder frame, N/m; positive.
    pub stiffness_n_per_m: [f32; 3],
    /// Warnings of each channel.
    pub quality: [Quality; MAX_CHANNELS],
    /// Channels in use, 1 to 8.
    pub channels: u8,
    /// What the values rest on.
    pub flags: StreamFlags,
}

impl Stream {
    /// The time that activation and stiffness describe, us, in the clock of `acquired_us`: the header's device time.
    /// Models are aligned by it; age and staleness are measured from `acquired_us` itself. The start of the clock
    /// if the packet claims to describe what was before it.
    #[must_use]
    pub const fn describes_us(&self, acquired_us: u64) -> u64 {
        acquired_us.saturating_sub(self.describes_before_us as u64)
    }
}

/// What a stream packet's values rest on.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StreamFlags(u16);

impl StreamFlags {
    /// The hand was seen recently; without it the elbow angle is an assumption.
    pub const HAND_SEEN: Self = Self(1 << 0);
    /// The upper arm's attitude is recent and its heading known; without it the swivel is assumed zero or, without a hand too, the arm to hang.
    pub const ORIENTATION_SEEN: Self = Self(1 << 1);
    /// Scans are missing within the memory of the filters.
    pub const GAP: Self = Self(1 << 2);
    /// The hand was a little outside the arm's reach, and was moved to its edge.
    pub const POSTURE_CLAMPED: Self = Self(1 << 3);
    /// Hand and attitude fit no arm, or no stiffness follows from them: the last one stands.
    pub const STIFFNESS_HELD: Self = Self(1 << 4);
    /// A channel that counts is saturated, flat or off, or the filters settle after a long gap: its last good
    /// value stands in the activation.
    pub const ACTIVATION_HELD: Self = Self(1 << 5);
    /// The stiffness is on its way from one source of posture to another, or back from a held value.
    pub const BLENDING: Self = Self(1 << 6);
    /// Near a straight elbow: the arm triangle's form has a share in the stiffness.
    pub const NEAR_SINGULAR: Self = Self(1 << 7);

    /// Every bit that has a meaning.
    pub(super) const KNOWN: u16 = (1 << 8) - 1;

    /// The flags as on the wire; reserved bits are refused when a frame is encoded or decoded.
    #[must_use]
    pub const fn from_bits(bits: u16) -> Self {
        Self(bits)
    }

    /// The bits as on the wire.
    #[must_use]
    pub const fn bits(self) -> u16 {
        self.0
    }

    /// Whether all flags of `other` are set.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// These flags, and `other` if `on`.
    #[must_use]
    pub const fn with(self, other: Self, on: bool) -> Self {
        if on { Self(self.0 | other.0) } else { self }
    }
}

/// Consecutive scans as they came from the converter.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct RawSemg {
    /// Index of the first scan; the others follow without a gap.
    pub first_index: u32,
    /// Channels per scan, 1 to 8.
    pub channels: u8,
    /// Counts (24 bits, signed), scan by scan, channels innermost; whole scans only.
    pub counts: Vec<i32, MAX_RAW_COUNTS>,
}

/// Attitude of the upper arm in the shoulder frame, at the header's device time.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Orientation {
    /// Unit quaternion, scalar last.
    pub xyzw: [f32; 4],
}

/// Where the hand is, at the header's device time (the host translates it to the wearable's clock).
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct HandPosition {
    /// Metres from the shoulder in the shoulder frame; none when the tracker does not see the hand.
    pub position_m: Option<[f32; 3]>,
}

/// Four times that let the requester fit the offset and rate of the other clock.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Ping {
    /// The question.
    Request {
        /// Pairs question and answer.
        id: u32,
        /// When it was sent, us of the requester's clock.
        requested_us: u64,
    },
    /// The answer.
    Reply {
        /// As in the request.
        id: u32,
        /// As in the request.
        requested_us: u64,
        /// When the request came, us of the replier's clock.
        received_us: u64,
        /// When the reply was sent, us of the replier's clock; not before `received_us`.
        replied_us: u64,
    },
}

/// One skill and how probable it is.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SkillPosterior {
    /// Number of the skill in the model.
    pub skill: u8,
    /// Natural logarithm of its posterior probability; at most 0 (plus rounding).
    pub log_posterior: f32,
}

/// What the person is doing and how firm they will be.
#[derive(Clone, Debug, PartialEq)]
pub struct Inference {
    /// Skills in the model.
    pub skills: u8,
    /// The most probable ones, best first.
    pub top: Vec<SkillPosterior, MAX_SKILLS>,
    /// How far through the best skill, 0 to 1.
    pub phase: f32,
    /// Predicted stiffness of the human hand, N/m; positive.
    pub stiffness_n_per_m: [f32; 3],
}

/// Why the wearable last started.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(feature = "defmt", derive(defmt::Format))]
#[repr(u8)]
pub enum ResetReason {
    /// Not known, or not a chip.
    #[default]
    Unknown = 0,
    /// Power came on, or browned out.
    PowerOn = 1,
    /// The reset pin.
    Pin = 2,
    /// The watchdog was not petted.
    Watchdog = 3,
    /// The firmware asked for it, a panic included.
    Software = 4,
    /// The processor locked up.
    Lockup = 5,
    /// A wake from deep sleep.
    Wake = 6,
}

/// What is wrong with the wearable, or awaits the host.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct StatusFlags(u8);

impl StatusFlags {
    /// The battery will soon be empty.
    pub const LOW_BATTERY: Self = Self(1 << 0);
    /// The converter does not answer, or answers nonsense.
    pub const FRONT_END_FAILED: Self = Self(1 << 1);
    /// The attitude sensor does not answer, or answers nonsense.
    pub const ATTITUDE_SENSOR_FAILED: Self = Self(1 << 2);
    /// The message of a panic can be asked for.
    pub const LAST_WORDS_WAIT: Self = Self(1 << 3);
    /// No calibration is stored: levels and arm are illustrative.
    pub const NOT_CALIBRATED: Self = Self(1 << 4);
    /// No model is stored: nothing is recognised.
    pub const NO_MODEL: Self = Self(1 << 5);

    /// Every bit that has a meaning.
    pub(super) const KNOWN: u8 = (1 << 6) - 1;

    /// The flags as on the wire; reserved bits are refused when a frame is encoded or decoded.
    #[must_use]
    pub const fn from_bits(bits: u8) -> Self {
        Self(bits)
    }

    /// The bits as on the wire.
    #[must_use]
    pub const fn bits(self) -> u8 {
        self.0
    }

    /// Whether all flags of `other` are set.
    #[must_use]
    pub const fn contains(self, other: Self) -> bool {
        self.0 & other.0 == other.0
    }

    /// These flags, and `other` if `on`.
    #[must_use]
    pub const fn with(self, other: Self, on: bool) -> Self {
        if on { Self(self.0 | other.0) } else { self }
    }
}

/// How the wearable fares; all counters count since it started and wrap.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Status {
    /// Seconds since the pipeline started.
    pub uptime_s: u32,
    /// Battery, mV; none when not measured.
    pub battery_mv: Option<u16>,
    /// Why it started.
    pub reset_reason: ResetReason,
    /// Scans that were not processed in time.
    pub overruns: u32,
    /// Interruptions of the scan index.
    pub gaps: u32,
    /// Scans missing in them.
    pub missed_scans: u32,
    /// Scans, positions and attitudes refused as impossible.
    pub refused: u32,
    /// Packets that were replaced by newer ones before they could be sent, those without a host included.
    pub dropped_packets: u32,
    /// Warnings raised on each channel since the last status.
    pub quality: [Quality; MAX_CHANNELS],
    /// What is wrong, or awaits the host.
    pub flags: StatusFlags,
    /// Hypotheses that recognition dropped under load.
    pub dropped_hypotheses: u32,
    /// Requests of a host that were refused, unreadable ones included.
    pub refused_requests: u32,
    /// Times that a host connected.
    pub links: u16,
    /// Replies and other reports that found no room to wait in.
    pub lost_reports: u32,
}

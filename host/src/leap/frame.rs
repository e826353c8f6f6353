//! One message of the service.

use std::fmt;

use serde::Deserialize;
use serde::de::{Deserializer, IgnoredAny, SeqAccess, Visitor};
use thiserror::Error;
use tonus_native::leapc::Unreadable;

/// Largest message, bytes: twenty times a frame with two hands and all their bones.
pub const MAX_BYTES: usize = 256 * 1024;
/// Deepest nesting: a finger's bases have five.
const MAX_DEPTH: usize = 12;
/// Most values and names in one message: ten times a frame with two hands and all their bones.
const MAX_ELEMENTS: usize = 20_000;
/// Most hands in one frame.
const MAX_HANDS: usize = 8;
/// No hand is seen farther away, metres.
const MAX_DISTANCE_M: f64 = 5.0;
/// No hand is faster, metres per second.
const MAX_SPEED_M_PER_S: f64 = 50.0;
/// How far rounding may take shares and components of unit vectors beyond 1.
const ROUNDING: f64 = 0.01;

/// Which hand.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Side {
    /// The left one.
    Left,
    /// The right one.
    Right,
}

/// One hand of a frame. What older services and the bridge leave out is none.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Hand {
    /// Number of this hand for as long as it stays in view.
    pub id: i64,
    /// Left or right.
    pub side: Option<Side>,
    /// Middle of the palm in the tracker's frame, metres.
    pub palm_m: [f64; 3],
    /// Its velocity, metres per second.
    pub velocity_m_per_s: Option<[f64; 3]>,
    /// Unit vector out of the palm.
    pub palm_normal: Option<[f64; 3]>,
    /// Unit vector from the palm to the fingers.
    pub direction: Option<[f64; 3]>,
    /// 0 open, 1 a fist.
    pub grab: Option<f64>,
    /// 0 open, 1 thumb and finger together.
    pub pinch: Option<f64>,
    /// How well the hand fits what is seen, 0 to 1.
    pub confidence: Option<f64>,
}

/// One picture's worth.
#[derive(Debug, Clone, PartialEq)]
pub struct Frame {
    /// Counts up while the service runs.
    pub id: i64,
    /// When the picture was taken, microseconds of the service's clock.
    pub timestamp_us: u64,
    /// That clock when the frame came, where it can be read.
    pub clock_us: Option<u64>,
    /// Hands in view, at most eight.
    pub hands: Vec<Hand>,
}

/// What a message holds.
#[derive(Debug, Clone, PartialEq)]
pub enum Content {
    /// The protocol that will be spoken; the first message.
    Version(u64),
    /// LeapC has reached its service; the first message.
    LeapC,
    /// Something about the devices.
    Event,
    /// A frame.
    Frame(Frame),
}

/// Why a message is not used.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum FrameError {
    /// Too many bytes.
    #[error("a message of {got} bytes, at most {MAX_BYTES} are read")]
    TooLarge {
        /// Its length.
        got: usize,
    },
    /// Nested too deep.
    #[error("a message nested deeper than {MAX_DEPTH}")]
    TooDeep,
    /// Too many values.
    #[error("a message of more than {MAX_ELEMENTS} values")]
    TooMany,
    /// Not JSON, or not of this protocol.
    #[error("not a message of protocol 1 to 6: {0}")]
    Malformed(String),
    /// Neither version, event nor frame.
    #[error("a message without `version`, `event` or the frame's `{missing}`")]
    Incomplete {
        /// The first field that a frame lacks.
        missing: &'static str,
    },
    /// A value that no hand has.
    #[error("`{field}` is {got}, at most {limit} is possible")]
    OutOfRange {
        /// The protocol's name of the field.
        field: &'static str,
        /// Its value, in the unit of the limit.
        got: f64,
        /// The largest possible.
        limit: f64,
    },
    /// A time before its clock began.
    #[error("`{field}` is {got} us; a time is no less than 0")]
    Negative {
        /// The library's name of it.
        field: &'static str,
        /// Its value.
        got: i64,
    },
    /// What LeapC says no frame can.
    #[error(transparent)]
    LeapC(#[from] Unreadable),
}

impl Hand {
    /// Itself.
    ///
    /// # Errors
    /// [`FrameError::OutOfRange`] where no hand can be so.
    pub(super) fn checked(self) -> Result<Self, FrameError> {
        within("palmPosition", MAX_DISTANCE_M, self.palm_m)?;
        if let Some(velocity) = self.velocity_m_per_s {
            within("palmVelocity", MAX_SPEED_M_PER_S, velocity)?;
        }
        for (field, unit) in [
            ("palmNormal", self.palm_normal),
            ("direction", self.direction),
        ] {
            if let Some(unit) = unit {
                within(field, 1.0 + ROUNDING, unit)?;
            }
        }
        for (field, value) in [
            ("grabStrength", self.grab),
            ("pinchStrength", self.pinch),
            ("confidence", self.confidence),
        ] {
            share(field, value)?;
        }
        Ok(self)
    }
}

/// Reads one message.
///
/// # Errors
/// [`FrameError`]; the work is bounded by [`MAX_BYTES`] whatever the text holds.
pub fn parse(text: &str) -> Result<Content, FrameError> {
    if text.len() > MAX_BYTES {
        return Err(FrameError::TooLarge { got: text.len() });
    }
    check_shape(text.as_bytes())?;
    let raw: RawMessage =
        serde_json::from_str(text).map_err(|error| FrameError::Malformed(error.to_string()))?;
    if let Some(version) = raw.version {
        return Ok(Content::Version(version));
    }
    if raw.event.is_some() {
        return Ok(Content::Event);
    }
    let missing = |missing| FrameError::Incomplete { missing };
    let hands = raw.hands.ok_or(missing("hands"))?;
    Ok(Content::Frame(Frame {
        id: raw.id.ok_or(missing("id"))?,
        timestamp_us: raw.timestamp.ok_or(missing("timestamp"))?,
        clock_us: None,
        hands: hands.iter().map(RawHand::hand).collect::<Result<_, _>>()?,
    }))
}

/// Refuses by depth and count before anything is built; whether it is JSON is the parser's to say.
fn check_shape(text: &[u8]) -> Result<(), FrameError> {
    let (mut depth, mut elements) = (0_usize, 1_usize);
    let (mut within, mut escaped) = (false, false);
    for byte in text {
        match (within, *byte) {
            (true, _) if escaped => escaped = false,
            (true, b'\\') => escaped = true,
            (_, b'"') => within = !within,
            (false, b'[' | b'{') => depth += 1,
            (false, b']' | b'}') => depth = depth.saturating_sub(1),
            (false, b',' | b':') => elements += 1,
            _ => {}
        }
        if depth > MAX_DEPTH {
            return Err(FrameError::TooDeep);
        }
        if elements > MAX_ELEMENTS {
            return Err(FrameError::TooMany);
        }
    }
    Ok(())
}

#[derive(Deserialize)]
struct RawMessage {
    version: Option<u64>,
    event: Option<IgnoredAny>,
    id: Option<i64>,
    timestamp: Option<u64>,
    #[serde(default, deserialize_with = "few_hands")]
    hands: Option<Vec<RawHand>>,
}

#[derive(Deserialize)]
#[serde(rename_all = "camelCase")]
struct RawHand {
    id: i64,
    #[serde(rename = "type")]
    side: Option<String>,
    palm_position: [f64; 3],
    palm_velocity: Option<[f64; 3]>,
    palm_normal: Option<[f64; 3]>,
    direction: Option<[f64; 3]>,
    grab_strength: Option<f64>,
    pinch_strength: Option<f64>,
    confidence: Option<f64>,
}

impl RawHand {
    fn hand(&self) -> Result<Hand, FrameError> {
        let metres = |vector: [f64; 3]| vector.map(|mm| mm / 1e3);
        Hand {
            id: self.id,
            side: match self.side.as_deref() {
                Some("left") => Some(Side::Left),
                Some("right") => Some(Side::Right),
                _ => None,
            },
            palm_m: metres(self.palm_position),
            velocity_m_per_s: self.palm_velocity.map(metres),
            palm_normal: self.palm_normal,
            direction: self.direction,
            grab: self.grab_strength,
            pinch: self.pinch_strength,
            confidence: self.confidence,
        }
        .checked()
    }
}

fn within(field: &'static str, limit: f64, vector: [f64; 3]) -> Result<(), FrameError> {
    let impossible = |value: &&f64| value.is_nan() || value.abs() > limit;
    match vector.iter().find(impossible) {
        None => Ok(()),
        Some(&got) => Err(FrameError::OutOfRange { field, got, limit }),
    }
}

fn share(field: &'static str, value: Option<f64>) -> Result<(), FrameError> {
    match value {
        Some(got) if !(-ROUNDING..=1.0 + ROUNDING).contains(&got) => Err(FrameError::OutOfRange {
            field,
            got,
            limit: 1.0,
        }),
        _ => Ok(()),
    }
}

/// A list that is given up at its ninth hand.
fn few_hands<'de, D: Deserializer<'de>>(source: D) -> Result<Option<Vec<RawHand>>, D::Error> {
    struct Few;
    impl<'de> Visitor<'de> for Few {
        type Value = Vec<RawHand>;

        fn expecting(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
            write!(f, "at most {MAX_HANDS} hands")
        }

        fn visit_seq<A: SeqAccess<'de>>(self, mut list: A) -> Result<Self::Value, A::Error> {
            let mut hands = Vec::with_capacity(2);
            while let Some(hand) = list.next_element()? {
                if hands.len() == MAX_HANDS {
                    return Err(serde::de::Error::invalid_length(MAX_HANDS + 1, &self));
                }
                hands.push(hand);
            }
            Ok(hands)
        }
    }
    source.deserialize_seq(Few).map(Some)
}

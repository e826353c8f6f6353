//! One hand out of the frames of a service; no sockets, and no clock but the times it is told.

use std::fmt;

use thiserror::Error;

use super::age::{Age, Stamp};
use super::frame::{Content, Frame, FrameError, Hand, Side, parse};

/// Versions of the protocol that are understood.
const VERSIONS: std::ops::RangeInclusive<u64> = 1..=6;
/// Older than this, a hand is not given: the age at which a robot begins to let go, microseconds.
const MAX_AGE_US: u64 = 100_000;

/// Which hand to follow.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Wanted {
    /// This one alone; a service too old to tell the sides shows none.
    Only(Side),
    /// Whichever is seen, the one followed before first.
    Either,
}

/// How the service is spoken with.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum Protocol {
    /// By this version of the WebSocket's, 1 to 6.
    WebSocket(u8),
    /// Through the library.
    LeapC,
}

impl fmt::Display for Protocol {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::WebSocket(version) => write!(out, "protocol {version}"),
            Self::LeapC => out.write_str("LeapC"),
        }
    }
}

/// A hand and when it was there.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Sight {
    /// The hand.
    pub hand: Hand,
    /// Number of its frame.
    pub frame_id: i64,
    /// When the picture was taken, microseconds of host time.
    pub exposed_us: u64,
    /// How far that may be off, beside the constant delay of camera and service, microseconds.
    pub uncertainty_us: f64,
    /// Whether it is another hand, or the same after it was lost, than the one before.
    pub new_hand: bool,
}

impl Sight {
    /// Time since the picture was taken, microseconds.
    #[must_use]
    pub fn age_us(&self, now_us: u64) -> u64 {
        now_us.saturating_sub(self.exposed_us)
    }
}

/// What a message said.
#[derive(Debug, Clone, Copy, PartialEq)]
#[expect(clippy::large_enum_variant, reason = "nearly all are sights")]
pub enum Message {
    /// The protocol that is spoken from here on.
    Protocol(Protocol),
    /// Something about the devices.
    Event,
    /// The wanted hand, fresh.
    Seen(Sight),
    /// A fresh frame without it.
    Unseen,
}

/// Why a message was not used. It changed nothing.
#[derive(Debug, Clone, PartialEq, Error)]
pub enum Refusal {
    /// It cannot be read.
    #[error(transparent)]
    Frame(#[from] FrameError),
    /// A protocol that is not known.
    #[error(
        "the service speaks protocol {got}; 1 to 6 are understood: update Tonus, or use an older service"
    )]
    Version {
        /// What it said.
        got: u64,
    },
    /// A frame before the service said its protocol.
    #[error("a frame before the protocol's version")]
    NoVersion,
    /// Its number or time stamp is not ahead of the newest.
    #[error(
        "frame {got_id} does not follow frame {newest_id}: the service stands still or repeats itself"
    )]
    Repeated {
        /// The newest so far.
        newest_id: i64,
        /// This one.
        got_id: i64,
    },
    /// Too soon after a start to know its age.
    #[error("the service's clock is not known yet")]
    Settling,
    /// Taken after it came.
    #[error("a frame of {timestamp_us} us by the service's clock is yet to come")]
    Impossible {
        /// Its time stamp.
        timestamp_us: u64,
    },
    /// Held back for too long.
    #[error("a frame came {age_us} us after its picture; {MAX_AGE_US} us is the limit")]
    Stale {
        /// Its age when it came.
        age_us: u64,
    },
}

/// What became of the messages of all connections.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct Counts {
    /// Fresh frames with the wanted hand.
    pub seen: u64,
    /// Fresh frames without it.
    pub unseen: u64,
    /// Messages that cannot be read, or not at this point.
    pub malformed: u64,
    /// Frames that do not follow the newest.
    pub repeated: u64,
    /// Frames before the service's clock was known.
    pub settling: u64,
    /// Frames that were too old when they came, or from the future.
    pub stale: u64,
}

impl Wanted {
    /// The other hand than the one that is followed, to touch its shoulder; whichever it is where either is followed.
    #[must_use]
    pub fn other(self) -> Self {
        match self {
            Self::Either => Self::Either,
            Self::Only(Side::Left) => Self::Only(Side::Right),
            Self::Only(Side::Right) => Self::Only(Side::Left),
        }
    }
}

/// Follows one hand.
#[derive(Debug, Clone)]
pub struct Follower {
    wanted: Wanted,
    age: Age,
    protocol: Option<Protocol>,
    last: Option<Sight>,
    counts: Counts,
}

impl Follower {
    /// Nothing seen. `transport_us` is the shortest delay from picture to arrival, which cannot be observed; 0 where frames
    /// come with the service's clock.
    #[must_use]
    pub fn new(wanted: Wanted, transport_us: u32) -> Self {
        Self {
            wanted,
            age: Age::new(transport_us),
            protocol: None,
            last: None,
            counts: Counts::default(),
        }
    }

    /// Follows this hand from now on.
    pub fn want(&mut self, wanted: Wanted) {
        if self.wanted != wanted {
            self.wanted = wanted;
            self.last = None;
        }
    }

    /// A connection was made or lost: what was seen is no longer followed. What was learnt of the service's clock stays,
    /// so that a service which goes on where it stood is aged at once.
    pub fn reconnect(&mut self) {
        self.protocol = None;
        self.last = None;
    }

    /// The protocol spoken, once the service has said it.
    #[must_use]
    pub fn protocol(&self) -> Option<Protocol> {
        self.protocol
    }

    /// The hand as last seen, unless that was too long ago.
    #[must_use]
    pub fn hand(&self, now_us: u64) -> Option<&Sight> {
        self.last
            .as_ref()
            .filter(|sight| sight.age_us(now_us) <= MAX_AGE_US)
    }

    /// What became of the messages so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    /// Takes a message that came at `now_us`.
    ///
    /// # Errors
    /// [`Refusal`]; counted, and nothing else.
    pub fn take(&mut self, text: &str, now_us: u64) -> Result<Message, Refusal> {
        self.take_read(parse(text), now_us)
    }

    /// Takes what was read of a message that came at `now_us`.
    ///
    /// # Errors
    /// As [`Follower::take`].
    pub fn take_read(
        &mut self,
        read: Result<Content, FrameError>,
        now_us: u64,
    ) -> Result<Message, Refusal> {
        let outcome = self.judge(read, now_us);
        let count = match &outcome {
            Ok(Message::Seen(_)) => &mut self.counts.seen,
            Ok(Message::Unseen) => &mut self.counts.unseen,
            Ok(Message::Protocol(_) | Message::Event) => return outcome,
            Err(Refusal::Frame(_) | Refusal::Version { .. } | Refusal::NoVersion) => {
                &mut self.counts.malformed
            }
            Err(Refusal::Repeated { .. }) => &mut self.counts.repeated,
            Err(Refusal::Settling) => &mut self.counts.settling,
            Err(Refusal::Impossible { .. } | Refusal::Stale { .. }) => &mut self.counts.stale,
        };
        *count += 1;
        outcome
    }

    fn judge(
        &mut self,
        read: Result<Content, FrameError>,
        now_us: u64,
    ) -> Result<Message, Refusal> {
        match read? {
            Content::Event => Ok(Message::Event),
            Content::Version(got) => match u8::try_from(got) {
                Ok(version) if VERSIONS.contains(&got) => {
                    Ok(self.spoken(Protocol::WebSocket(version)))
                }
                _ => Err(Refusal::Version { got }),
            },
            Content::LeapC => Ok(self.spoken(Protocol::LeapC)),
            Content::Frame(_) if self.protocol.is_none() => Err(Refusal::NoVersion),
            Content::Frame(frame) => self.frame(&frame, now_us),
        }
    }

    fn spoken(&mut self, protocol: Protocol) -> Message {
        self.protocol = Some(protocol);
        Message::Protocol(protocol)
    }

    fn frame(&mut self, frame: &Frame, now_us: u64) -> Result<Message, Refusal> {
        let stamp = Stamp {
            id: frame.id,
            timestamp_us: frame.timestamp_us,
            clock_us: frame.clock_us.unwrap_or(frame.timestamp_us),
        };
        let exposed = self.age.place(stamp, now_us)?;
        let age_us = now_us - exposed.at_us;
        if age_us > MAX_AGE_US {
            return Err(Refusal::Stale { age_us });
        }
        let before = self.last.take();
        let followed = before.map(|sight| sight.hand.id);
        let Some(hand) = self.choose(&frame.hands, followed) else {
            return Ok(Message::Unseen);
        };
        let sight = Sight {
            hand,
            frame_id: frame.id,
            exposed_us: exposed.at_us,
            uncertainty_us: exposed.uncertainty_us,
            new_hand: followed != Some(hand.id),
        };
        self.last = Some(sight);
        Ok(Message::Seen(sight))
    }

    /// The hand followed before, else the one that the service is surest of.
    fn choose(&self, hands: &[Hand], followed: Option<i64>) -> Option<Hand> {
        let wanted = |hand: &&Hand| match self.wanted {
            Wanted::Either => true,
            Wanted::Only(side) => hand.side == Some(side),
        };
        let sureness = |hand: &Hand| hand.confidence.unwrap_or(0.0);
        hands
            .iter()
            .filter(wanted)
            .max_by(|a, b| {
                let (a_followed, b_followed) = (followed == Some(a.id), followed == Some(b.id));
                let order = a_followed.cmp(&b_followed);
                order.then(sureness(a).total_cmp(&sureness(b)))
            })
            .copied()
    }
}

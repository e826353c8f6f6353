//! A connection through LeapC.

use std::time::{Duration, Instant};

use tonus_native::leapc::{self, Connection, Event, LeapC, LeapCError};

use super::frame::{Content, Frame, FrameError, Hand, Side};
use super::loss::Loss;

/// How often it is asked whether the service is there, once LeapC says at once that it is not.
const LOOK: Duration = Duration::from_millis(20);

/// One connection.
#[derive(Debug)]
pub(super) struct Library {
    connection: Connection,
    /// Whether the service has answered.
    reached: bool,
}

impl Library {
    pub(super) fn open(leapc: &LeapC) -> Result<Self, Loss> {
        Ok(Self {
            connection: leapc.connect()?,
            reached: false,
        })
    }

    /// What comes by `until`, or none by then or earlier.
    pub(super) fn next(
        &mut self,
        until: Instant,
    ) -> Result<Option<Result<Content, FrameError>>, Loss> {
        let left = until.saturating_duration_since(Instant::now());
        let event = match self.connection.poll(left) {
            Ok(event) => event,
            Err(LeapCError::NotConnected) if !self.reached => {
                std::thread::sleep(left.min(LOOK));
                return Ok(None);
            }
            Err(LeapCError::NotConnected) => return Err(Loss::ServiceGone),
            Err(error) => return Err(error.into()),
        };
        Ok(Some(match event {
            None => return Ok(None),
            Some(Event::Connected) => {
                self.reached = true;
                Ok(Content::LeapC)
            }
            Some(Event::ConnectionLost) => return Err(Loss::ServiceGone),
            Some(Event::DeviceLost) => return Err(Loss::Unplugged),
            Some(Event::DeviceFailed { status }) => return Err(Loss::Failed { status }),
            Some(Event::DeviceFound | Event::Other) => Ok(Content::Event),
            Some(Event::Frame(told)) => frame(&told),
            Some(Event::Unreadable(unreadable)) => Err(unreadable.into()),
        }))
    }

    /// What it means that nothing came for too long.
    pub(super) fn silence(&self) -> Loss {
        if self.reached {
            Loss::Silent
        } else {
            Loss::NoService
        }
    }
}

fn frame(told: &leapc::Frame) -> Result<Content, FrameError> {
    let time =
        |field, got: i64| u64::try_from(got).map_err(|_| FrameError::Negative { field, got });
    Ok(Content::Frame(Frame {
        id: told.id,
        timestamp_us: time("timestamp", told.timestamp_us)?,
        clock_us: Some(time("LeapGetNow", told.now_us)?),
        hands: told.hands.iter().map(hand).collect::<Result<_, _>>()?,
    }))
}

fn hand(told: &leapc::Hand) -> Result<Hand, FrameError> {
    let wide = |vector: [f32; 3]| vector.map(f64::from);
    Hand {
        id: i64::from(told.id),
        side: told.side.map(|side| match side {
            leapc::Side::Left => Side::Left,
            leapc::Side::Right => Side::Right,
        }),
        palm_m: wide(told.palm_mm).map(|mm| mm / 1e3),
        velocity_m_per_s: Some(wide(told.velocity_mm_per_s).map(|mm| mm / 1e3)),
        palm_normal: Some(wide(told.palm_normal)),
        direction: Some(wide(told.direction)),
        grab: Some(f64::from(told.grab)),
        pinch: Some(f64::from(told.pinch)),
        confidence: Some(f64::from(told.confidence)),
    }
    .checked()
}

//! The connection to a service: made, kept, made again.

use std::io::ErrorKind;
use std::time::{Duration, Instant};

use thiserror::Error;
use tungstenite::client::client_with_config;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{WebSocket, WebSocketConfig};
use tungstenite::{Error, HandshakeError, Message as Ws};

use super::follower::{Counts, Follower, Message, Refusal, Sight, Wanted};
use super::frame::MAX_BYTES;
use super::line::Line;
use super::service::Service;

/// Newest version of the protocol, asked for first.
const NEWEST: u8 = 6;
/// Longest wait for the service to agree to the WebSocket.
const HANDSHAKE_LIMIT: Duration = Duration::from_millis(1_000);
/// A connection that brings nothing usable for so long is given up.
const SILENCE_LIMIT: Duration = Duration::from_secs(3);
/// Protocols 2 and 3 want a sign of life so often.
const HEARTBEAT: Duration = Duration::from_millis(100);

/// Waits between attempts to connect: the first, doubled up to the longest.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct Backoff {
    /// After a connection that worked.
    pub first: Duration,
    /// At most.
    pub longest: Duration,
}

impl Default for Backoff {
    fn default() -> Self {
        Self {
            first: Duration::from_millis(100),
            longest: Duration::from_secs(2),
        }
    }
}

/// Which service and which hand.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Config {
    /// Where the service is.
    pub service: Service,
    /// Which hand.
    pub wanted: Wanted,
    /// Shortest delay from picture to arrival, which cannot be observed, microseconds.
    pub transport_us: u32,
    /// Waits between attempts.
    pub backoff: Backoff,
}

/// Why there is no connection.
#[derive(Debug, Error)]
pub enum Loss {
    /// Nobody answers.
    #[error(
        "{url}: no Leap service: {source}; start it (with Gemini or later also UltraleapTrackingWebSocket), and check host and port"
    )]
    Connect {
        /// What was asked for.
        url: String,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Somebody answers who is no such service, or none of this version.
    #[error("{url}: no WebSocket of a Leap service: {source}; check host and port")]
    Handshake {
        /// What was asked for.
        url: String,
        /// The reason.
        source: Box<Error>,
    },
    /// It accepts a connection and says no more.
    #[error("{url}: answers nothing within {HANDSHAKE_LIMIT:?}; restart the Leap service")]
    NoAnswer {
        /// What was asked for.
        url: String,
    },
    /// It was ended, or broke the rules.
    #[error("the Leap service's connection ended: {0}")]
    Ended(Box<Error>),
    /// The service closed it.
    #[error("the Leap service closed the connection: {0}")]
    Closed(String),
    /// Nothing usable for too long.
    #[error(
        "the Leap service sent nothing usable for {SILENCE_LIMIT:?}; check that the tracker is plugged in"
    )]
    Silent,
    /// A protocol that is not known.
    #[error(transparent)]
    Version(Refusal),
}

/// What happened.
#[derive(Debug)]
pub enum Update {
    /// The service said which protocol it speaks.
    Connected {
        /// 1 to 6.
        version: u8,
    },
    /// There is no connection; another attempt follows by itself.
    Lost(Loss),
    /// The wanted hand, fresh.
    Seen(Sight),
    /// A fresh frame without it.
    Unseen,
    /// Something that was not used.
    Refused(Refusal),
}

/// Follows one hand of a service, and connects again whenever there is need.
#[derive(Debug)]
pub struct Leap {
    config: Config,
    epoch: Instant,
    follower: Follower,
    state: State,
    /// Version to ask for next.
    ask: u8,
    wait: Duration,
}

#[derive(Debug)]
enum State {
    /// Not before this instant.
    Waiting(Instant),
    Connected(Box<Connection>),
}

#[derive(Debug)]
struct Connection {
    socket: WebSocket<Line>,
    usable_at: Instant,
    heartbeat_at: Option<Instant>,
}

impl Leap {
    /// Connects at the first [`Leap::receive`]. Host time counts from `epoch`.
    #[must_use]
    pub fn new(config: Config, epoch: Instant) -> Self {
        Self {
            follower: Follower::new(config.wanted, config.transport_us),
            wait: config.backoff.first,
            config,
            epoch,
            state: State::Waiting(epoch),
            ask: NEWEST,
        }
    }

    /// Follows this hand from now on.
    pub fn want(&mut self, wanted: Wanted) {
        self.follower.want(wanted);
    }

    /// Host time now, microseconds.
    #[must_use]
    pub fn now_us(&self) -> u64 {
        u64::try_from(self.epoch.elapsed().as_micros()).unwrap_or(u64::MAX)
    }

    /// The hand as last seen, unless that was more than 100 ms ago or the connection is gone.
    #[must_use]
    pub fn hand(&self) -> Option<&Sight> {
        self.follower.hand(self.now_us())
    }

    /// What became of the messages so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.follower.counts()
    }

    /// What happens next, or none within `limit`; an attempt to connect may take a second and a half longer. Whoever calls it
    /// too seldom gets frames late, which are then refused as stale.
    pub fn receive(&mut self, limit: Duration) -> Option<Update> {
        let until = Instant::now() + limit;
        loop {
            let outcome = match &mut self.state {
                State::Waiting(next) => {
                    let wake = until.min(*next);
                    std::thread::sleep(wake.saturating_duration_since(Instant::now()));
                    if wake < *next {
                        return None;
                    }
                    self.connect()
                }
                State::Connected(connection) => match connection.next(until) {
                    Ok(None) if Instant::now() >= until => return None,
                    Ok(None) => continue,
                    Ok(Some(text)) => self.take(&text),
                    Err(loss) => Err(loss),
                },
            };
            match outcome {
                Ok(None) => {}
                Ok(Some(update)) => return Some(update),
                Err(loss) => {
                    self.lose(&loss);
                    return Some(Update::Lost(loss));
                }
            }
        }
    }

    fn connect(&mut self) -> Result<Option<Update>, Loss> {
        let connection = Connection::open(&self.config.service, self.ask)?;
        self.follower.reconnect();
        self.state = State::Connected(Box::new(connection));
        Ok(None)
    }

    fn take(&mut self, text: &str) -> Result<Option<Update>, Loss> {
        let now_us = self.now_us();
        let outcome = self.follower.take(text, now_us);
        let State::Connected(connection) = &mut self.state else {
            return Ok(None);
        };
        if let Ok(message) = &outcome
            && !matches!(message, Message::Event)
        {
            connection.usable_at = Instant::now();
        }
        match outcome {
            Ok(Message::Version(version)) => {
                connection.greet(version)?;
                Ok(Some(Update::Connected { version }))
            }
            Ok(Message::Event) => Ok(None),
            Ok(Message::Seen(sight)) => {
                self.wait = self.config.backoff.first;
                Ok(Some(Update::Seen(sight)))
            }
            Ok(Message::Unseen) => {
                self.wait = self.config.backoff.first;
                Ok(Some(Update::Unseen))
            }
            Err(refusal @ Refusal::Version { .. }) => Err(Loss::Version(refusal)),
            Err(refusal) => Ok(Some(Update::Refused(refusal))),
        }
    }

    /// Forgets the hand and plans the next attempt: one version lower when this one is not spoken.
    fn lose(&mut self, loss: &Loss) {
        let unspoken = match loss {
            Loss::Handshake { source, .. } => matches!(**source, Error::Http(_)),
            Loss::Closed(_) => self.follower.version().is_none(),
            _ => false,
        };
        self.ask = if unspoken && self.ask > 1 {
            self.ask - 1
        } else {
            NEWEST
        };
        self.follower.reconnect();
        self.state = State::Waiting(Instant::now() + self.wait);
        if !unspoken {
            self.wait = (self.wait * 2).min(self.config.backoff.longest);
        }
    }
}

impl Connection {
    fn open(service: &Service, version: u8) -> Result<Self, Loss> {
        let url = service.url(version);
        let line = match Line::open(service, Instant::now() + HANDSHAKE_LIMIT) {
            Ok(line) => line,
            Err(source) => return Err(Loss::Connect { url, source }),
        };
        let limits = WebSocketConfig::default()
            .read_buffer_size(64 * 1024)
            .write_buffer_size(0)
            .max_message_size(Some(MAX_BYTES))
            .max_frame_size(Some(MAX_BYTES));
        match client_with_config(url.as_str(), line, Some(limits)) {
            Ok((socket, _)) => Ok(Self {
                socket,
                usable_at: Instant::now(),
                heartbeat_at: None,
            }),
            Err(HandshakeError::Interrupted(_)) => Err(Loss::NoAnswer { url }),
            Err(HandshakeError::Failure(error)) => Err(Loss::Handshake {
                url,
                source: Box::new(error),
            }),
        }
    }

    /// What a client says first, byte for byte: the bridge compares whole strings.
    fn greet(&mut self, version: u8) -> Result<(), Loss> {
        if version >= 4 {
            self.say(r#"{"background":true}"#)?;
            self.say(r#"{"focused":true}"#)?;
        }
        if version >= 5 {
            self.say(r#"{"optimizeHMD":false}"#)?;
        }
        self.heartbeat_at = matches!(version, 2 | 3).then(Instant::now);
        Ok(())
    }

    fn say(&mut self, text: &'static str) -> Result<(), Loss> {
        let sent = self.socket.send(Ws::text(text));
        sent.map_err(|error| Loss::Ended(Box::new(error)))
    }

    /// The next text, or none by `until` or earlier.
    fn next(&mut self, until: Instant) -> Result<Option<String>, Loss> {
        let now = Instant::now();
        let silent_at = self.usable_at + SILENCE_LIMIT;
        if now >= silent_at {
            return Err(Loss::Silent);
        }
        if self.heartbeat_at.is_some_and(|due| now >= due) {
            self.say(r#"{"heartbeat":true}"#)?;
            self.heartbeat_at = Some(now + HEARTBEAT);
        }
        let wake = until.min(silent_at).min(self.heartbeat_at.unwrap_or(until));
        self.socket.get_mut().wait_until(wake);
        match self.socket.read() {
            Ok(Ws::Text(text)) => Ok(Some(text.as_str().to_owned())),
            Ok(Ws::Close(frame)) => Err(closed(
                frame.map(|frame| (frame.code, frame.reason.to_string())),
            )),
            Ok(Ws::Binary(_) | Ws::Ping(_) | Ws::Pong(_) | Ws::Frame(_)) => Ok(None),
            Err(Error::Io(error))
                if matches!(error.kind(), ErrorKind::WouldBlock | ErrorKind::TimedOut) =>
            {
                Ok(None)
            }
            Err(error) => Err(Loss::Ended(Box::new(error))),
        }
    }
}

fn closed(frame: Option<(CloseCode, String)>) -> Loss {
    Loss::Closed(match frame {
        Some((code, reason)) => format!("{} {reason}", u16::from(code))
            .trim_end()
            .to_owned(),
        None => "without a reason".to_owned(),
    })
}

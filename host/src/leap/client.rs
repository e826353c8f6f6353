//! The connection to a service: made, kept, made again.

use std::path::Path;
use std::time::{Duration, Instant};

use tonus_native::leapc::LeapC;
use tungstenite::Error;

use super::follower::{Counts, Follower, Message, Protocol, Refusal, Sight, Wanted};
use super::frame::{Content, FrameError, parse};
use super::library::Library;
use super::loss::{Loss, SILENCE_LIMIT};
use super::origin::Origin;
use super::socket::{NEWEST, Socket};

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
    /// Where frames come from.
    pub origin: Origin,
    /// Which hand.
    pub wanted: Wanted,
    /// Shortest delay from picture to arrival over the WebSocket, which cannot be observed, microseconds. LeapC's clock is
    /// read with every frame.
    pub transport_us: u32,
    /// Waits between attempts.
    pub backoff: Backoff,
}

/// What happened.
#[derive(Debug)]
pub enum Update {
    /// The service answers.
    Connected {
        /// How it is spoken with.
        protocol: Protocol,
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
    /// Version of the WebSocket's protocol to ask for next.
    ask: u8,
    wait: Duration,
    /// LeapC, once it is needed: kept, because it may not like to be unloaded.
    leapc: Option<LeapC>,
}

#[derive(Debug)]
enum State {
    /// Not before this instant.
    Waiting(Instant),
    Connected {
        connection: Connection,
        usable_at: Instant,
    },
}

#[derive(Debug)]
enum Connection {
    Socket(Box<Socket>),
    Library(Library),
}

impl Leap {
    /// Connects at the first [`Leap::receive`]. Host time counts from `epoch`.
    #[must_use]
    pub fn new(config: Config, epoch: Instant) -> Self {
        let transport_us = match config.origin {
            Origin::Service(_) => config.transport_us,
            Origin::LeapC(_) => 0,
        };
        Self {
            follower: Follower::new(config.wanted, transport_us),
            wait: config.backoff.first,
            config,
            epoch,
            state: State::Waiting(epoch),
            ask: NEWEST,
            leapc: None,
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
                State::Connected {
                    connection,
                    usable_at,
                } => match connection.next(until, *usable_at + SILENCE_LIMIT) {
                    Ok(None) if Instant::now() >= until => return None,
                    Ok(None) => continue,
                    Ok(Some(read)) => self.take(read),
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
        let connection = match &self.config.origin {
            Origin::Service(service) => {
                Connection::Socket(Box::new(Socket::open(service, self.ask)?))
            }
            Origin::LeapC(file) => {
                Connection::Library(Library::open(loaded(&mut self.leapc, file.as_deref())?)?)
            }
        };
        self.follower.reconnect();
        self.state = State::Connected {
            connection,
            usable_at: Instant::now(),
        };
        Ok(None)
    }

    fn take(&mut self, read: Result<Content, FrameError>) -> Result<Option<Update>, Loss> {
        let now_us = self.now_us();
        let outcome = self.follower.take_read(read, now_us);
        let State::Connected {
            connection,
            usable_at,
        } = &mut self.state
        else {
            return Ok(None);
        };
        if let Ok(message) = &outcome
            && !matches!(message, Message::Event)
        {
            *usable_at = Instant::now();
        }
        match outcome {
            Ok(Message::Protocol(protocol)) => {
                if let (Connection::Socket(socket), Protocol::WebSocket(version)) =
                    (connection, protocol)
                {
                    socket.greet(version)?;
                }
                Ok(Some(Update::Connected { protocol }))
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
            Loss::Closed(_) => self.follower.protocol().is_none(),
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
    /// What comes by `until`, or none by then or earlier; an error where nothing usable came by `silent_at`.
    fn next(
        &mut self,
        until: Instant,
        silent_at: Instant,
    ) -> Result<Option<Result<Content, FrameError>>, Loss> {
        if Instant::now() >= silent_at {
            return Err(match self {
                Self::Socket(_) => Loss::Silent,
                Self::Library(library) => library.silence(),
            });
        }
        let until = until.min(silent_at);
        match self {
            Self::Socket(socket) => Ok(socket.next(until)?.map(|text| parse(&text))),
            Self::Library(library) => library.next(until),
        }
    }
}

fn loaded<'a>(leapc: &'a mut Option<LeapC>, file: Option<&Path>) -> Result<&'a LeapC, Loss> {
    match leapc {
        Some(leapc) => Ok(leapc),
        None => Ok(leapc.insert(LeapC::load(file)?)),
    }
}

//! Set-points as JSON datagrams to a person's own controller, and what it says of itself.
//!
//! ```text
//! Gate --Setpoint (1 kHz)--> UdpRobot --{"version":1,...} (200 Hz)--> controller
//!                            UdpRobot <--{"version":1,"position_m":...}-- controller, to where the commands came from
//! ```
//!
//! Clocks are not compared: a datagram tells **ages**. `age_us` is how old the evidence was when it was sent, `valid_for_us`
//! for how long after its arrival it may be followed; the controller measures that by its own clock and holds, then stops, by
//! itself (`docs/receiver.py`). The absolute times beside them are the host's, for logs.
//!
//! It sends only to the one address that a person named, and hears only that one. A datagram that the network does not take
//! at once is dropped and counted: the next one is newer.

use std::io::ErrorKind;
use std::net::{IpAddr, Ipv4Addr, Ipv6Addr, SocketAddr, UdpSocket};

use serde::{Deserialize, Serialize};

use super::command::{Command, Quality};
use super::gate::{Cause, State};
use super::limits::Setpoint;

/// Version of both datagrams.
pub const UDP_VERSION: u32 = 1;
/// No set-point may be followed longer than this after it was sent, microseconds: ten of them lost in a row.
pub const SETPOINT_LIFE_US: u64 = 100_000;
/// Rates at which set-points may be sent, Hz.
pub const RATES_HZ: [f64; 2] = [1.0, 1000.0];
/// A datagram of feedback is this long at most, bytes.
const MOST_FEEDBACK_BYTES: usize = 1024;
/// Datagrams read at once: a flood waits in the socket, which drops what it has no room for.
const MOST_READ: usize = 64;

/// What went wrong with the socket or its address.
#[derive(Debug, thiserror::Error)]
pub enum UdpError {
    /// Not an address.
    #[error(
        "{got:?} is no address to send to: give PORT or ADDRESS:PORT, as 5005 or 192.168.1.7:5005 (no names)"
    )]
    Address {
        /// What was given.
        got: String,
    },
    /// Not one controller.
    #[error("{got} is no single controller: give its own address and a port above 0")]
    NotOne {
        /// The address given.
        got: SocketAddr,
    },
    /// Too slow or too fast.
    #[error("{got_hz} set-points a second: give {low} to {high}", low = RATES_HZ[0], high = RATES_HZ[1])]
    Rate {
        /// The rate given, Hz.
        got_hz: f64,
    },
    /// No socket.
    #[error("no UDP socket towards {to}: {source}; is the network up?")]
    Socket {
        /// Where to.
        to: SocketAddr,
        /// Why.
        source: std::io::Error,
    },
}

/// One set-point as it is sent.
#[derive(Debug, Clone, PartialEq, Serialize, Deserialize)]
pub struct SetpointDatagram {
    /// [`UDP_VERSION`].
    pub version: u32,
    /// One more than the datagram's before.
    pub sequence: u64,
    /// The wearable's boot that the evidence comes from; none before there is any.
    pub boot_id: Option<u32>,
    /// When its newest scan was taken, host's session time, microseconds.
    pub acquired_us: Option<u64>,
    /// Until when this may be followed, host's session time, microseconds.
    pub valid_until_us: u64,
    /// When it was sent, host's session time, microseconds.
    pub sent_us: u64,
    /// How old the evidence was then, microseconds.
    pub age_us: Option<u64>,
    /// For how long after its arrival it may be followed, microseconds.
    pub valid_for_us: u64,
    /// Where the hand is to be, robot base frame, m.
    pub position_m: [f64; 3],
    /// Its velocity, m/s.
    pub velocity_m_per_s: [f64; 3],
    /// Diagonal stiffness, N/m.
    pub stiffness_n_per_m: [f64; 3],
    /// Ratio of damping to critical damping.
    pub damping_ratio: f64,
    /// `disarmed`, `following`, `holding`, `falling_back`.
    pub state: String,
    /// `good`, `undecided`, `novel`, `signal_fault`; none before the first command.
    pub quality: Option<String>,
}

/// What a controller may tell of itself.
#[derive(Debug, Clone, Copy, PartialEq, Deserialize)]
struct FeedbackDatagram {
    version: u32,
    position_m: [f64; 3],
    stiffness_n_per_m: [f64; 3],
    /// How old the measurement is, microseconds.
    #[serde(default)]
    age_us: u64,
}

/// Where the robot is, as its controller says.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Feedback {
    /// When it was there, session time, microseconds.
    pub measured_us: u64,
    /// Its hand, base frame, m.
    pub position_m: [f64; 3],
    /// Diagonal stiffness that it keeps, N/m.
    pub stiffness_n_per_m: [f64; 3],
}

/// What became of datagrams.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct UdpCounts {
    /// Set-points sent.
    pub sent: u64,
    /// Set-points that the network did not take.
    pub dropped: u64,
    /// Feedback taken.
    pub heard: u64,
    /// Feedback that was none, or came from elsewhere.
    pub refused: u64,
}

/// One controller at the other end of a socket.
#[derive(Debug)]
pub struct UdpRobot {
    socket: UdpSocket,
    to: SocketAddr,
    period_us: u64,
    next_us: u64,
    /// The state that was told last.
    told: Option<State>,
    last: Option<SetpointDatagram>,
    counts: UdpCounts,
}

/// The address of `PORT` (on this machine) or `ADDRESS:PORT`.
///
/// # Errors
/// [`UdpError::Address`].
pub fn address(text: &str) -> Result<SocketAddr, UdpError> {
    let local = |port: u16| SocketAddr::from((Ipv4Addr::LOCALHOST, port));
    let parsed = text.parse::<u16>().map(local);
    parsed
        .or_else(|_| text.parse::<SocketAddr>())
        .map_err(|_| UdpError::Address { got: text.into() })
}

impl UdpRobot {
    /// Opens a socket towards `to`; nothing is sent yet.
    ///
    /// # Errors
    /// [`UdpError`].
    pub fn open(to: SocketAddr, rate_hz: f64) -> Result<Self, UdpError> {
        let broadcast = to.ip() == IpAddr::V4(Ipv4Addr::BROADCAST);
        if to.port() == 0 || to.ip().is_unspecified() || to.ip().is_multicast() || broadcast {
            return Err(UdpError::NotOne { got: to });
        }
        let [low, high] = RATES_HZ;
        if !(low..=high).contains(&rate_hz) {
            return Err(UdpError::Rate { got_hz: rate_hz });
        }
        let own: IpAddr = match (to.ip().is_loopback(), to.is_ipv4()) {
            (true, true) => Ipv4Addr::LOCALHOST.into(),
            (true, false) => Ipv6Addr::LOCALHOST.into(),
            (false, true) => Ipv4Addr::UNSPECIFIED.into(),
            (false, false) => Ipv6Addr::UNSPECIFIED.into(),
        };
        let opened = UdpSocket::bind((own, 0)).and_then(|socket| {
            socket.set_nonblocking(true)?;
            Ok(socket)
        });
        let socket = opened.map_err(|source| UdpError::Socket { to, source })?;
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "1 to 1000 Hz"
        )]
        let period_us = (1e6 / rate_hz) as u64;
        Ok(Self {
            socket,
            to,
            period_us,
            next_us: 0,
            told: None,
            last: None,
            counts: UdpCounts::default(),
        })
    }

    /// Sends what the gate gave at `now_us` (session time), if it is time for the next one, or at once if the state is another.
    /// `newest` is the newest command that the gate took.
    pub fn send(
        &mut self,
        setpoint: &Setpoint,
        state: State,
        newest: Option<&Command>,
        now_us: u64,
    ) {
        if now_us < self.next_us && self.told == Some(state) {
            return;
        }
        self.told = Some(state);
        // In step with the clock, but after a stall not in a burst.
        self.next_us = (self.next_us + self.period_us).max(now_us + self.period_us / 2);
        let sequence = self.counts.sent + self.counts.dropped;
        let datagram = datagram(setpoint, state, newest, sequence, now_us);
        let sent = serde_json::to_vec(&datagram);
        self.last = Some(datagram);
        let sent = sent
            .map_err(std::io::Error::from)
            .and_then(|bytes| self.socket.send_to(&bytes, self.to));
        match sent {
            Ok(_) => self.counts.sent += 1,
            // Nobody listens, or the network is busy: the counter tells, the next one follows.
            Err(_) => self.counts.dropped += 1,
        }
    }

    /// Sends the last datagram's content again, some times: the last word must arrive, and no other follows it.
    pub fn repeat(&mut self) {
        const TIMES: usize = 3;
        let Some(mut last) = self.last.take() else {
            return;
        };
        for _ in 0..TIMES {
            last.sequence += 1;
            let bytes = serde_json::to_vec(&last).unwrap_or_default();
            match self.socket.send_to(&bytes, self.to) {
                Ok(_) => self.counts.sent += 1,
                Err(_) => self.counts.dropped += 1,
            }
        }
    }

    /// The newest that the controller said since the last call, if anything; `now_us` is session time.
    pub fn heard(&mut self, now_us: u64) -> Option<Feedback> {
        let mut newest = None;
        let mut bytes = [0; MOST_FEEDBACK_BYTES + 1];
        for _ in 0..MOST_READ {
            match self.socket.recv_from(&mut bytes) {
                Ok((length, from)) => {
                    let ours = from == self.to && length <= MOST_FEEDBACK_BYTES;
                    let told = ours.then(|| feedback(&bytes[..length], now_us)).flatten();
                    match told {
                        Some(told) => {
                            self.counts.heard += 1;
                            newest = Some(told);
                        }
                        None => self.counts.refused += 1,
                    }
                }
                Err(error) if error.kind() == ErrorKind::WouldBlock => break,
                // A closed port at the other end is told here by some systems; go on with the next datagram.
                Err(_) => {}
            }
        }
        newest
    }

    /// What became of datagrams so far.
    #[must_use]
    pub fn counts(&self) -> UdpCounts {
        self.counts
    }
}

fn datagram(
    setpoint: &Setpoint,
    state: State,
    newest: Option<&Command>,
    sequence: u64,
    now_us: u64,
) -> SetpointDatagram {
    // What the gate gives without following it gives on its own word: it is good for as long as any. Before a person armed it
    // that is not at all: the robot's own controller has it.
    let until_us = match (state, newest) {
        (State::Following, Some(command)) => command.valid_until_us,
        (State::Disarmed(Cause::Start), _) => 0,
        _ => u64::MAX,
    };
    let valid_until_us = until_us.min(now_us.saturating_add(SETPOINT_LIFE_US));
    SetpointDatagram {
        version: UDP_VERSION,
        sequence,
        boot_id: newest.map(|command| command.boot_id),
        acquired_us: newest.map(|command| command.acquired_us),
        valid_until_us,
        sent_us: now_us,
        age_us: newest.map(|command| now_us.saturating_sub(command.acquired_us)),
        valid_for_us: valid_until_us.saturating_sub(now_us),
        position_m: setpoint.position_m,
        velocity_m_per_s: setpoint.velocity_m_per_s,
        stiffness_n_per_m: setpoint.stiffness_n_per_m,
        damping_ratio: setpoint.damping_ratio,
        state: state_name(state).into(),
        quality: newest.map(|command| quality_name(command.quality).into()),
    }
}

/// A gate's state in one word.
#[must_use]
pub fn state_name(state: State) -> &'static str {
    match state {
        State::Disarmed(_) => "disarmed",
        State::Following => "following",
        State::Holding => "holding",
        State::FallingBack => "falling_back",
    }
}

fn quality_name(quality: Quality) -> &'static str {
    match quality {
        Quality::Good => "good",
        Quality::Undecided => "undecided",
        Quality::Novel => "novel",
        Quality::SignalFault => "signal_fault",
    }
}

/// None for bytes that are no feedback: another version, numbers that are none, a stiffness that is not positive.
fn feedback(bytes: &[u8], now_us: u64) -> Option<Feedback> {
    let told: FeedbackDatagram = serde_json::from_slice(bytes).ok()?;
    let numbers = told.position_m.iter().chain(&told.stiffness_n_per_m);
    let sound = told.version == UDP_VERSION
        && numbers.into_iter().all(|x| x.is_finite())
        && told.stiffness_n_per_m.iter().all(|k| *k > 0.0)
        && told.age_us <= now_us;
    sound.then(|| Feedback {
        measured_us: now_us - told.age_us,
        position_m: told.position_m,
        stiffness_n_per_m: told.stiffness_n_per_m,
    })
}

#[cfg(test)]
mod tests;

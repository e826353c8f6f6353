//! A connection over the WebSocket.

use std::io::ErrorKind;
use std::time::{Duration, Instant};

use tungstenite::client::client_with_config;
use tungstenite::protocol::frame::coding::CloseCode;
use tungstenite::protocol::{WebSocket, WebSocketConfig};
use tungstenite::{Error, HandshakeError, Message as Ws};

use super::Service;
use super::frame::MAX_BYTES;
use super::line::Line;
use super::loss::{HANDSHAKE_LIMIT, Loss};

/// Newest version of the protocol, asked for first.
pub(super) const NEWEST: u8 = 6;
/// Protocols 2 and 3 want a sign of life so often.
const HEARTBEAT: Duration = Duration::from_millis(100);

/// One connection.
#[derive(Debug)]
pub(super) struct Socket {
    socket: WebSocket<Line>,
    heartbeat_at: Option<Instant>,
}

impl Socket {
    pub(super) fn open(service: &Service, version: u8) -> Result<Self, Loss> {
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
    pub(super) fn greet(&mut self, version: u8) -> Result<(), Loss> {
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
    pub(super) fn next(&mut self, until: Instant) -> Result<Option<String>, Loss> {
        let now = Instant::now();
        if self.heartbeat_at.is_some_and(|due| now >= due) {
            self.say(r#"{"heartbeat":true}"#)?;
            self.heartbeat_at = Some(now + HEARTBEAT);
        }
        let wake = until.min(self.heartbeat_at.unwrap_or(until));
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

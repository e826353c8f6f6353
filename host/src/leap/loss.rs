//! Why there is no connection.

use std::time::Duration;

use thiserror::Error;
use tonus_native::leapc::LeapCError;
use tungstenite::Error;

use super::follower::Refusal;

/// Longest wait for the service to agree to the WebSocket.
pub(super) const HANDSHAKE_LIMIT: Duration = Duration::from_millis(1_000);
/// A connection that brings nothing usable for so long is given up.
pub(super) const SILENCE_LIMIT: Duration = Duration::from_secs(3);

/// Why there is no connection.
#[derive(Debug, Error)]
pub enum Loss {
    /// Nobody answers.
    #[error(
        "{url}: no Leap service: {source}; start it (with Gemini or later also UltraleapTrackingWebSocket, or use `leapc`), \
         and check host and port"
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
    /// LeapC is not there, or fails.
    #[error("{0}; or follow the service's WebSocket: ws://127.0.0.1:6437")]
    LeapC(#[from] LeapCError),
    /// LeapC is there and finds no service.
    #[error(
        "LeapC finds no tracking service within {SILENCE_LIMIT:?}: start it (Ultraleap Tracking Service; on Linux \
         `systemctl start ultraleap-hand-tracking-service`)"
    )]
    NoService,
    /// LeapC's service has gone.
    #[error("the Ultraleap tracking service has gone: start it again")]
    ServiceGone,
    /// The tracker was unplugged.
    #[error("the tracker has gone: plug it in again")]
    Unplugged,
    /// The tracker does not work.
    #[error(
        "the tracker has failed ({status:#010x}): unplug it and plug it in again, without a hub"
    )]
    Failed {
        /// Of LeapC's `eLeapDeviceStatus`.
        status: u32,
    },
}

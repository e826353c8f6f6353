//! Who may look and act: requests to this very address, from this very page, that know the token.

use axum::http::header::{HOST, ORIGIN, SEC_WEBSOCKET_PROTOCOL};
use axum::http::{HeaderMap, HeaderName, StatusCode};
use rand::TryRng;
use rand::rngs::SysRng;

use super::PageError;

/// The subprotocol that a browser asks for, followed by the token.
pub(super) const PROTOCOL: &str = "tonus";

/// What a request must show.
#[derive(Debug)]
pub(super) struct Guard {
    token: String,
    hosts: [String; 2],
    origins: [String; 2],
}

impl Guard {
    /// A guard of this port with a fresh token of 128 bits.
    pub(super) fn new(port: u16) -> Result<Self, PageError> {
        let mut bytes = [0_u8; 16];
        SysRng
            .try_fill_bytes(&mut bytes)
            .map_err(|error| PageError::NoToken {
                reason: error.to_string(),
            })?;
        let hosts = ["127.0.0.1", "localhost"].map(|name| format!("{name}:{port}"));
        Ok(Self {
            token: bytes.iter().map(|byte| format!("{byte:02x}")).collect(),
            origins: hosts.clone().map(|host| format!("http://{host}")),
            hosts,
        })
    }

    pub(super) fn token(&self) -> &str {
        &self.token
    }

    /// Where the page may connect to, for its content security policy.
    pub(super) fn sockets(&self) -> String {
        self.hosts
            .clone()
            .map(|host| format!("ws://{host}"))
            .join(" ")
    }

    /// Whether a request is to this server by its own name and from its own page, or from no page at all.
    pub(super) fn admits(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let host = only(headers, &HOST)?;
        if !host.is_some_and(|host| self.hosts.iter().any(|own| own == host)) {
            return Err(Refusal::Host);
        }
        let origin = only(headers, &ORIGIN)?;
        if !origin.is_none_or(|origin| self.origins.iter().any(|own| own == origin)) {
            return Err(Refusal::Origin);
        }
        Ok(())
    }

    /// Whether a request for a WebSocket knows the token: `Sec-WebSocket-Protocol: tonus, TOKEN`.
    pub(super) fn knows_token(&self, headers: &HeaderMap) -> Result<(), Refusal> {
        let asked = only(headers, &SEC_WEBSOCKET_PROTOCOL)?.unwrap_or("");
        let mut names = asked.split(',').map(str::trim);
        if names.next() == Some(PROTOCOL) && names.any(|name| same(name, &self.token)) {
            Ok(())
        } else {
            Err(Refusal::Token)
        }
    }
}

/// Why a request is turned away.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(super) enum Refusal {
    Host,
    Origin,
    Token,
    /// A header that must come once comes twice, or in no text.
    Header,
}

impl Refusal {
    pub(super) fn status(self) -> StatusCode {
        match self {
            Self::Host | Self::Origin => StatusCode::FORBIDDEN,
            Self::Token => StatusCode::UNAUTHORIZED,
            Self::Header => StatusCode::BAD_REQUEST,
        }
    }

    pub(super) fn text(self) -> &'static str {
        match self {
            Self::Host => {
                "this page answers to 127.0.0.1 and localhost alone: open the address that the program printed"
            }
            Self::Origin => "another page asked: only the program's own page may",
            Self::Token => {
                "the token is missing or of another run: open the address that the program printed"
            }
            Self::Header => "Host, Origin and Sec-WebSocket-Protocol must come once, as text",
        }
    }
}

fn only<'a>(headers: &'a HeaderMap, name: &HeaderName) -> Result<Option<&'a str>, Refusal> {
    let mut values = headers.get_all(name).iter();
    let Some(value) = values.next() else {
        return Ok(None);
    };
    match (value.to_str(), values.next()) {
        (Ok(text), None) => Ok(Some(text)),
        _ => Err(Refusal::Header),
    }
}

/// Compares without telling by its time where two texts differ.
fn same(one: &str, other: &str) -> bool {
    let differing = one
        .bytes()
        .zip(other.bytes())
        .fold(0, |all, (a, b)| all | (a ^ b));
    one.len() == other.len() && differing == 0
}

//! Where frames come from.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use thiserror::Error;

use super::Service;

/// What stands for LeapC in a configuration.
const LEAPC: &str = "leapc";

/// Where frames come from.
#[derive(Debug, Clone, PartialEq, Eq)]
pub enum Origin {
    /// A WebSocket of the service, or of the bridge.
    Service(Service),
    /// The library LeapC: this file, or where it usually is.
    LeapC(Option<PathBuf>),
}

/// Neither.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "`{got}` is no Leap service: give ws://HOST:PORT, for example ws://127.0.0.1:6437, or leapc[:FILE] for Ultraleap's library"
)]
pub struct OriginError {
    /// What was given.
    pub got: String,
}

impl FromStr for Origin {
    type Err = OriginError;

    /// `ws://HOST[:PORT]`, `leapc` or `leapc:FILE`.
    fn from_str(text: &str) -> Result<Self, OriginError> {
        if text == LEAPC {
            return Ok(Self::LeapC(None));
        }
        let file = text.strip_prefix(LEAPC).and_then(|at| at.strip_prefix(':'));
        if let Some(file) = file.filter(|file| !file.is_empty()) {
            return Ok(Self::LeapC(Some(PathBuf::from(file))));
        }
        let refused = |_| OriginError {
            got: text.to_owned(),
        };
        text.parse().map(Self::Service).map_err(refused)
    }
}

impl fmt::Display for Origin {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Service(service) => write!(out, "{}:{}", service.host, service.port),
            Self::LeapC(None) => out.write_str("LeapC"),
            Self::LeapC(Some(file)) => write!(out, "LeapC ({})", file.display()),
        }
    }
}

#[cfg(test)]
mod tests {
    use std::path::PathBuf;

    use super::{Origin, Service};

    #[test]
    fn the_library_is_named_with_or_without_its_file() {
        for (text, origin) in [
            ("leapc", Origin::LeapC(None)),
            (
                "leapc:/opt/libLeapC.so",
                Origin::LeapC(Some(PathBuf::from("/opt/libLeapC.so"))),
            ),
            ("ws://127.0.0.1", Origin::Service(Service::default())),
        ] {
            assert_eq!(text.parse(), Ok(origin));
        }
        for text in ["", "leapc:", "leapcx", "LeapC", "http://127.0.0.1"] {
            let error = text.parse::<Origin>().unwrap_err();
            assert!(error.to_string().contains("leapc[:FILE]"), "{text:?}");
        }
    }
}

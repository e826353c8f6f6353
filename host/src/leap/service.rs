//! Where the service is.

use std::str::FromStr;

use thiserror::Error;

/// Port of the service and of the bridge.
const PORT: u16 = 6437;

/// Host and port of a service.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Service {
    /// Name or address; one of version 6 without brackets.
    pub host: String,
    /// TCP port.
    pub port: u16,
}

impl Default for Service {
    /// The one on this machine.
    fn default() -> Self {
        Self {
            host: "127.0.0.1".to_owned(),
            port: PORT,
        }
    }
}

impl Service {
    /// The address of one version of the protocol.
    #[must_use]
    pub fn url(&self, version: u8) -> String {
        let (open, close) = if self.host.contains(':') {
            ("[", "]")
        } else {
            ("", "")
        };
        format!(
            "ws://{open}{}{close}:{}/v{version}.json",
            self.host, self.port
        )
    }
}

/// Not the address of a service.
#[derive(Debug, Clone, PartialEq, Eq, Error)]
#[error(
    "`{got}` is no address of a Leap service: give ws://HOST:PORT, for example ws://127.0.0.1:6437"
)]
pub struct ServiceError {
    /// What was given.
    pub got: String,
}

impl FromStr for Service {
    type Err = ServiceError;

    /// `ws://HOST[:PORT]`, with or without a path `/vN.json`, which is chosen by what the service speaks.
    fn from_str(text: &str) -> Result<Self, ServiceError> {
        let refused = || ServiceError {
            got: text.to_owned(),
        };
        let rest = text.strip_prefix("ws://").ok_or_else(refused)?;
        let (address, path) = rest.split_once('/').unwrap_or((rest, ""));
        let known_path = path.is_empty()
            || matches!(
                path.as_bytes(),
                [b'v', b'1'..=b'6', b'.', b'j', b's', b'o', b'n']
            );
        let (host, port) = match address.strip_prefix('[') {
            Some(six) => six.split_once(']').ok_or_else(refused)?,
            None => match address.find(':') {
                Some(at) => address.split_at(at),
                None => (address, ""),
            },
        };
        let port = match port.strip_prefix(':') {
            Some(number) => number.parse().ok().filter(|port| *port != 0),
            None => port.is_empty().then_some(PORT),
        };
        let plain = !host.is_empty()
            && host
                .bytes()
                .all(|b| b.is_ascii_alphanumeric() || b".-:_".contains(&b));
        match port {
            Some(port) if plain && known_path => Ok(Self {
                host: host.to_owned(),
                port,
            }),
            _ => Err(refused()),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Service;

    #[test]
    fn addresses() {
        for (text, url) in [
            ("ws://127.0.0.1:6437", "ws://127.0.0.1:6437/v6.json"),
            ("ws://localhost", "ws://localhost:6437/v6.json"),
            ("ws://tracker-2:80/", "ws://tracker-2:80/v6.json"),
            ("ws://[::1]:7000/v3.json", "ws://[::1]:7000/v6.json"),
        ] {
            assert_eq!(text.parse::<Service>().unwrap().url(6), url);
        }
        assert_eq!(Service::default().url(1), "ws://127.0.0.1:6437/v1.json");
    }

    #[test]
    fn what_is_none() {
        for text in [
            "",
            "127.0.0.1:6437",
            "http://a:1",
            "wss://a:1",
            "ws://",
            "ws://:1",
            "ws://a:",
            "ws://a:0",
            "ws://a:65536",
            "ws://a:1/v7.json",
            "ws://a:1/x",
            "ws://[::1",
            "ws://[::1]x",
            "ws://a b:1",
            "ws://a\r\nHost: b",
            "ws://user@a:1",
        ] {
            assert!(text.parse::<Service>().is_err(), "{text:?}");
        }
    }
}

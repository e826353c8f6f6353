//! Which device takes the wearable's place, as the command line names it.

use std::fmt;
use std::path::PathBuf;
use std::str::FromStr;

use thiserror::Error;

/// A device, or what stands in for one.
#[derive(Clone, Debug, PartialEq, Eq)]
pub enum LinkChoice {
    /// A wearable over Bluetooth LE, by its name or address; none for any.
    Ble(Option<String>),
    /// A wearable on a serial port.
    Serial(PathBuf),
    /// A Myo armband.
    Myo,
    /// A recording.
    Replay(PathBuf),
    /// The simulated wearer.
    Simulated,
    /// A stream of the Lab Streaming Layer, by its name; none for any of type EMG.
    Lsl(Option<String>),
}

/// A text that names no link.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
#[error(
    "`{got}` is no link: give ble (any wearable near by) or ble:NAME, serial:PORT (such as serial:/dev/ttyACM0 or serial:COM3), myo, \
     replay:FILE, sim, or lsl or lsl:NAME"
)]
pub struct NoLink {
    /// The text.
    pub got: String,
}

impl FromStr for LinkChoice {
    type Err = NoLink;

    fn from_str(text: &str) -> Result<Self, NoLink> {
        let (kind, of) = match text.split_once(':') {
            Some((kind, of)) => (kind, Some(of)),
            None => (text, None),
        };
        let choice = match (kind, of) {
            // A colon announces a name.
            (_, Some("")) => None,
            ("ble", name) => Some(Self::Ble(name.map(str::to_owned))),
            ("serial", Some(port)) => Some(Self::Serial(port.into())),
            ("myo", None) => Some(Self::Myo),
            ("replay", Some(file)) => Some(Self::Replay(file.into())),
            ("sim", None) => Some(Self::Simulated),
            ("lsl", name) => Some(Self::Lsl(name.map(str::to_owned))),
            _ => None,
        };
        choice.ok_or_else(|| NoLink {
            got: text.to_owned(),
        })
    }
}

/// As it is parsed.
impl fmt::Display for LinkChoice {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        match self {
            Self::Ble(None) => write!(out, "ble"),
            Self::Ble(Some(name)) => write!(out, "ble:{name}"),
            Self::Serial(port) => write!(out, "serial:{}", port.display()),
            Self::Myo => write!(out, "myo"),
            Self::Replay(file) => write!(out, "replay:{}", file.display()),
            Self::Simulated => write!(out, "sim"),
            Self::Lsl(None) => write!(out, "lsl"),
            Self::Lsl(Some(name)) => write!(out, "lsl:{name}"),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn every_link_is_named_as_it_is_shown() {
        for (text, choice) in [
            ("ble", LinkChoice::Ble(None)),
            ("ble:Tonus", LinkChoice::Ble(Some("Tonus".to_owned()))),
            // An address holds colons of its own.
            (
                "ble:C7:0A:70:5E:00:01",
                LinkChoice::Ble(Some("C7:0A:70:5E:00:01".to_owned())),
            ),
            (
                "serial:/dev/ttyACM0",
                LinkChoice::Serial("/dev/ttyACM0".into()),
            ),
            ("serial:COM3", LinkChoice::Serial("COM3".into())),
            ("myo", LinkChoice::Myo),
            (r"replay:C:\a.mcap", LinkChoice::Replay(r"C:\a.mcap".into())),
            ("sim", LinkChoice::Simulated),
            ("lsl", LinkChoice::Lsl(None)),
            ("lsl:My EMG", LinkChoice::Lsl(Some("My EMG".to_owned()))),
        ] {
            assert_eq!(text.parse(), Ok(choice.clone()));
            assert_eq!(choice.to_string(), text);
        }
    }

    #[test]
    fn what_is_no_link_is_refused_with_all_that_are() {
        for text in [
            "", "usb", "serial", "serial:", "ble:", "sim:1", "replay", "myo:", "BLE",
        ] {
            let error = text.parse::<LinkChoice>().unwrap_err();
            assert_eq!(error.got, text);
            let text = error.to_string();
            for link in [
                "ble:NAME",
                "serial:PORT",
                "myo",
                "replay:FILE",
                "sim",
                "lsl:NAME",
            ] {
                assert!(text.contains(link), "{text}");
            }
        }
    }
}

//! The command line.

use std::{net::SocketAddr, path::PathBuf};

use embassy_time::Duration;
use trouble_host::Address;

use crate::{Failure, INTERVAL};

const PACKETS: u64 = 300;

/// What to do, and over which radio.
pub(crate) struct Options {
    pub(crate) controller: SocketAddr,
    pub(crate) task: Task,
    /// Stream packets to count.
    pub(crate) packets: u64,
    /// Connection interval of a session.
    pub(crate) interval: Duration,
}

pub(crate) enum Task {
    /// The wearable of this address once, with the bond in this file.
    Visit(Address, PathBuf),
    /// The host's own logic.
    Session(Session),
}

#[derive(Clone, Copy)]
pub(crate) enum Session {
    Wearable,
    Myo,
}

pub(crate) fn options(mut words: impl Iterator<Item = String>) -> Result<Options, Failure> {
    let missing = |what: &str| Failure::Usage(format!("{what} is missing"));
    let controller = words.next().ok_or_else(|| missing("the controller"))?;
    let controller = controller
        .parse()
        .map_err(|_| Failure::Usage(format!("{controller} is no address with port")))?;
    let (mut wearable, mut bond, mut session) = (None, None, None);
    let (mut packets, mut interval) = (PACKETS, INTERVAL);
    while let Some(word) = words.next() {
        let value = words.next().ok_or_else(|| missing(&word))?;
        let wrong = || Failure::Usage(format!("{value} is no {word}"));
        match word.as_str() {
            "--wearable" => wearable = Some(address(&value).ok_or_else(wrong)?),
            "--bond" => bond = Some(PathBuf::from(&value)),
            "--session" if value == "wearable" => session = Some(Session::Wearable),
            "--session" if value == "myo" => session = Some(Session::Myo),
            "--packets" => packets = value.parse().map_err(|_| wrong())?,
            "--interval-ms" => {
                interval = Duration::from_millis(value.parse().map_err(|_| wrong())?)
            }
            other => return Err(Failure::Usage(format!("{other} {value} is unknown"))),
        }
    }
    let task = match session {
        Some(session) => Task::Session(session),
        None => Task::Visit(
            wearable.ok_or_else(|| missing("--wearable"))?,
            bond.ok_or_else(|| missing("--bond"))?,
        ),
    };
    Ok(Options {
        controller,
        task,
        packets,
        interval,
    })
}

/// A random address as it is printed, most significant byte first.
pub(crate) fn address(text: &str) -> Option<Address> {
    let mut bytes = [0; 6];
    let mut parts = text.split(':');
    for byte in bytes.iter_mut().rev() {
        *byte = u8::from_str_radix(parts.next()?, 16).ok()?;
    }
    parts.next().is_none().then(|| Address::random(bytes))
}

//! Why there is no link by Bluetooth, and what to do.

use thiserror::Error;
use tonus_shared::wire::MIN_ATT_MTU;

use super::passkey::LIMIT as PASSKEY_WITHIN;
use super::wearable::{INTERVAL_LIMIT_US, SCAN};

/// Why there is no link, or none any more.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum BleError {
    /// There is nothing to scan with.
    #[error(
        "no Bluetooth: {reason}; plug in or switch on an adapter, or use --link serial:PORT (wired image) or --link sim"
    )]
    NoAdapter {
        /// What the system says.
        reason: String,
    },
    /// The system's Bluetooth failed.
    #[error("the system's Bluetooth failed in {doing}: {reason}")]
    System {
        /// What was to be done.
        doing: &'static str,
        /// What the system says.
        reason: String,
    },
    /// Nobody who is looked for advertises.
    #[error(
        "no {wanted} within {} s{}: switch it on and bring it near; a wearable that is connected to another host does not advertise",
        SCAN.as_secs(), seen(others)
    )]
    NotFound {
        /// Who is looked for.
        wanted: String,
        /// Names of those of the same kind that were there.
        others: Vec<String>,
    },
    /// It was found, and does not answer.
    #[error("{name} does not answer: {reason}; bring it nearer")]
    NoLink {
        /// Who.
        name: String,
        /// What the system says.
        reason: String,
    },
    /// Stream packets do not fit.
    #[error(
        "the link carries attributes of {got} bytes, the stream needs {MIN_ATT_MTU}: this Bluetooth adapter or its driver does not negotiate the MTU; use another"
    )]
    Mtu {
        /// Largest attribute, bytes.
        got: u16,
    },
    /// Packets would be too old when they come.
    #[error(
        "the connection interval is {} ms, the stream needs {} ms or less: close other Bluetooth connections of this computer, or use another adapter",
        f64::from(*got_us) / 1e3, INTERVAL_LIMIT_US / 1_000
    )]
    Interval {
        /// Connection interval, microseconds.
        got_us: u32,
    },
    /// The wearable pairs with nobody now.
    #[error(
        "the wearable does not pair: {reason}; press its pairing button and try again within a minute"
    )]
    PairingRefused {
        /// What the system says.
        reason: String,
    },
    /// Nobody gave six digits.
    #[error(
        "no passkey was given: press the wearable's pairing button, and type the six digits that its log shows within {} s, on the page or at the terminal",
        PASSKEY_WITHIN.as_secs()
    )]
    NoPasskey,
    /// The wearable does not take the digits.
    #[error(
        "the wearable did not take the passkey: press its pairing button, and type the six digits that its log shows then"
    )]
    WrongPasskey,
    /// A bond on one side only.
    #[error(
        "the wearable does not know this computer any more: remove it from the system's Bluetooth devices (Linux: bluetoothctl remove {id}), press its pairing button and try again"
    )]
    NotAllowed {
        /// Its address.
        id: String,
    },
    /// The other side lacks something.
    #[error(
        "it has no characteristic {characteristic:032x}: its firmware is of another version; update it"
    )]
    Missing {
        /// Which.
        characteristic: u128,
    },
    /// The link ended.
    #[error("the link ended: out of reach, or switched off; trying again")]
    LinkLost,
    /// The link stands, and nothing comes.
    #[error("nothing came for {seconds} s: its front end has failed or it hangs; trying again")]
    Silent {
        /// So long.
        seconds: u64,
    },
    /// What the device numbers nowhere is lost or waits on the way, and nobody can tell which.
    #[error(
        "samples of {late_ms} ms are lost or late, and nothing tells which: the link is made anew; bring it nearer if this comes again"
    )]
    Late {
        /// Of so long.
        late_ms: u64,
    },
}

fn seen(others: &[String]) -> String {
    if others.is_empty() {
        String::new()
    } else {
        format!(", but {}", others.join(", "))
    }
}

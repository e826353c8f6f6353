//! The wearable over Bluetooth LE: whom to connect to, what a link must offer, pairing, and which characteristic a
//! frame goes to.
//!
//! All of it stands on [`Central`], so that it runs on the system's Bluetooth ([`platform`]) and on a virtual radio
//! alike. **The former has never met a radio**: what is shown of it is that it compiles, and what it says where
//! there is no adapter. The virtual radio (`tests/air`) shows the rest against the wearable's own code.

#[cfg(target_os = "linux")]
pub mod agent;
mod error;
mod passkey;
pub mod platform;
mod wearable;

pub use error::BleError;
pub use passkey::{LIMIT as PASSKEY_WITHIN, NotTaken, Passkeys, Wanted as WantedPasskey, passkey};
pub use wearable::{NOTIFYING, Place, Wanted, check, find, open, place};

use std::sync::Arc;
use std::time::Duration;

/// Asks a person for the six digits that the wearable shows, given its name; none if nobody answers. It may block.
pub type AskPasskey = Arc<dyn Fn(&str) -> Option<u32> + Send + Sync>;

/// Somebody who advertises.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Found {
    /// For [`Central::connect`], and unique: an address, or what the system gives instead.
    pub id: String,
    /// The advertised name.
    pub name: Option<String>,
    /// Services advertised.
    pub services: Vec<u128>,
    /// Signal strength, dBm; none where the system does not tell.
    pub rssi_dbm: Option<i16>,
}

/// What the link carries.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Parameters {
    /// Largest attribute, bytes.
    pub mtu: u16,
    /// Connection interval, microseconds; none where the system does not tell (BlueZ and macOS do not).
    pub interval_us: Option<u32>,
}

/// One value that the other side sent by itself.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Notified {
    /// From this characteristic.
    pub characteristic: u128,
    /// Its value.
    pub value: Vec<u8>,
}

/// A Bluetooth host in the central's role, with one link at most.
///
/// It is used on one thread. [`Self::notified`] may be dropped while it waits and loses nothing; whoever implements
/// this takes notifications off the system as they come, whether somebody waits or not.
#[allow(
    async_fn_in_trait,
    reason = "used on one thread, so nothing must be Send"
)]
pub trait Central {
    /// Listens for advertisers for at most `limit`, or until one of them is `enough`; each of them once.
    ///
    /// # Errors
    /// [`BleError::NoAdapter`] and [`BleError::System`].
    async fn scan(
        &mut self,
        limit: Duration,
        enough: &dyn Fn(&Found) -> bool,
    ) -> Result<Vec<Found>, BleError>;

    /// Connects, asks for the largest MTU and finds the characteristics.
    ///
    /// # Errors
    /// [`BleError::NoLink`] when the other side does not answer, or [`BleError::System`].
    async fn connect(&mut self, found: &Found) -> Result<(), BleError>;

    /// What the link carries now.
    ///
    /// # Errors
    /// [`BleError::LinkLost`].
    async fn parameters(&mut self) -> Result<Parameters, BleError>;

    /// Makes the link authenticated: by the bond that is kept, or else by pairing with a passkey.
    ///
    /// # Errors
    /// [`BleError::PairingRefused`], [`BleError::NoPasskey`], [`BleError::WrongPasskey`] or [`BleError::LinkLost`].
    async fn pair(&mut self, ask: &AskPasskey) -> Result<(), BleError>;

    /// Asks for notifications of a characteristic.
    ///
    /// # Errors
    /// [`BleError::Missing`], [`BleError::NotAllowed`], [`BleError::LinkLost`] or [`BleError::System`].
    async fn subscribe(&mut self, characteristic: u128) -> Result<(), BleError>;

    /// Writes a characteristic, `confirmed` or without an answer.
    ///
    /// # Errors
    /// As [`Self::subscribe`].
    async fn write(
        &mut self,
        characteristic: u128,
        value: &[u8],
        confirmed: bool,
    ) -> Result<(), BleError>;

    /// Waits for the next notification.
    ///
    /// # Errors
    /// [`BleError::LinkLost`].
    async fn notified(&mut self) -> Result<Notified, BleError>;

    /// Ends the link, if there is one.
    async fn leave(&mut self);
}

//! Hosts that were paired with, oldest first, as one record.

use core::fmt::Debug;

use heapless::Vec;

use super::{error::StorageError, records::PAYLOAD_LIMIT};

/// Hosts that are remembered.
pub const BONDS: usize = 4;
/// Longest secret of a bond in bytes.
pub const SECRET_BYTES: usize = 96;
/// A host's identity: address kind and address.
pub const HOST_BYTES: usize = 7;

/// The longest record fits.
const _: () = assert!(BONDS * (HOST_BYTES + 1 + SECRET_BYTES) <= PAYLOAD_LIMIT);

/// Hosts that were paired with, oldest first.
pub type Bonds = Vec<Bond, BONDS>;

/// One host and what it was paired with.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Bond {
    /// The host's identity: address kind and address. A host has one bond.
    pub host: [u8; HOST_BYTES],
    /// Keys and security level, as the Bluetooth layer serialised them.
    pub secret: Vec<u8, SECRET_BYTES>,
}

/// Whether a person has just opened the wearable to a new host.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum PairingWindow {
    /// A bond may take another's place.
    Open,
    /// Nothing that is kept may be replaced.
    Closed,
}

/// Puts `bond` last: in place of the same host's bond, else, with every place taken, of the oldest. Says whose
/// bond went.
///
/// # Errors
/// [`StorageError::WindowClosed`] when one would have to go and the window is closed; then nothing changed.
pub(super) fn put<E: Debug>(
    bonds: &mut Bonds,
    bond: Bond,
    window: PairingWindow,
) -> Result<Option<[u8; HOST_BYTES]>, StorageError<E>> {
    let same = bonds.iter().position(|kept| kept.host == bond.host);
    let goes = match same {
        None if bonds.is_full() => Some(0),
        other => other,
    };
    let refused = StorageError::WindowClosed { got: bonds.len() };
    if goes.is_some() && window == PairingWindow::Closed {
        return Err(refused);
    }
    let gone = goes.map(|index| bonds.remove(index).host);
    match bonds.push(bond) {
        Ok(()) => Ok(gone),
        Err(_) => Err(refused),
    }
}

/// The record: per bond the host, the secret's length (u8) and the secret; no bond at all is one zero byte.
/// `None` cannot be: the longest record fits, as is asserted above.
pub(super) fn encode(bonds: &Bonds) -> Option<Vec<u8, PAYLOAD_LIMIT>> {
    let mut bytes = Vec::new();
    for bond in bonds {
        bytes.extend_from_slice(&bond.host).ok()?;
        bytes.push(u8::try_from(bond.secret.len()).ok()?).ok()?;
        bytes.extend_from_slice(&bond.secret).ok()?;
    }
    if bytes.is_empty() {
        bytes.push(0).ok()?;
    }
    Some(bytes)
}

/// Reads a record; `None` for one that [`encode`] does not write.
pub(super) fn decode(mut bytes: &[u8]) -> Option<Bonds> {
    let mut bonds = Bonds::new();
    if bytes == [0] {
        return Some(bonds);
    }
    while !bytes.is_empty() {
        let (host, rest) = bytes.split_first_chunk::<HOST_BYTES>()?;
        let (&length, rest) = rest.split_first()?;
        let (secret, rest) = rest.split_at_checked(usize::from(length))?;
        let bond = Bond {
            host: *host,
            secret: Vec::from_slice(secret).ok()?,
        };
        bonds.push(bond).ok()?;
        bytes = rest;
    }
    Some(bonds)
}

//! The bond with the wearable as a file: address, identity resolving key (zeros: none), long term key, least significant byte
//! first. Only what was made with a passkey is kept.

use std::{io, path::Path};

use trouble_host::{
    Address, BondInformation, Identity, IdentityResolvingKey, LongTermKey,
    connection::SecurityLevel,
};

use crate::Failure;

const BYTES: usize = 6 + 16 + 16;

/// The bond kept; none where there is no file.
pub(crate) fn load(path: &Path) -> Result<Option<BondInformation>, Failure> {
    let bytes = match std::fs::read(path) {
        Err(error) if error.kind() == io::ErrorKind::NotFound => return Ok(None),
        bytes => bytes?,
    };
    let (address, rest) = bytes.split_first_chunk::<6>().ok_or(short(&bytes))?;
    let (irk, rest) = rest.split_first_chunk::<16>().ok_or(short(&bytes))?;
    let ltk = <[u8; 16]>::try_from(rest).map_err(|_| short(&bytes))?;
    let identity = Identity {
        addr: Address::random(*address),
        irk: IdentityResolvingKey::from_le_bytes(*irk),
    };
    Ok(Some(BondInformation::new(
        identity,
        LongTermKey::from_le_bytes(ltk),
        SecurityLevel::EncryptedAuthenticated,
        true,
    )))
}

fn short(bytes: &[u8]) -> Failure {
    Failure::Bond {
        expected: BYTES,
        got: bytes.len(),
    }
}

/// Keeps a bond.
pub(crate) fn store(path: &Path, bond: &BondInformation) -> io::Result<()> {
    let Identity { addr, irk } = bond.identity;
    let mut bytes = Vec::with_capacity(BYTES);
    bytes.extend(addr.addr.into_inner());
    bytes.extend(irk.map_or([0; 16], IdentityResolvingKey::to_le_bytes));
    bytes.extend(bond.ltk.to_le_bytes());
    std::fs::write(path, bytes)
}

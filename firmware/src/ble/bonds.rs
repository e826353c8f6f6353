//! The hosts that have paired: at most [`MAX_BONDS`], the oldest first, in a fixed layout for the flash.

use heapless::Vec;
use trouble_host::{
    Address, BondInformation, Identity, IdentityResolvingKey, LongTermKey,
    connection::SecurityLevel,
};

/// Hosts that are remembered.
pub const MAX_BONDS: usize = 4;
/// Bytes of one [`BondRecord`].
pub const BOND_BYTES: usize = 1 + 1 + 6 + 16 + 16;
/// First byte of a record. Any change of the layout raises it; a record of another version is forgotten,
/// and its host pairs again.
const VERSION: u8 = 1;

/// One bond as it is kept: version, address kind (0 public, 1 random), address, identity resolving key
/// (zeros: none), long term key; numbers least significant byte first.
///
/// Only bonds made with a passkey are kept, so that needs no field.
#[derive(Clone, Copy, PartialEq, Eq)]
pub struct BondRecord(pub [u8; BOND_BYTES]);

/// Every bond kept, the oldest first.
pub type BondList = Vec<BondRecord, MAX_BONDS>;

/// Where bonds are kept over a reset.
#[allow(
    async_fn_in_trait,
    reason = "one executor thread runs all of the radio; nothing asks for `Send`"
)]
pub trait Bonds {
    /// The list stored last; empty where there is none or it cannot be read.
    async fn load(&mut self) -> BondList;

    /// Keeps this list in place of the one before, wholly or not at all.
    ///
    /// # Errors
    /// [`BondsNotKept`] when the storage failed: the host has to pair again after a reset.
    async fn store(&mut self, bonds: &BondList) -> Result<(), BondsNotKept>;
}

/// The storage of bonds failed.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[error("the bonds could not be stored: after a reset the newest host must pair again")]
pub struct BondsNotKept;

impl BondRecord {
    /// The record of a bond; `None` unless a passkey was compared.
    #[must_use]
    pub(super) fn of(bond: &BondInformation) -> Option<Self> {
        if !bond.security_level.authenticated() {
            return None;
        }
        let Identity { addr, irk } = bond.identity;
        let mut bytes = [0; BOND_BYTES];
        // Kinds 2 and 3 are 0 and 1, resolved by the controller.
        bytes[..2].copy_from_slice(&[VERSION, addr.kind.into_inner() & 1]);
        bytes[2..8].copy_from_slice(&addr.addr.into_inner());
        bytes[8..24].copy_from_slice(&irk.map_or([0; 16], |key| key.to_le_bytes()));
        bytes[24..].copy_from_slice(&bond.ltk.to_le_bytes());
        Some(Self(bytes))
    }

    /// The bond in this record; `None` when it is of another version or kind.
    #[must_use]
    pub(super) fn bond(&self) -> Option<BondInformation> {
        let [VERSION, kind @ (0 | 1), rest @ ..] = &self.0 else {
            return None;
        };
        let (address, rest) = rest.split_first_chunk::<6>()?;
        let (irk, rest) = rest.split_first_chunk::<16>()?;
        let ltk = rest.first_chunk::<16>()?;
        let mut addr = Address::random(*address);
        if *kind == 0 {
            addr.kind = bt_hci::param::AddrKind::PUBLIC;
        }
        let identity = Identity {
            addr,
            irk: IdentityResolvingKey::from_le_bytes(*irk),
        };
        Some(BondInformation::new(
            identity,
            LongTermKey::from_le_bytes(*ltk),
            SecurityLevel::EncryptedAuthenticated,
            true,
        ))
    }
}

impl core::fmt::Debug for BondRecord {
    /// Without its keys: notices and errors go to a console.
    fn fmt(&self, f: &mut core::fmt::Formatter<'_>) -> core::fmt::Result {
        write!(f, "BondRecord({:02x?})", &self.0[..8])
    }
}

/// Makes `bond` the newest of `list`. It takes the place of an older bond of the same host; a full list
/// gives up its oldest, whose identity is returned.
pub(super) fn keep(list: &mut BondList, bond: &BondInformation) -> Option<Identity> {
    let record = BondRecord::of(bond)?;
    list.retain(|kept| {
        kept.bond()
            .is_some_and(|kept| !kept.identity.match_identity(&bond.identity))
    });
    let replaced = list.is_full().then(|| list.remove(0));
    // There is room: a full list has just given up one.
    let _ = list.push(record);
    replaced?.bond().map(|bond| bond.identity)
}

#[cfg(test)]
mod tests {
    use super::*;

    fn bond(number: u8) -> BondInformation {
        BondInformation::new(
            Address::random([number, 2, 3, 4, 5, 0xc6]).into(),
            LongTermKey::from_le_bytes([number; 16]),
            SecurityLevel::EncryptedAuthenticated,
            true,
        )
    }

    fn numbers(list: &BondList) -> std::vec::Vec<u8> {
        list.iter().map(|record| record.0[2]).collect()
    }

    #[test]
    fn a_record_is_these_bytes() {
        let mut random = bond(0x11);
        random.identity.irk = IdentityResolvingKey::from_le_bytes([0x22; 16]);
        let mut bytes = [0; BOND_BYTES];
        bytes[..8].copy_from_slice(&[1, 1, 0x11, 2, 3, 4, 5, 0xc6]);
        bytes[8..24].fill(0x22);
        bytes[24..].fill(0x11);
        assert_eq!(BondRecord::of(&random), Some(BondRecord(bytes)));
        assert_eq!(BondRecord(bytes).bond(), Some(random));

        bytes[1] = 0;
        bytes[8..24].fill(0);
        let public = BondRecord(bytes).bond().unwrap();
        assert_eq!(public.identity.irk, None);
        assert_eq!(public.identity.addr.kind, bt_hci::param::AddrKind::PUBLIC);
    }

    #[test]
    fn another_version_or_kind_is_no_bond() {
        let BondRecord(good) = BondRecord::of(&bond(1)).unwrap();
        for (place, value) in [(0, 0), (0, 2), (0, 0xff), (1, 2), (1, 0xff)] {
            let mut bytes = good;
            bytes[place] = value;
            assert_eq!(BondRecord(bytes).bond(), None, "byte {place} = {value}");
        }
    }

    #[test]
    fn only_a_bond_with_a_passkey_is_kept() {
        let mut list = BondList::new();
        for level in [SecurityLevel::Encrypted, SecurityLevel::NoEncryption] {
            let mut unauthenticated = bond(1);
            unauthenticated.security_level = level;
            assert_eq!(keep(&mut list, &unauthenticated), None);
            assert!(list.is_empty());
        }
    }

    #[test]
    fn a_fifth_bond_replaces_the_oldest() {
        let mut list = BondList::new();
        for number in 1..=4 {
            assert_eq!(keep(&mut list, &bond(number)), None);
        }
        assert_eq!(keep(&mut list, &bond(5)), Some(bond(1).identity));
        assert_eq!(numbers(&list), [2, 3, 4, 5]);
    }

    #[test]
    fn a_host_that_pairs_again_is_the_newest_and_pushes_nobody_out() {
        let mut list = BondList::new();
        for number in 1..=4 {
            keep(&mut list, &bond(number));
        }
        assert_eq!(keep(&mut list, &bond(2)), None);
        assert_eq!(numbers(&list), [1, 3, 4, 2]);
    }

    #[test]
    fn a_debug_print_holds_no_key() {
        let printed = std::format!("{:?}", BondRecord::of(&bond(0x5a)).unwrap());
        assert_eq!(printed.matches("5a").count(), 1, "{printed}");
    }
}

//! Bonds in the wearable's flash.

use embedded_storage_async::nor_flash::MultiwriteNorFlash;
use heapless::Vec;

use crate::{
    keeper::Flash,
    storage::{RECORD_BYTES, Record},
};

use super::{BOND_BYTES, BondList, BondRecord, Bonds, BondsNotKept, MAX_BONDS};

/// Format of the record: [`BondRecord`]s, one after another.
const VERSION: u16 = 1;

const _: () = assert!(MAX_BONDS * BOND_BYTES <= RECORD_BYTES);

/// The bonds' place in this flash.
#[derive(Clone, Copy)]
pub struct KeptBonds<'a, F: MultiwriteNorFlash>(pub &'a Flash<F>);

impl<F: MultiwriteNorFlash> Bonds for KeptBonds<'_, F> {
    async fn load(&mut self) -> BondList {
        // What rotted, or is of another format, lets nobody in.
        let Ok(Some(record)) = self.0.lock().await.bonds().await else {
            return BondList::new();
        };
        let (bonds, rest) = record.bytes.as_chunks::<BOND_BYTES>();
        if record.version != VERSION || !rest.is_empty() {
            return BondList::new();
        }
        bonds
            .iter()
            .take(MAX_BONDS)
            .copied()
            .map(BondRecord)
            .collect()
    }

    async fn store(&mut self, bonds: &BondList) -> Result<(), BondsNotKept> {
        let mut bytes = Vec::new();
        for bond in bonds {
            bytes.extend_from_slice(&bond.0).map_err(|_| BondsNotKept)?;
        }
        let record = Record {
            version: VERSION,
            bytes,
        };
        let mut flash = self.0.lock().await;
        flash.keep_bonds(&record).await.map_err(|_| BondsNotKept)
    }
}

//! Bonds in a file, in the place of the chip's flash.

use std::{fs, path::PathBuf};

use tonus_firmware::ble::{BOND_BYTES, BondList, BondRecord, Bonds, BondsNotKept};

/// The records one after another; a process that starts with the same file is the same wearable after a
/// reset.
pub(crate) struct FileBonds {
    path: PathBuf,
}

impl FileBonds {
    pub(crate) fn new(path: PathBuf) -> Self {
        Self { path }
    }
}

impl Bonds for FileBonds {
    async fn load(&mut self) -> BondList {
        let bytes = fs::read(&self.path).unwrap_or_default();
        let (records, _) = bytes.as_chunks::<BOND_BYTES>();
        records.iter().copied().map(BondRecord).collect()
    }

    async fn store(&mut self, bonds: &BondList) -> Result<(), BondsNotKept> {
        let bytes: Vec<u8> = bonds.iter().flat_map(|record| record.0).collect();
        fs::write(&self.path, bytes).map_err(|_| BondsNotKept)
    }
}

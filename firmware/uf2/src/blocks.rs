//! UF2: blocks of 512 bytes, each with the address of what it carries.
//!
//! By Microsoft's specification (<https://github.com/microsoft/uf2>), and as Adafruit's nRF52 bootloader, which the
//! XIAO comes with, wants it (`src/usb/uf2/ghostfat.c`, `is_uf2_block`): payloads of exactly 256 bytes at addresses
//! divisible by that, each block with the family.

use std::collections::BTreeMap;

use crate::image::Image;

/// Length of a block in bytes.
pub(crate) const BLOCK_BYTES: usize = 512;
/// What of the flash a block carries, in bytes.
pub(crate) const PAYLOAD_BYTES: usize = 256;

const MAGIC_START: [u32; 2] = [0x0A32_4655, 0x9E5D_5157];
const MAGIC_END: u32 = 0x0AB1_6F30;
/// The last word of the header is the family.
const FLAG_FAMILY: u32 = 0x0000_2000;
/// nRF52840 (`utils/uf2families.json` there; `CFG_UF2_FAMILY_APP_ID` in the bootloader's `uf2cfg.h`).
const FAMILY: u32 = 0xADA5_2840;
/// What the flash holds where nothing was written.
const ERASED: u8 = 0xff;

/// The image as blocks, by address. What it leaves open within a block is [`ERASED`]; where it leaves a whole block
/// open there is none.
pub(crate) fn blocks(image: &Image) -> Vec<[u8; BLOCK_BYTES]> {
    let mut payloads = BTreeMap::new();
    for part in &image.parts {
        for (at, byte) in (part.start..).zip(part.bytes) {
            let within = at as usize % PAYLOAD_BYTES;
            let payload = payloads
                .entry(at - within as u32)
                .or_insert([ERASED; PAYLOAD_BYTES]);
            payload[within] = *byte;
        }
    }
    let count = payloads.len() as u32;
    (0..)
        .zip(&payloads)
        .map(|(number, (address, payload))| block(*address, payload, number, count))
        .collect()
}

fn block(
    address: u32,
    payload: &[u8; PAYLOAD_BYTES],
    number: u32,
    count: u32,
) -> [u8; BLOCK_BYTES] {
    let header = [
        MAGIC_START[0],
        MAGIC_START[1],
        FLAG_FAMILY,
        address,
        PAYLOAD_BYTES as u32,
        number,
        count,
        FAMILY,
    ];
    let mut block = [0; BLOCK_BYTES];
    for (bytes, word) in block.chunks_exact_mut(4).zip(header) {
        bytes.copy_from_slice(&word.to_le_bytes());
    }
    block[32..32 + PAYLOAD_BYTES].copy_from_slice(payload);
    block[BLOCK_BYTES - 4..].copy_from_slice(&MAGIC_END.to_le_bytes());
    block
}

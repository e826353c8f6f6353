#![allow(clippy::expect_used, reason = "in a test that is how it fails")]

use super::*;
use crate::image::Part;

/// One program header: type, load address, bytes.
type Segment<'a> = (u32, u32, &'a [u8]);
const LOAD: u32 = 1;
const NOTE: u32 = 4;
const ARM: u16 = 40;

/// A 32-bit little-endian ELF file by the System V ABI: header, program headers, what they load.
fn elf(machine: u16, segments: &[Segment]) -> Vec<u8> {
    let mut file = vec![0x7f, b'E', b'L', b'F', 1, 1, 1, 0, 0, 0, 0, 0, 0, 0, 0, 0];
    // Executable; machine; version; entry, program headers at 52, no sections; flags.
    file.extend(2u16.to_le_bytes());
    file.extend(machine.to_le_bytes());
    for word in [1, 0, 52, 0, 0u32] {
        file.extend(word.to_le_bytes());
    }
    for half in [52, 32, segments.len() as u16, 40, 0, 0] {
        file.extend(half.to_le_bytes());
    }
    let mut offset = 52 + 32 * segments.len() as u32;
    for (kind, address, bytes) in segments {
        let length = bytes.len() as u32;
        // Initial data runs in RAM and is loaded into the flash: the run address must not matter.
        for word in [*kind, offset, 0x2000_0000, *address, length, length, 4, 4] {
            file.extend(word.to_le_bytes());
        }
        offset += length;
    }
    for (_, _, bytes) in segments {
        file.extend_from_slice(bytes);
    }
    file
}

fn read(file: &[u8]) -> Result<Vec<[u8; 512]>, Uf2Error> {
    Image::read(file, &XIAO.image).map(|image| blocks::blocks(&image))
}

#[test]
fn blocks_are_microsofts_to_the_byte() {
    let code: Vec<u8> = (0..300u32).map(|byte| byte as u8).collect();
    let blocks = read(&elf(ARM, &[(LOAD, 0x2_7000, &code)])).expect("an image");
    assert_eq!(blocks.len(), 2);
    // "UF2\n", second magic number, family present, 0x27000, 256 bytes, block 0 of 2, nRF52840.
    assert_eq!(
        blocks[0][..32],
        [
            0x55, 0x46, 0x32, 0x0a, 0x57, 0x51, 0x5d, 0x9e, 0x00, 0x20, 0x00, 0x00, 0x00, 0x70,
            0x02, 0x00, //
            0x00, 0x01, 0x00, 0x00, 0x00, 0x00, 0x00, 0x00, 0x02, 0x00, 0x00, 0x00, 0x40, 0x28,
            0xa5, 0xad,
        ]
    );
    assert_eq!(
        blocks[1][12..24],
        [
            0x00, 0x71, 0x02, 0x00, 0x00, 0x01, 0x00, 0x00, 0x01, 0x00, 0x00, 0x00
        ]
    );
    for block in &blocks {
        assert_eq!(block[508..], [0x30, 0x6f, 0xb1, 0x0a]);
        assert_eq!(block[288..508], [0; 220]);
    }
    assert_eq!(blocks[0][32..288], code[..256]);
    assert_eq!(blocks[1][32..76], code[256..]);
    assert_eq!(blocks[1][76..288], [0xff; 212]);
}

#[test]
fn parts_are_taken_at_their_load_addresses() {
    let file = elf(
        ARM,
        &[
            (LOAD, 0x2_7210, &[5, 6]),
            (NOTE, 0, &[9; 8]),
            (LOAD, 0x2_7000, &[1, 2, 3, 4]),
            (LOAD, 0x2_7004, &[7]),
            (LOAD, 0x2000_0000, &[]),
        ],
    );
    let image = Image::read(&file, &XIAO.image).expect("an image");
    let part = |start, bytes| Part { start, bytes };
    assert_eq!(
        image.parts,
        [
            part(0x2_7000, &[1, 2, 3, 4][..]),
            part(0x2_7004, &[7]),
            part(0x2_7210, &[5, 6])
        ]
    );
    let blocks = blocks::blocks(&image);
    // Nothing is said about 0x27100..0x27200, so no block goes there.
    assert_eq!(blocks.len(), 2);
    assert_eq!(blocks[0][32..38], [1, 2, 3, 4, 7, 0xff]);
    assert_eq!(blocks[1][12..16], 0x2_7200u32.to_le_bytes());
    assert_eq!(blocks[1][32 + 0x0f..32 + 0x13], [0xff, 5, 6, 0xff]);
}

#[test]
fn the_last_byte_of_the_place_is_taken_and_the_next_refused() {
    let start: Segment = (LOAD, 0x2_7000, &[1]);
    assert!(read(&elf(ARM, &[start, (LOAD, 0xc_1ffe, &[1, 2])])).is_ok());
    let refused = read(&elf(ARM, &[start, (LOAD, 0xc_1ffe, &[1, 2, 3])]));
    assert!(matches!(
        refused,
        Err(Uf2Error::Outside {
            end: 0xc_2001,
            expected_end: 0xc_2000,
            ..
        })
    ));
    let refused = read(&elf(ARM, &[start, (LOAD, 0xffff_ffff, &[1, 2])]));
    assert!(matches!(
        refused,
        Err(Uf2Error::Outside {
            end: 0x1_0000_0001,
            ..
        })
    ));
}

#[test]
fn the_other_boards_image_is_refused_with_what_to_do() {
    let error = read(&elf(ARM, &[(LOAD, 0, &[1, 2, 3, 4])])).expect_err("the DK's");
    assert!(matches!(
        error,
        Uf2Error::Outside {
            start: 0,
            end: 4,
            expected_start: 0x2_7000,
            ..
        }
    ));
    assert!(error.to_string().contains("cargo firmware-xiao"), "{error}");
}

#[test]
fn what_is_no_image_for_the_chip_is_refused() {
    let x86 = read(&elf(62, &[(LOAD, 0x2_7000, &[1])]));
    assert!(matches!(
        x86,
        Err(Uf2Error::Processor {
            expected: 40,
            got: 62
        })
    ));
    let mut wide = elf(ARM, &[(LOAD, 0x2_7000, &[1])]);
    wide[4] = 2;
    assert!(matches!(read(&wide), Err(Uf2Error::NotAnImage { .. })));
    let mut big_endian = elf(ARM, &[(LOAD, 0x2_7000, &[1])]);
    big_endian[5] = 2;
    assert!(matches!(
        read(&big_endian),
        Err(Uf2Error::NotAnImage { .. })
    ));
    assert!(matches!(read(b"UF2\n"), Err(Uf2Error::NotAnImage { .. })));
    assert!(matches!(read(&elf(ARM, &[])), Err(Uf2Error::Empty)));
    let late = read(&elf(ARM, &[(LOAD, 0x2_7100, &[1])]));
    assert!(matches!(
        late,
        Err(Uf2Error::Start {
            expected: 0x2_7000,
            got: 0x2_7100
        })
    ));
    let twice = read(&elf(
        ARM,
        &[(LOAD, 0x2_7000, &[1, 2]), (LOAD, 0x2_7001, &[3])],
    ));
    assert!(matches!(twice, Err(Uf2Error::Overlap { at: 0x2_7001 })));
    let mut cut = elf(ARM, &[(LOAD, 0x2_7000, &[1, 2, 3])]);
    cut.pop();
    assert!(matches!(read(&cut), Err(Uf2Error::Cut { start: 0x2_7000 })));
}

#[test]
fn a_refused_image_leaves_the_file_as_it_was() {
    let folder = tempfile::tempdir().expect("a folder");
    let [good, bad, uf2] = ["good", "bad", "out.uf2"].map(|name| folder.path().join(name));
    std::fs::write(&good, elf(ARM, &[(LOAD, 0x2_7000, &[1])])).expect("written");
    std::fs::write(&bad, elf(ARM, &[(LOAD, 0, &[1])])).expect("written");
    assert_eq!(convert(&good, &uf2).expect("converted"), 1);
    let first = std::fs::read(&uf2).expect("there");
    assert_eq!(first.len(), 512);
    convert(&bad, &uf2).expect_err("refused");
    convert(&folder.path().join("none"), &uf2).expect_err("no image");
    assert_eq!(std::fs::read(&uf2).expect("still there"), first);
    convert(&good, &folder.path().join("no/such/folder.uf2")).expect_err("nowhere to write");
    // A folder stands where the file should go: written beside it, not moved there, and cleared away.
    std::fs::create_dir(folder.path().join("folder")).expect("a folder");
    convert(&good, &folder.path().join("folder")).expect_err("not a file");
    // Nothing half written lies about.
    assert_eq!(std::fs::read_dir(&folder).expect("read").count(), 4);
}

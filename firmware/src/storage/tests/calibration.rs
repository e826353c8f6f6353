use super::*;

/// Recognisable, and different in every byte from its neighbours in number; the length of the real packet's order.
fn calibration(number: u32) -> Record {
    let bytes = Random(u64::from(number)).bytes(150 + number as usize % 7);
    Record {
        version: 2,
        bytes: Vec::from_slice(&bytes).unwrap(),
    }
}

fn keep(storage: &mut Opened<'_>, number: u32) -> Result<(), Error> {
    block_on(storage.keep_calibration(&calibration(number)))
}

fn read(flash: &mut FakeFlash) -> Result<Option<Record>, Error> {
    block_on(open(flash).calibration())
}

/// A flash in which `count` calibrations were kept, numbered from 1.
fn kept(count: u32) -> FakeFlash {
    let mut flash = FakeFlash::new();
    for number in 1..=count {
        keep(&mut open(&mut flash), number).unwrap();
    }
    flash
}

fn numbered(count: u32) -> Option<Record> {
    (count > 0).then(|| calibration(count))
}

#[test]
fn what_was_kept_comes_back_after_a_restart() {
    for count in 0..40 {
        assert_eq!(read(&mut kept(count)), Ok(numbered(count)));
    }
}

/// The bytes in the flash, worked out by hand: the checksum is that of Python's `zlib.crc32`.
#[test]
fn a_record_in_the_flash_is_what_the_documentation_says() {
    let mut flash = FakeFlash::new();
    let calibration = Record {
        version: 0x0102,
        bytes: Vec::from_slice(b"tonus").unwrap(),
    };
    block_on(open(&mut flash).keep_calibration(&calibration)).unwrap();
    let start = DK.calibration.start + 32;
    // python3 -c 'import zlib; print(hex(zlib.crc32(bytes([1,0,0,0, 5,0, 2,1]) + b"tonus")))'
    let crc = 0x72ac_f281_u32.to_le_bytes();
    let expected = [
        1, 0, 0, 0, 5, 0, 2, 1, crc[0], crc[1], crc[2], crc[3], b't', b'o', b'n', b'u', b's', 0xff,
        0xff, 0xff,
    ];
    assert_eq!(flash.slice(start, 20), expected);
    assert_eq!(flash.slice(start + 504, 4), [0; 4], "the mark");
    let first_mark = flash.slice(DK.calibration.start, 4);
    assert_eq!(first_mark, [0xff; 4], "the page is not closed");
}

/// Every step of a write, into every kind of place: the first, one within a page, the last of a page, the first
/// of the next with the erase before it, and the same once both pages were full.
#[test]
fn a_cut_leaves_the_old_calibration_or_the_new_one() {
    let mut steps = 0;
    for count in [0, 1, 7, 8, 9, 15, 16, 24] {
        let base = kept(count);
        steps += cut_everywhere(
            &base,
            |storage| keep(storage, count + 1),
            |flash, acknowledged| {
                let found = read(flash).unwrap();
                let new = found == numbered(count + 1);
                assert!(new || (found == numbered(count) && !acknowledged));
                keep(&mut open(flash), 1000).unwrap();
                assert_eq!(read(flash), Ok(numbered(1000)));
            },
        );
    }
    println!("calibration: {steps} steps cut in seven ways");
    assert!(steps > 300);
}

/// Nothing but cuts: the value before them survives however many there are.
#[test]
fn a_calibration_survives_a_hundred_cuts_in_a_row() {
    for seed in 0..20 {
        let mut random = Random(seed);
        let mut flash = kept(seed as u32 + 1);
        let mut last = seed as u32 + 1;
        for number in 100..200 {
            flash.cut(Cut {
                step: random.below(48),
                how: How::Within {
                    seed: random.next(),
                },
            });
            let cut = power_was_cut(keep(&mut open(&mut flash), number));
            flash.restart();
            let found = read(&mut flash).unwrap();
            if found == numbered(number) {
                last = number;
            } else {
                assert!(cut, "an acknowledged calibration is gone");
                assert_eq!(found, numbered(last));
            }
        }
    }
}

/// Every bit of the newest record, with an older one before it: the value comes back or is refused, and the
/// older one never takes its place.
#[test]
fn a_rotten_bit_is_found_and_refused() {
    let base = kept(2);
    let start = DK.calibration.start + 32 + 508;
    let payload = calibration(2).bytes.len() as u32;
    for offset in 0..508 {
        for bit in 0..8 {
            let mut flash = base.clone();
            flash.flip(start + offset, bit);
            let found = read(&mut flash);
            if offset < 12 + payload {
                let Err(StorageError::Damaged {
                    partition: Name::Calibration,
                    offset,
                    expected,
                    got,
                }) = found
                else {
                    panic!("byte {offset} bit {bit}: {found:?}");
                };
                assert_eq!(offset, start);
                assert_ne!(expected, got);
            } else {
                assert_eq!(found, Ok(numbered(2)), "padding and mark hold nothing");
            }
            keep(&mut open(&mut flash), 3).unwrap();
            assert_eq!(read(&mut flash), Ok(numbered(3)));
        }
    }
}

/// Bits of everything else in the partition: page marks, older records, what was never written.
#[test]
fn a_rotten_bit_elsewhere_changes_nothing() {
    for count in [3, 8, 9, 16, 17] {
        let base = kept(count);
        let newest = (count as usize - 1) % 16;
        let newest = DK.calibration.start
            + (newest / 8) as u32 * PAGE_BYTES
            + 32
            + (newest % 8) as u32 * 508;
        let mut random = Random(u64::from(count));
        for _ in 0..1000 {
            let address = DK.calibration.start + random.below(8192) as u32;
            if (newest..newest + 508).contains(&address) {
                continue;
            }
            let mut flash = base.clone();
            flash.flip(address, random.below(8) as u32);
            assert_eq!(read(&mut flash), Ok(numbered(count)), "{address:#x}");
        }
    }
}

/// Several bits at once, anywhere in the newest record: never a third value.
#[test]
fn rot_never_makes_another_calibration() {
    let base = kept(5);
    let start = DK.calibration.start + 32 + 4 * 508;
    let mut random = Random(7);
    for _ in 0..3000 {
        let mut flash = base.clone();
        for _ in 0..2 + random.below(30) {
            let address = start + random.below(170) as u32;
            flash.flip(address, random.below(8) as u32);
        }
        match read(&mut flash) {
            Ok(found) => assert_eq!(found, numbered(5)),
            Err(error) => assert!(matches!(error, StorageError::Damaged { .. }), "{error}"),
        }
    }
}

/// A board that was used for something else: refused as damaged or seen as empty, and written all the same.
#[test]
fn foreign_bytes_in_the_partition_do_not_keep_a_calibration_out() {
    for seed in 0..50 {
        let mut random = Random(seed);
        let mut flash = FakeFlash::new();
        let start = DK.calibration.start as usize;
        let foreign = match seed {
            0 => vec![0; 8192],
            1 => vec![0x55; 8192],
            _ => random.bytes(8192),
        };
        flash.bytes[start..start + 8192].copy_from_slice(&foreign);
        assert!(!matches!(read(&mut flash), Ok(Some(_))));
        for number in 1..20 {
            keep(&mut open(&mut flash), number).unwrap();
            assert_eq!(read(&mut flash), Ok(numbered(number)));
        }
    }
}

#[test]
fn eight_calibrations_cost_one_erase_and_both_pages_share_them() {
    let flash = kept(1600);
    let first = (DK.calibration.start / PAGE_BYTES) as usize;
    let erases: u32 = flash.erases.iter().sum();
    assert_eq!(flash.erases[first], 99);
    assert_eq!(flash.erases[first + 1], 100);
    assert_eq!(
        erases, 199,
        "one for each page that was begun, but the first"
    );
}

#[test]
fn an_empty_calibration_is_refused() {
    let mut flash = kept(1);
    let empty = Record {
        version: 2,
        bytes: Vec::new(),
    };
    assert_eq!(
        block_on(open(&mut flash).keep_calibration(&empty)),
        Err(StorageError::WrongLength {
            partition: Name::Calibration,
            expected: 256,
            got: 0
        })
    );
    assert_eq!(read(&mut flash), Ok(numbered(1)));
}

#[test]
fn the_longest_calibration_fits() {
    let mut flash = kept(1);
    let longest = Record {
        version: u16::MAX,
        bytes: Vec::from_slice(&Random(1).bytes(RECORD_BYTES)).unwrap(),
    };
    block_on(open(&mut flash).keep_calibration(&longest)).unwrap();
    assert_eq!(read(&mut flash), Ok(Some(longest)));
}

/// Bonds lie in a partition of their own, and come back when a rotten record was replaced.
#[test]
fn bonds_and_calibration_do_not_touch_each_other_and_rotten_bonds_can_be_replaced() {
    let mut flash = kept(1);
    assert_eq!(block_on(open(&mut flash).bonds()), Ok(None));
    for number in 10..40 {
        block_on(open(&mut flash).keep_bonds(&calibration(number))).unwrap();
        assert_eq!(
            block_on(open(&mut flash).bonds()),
            Ok(Some(calibration(number)))
        );
    }
    assert_eq!(read(&mut flash), Ok(numbered(1)));
    let newest = DK.bonds.start + PAGE_BYTES + 32 + 5 * 508;
    flash.flip(newest + 20, 3);
    let rotten = block_on(open(&mut flash).bonds());
    assert!(
        matches!(
            rotten,
            Err(StorageError::Damaged {
                partition: Name::Bonds,
                ..
            })
        ),
        "{rotten:?}"
    );
    block_on(open(&mut flash).keep_bonds(&calibration(40))).unwrap();
    assert_eq!(
        block_on(open(&mut flash).bonds()),
        Ok(Some(calibration(40)))
    );
}

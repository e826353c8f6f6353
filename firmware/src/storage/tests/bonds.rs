use super::*;

fn bond(number: u8) -> Bond {
    Bond {
        host: [number; HOST_BYTES],
        secret: Vec::from_slice(&Random(u64::from(number)).bytes(60)).unwrap(),
    }
}

fn keep(
    storage: &mut Opened<'_>,
    number: u8,
    window: PairingWindow,
) -> Result<Option<[u8; HOST_BYTES]>, Error> {
    block_on(storage.keep_bond(bond(number), window))
}

/// A flash in which the numbered hosts were paired with, in this order.
fn paired(numbers: &[u8]) -> FakeFlash {
    let mut flash = FakeFlash::new();
    for &number in numbers {
        keep(&mut open(&mut flash), number, PairingWindow::Open).unwrap();
    }
    flash
}

fn read(flash: &mut FakeFlash) -> Result<std::vec::Vec<Bond>, Error> {
    let bonds = block_on(open(flash).bonds())?;
    Ok(bonds.iter().cloned().collect())
}

fn numbered(numbers: &[u8]) -> std::vec::Vec<Bond> {
    numbers.iter().copied().map(bond).collect()
}

/// Behind a record's header of 12 bytes: two bonds, each host, length, secret.
#[test]
fn bonds_in_the_flash_are_what_the_documentation_says() {
    let mut flash = FakeFlash::new();
    for (number, secret) in [(0x11, &b"ab"[..]), (0x22, b"cde")] {
        let bond = Bond {
            host: [number; HOST_BYTES],
            secret: Vec::from_slice(secret).unwrap(),
        };
        block_on(open(&mut flash).keep_bond(bond, PairingWindow::Closed)).unwrap();
    }
    let second = DK.bonds.start + 32 + 508 + 12;
    let expected = b"\x11\x11\x11\x11\x11\x11\x11\x02ab\x22\x22\x22\x22\x22\x22\x22\x03cde\xff";
    assert_eq!(flash.slice(second, 22), expected);
}

#[test]
fn the_fifth_host_takes_the_place_of_the_oldest() {
    let mut flash = paired(&[1, 2, 3, 4]);
    assert_eq!(read(&mut flash), Ok(numbered(&[1, 2, 3, 4])));
    let gone = keep(&mut open(&mut flash), 5, PairingWindow::Open);
    assert_eq!(gone, Ok(Some([1; HOST_BYTES])));
    assert_eq!(read(&mut flash), Ok(numbered(&[2, 3, 4, 5])));
}

#[test]
fn a_host_that_pairs_again_has_one_bond_and_is_the_newest() {
    let mut flash = paired(&[1, 2, 3, 4]);
    let mut again = bond(2);
    again.secret[0] ^= 1;
    let gone = block_on(open(&mut flash).keep_bond(again.clone(), PairingWindow::Open));
    assert_eq!(gone, Ok(Some([2; HOST_BYTES])));
    let mut expected = numbered(&[1, 3, 4]);
    expected.push(again);
    assert_eq!(read(&mut flash), Ok(expected));
}

#[test]
fn a_closed_window_replaces_nothing() {
    let mut flash = paired(&[1, 2, 3, 4]);
    for number in [5, 2] {
        let refused = keep(&mut open(&mut flash), number, PairingWindow::Closed);
        assert_eq!(refused, Err(StorageError::WindowClosed { got: 4 }));
    }
    assert_eq!(read(&mut flash), Ok(numbered(&[1, 2, 3, 4])));
    let mut free = paired(&[1]);
    assert_eq!(
        keep(&mut open(&mut free), 2, PairingWindow::Closed),
        Ok(None),
        "a free place is no replacement"
    );
}

#[test]
fn forgotten_hosts_stay_forgotten() {
    let mut flash = paired(&[1, 2, 3, 4]);
    block_on(open(&mut flash).forget_bonds()).unwrap();
    assert_eq!(read(&mut flash), Ok(vec![]));
}

#[test]
fn four_bonds_of_the_longest_fit_and_so_does_an_empty_one() {
    let mut flash = FakeFlash::new();
    let mut expected = vec![];
    for (number, length) in [(1, 0), (2, 96), (3, 96), (4, 96), (5, 96)] {
        let bond = Bond {
            host: [number; HOST_BYTES],
            secret: Vec::from_slice(&Random(u64::from(number)).bytes(length)).unwrap(),
        };
        block_on(open(&mut flash).keep_bond(bond.clone(), PairingWindow::Open)).unwrap();
        expected.push(bond);
        if expected.len() > BONDS {
            expected.remove(0);
        }
        assert_eq!(read(&mut flash).as_ref(), Ok(&expected));
    }
}

/// Adding, replacing the oldest, replacing the same host's and forgetting, on a fresh page and across the turn of one.
#[test]
fn a_cut_leaves_the_old_bonds_or_the_new_ones() {
    let histories: [&[u8]; 5] = [
        &[],
        &[1],
        &[1, 2, 3, 4],
        &[1, 2, 3, 4, 5, 6, 7, 8],
        &[1, 2, 3, 4, 5, 6, 7, 8, 9, 10, 11, 12, 13, 14, 15, 16],
    ];
    for history in histories {
        let mut base = paired(history);
        let old = read(&mut base).unwrap();
        let mut replaced: std::vec::Vec<Bond> = old.clone();
        if replaced.len() == BONDS {
            replaced.remove(0);
        }
        replaced.push(bond(100));
        let outcomes = |flash: &mut FakeFlash, acknowledged: bool, new: &[Bond]| {
            let found = read(flash).unwrap();
            assert!(found == new || (found == old && !acknowledged), "{found:?}");
            keep(&mut open(flash), 200, PairingWindow::Open).unwrap();
            let newest = read(flash).unwrap().last().cloned();
            assert_eq!(newest, Some(bond(200)));
        };
        cut_everywhere(
            &base,
            |storage| keep(storage, 100, PairingWindow::Open).map(|_| ()),
            |flash, acknowledged| outcomes(flash, acknowledged, &replaced),
        );
        cut_everywhere(
            &base,
            |storage| block_on(storage.forget_bonds()),
            |flash, acknowledged| outcomes(flash, acknowledged, &[]),
        );
    }
}

/// An older record would let a host back in whose bond was taken away.
#[test]
fn rotten_bonds_are_refused_until_they_are_forgotten() {
    let base = paired(&[1, 2, 3, 4, 5]);
    let start = DK.bonds.start + 32 + 4 * 508;
    let mut random = Random(3);
    for _ in 0..500 {
        let mut flash = base.clone();
        let address = start + random.below(12 + 4 * 68) as u32;
        flash.flip(address, random.below(8) as u32);
        let refused = |outcome: Result<(), Error>| {
            assert!(
                matches!(
                    outcome,
                    Err(StorageError::Damaged {
                        partition: Name::Bonds,
                        ..
                    })
                ),
                "{outcome:?}"
            );
        };
        refused(read(&mut flash).map(|_| ()));
        refused(keep(&mut open(&mut flash), 6, PairingWindow::Open).map(|_| ()));
        block_on(open(&mut flash).forget_bonds()).unwrap();
        keep(&mut open(&mut flash), 6, PairingWindow::Closed).unwrap();
        assert_eq!(read(&mut flash), Ok(numbered(&[6])));
    }
}

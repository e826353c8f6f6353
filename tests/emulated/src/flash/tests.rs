use super::*;

const PAGE: u32 = 0xF_C000;

fn write(address: u32, value: u32) -> Operation {
    Operation::Write { address, value }
}

const ERASE: Operation = Operation::Erase {
    address: PAGE,
    share: WHOLE,
};

/// The word after the operations, in a page that was erased.
fn word_after(flash: &mut Flash, values: &[u32]) -> Result<u32, MachineError> {
    let mut word = [0xFF; 4];
    for value in values {
        flash.perform(write(PAGE, *value), &mut word)?;
    }
    Ok(u32::from_le_bytes(word))
}

fn erased() -> Flash {
    Flash::new(&vec![0xFF; FLASH_BYTES], 7)
}

#[test]
fn a_write_clears_bits_and_sets_none() {
    assert_eq!(
        word_after(&mut erased(), &[0xF0F0_FFFF, 0xFF00_FF0F]),
        Ok(0xF000_FF0F)
    );
}

#[test]
fn a_third_write_to_a_word_is_an_error_until_its_page_is_erased() {
    let mut flash = erased();
    let too_often = Err(MachineError::Flash {
        address: PAGE,
        misuse: FlashMisuse::WrittenTooOften,
    });
    assert_eq!(word_after(&mut flash, &[1, 1, 1]), too_often);
    let mut page = [0; PAGE_BYTES];
    flash.perform(ERASE, &mut page).unwrap();
    assert_eq!(page, [0xFF; PAGE_BYTES]);
    assert_eq!(word_after(&mut flash, &[1, 1]), Ok(1));
    // What the programmer wrote counts.
    let mut flash = Flash::new(&[0; FLASH_BYTES], 7);
    assert_eq!(word_after(&mut flash, &[1]), Ok(1));
    assert_eq!(word_after(&mut flash, &[1]), too_often);
}

#[test]
fn a_cut_leaves_a_word_between_old_and_new_and_ends_all_that_follows() {
    let mut between = 0;
    for seed in 0..100 {
        let mut flash = Flash::new(&vec![0xFF; FLASH_BYTES], seed);
        flash.cut_at = Some(1);
        let value = 0x1234_5678;
        let word = word_after(&mut flash, &[0xFFFF_0000, value, 0]).unwrap();
        assert!(flash.cut);
        assert_eq!(word & !0xFFFF_0000, 0, "the first write was whole");
        assert_eq!(word & value & 0xFFFF_0000, value & 0xFFFF_0000);
        assert_eq!(flash.operations.len(), 2);
        between += u32::from(word != 0xFFFF_0000 && word != value & 0xFFFF_0000);
    }
    assert!(between > 80, "{between} of 100 words were half written");
}

#[test]
fn a_cut_leaves_a_page_half_erased() {
    let mut shares: Vec<usize> = (0..64)
        .map(|seed| {
            let mut page = [0; PAGE_BYTES];
            ERASE.tear(&mut page, &mut Noise::new(seed));
            page.iter().map(|byte| byte.count_ones() as usize).sum()
        })
        .collect();
    shares.sort_unstable();
    // From hardly begun to nearly done, and never whole.
    assert!(shares[0] < PAGE_BYTES && shares[63] > 7 * PAGE_BYTES && shares[63] < 8 * PAGE_BYTES);
}

#[test]
fn what_a_cut_leaves_can_be_told_from_the_operations() {
    let before = vec![0; PAGE as usize + PAGE_BYTES];
    let operations = [ERASE, write(PAGE, 0xAAAA_AAAA), write(PAGE + 4, 0)];
    let mut half = 0;
    for seed in 0..20 {
        let flash = torn(&before, &operations, seed);
        assert_eq!(flash.len(), FLASH_BYTES);
        let at = PAGE as usize;
        assert_eq!(flash[at - 4..at], [0; 4]);
        assert_eq!(flash[at..at + 4], [0xAA; 4]);
        assert_eq!(flash[at + 8..at + PAGE_BYTES], [0xFF; PAGE_BYTES - 8]);
        half += u32::from(![[0; 4], [0xFF; 4]].contains(flash[at + 4..].first_chunk().unwrap()));
        assert_eq!(flash, torn(&before, &operations, seed));
    }
    assert!(half > 14, "the last one was torn in {half} of 20 cuts");
    assert_ne!(torn(&before, &operations, 1), torn(&before, &operations, 2));
}

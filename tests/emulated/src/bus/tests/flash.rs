use super::*;
use crate::error::FlashMisuse;
use crate::flash::PAGE_BYTES;

const PAGE: u32 = 0xF_C000;
const CONFIG: u32 = nvmc::BASE + 0x504;
const ERASE_PAGE: u32 = nvmc::BASE + 0x508;
const ERASE_PART: u32 = nvmc::BASE + 0x518;
const PART_MS: u32 = nvmc::BASE + 0x51C;

impl Bench {
    fn page(&self) -> &[u8] {
        &self.memory.flash[PAGE as usize..][..PAGE_BYTES]
    }

    /// Milliseconds that the processor stood still since this was asked last.
    fn stalled_us(&mut self) -> u64 {
        std::mem::take(&mut self.bus.effects.stall_cycles) / 64
    }
}

#[test]
fn a_page_is_erased_in_erase_mode_only_and_takes_85_ms() {
    let mut bench = Bench::new(World::default());
    for mode in [0, 1] {
        bench.write(CONFIG, mode);
        assert!(bench.refuses(ERASE_PAGE, PAGE), "in mode {mode}");
    }
    bench.write(CONFIG, 2);
    // Any address within the page.
    bench.write(ERASE_PAGE, PAGE + 0x123);
    assert_eq!(bench.stalled_us(), 85_000);
    assert_eq!(bench.page(), [0xFF; PAGE_BYTES]);
    assert_eq!(bench.memory.flash[PAGE as usize - 1], 0);
    assert!(bench.refuses(ERASE_PAGE, FLASH_BYTES as u32));
    assert!(bench.refuses(CONFIG, 3));
    assert_eq!(bench.read(nvmc::BASE + 0x400), 1);
}

#[test]
fn the_processor_may_write_in_write_mode_only() {
    let mut bench = Bench::new(World::default());
    for (mode, writable) in [(1, true), (2, false), (1, true), (0, false)] {
        bench.write(CONFIG, mode);
        assert_eq!(bench.memory.writable, writable);
        assert_eq!(bench.read(CONFIG), mode);
    }
}

#[test]
fn a_page_erased_in_parts_is_undefined_until_the_time_of_a_whole_erase_is_spent() {
    let mut bench = Bench::new(World::default());
    bench.write(CONFIG, 2);
    // A part takes 10 ms at reset, and 5 per cent more at most.
    assert_eq!(bench.read(PART_MS), 10);
    for part in 1..=8 {
        bench.write(ERASE_PART, PAGE);
        assert_eq!(bench.stalled_us(), 10_500);
        let ones: u32 = bench.page().iter().map(|byte| byte.count_ones()).sum();
        assert!((1..8 * PAGE_BYTES as u32).contains(&ones), "{part}: {ones}");
    }
    bench.write(PART_MS, 5);
    bench.write(ERASE_PART, PAGE);
    assert_eq!(bench.stalled_us(), 5_250);
    assert_eq!(bench.page(), [0xFF; PAGE_BYTES]);
}

#[test]
fn a_word_wears_until_its_page_is_erased() {
    let mut bench = Bench::new(World::default());
    bench.memory.worn = Flash::new(&[0xFF; FLASH_BYTES], 1);
    let write = |bench: &mut Bench| {
        bench.memory.flash(Operation::Write {
            address: PAGE,
            value: 0,
        })
    };
    assert_eq!([write(&mut bench), write(&mut bench)], [Ok(()), Ok(())]);
    let worn = MachineError::Flash {
        address: PAGE,
        misuse: FlashMisuse::WrittenTooOften,
    };
    assert_eq!(write(&mut bench), Err(worn));
    bench.write(CONFIG, 2);
    bench.write(ERASE_PAGE, PAGE);
    assert_eq!(write(&mut bench), Ok(()));
}

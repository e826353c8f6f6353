//! A flash like the nRF52840's, whose power can be cut in any step.
//!
//! What it cannot show: a word cut short may read differently from one time to the next on silicon. Here it
//! reads the same until it is written or erased again.

use embedded_storage_async::nor_flash::{
    ErrorType, MultiwriteNorFlash, NorFlash, NorFlashError, NorFlashErrorKind, ReadNorFlash,
};

use crate::storage::partitions::{FLASH_BYTES, PAGE_BYTES, WORD_BYTES};

/// Times that a word may be written between two erases (nRF52840 product specification, n_WRITE).
const WRITES_PER_ERASE: u8 = 2;

/// SplitMix64 (Steele, Lea and Flood 2014).
#[derive(Clone, Debug)]
pub(crate) struct Random(pub(crate) u64);

impl Random {
    pub(crate) fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut mixed = self.0;
        mixed = (mixed ^ (mixed >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        mixed = (mixed ^ (mixed >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        mixed ^ (mixed >> 31)
    }

    pub(crate) fn below(&mut self, limit: u64) -> u64 {
        self.next() % limit
    }

    pub(crate) fn bytes(&mut self, length: usize) -> Vec<u8> {
        (0..length).map(|_| self.next() as u8).collect()
    }
}

#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum FakeError {
    NotAligned,
    OutOfBounds,
    /// A word was written more often than the chip allows.
    WrittenTooOften,
    PowerCut,
    /// A passing failure, power stays.
    Busy,
}

impl NorFlashError for FakeError {
    fn kind(&self) -> NorFlashErrorKind {
        match self {
            Self::NotAligned => NorFlashErrorKind::NotAligned,
            Self::OutOfBounds => NorFlashErrorKind::OutOfBounds,
            _ => NorFlashErrorKind::Other,
        }
    }
}

/// How a step is cut.
#[derive(Clone, Copy, Debug)]
pub(crate) enum How {
    Before,
    /// Some bits are written or erased, others are not.
    Within {
        seed: u64,
    },
    After,
    /// The step fails, and power stays.
    Busy,
}

/// Cuts power in the step that comes after `step` others.
#[derive(Clone, Copy, Debug)]
pub(crate) struct Cut {
    pub(crate) step: u64,
    pub(crate) how: How,
}

/// What a step did, for choosing where to cut.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub(crate) enum Step {
    Write(u32),
    Erase(u32),
}

#[derive(Clone)]
pub(crate) struct FakeFlash {
    pub(crate) bytes: Vec<u8>,
    writes: Vec<u8>,
    /// Words written and pages erased so far.
    pub(crate) steps: u64,
    pub(crate) erases: Vec<u32>,
    pub(crate) trace: Option<Vec<Step>>,
    cut: Option<Cut>,
    powered: bool,
}

impl FakeFlash {
    pub(crate) fn new() -> Self {
        Self {
            bytes: vec![0xff; FLASH_BYTES as usize],
            writes: vec![0; (FLASH_BYTES / WORD_BYTES) as usize],
            steps: 0,
            erases: vec![0; (FLASH_BYTES / PAGE_BYTES) as usize],
            trace: None,
            cut: None,
            powered: true,
        }
    }

    /// Cuts power, counted from now.
    pub(crate) fn cut(&mut self, cut: Cut) {
        let step = self.steps + cut.step;
        self.cut = Some(Cut { step, ..cut });
    }

    /// Power comes back.
    pub(crate) fn restart(&mut self) {
        self.powered = true;
        self.cut = None;
    }

    pub(crate) fn flip(&mut self, address: u32, bit: u32) {
        self.bytes[address as usize] ^= 1 << bit;
    }

    pub(crate) fn slice(&self, start: u32, length: u32) -> &[u8] {
        &self.bytes[start as usize..(start + length) as usize]
    }

    /// Counts a step; says how it is cut, if it is.
    fn step(&mut self, step: Step) -> Option<How> {
        if let Some(trace) = &mut self.trace {
            trace.push(step);
        }
        let how = self
            .cut
            .filter(|cut| cut.step == self.steps)
            .map(|cut| cut.how);
        self.steps += 1;
        if how.is_some() {
            self.cut = None;
            self.powered = matches!(how, Some(How::Busy));
        }
        how
    }

    fn check(&self, address: u32, length: usize, align: u32) -> Result<(), FakeError> {
        if !self.powered {
            return Err(FakeError::PowerCut);
        }
        let end = u64::from(address) + length as u64;
        if end > u64::from(FLASH_BYTES) {
            return Err(FakeError::OutOfBounds);
        }
        if !address.is_multiple_of(align) || !length.is_multiple_of(align as usize) {
            return Err(FakeError::NotAligned);
        }
        Ok(())
    }

    fn program(&mut self, address: u32, word: &[u8], leave: u32) -> Result<(), FakeError> {
        let count = &mut self.writes[(address / WORD_BYTES) as usize];
        *count += 1;
        if *count > WRITES_PER_ERASE {
            return Err(FakeError::WrittenTooOften);
        }
        for (index, (kept, byte)) in self.bytes[address as usize..]
            .iter_mut()
            .zip(word)
            .enumerate()
        {
            *kept &= byte | leave.to_le_bytes()[index];
        }
        Ok(())
    }

    fn erase_page(&mut self, address: u32, mut set: impl FnMut() -> u8) {
        let page = address as usize..(address + PAGE_BYTES) as usize;
        for byte in &mut self.bytes[page] {
            *byte |= set();
        }
        let words = (address / WORD_BYTES) as usize..((address + PAGE_BYTES) / WORD_BYTES) as usize;
        self.writes[words].fill(0);
        self.erases[(address / PAGE_BYTES) as usize] += 1;
    }
}

/// What the step gives back once it was cut.
fn outcome(how: How) -> FakeError {
    match how {
        How::Busy => FakeError::Busy,
        _ => FakeError::PowerCut,
    }
}

impl ErrorType for FakeFlash {
    type Error = FakeError;
}

impl ReadNorFlash for FakeFlash {
    const READ_SIZE: usize = 1;

    async fn read(&mut self, address: u32, bytes: &mut [u8]) -> Result<(), FakeError> {
        self.check(address, bytes.len(), 1)?;
        bytes.copy_from_slice(self.slice(address, bytes.len() as u32));
        Ok(())
    }

    fn capacity(&self) -> usize {
        self.bytes.len()
    }
}

impl NorFlash for FakeFlash {
    const WRITE_SIZE: usize = WORD_BYTES as usize;
    const ERASE_SIZE: usize = PAGE_BYTES as usize;

    async fn erase(&mut self, from: u32, to: u32) -> Result<(), FakeError> {
        self.check(from, (to - from) as usize, PAGE_BYTES)?;
        for page in (from..to).step_by(PAGE_BYTES as usize) {
            match self.step(Step::Erase(page)) {
                None => self.erase_page(page, || 0xff),
                Some(how) => {
                    match how {
                        How::Before | How::Busy => {}
                        How::After => self.erase_page(page, || 0xff),
                        How::Within { seed } => {
                            // From hardly begun to nearly done.
                            let mut random = Random(seed ^ u64::from(page));
                            let chance = [5, 30, 60, 95][(seed % 4) as usize];
                            self.erase_page(page, || {
                                (0..8).fold(0, |byte, bit| {
                                    byte | (u8::from(random.below(100) < chance) << bit)
                                })
                            });
                        }
                    }
                    return Err(outcome(how));
                }
            }
        }
        Ok(())
    }

    async fn write(&mut self, address: u32, bytes: &[u8]) -> Result<(), FakeError> {
        self.check(address, bytes.len(), WORD_BYTES)?;
        if !(bytes.as_ptr() as usize).is_multiple_of(WORD_BYTES as usize) {
            return Err(FakeError::NotAligned);
        }
        for (at, word) in (address..)
            .step_by(WORD_BYTES as usize)
            .zip(bytes.chunks(4))
        {
            match self.step(Step::Write(at)) {
                None => self.program(at, word, 0)?,
                Some(how) => {
                    match how {
                        How::Before | How::Busy => {}
                        How::After => self.program(at, word, 0)?,
                        How::Within { seed } => {
                            let leave = Random(seed ^ u64::from(at)).next() as u32;
                            self.program(at, word, leave)?;
                        }
                    }
                    return Err(outcome(how));
                }
            }
        }
        Ok(())
    }
}

impl MultiwriteNorFlash for FakeFlash {}

#[test]
fn the_fake_refuses_what_the_chip_refuses() {
    use embassy_futures::block_on;
    #[repr(align(4))]
    struct Words([u8; 8]);
    let words = Words([0x5a; 8]);
    let mut flash = FakeFlash::new();
    let mut write = |address, bytes: &[u8]| block_on(flash.write(address, bytes));
    assert_eq!(write(2, &words.0[..4]), Err(FakeError::NotAligned));
    assert_eq!(write(0, &words.0[..3]), Err(FakeError::NotAligned));
    assert_eq!(write(0, &words.0[1..5]), Err(FakeError::NotAligned));
    assert_eq!(write(FLASH_BYTES, &words.0), Err(FakeError::OutOfBounds));
    assert_eq!(write(0, &words.0), Ok(()));
    assert_eq!(write(0, &Words([0xa5; 8]).0), Ok(()));
    assert_eq!(write(0, &words.0), Err(FakeError::WrittenTooOften));
    assert_eq!(flash.slice(0, 8), [0; 8], "bits only clear");
    assert_eq!(
        block_on(flash.erase(4, 4 + PAGE_BYTES)),
        Err(FakeError::NotAligned)
    );
    assert_eq!(block_on(flash.erase(0, PAGE_BYTES)), Ok(()));
    assert!(flash.slice(0, PAGE_BYTES).iter().all(|&byte| byte == 0xff));
    flash.cut(Cut {
        step: 1,
        how: How::Before,
    });
    assert_eq!(block_on(flash.write(0, &words.0)), Err(FakeError::PowerCut));
    assert_eq!(
        block_on(flash.read(0, &mut [0; 4])),
        Err(FakeError::PowerCut)
    );
    flash.restart();
    assert_eq!(
        flash.slice(0, 8),
        [0x5a, 0x5a, 0x5a, 0x5a, 0xff, 0xff, 0xff, 0xff]
    );
}

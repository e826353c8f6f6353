//! Instructions by the system timer. QEMU's `-icount shift=6` lets 64 ns pass for each instruction; the board's timer
//! ticks at 25 MHz, 1.6 times in that.

use core::hint::black_box;

use cortex_m::peripheral::{SYST, syst::SystClkSource};
use cortex_m_semihosting::hprintln;

/// The timer counts down from here and wraps: 10 million instructions.
const RELOAD: u32 = 0x00FF_FFFF;
/// Five instructions take eight ticks.
const INSTRUCTIONS: u64 = 5;
const TICKS: u64 = 8;

/// A hundred instructions.
fn known() {
    macro_rules! ten {
        ($($call:expr);*) => {{ $($call; $call; $call; $call; $call; $call; $call; $call; $call; $call;)* }};
    }
    ten!(ten!(cortex_m::asm::nop()));
}

/// Counts what a call takes.
pub(crate) struct Counter {
    timer: SYST,
    /// Ticks that counting nothing takes.
    nothing: u32,
}

impl Counter {
    /// Starts the timer, and refuses an emulator whose clock is another.
    pub(crate) fn new(mut timer: SYST) -> Self {
        timer.set_clock_source(SystClkSource::Core);
        timer.set_reload(RELOAD);
        timer.clear_current();
        timer.enable_counter();
        let mut counter = Self { timer, nothing: 0 };
        counter.nothing = counter.ticks(|| {}).1;
        let ((), known) = counter.instructions(known);
        assert!(
            (100..110).contains(&known),
            "100 instructions count {known}"
        );
        counter
    }

    /// Prints how many instructions the call takes.
    pub(crate) fn print<R>(&mut self, name: &str, call: impl FnOnce() -> R) -> R {
        let (result, instructions) = self.instructions(call);
        self.say(name, instructions);
        result
    }

    /// Prints a count.
    #[allow(clippy::unused_self, reason = "whoever prints has counted")]
    pub(crate) fn say(&self, name: &str, instructions: u64) {
        hprintln!("{} {}", name, instructions);
    }

    /// What the call returns, and how many instructions it takes.
    pub(crate) fn instructions<R>(&mut self, call: impl FnOnce() -> R) -> (R, u64) {
        let (result, ticks) = self.ticks(call);
        let ticks = u64::from(ticks.saturating_sub(self.nothing));
        (result, ticks * INSTRUCTIONS / TICKS)
    }

    fn ticks<R>(&mut self, call: impl FnOnce() -> R) -> (R, u32) {
        self.timer.clear_current();
        self.timer.has_wrapped();
        let before = SYST::get_current();
        let result = black_box(call());
        let after = SYST::get_current();
        assert!(
            !self.timer.has_wrapped() || after > before,
            "too long for the timer"
        );
        (result, before.wrapping_sub(after) & RELOAD)
    }
}

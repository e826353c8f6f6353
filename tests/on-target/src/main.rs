//! Runs the shared code on a Cortex-M4F under QEMU: compares its results with the host's, then counts the instructions
//! of its kernels and prints `name instructions` lines (and what it compared behind a `#`).
//! `tests/on-target/run` builds and starts it.
#![no_std]
#![no_main]
#![allow(
    clippy::unwrap_used,
    reason = "a panic here is how a measurement fails"
)]

mod agreement;
mod conditioning;
mod count;
mod model;
mod recognition;
mod signal;
mod vectors;

use cortex_m_rt::entry;
use cortex_m_semihosting::debug;
use panic_semihosting as _;

use count::Counter;

#[entry]
fn main() -> ! {
    agreement::check();
    let mut counter = Counter::new(cortex_m::Peripherals::take().unwrap().SYST);
    conditioning::count(&mut counter);
    recognition::count(&mut counter);
    signal::count(&mut counter);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::nop();
    }
}

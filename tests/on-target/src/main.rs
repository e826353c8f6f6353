//! Counts the instructions of the shared kernels on a Cortex-M4F under QEMU and prints `name instructions` lines.
//! `tests/on-target/run` builds and starts it.
#![no_std]
#![no_main]
#![allow(
    clippy::unwrap_used,
    reason = "a panic here is how a measurement fails"
)]

mod conditioning;
mod count;
mod model;
mod recognition;
mod signal;

use cortex_m_rt::entry;
use cortex_m_semihosting::debug;
use panic_semihosting as _;

use count::Counter;

#[entry]
fn main() -> ! {
    let mut counter = Counter::new(cortex_m::Peripherals::take().unwrap().SYST);
    conditioning::count(&mut counter);
    recognition::count(&mut counter);
    signal::count(&mut counter);
    debug::exit(debug::EXIT_SUCCESS);
    loop {
        cortex_m::asm::nop();
    }
}

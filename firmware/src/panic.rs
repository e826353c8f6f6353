//! What happens when all else fails: the message is kept, and the chip starts anew.

use core::{mem::MaybeUninit, panic::PanicInfo, ptr};

use cortex_m::peripheral::SCB;
use cortex_m_rt::{ExceptionFrame, exception};
use tonus_firmware::last_words::Record;
use tonus_shared::wire::LastWords;

/// Neither cleared nor set at start.
#[allow(
    unsafe_code,
    reason = "the section must be one that the start-up code leaves alone"
)]
// SAFETY: cortex-m-rt's linker script places `.uninit` in RAM and initialises nothing there.
#[unsafe(link_section = ".uninit.LAST_WORDS")]
static mut KEPT: MaybeUninit<Record> = MaybeUninit::uninit();

#[panic_handler]
fn panic(info: &PanicInfo<'_>) -> ! {
    cortex_m::interrupt::disable();
    keep(&Record::of(info));
    defmt::error!("{}", defmt::Display2Format(info));
    SCB::sys_reset()
}

/// What the processor could not do; the stack may be lost, so this says where and no more.
#[exception]
#[allow(
    unsafe_code,
    clippy::panic,
    reason = "the attribute asks for it: the frame may be any; and what cannot go on panics"
)]
unsafe fn HardFault(frame: &ExceptionFrame) -> ! {
    panic!("hard fault at {:#010x}", frame.pc())
}

/// The message of the panic before this start, if there was one; asked for once.
pub(crate) fn take() -> Option<LastWords> {
    let record = read();
    keep(&Record::EMPTY);
    record.read()
}

#[allow(unsafe_code, reason = "memory that outlives the program")]
fn read() -> Record {
    // SAFETY: `KEPT` is aligned and as large as a `Record`, which is made of integers, so that any bits are one; it is
    // read as volatile because what stands there was written by another run. Nobody holds a reference to it.
    unsafe { ptr::read_volatile((&raw const KEPT).cast()) }
}

#[allow(unsafe_code, reason = "memory that outlives the program")]
fn keep(record: &Record) {
    // SAFETY: as in `read`. It is called at start before any task runs, and in the panic handler, which is the last to run, with
    // interrupts off.
    unsafe { ptr::write_volatile((&raw mut KEPT).cast(), *record) }
}

//! The wearable's image, executed: a Cortex-M4F (by Unicorn) with models of the nRF52840's peripherals around it.
//!
//! The same ELF that a board would be flashed with runs here, with its interrupts, its DMA and its programmable
//! interconnect, in virtual time: two runs give the same bytes. One instruction is one cycle, so the load is
//! optimistic: flash wait states, taken branches and divisions cost more on silicon. A pass shows that the image
//! agrees with these models, not with silicon; each model names the section of the specification that it follows.
//!
//! Nordic's radio libraries must not be executed here (their licence): [`image::Image::read`] refuses an image that
//! holds them.

pub mod bus;
pub mod chip;
pub mod device;
pub mod error;
pub mod flash;
pub mod image;
pub mod log;
pub mod machine;
pub mod system;
pub mod world;

mod exception;
mod instructions;

pub use error::MachineError;
pub use image::Image;
pub use machine::{Damage, Machine, Stop};

//! Why there is no file, and what to do.

use std::path::PathBuf;

/// What is wrong with an image, or with where its file should go.
#[derive(Debug, thiserror::Error)]
pub(crate) enum Uf2Error {
    /// The image could not be read.
    #[error("cannot read {}: {source}; build the image first: cargo firmware-xiao", path.display())]
    Read {
        /// Where it should be.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// Not a 32-bit little-endian ELF file.
    #[error("not a linked image for the chip ({source}); build one: cargo firmware-xiao")]
    NotAnImage {
        /// What its reader says.
        source: object::read::Error,
    },
    /// An image, but for another processor.
    #[error(
        "the image is for processor {got} (ELF e_machine), not for Arm ({expected}); build one: cargo firmware-xiao"
    )]
    Processor {
        /// Arm's number.
        expected: u16,
        /// The file's.
        got: u16,
    },
    /// The file is shorter than its own headers say.
    #[error("the file ends before what belongs at {start:#x}; link it anew: cargo firmware-xiao")]
    Cut {
        /// Address of the part that is missing.
        start: u32,
    },
    /// It has bytes outside the application's place.
    #[error(
        "the image has bytes at {start:#x}..{end:#x}, and the XIAO's application lies in {expected_start:#x}..{expected_end:#x}; \
         an image that starts at 0 is the DK's: build the XIAO's with cargo firmware-xiao"
    )]
    Outside {
        /// First address of the part that lies outside.
        start: u64,
        /// Address behind it.
        end: u64,
        /// First address of the application's place.
        expected_start: u32,
        /// Address behind it.
        expected_end: u32,
    },
    /// Nothing at the address that the bootloader jumps to.
    #[error(
        "the image starts at {got:#x}, and the bootloader starts what lies at {expected:#x}; \
         firmware/memory-xiao.x puts it there: build it with cargo firmware-xiao"
    )]
    Start {
        /// The application's first address.
        expected: u32,
        /// The image's.
        got: u32,
    },
    /// Two parts claim one address.
    #[error("two parts of the image overlap at {at:#x}; link it anew: cargo firmware-xiao")]
    Overlap {
        /// The first address claimed twice.
        at: u32,
    },
    /// Nothing in it goes into the flash.
    #[error("the image holds nothing for the flash; link it anew: cargo firmware-xiao")]
    Empty,
    /// The file could not be written.
    #[error("cannot write {}: {source}; nothing was changed there", path.display())]
    Write {
        /// Where it should go.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

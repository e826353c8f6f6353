//! Why a run ended where it should not.

use thiserror::Error;

/// Everything that stops the machine.
#[derive(Clone, Debug, PartialEq, Eq, Error)]
pub enum MachineError {
    /// The file is no image for this chip.
    #[error("{reason}: build the image with cargo firmware-wired")]
    NotAnImage {
        /// What is wrong with it.
        reason: String,
    },
    /// The image holds code that is licensed for Nordic's chips only.
    #[error(
        "the image holds `{symbol}`, which may run on Nordic's chips only: build it with cargo firmware-wired"
    )]
    RadioLibrary {
        /// A symbol of the library.
        symbol: String,
    },
    /// A register that no model has.
    #[error("{access} {address:#010x} at PC {pc:#010x} ({function}): no model has this register")]
    Unmodelled {
        /// What the image did.
        access: Access,
        /// Address of the register.
        address: u32,
        /// Instruction, or one of the same block.
        pc: u32,
        /// Function around it.
        function: String,
    },
    /// A peripheral was to move data from or to what is not RAM.
    #[error("DMA of {length} bytes at {address:#010x}, which is not RAM")]
    DmaOutsideRam {
        /// First byte.
        address: u32,
        /// Bytes.
        length: usize,
    },
    /// A write to flash that the chip forbids.
    #[error("write to the flash at {address:#010x}: {misuse}")]
    Flash {
        /// Of the word.
        address: u32,
        /// What is wrong with it.
        misuse: FlashMisuse,
    },
    /// No function has such a name.
    #[error(
        "no function whose name holds {parts:?} in this order: it may have been inlined, name its caller"
    )]
    NoFunction {
        /// Parts of the name.
        parts: Vec<String>,
    },
    /// An instruction that does not exist, as at the end of a panic.
    #[error("undefined instruction at PC {pc:#010x} ({function}); log: {log}")]
    Undefined {
        /// Its address.
        pc: u32,
        /// Function around it.
        function: String,
        /// The last line of the image's log.
        log: String,
    },
    /// Interrupts that can reach no handler.
    #[error("asleep for ever at PC {pc:#010x}: no peripheral has anything to do")]
    AsleepForEver {
        /// Where it sleeps.
        pc: u32,
    },
    /// The emulator's own complaint.
    #[error("the processor's emulator says {0}")]
    Engine(String),
}

/// How flash must not be written (PS 4.3, "Writing to flash").
#[derive(Clone, Copy, Debug, PartialEq, Eq, Error)]
pub enum FlashMisuse {
    /// Fewer bytes than a word, or a word at no multiple of four: a hard fault on the chip.
    #[error("only whole words at multiples of four can be written")]
    NoWord,
    /// More often than the specification allows between two erases of the page.
    #[error(
        "the word was written twice since its page was erased, which is as often as is allowed"
    )]
    WrittenTooOften,
}

/// What an instruction did to an address.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Access {
    /// A load.
    Read,
    /// A store of this value.
    Write(u32),
    /// A task that PPI triggered.
    Task,
}

impl std::fmt::Display for Access {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        match self {
            Self::Read => write!(f, "read of"),
            Self::Write(value) => write!(f, "write of {value:#x} to"),
            Self::Task => write!(f, "task"),
        }
    }
}

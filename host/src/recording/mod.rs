//! What happened, on disk: recordings as MCAP files (<https://mcap.dev/spec>).
//!
//! A recording opens with whom, how and by what it was made, and goes on with every input of the running program in the
//! order in which the engine took them, and what the robot was told because of them. The channels are the table of
//! `channel`; the hand, the robot and messages follow Foxglove's schemas, so that its viewer and Lichtblick show them.
//!
//! ```text
//! engine --note--> bounded queue --> writer thread --chunk every 0.4 s--> file --fsync every 0.5 s--> disk
//! ```
//!
//! Chunks are not compressed: of a file that was cut anywhere, every whole message is read.

mod channel;
mod decode;
mod encode;
mod entry;
mod error;
mod reading;
mod recorder;
mod records;
mod recover;

pub use entry::{Entry, Opening};
pub use error::{ReadError, RecordError};
pub use reading::Reading;
pub use recorder::{Finished, Recorder};
pub use records::End;
pub use recover::{RecoverError, Recovered, recover};

/// Whether a file begins as MCAP files do.
///
/// # Errors
/// What the system says.
pub fn is_recording(path: &std::path::Path) -> std::io::Result<bool> {
    use std::io::Read;
    let mut start = Vec::with_capacity(mcap::MAGIC.len());
    let file = std::fs::File::open(path)?;
    file.take(mcap::MAGIC.len() as u64)
        .read_to_end(&mut start)?;
    Ok(start == mcap::MAGIC)
}

#[cfg(test)]
mod tests;

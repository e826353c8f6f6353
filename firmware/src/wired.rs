//! The wired transport: the frames of the radio, each in a COBS block, over any reader and writer.
//!
//! What leaves is the [`Outbox`]'s, so a stalled line drops old measurements just as a stalled radio link does.
//! What comes waits in an [`Inbox`] that does not grow.

use embassy_futures::select::{Either, select};
use embassy_time::Instant;
use embedded_io_async::{Read, Write};
use tonus_shared::wire::cobs::{BlockError, DELIMITER, MAX_BLOCK_BYTES, Unframer, enclose};

use crate::inbox::{Inbox, Refusal};
use crate::outbox::Outbox;

/// A reader that fails this often without a byte between is broken, not overrun.
const FAILURES_IN_A_ROW: u32 = 16;

/// Why something that came was dropped.
#[derive(Clone, Copy, Debug, PartialEq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum Dropped {
    /// The reader lost bytes; what follows is skipped up to the next delimiter.
    BytesLost,
    /// The bytes between two delimiters are no block.
    Block(BlockError),
    /// The inbox did not take what a block holds.
    Refused(Refusal),
}

/// How often each has happened since the line was opened; the counts wrap.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub struct DropCounts {
    /// [`Dropped::BytesLost`].
    pub bytes_lost: u32,
    /// [`Dropped::Block`].
    pub blocks: u32,
    /// [`Dropped::Refused`].
    pub refused: u32,
}

impl DropCounts {
    fn count(&mut self, dropped: Dropped) {
        let counter = match dropped {
            Dropped::BytesLost => &mut self.bytes_lost,
            Dropped::Block(_) => &mut self.blocks,
            Dropped::Refused(_) => &mut self.refused,
        };
        *counter = counter.wrapping_add(1);
    }
}

/// Why the line is served no longer.
#[derive(Clone, Copy, Debug, PartialEq, Eq, thiserror::Error)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
pub enum LineError<R, W> {
    /// The other side closed it.
    #[error("the serial line was closed: open it again")]
    Closed,
    /// The reader fails again and again.
    #[error("the serial line cannot be read: {0}")]
    Read(R),
    /// A block could not be written.
    #[error("the serial line cannot be written: {0}")]
    Write(W),
}

/// Serves the line until it fails: sends what appears in `outbox`, leaves what comes in `inbox`.
///
/// `report` is told of everything that is dropped, with the counts so far; it is called in this task and must be
/// short.
///
/// # Errors
/// [`LineError`]: it never ends otherwise.
pub async fn run<R: Read, W: Write>(
    mut reader: R,
    mut writer: W,
    outbox: &Outbox,
    inbox: &Inbox,
    report: impl FnMut(Dropped, DropCounts),
) -> Result<(), LineError<R::Error, W::Error>> {
    outbox.clear();
    // Both run until one fails, so no read or write is abandoned half done while the line is in use.
    let receiving = receive(&mut reader, inbox, report);
    let sending = send(&mut writer, outbox);
    match select(receiving, sending).await {
        Either::First(Err(error)) => Err(error),
        Either::Second(Err(error)) => Err(LineError::Write(error)),
        Either::First(Ok(())) | Either::Second(Ok(())) => Err(LineError::Closed),
    }
}

async fn send<W: Write>(writer: &mut W, outbox: &Outbox) -> Result<(), W::Error> {
    // Ends whatever the host took for the start of a block while nobody was sending.
    writer.write_all(&[DELIMITER]).await?;
    let mut block = [0; MAX_BLOCK_BYTES];
    loop {
        let frame = outbox.take().await;
        // No frame is longer than the block has room for.
        let Ok(length) = enclose(&frame, &mut block) else {
            continue;
        };
        writer.write_all(&block[..length]).await?;
        writer.flush().await?;
    }
}

async fn receive<R: Read, W>(
    reader: &mut R,
    inbox: &Inbox,
    mut report: impl FnMut(Dropped, DropCounts),
) -> Result<(), LineError<R::Error, W>> {
    let mut unframer: Unframer = Unframer::new();
    let mut counts = DropCounts::default();
    let mut failures = 0;
    let mut bytes = [0; 64];
    loop {
        let came = match reader.read(&mut bytes).await {
            Ok(0) => return Err(LineError::Closed),
            Ok(came) => {
                failures = 0;
                came
            }
            Err(error) => {
                failures += 1;
                if failures == FAILURES_IN_A_ROW {
                    return Err(LineError::Read(error));
                }
                unframer.skip();
                counts.count(Dropped::BytesLost);
                report(Dropped::BytesLost, counts);
                continue;
            }
        };
        for byte in bytes.iter().take(came) {
            if let Err(dropped) = accept(&mut unframer, *byte, inbox) {
                counts.count(dropped);
                report(dropped, counts);
            }
        }
    }
}

/// Takes one byte; the frame that it completes goes to the inbox.
fn accept(unframer: &mut Unframer, byte: u8, inbox: &Inbox) -> Result<(), Dropped> {
    let Some(bytes) = unframer.push(byte).map_err(Dropped::Block)? else {
        return Ok(());
    };
    let offered = inbox.offer_any(Instant::now(), bytes);
    offered.map_err(Dropped::Refused)
}

#[cfg(test)]
mod tests;

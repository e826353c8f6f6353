//! A cut or damaged recording made whole.

use std::io::BufWriter;
use std::path::{Path, PathBuf};

use mcap::records::{Record, op};
use mcap::{Attachment, McapError, WriteOptions, Writer};
use thiserror::Error;

use crate::atomic;

use super::error::ReadError;
use super::records::{End, Records, parse};

/// What could be kept.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct Recovered {
    /// Messages that were kept.
    pub messages: u64,
    /// Session time of the first and of the last of them, microseconds.
    pub times_us: Option<(u64, u64)>,
    /// Whether the file was closed.
    pub was_closed: bool,
    /// Bytes at its end that are no whole message.
    pub lost_bytes: u64,
    /// Records and chunks that are damaged.
    pub damaged: u64,
    /// What is wrong with the first of them, for people.
    pub damages: Vec<String>,
}

/// So many damages are described; the others are counted.
const DESCRIBED: usize = 20;

impl Recovered {
    fn damage(&mut self, what: String) {
        self.damaged += 1;
        if self.damages.len() < DESCRIBED {
            self.damages.push(what);
        }
    }
}

/// Why nothing could be kept.
#[derive(Debug, Error)]
pub enum RecoverError {
    /// The file is none.
    #[error(transparent)]
    Read(#[from] ReadError),
    /// The output cannot be written.
    #[error("{}: cannot be written: {source}", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What failed.
        source: McapError,
    },
}

/// Writes what is whole in a recording to a closed file with an index. The output is there whole or not at all.
///
/// # Errors
/// [`RecoverError`] where the input is no recording or the output cannot be written.
pub fn recover(input: &Path, output: &Path) -> Result<Recovered, RecoverError> {
    let mut records = Records::open(input)?;
    let mut recovered = Recovered::default();
    let written = atomic::write_with(output, |file| {
        let mut writer = WriteOptions::new()
            .profile(super::channel::PROFILE)
            .library(format!("tonus {}", env!("CARGO_PKG_VERSION")))
            .create(BufWriter::new(file))?;
        copy(&mut records, &mut writer, &mut recovered)?;
        writer.finish()?;
        let file = writer.into_inner();
        file.into_inner()
            .map_err(|error| McapError::Io(error.into_error()))?;
        Ok::<(), McapError>(())
    });
    written.map_err(|source| RecoverError::Write {
        path: output.to_owned(),
        source,
    })?;
    Ok(recovered)
}

fn copy<W: std::io::Write + std::io::Seek>(
    records: &mut Records,
    writer: &mut Writer<W>,
    recovered: &mut Recovered,
) -> Result<(), McapError> {
    loop {
        let raw = match records.next() {
            Ok(Some(raw)) => raw,
            Ok(None) => break,
            // The next call goes on after a damaged chunk, or says that nothing follows.
            Err(error) => {
                recovered.damage(error.to_string());
                continue;
            }
        };
        if raw.opcode == op::HEADER {
            continue;
        }
        let kept = match parse(raw.opcode, raw.body) {
            Ok(record) => keep(record, writer, recovered),
            Err(why) => {
                recovered.damage(format!("record at byte {}: {why}", raw.offset));
                Ok(())
            }
        };
        match kept {
            // A message whose channel was in a damaged chunk.
            Err(error) if !matches!(error, McapError::Io(_)) => {
                recovered.damage(format!("record at byte {}: {error}", raw.offset));
            }
            kept => kept?,
        }
    }
    match records.end() {
        Some(End::Closed) => recovered.was_closed = true,
        Some(End::Cut { lost_bytes, .. }) => recovered.lost_bytes = lost_bytes,
        None => {}
    }
    Ok(())
}

fn keep<W: std::io::Write + std::io::Seek>(
    record: Record<'_>,
    writer: &mut Writer<W>,
    recovered: &mut Recovered,
) -> Result<(), McapError> {
    match record {
        Record::Schema { header, data } => {
            writer.add_schema_with_id(header.id, &header.name, &header.encoding, &data)?;
        }
        Record::Channel(channel) => {
            writer.add_channel_with_id(
                channel.id,
                channel.schema_id,
                &channel.topic,
                &channel.message_encoding,
                &channel.metadata,
            )?;
        }
        Record::Message { header, data } => {
            writer.write_to_known_channel(&header, &data)?;
            recovered.messages += 1;
            let at_us = header.log_time / 1000;
            let first_us = recovered.times_us.map_or(at_us, |(first_us, _)| first_us);
            recovered.times_us = Some((first_us, at_us));
        }
        Record::Metadata(metadata) => writer.write_metadata(&metadata)?,
        Record::Attachment { header, data, .. } => writer.attach(&Attachment {
            log_time: header.log_time,
            create_time: header.create_time,
            name: header.name,
            media_type: header.media_type,
            data,
        })?,
        // Indexes and statistics are made anew.
        _ => {}
    }
    Ok(())
}

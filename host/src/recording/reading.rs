//! Recordings read again.

use std::collections::{BTreeMap, HashMap};
use std::path::Path;

use mcap::records::{Record, op};

use crate::live::Timed;

use super::channel::{CALIBRATION, CONFIGURATION, Channel, FORMAT, MODEL, OPENING, PROFILE};
use super::decode::decode;
use super::entry::{Entry, Opening};
use super::error::ReadError;
use super::records::{End, Records, parse};

/// The entries of a recording in the order in which they were written. Ends at the first error.
#[derive(Debug)]
pub struct Reading {
    records: Records,
    channels: HashMap<u16, Channel>,
    opening: Opening,
    failed: bool,
}

impl Reading {
    /// Opens a recording, closed or cut.
    ///
    /// # Errors
    /// [`ReadError`] where it is none, or is cut before its first entry could be.
    pub fn open(path: &Path) -> Result<Self, ReadError> {
        let mut records = Records::open(path)?;
        let mut channels = HashMap::new();
        let mut parts = Parts::default();
        while channels.is_empty() {
            let path = || path.to_owned();
            let Some(raw) = records.next()? else {
                let offset = match records.end() {
                    Some(End::Cut { at_byte, .. }) => at_byte,
                    _ => 0,
                };
                return Err(ReadError::CutInOpening {
                    path: path(),
                    offset,
                });
            };
            let offset = raw.offset;
            let wrong = |why| ReadError::Record {
                path: path(),
                offset,
                why,
            };
            match parse(raw.opcode, raw.body).map_err(wrong)? {
                Record::Header(header) if header.profile != PROFILE => {
                    let got = header.profile;
                    return Err(ReadError::Foreign { path: path(), got });
                }
                Record::Metadata(metadata) if metadata.name == OPENING => {
                    parts.metadata = metadata.metadata;
                }
                Record::Attachment { header, data, .. } => {
                    parts.attachments.insert(header.name, data.into_owned());
                }
                Record::Channel(record) => {
                    note(&mut channels, &record);
                }
                _ => {}
            }
        }
        let format = parts.metadata.get("format").map_or("none", String::as_str);
        if format != FORMAT {
            return Err(ReadError::Format {
                path: path.to_owned(),
                got: format.to_owned(),
                expected: FORMAT,
            });
        }
        Ok(Self {
            records,
            channels,
            opening: parts.opening(),
            failed: false,
        })
    }

    /// What was known when the recording began.
    #[must_use]
    pub fn opening(&self) -> &Opening {
        &self.opening
    }

    /// Whether the program that wrote this tells of its stalls; known once the first entry was read.
    #[must_use]
    pub fn tells_of_stalls(&self) -> bool {
        self.channels
            .values()
            .any(|channel| *channel == Channel::Stalled)
    }

    /// How the file ends, once all was read.
    #[must_use]
    pub fn end(&self) -> Option<End> {
        self.records.end()
    }

    /// The inputs alone: what the engine took, in its order.
    pub fn inputs(self) -> impl Iterator<Item = Result<Timed, ReadError>> {
        self.filter_map(|entry| match entry {
            Ok(Entry::Input(timed)) => Some(Ok(timed)),
            Ok(_) => None,
            Err(error) => Some(Err(error)),
        })
    }

    fn entry(&mut self) -> Result<Option<Entry>, ReadError> {
        let path = self.records.path().to_owned();
        while let Some(raw) = self.records.next()? {
            if !matches!(raw.opcode, op::CHANNEL | op::MESSAGE) {
                continue;
            }
            let offset = raw.offset;
            let record = parse(raw.opcode, raw.body).map_err(|why| ReadError::Record {
                path: path.clone(),
                offset,
                why,
            })?;
            match record {
                Record::Channel(record) => note(&mut self.channels, &record),
                Record::Message { header, data } => {
                    // A channel of a later version is passed over.
                    let Some(&channel) = self.channels.get(&header.channel_id) else {
                        continue;
                    };
                    let entry = decode(channel, header.log_time / 1000, &data);
                    return entry.map(Some).map_err(|why| ReadError::Message {
                        path,
                        offset,
                        topic: channel.topic(),
                        why,
                    });
                }
                _ => {}
            }
        }
        Ok(None)
    }
}

fn note(channels: &mut HashMap<u16, Channel>, record: &mcap::records::Channel) {
    let known = Channel::ALL
        .into_iter()
        .find(|channel| channel.topic() == record.topic);
    if let Some(channel) = known {
        channels.insert(record.id, channel);
    }
}

impl Iterator for Reading {
    type Item = Result<Entry, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        if self.failed {
            return None;
        }
        let entry = self.entry().transpose();
        self.failed = matches!(entry, Some(Err(_)));
        entry
    }
}

/// The opening's pieces.
#[derive(Default)]
struct Parts {
    metadata: BTreeMap<String, String>,
    attachments: BTreeMap<String, Vec<u8>>,
}

impl Parts {
    fn opening(mut self) -> Opening {
        let mut text = |name: &str| {
            let bytes = self.attachments.remove(name)?;
            Some(String::from_utf8_lossy(&bytes).into_owned())
        };
        let (configuration, calibration) = (text(CONFIGURATION), text(CALIBRATION));
        let said = |name: &str| self.metadata.get(name);
        Opening {
            version: said("version").cloned().unwrap_or_default(),
            started_unix_us: said("started_unix_us")
                .and_then(|us| us.parse().ok())
                .unwrap_or_default(),
            subject: said("subject").and_then(|person| serde_json::from_str(person).ok()),
            configuration: configuration.unwrap_or_default(),
            calibration,
            model: self.attachments.remove(MODEL),
        }
    }
}

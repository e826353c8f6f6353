//! The records of an MCAP file one after the other, also of one that was cut anywhere.
//!
//! The `mcap` crate's readers know no offsets and give up a chunk that is cut; this one yields every whole record of such a
//! chunk, and says where an error lies. What a record's bytes mean is the crate's.

use std::fs::File;
use std::io::{BufReader, Read, Seek, SeekFrom};
use std::path::{Path, PathBuf};

use mcap::MAGIC;
use mcap::records::{Record, op};

use super::error::ReadError;

/// Longest record that is read, bytes: a chunk is a few hundred thousand, the largest model some million.
pub(super) const LIMIT: u64 = 64 << 20;
/// An opcode and a length.
const HEAD: usize = 9;
/// What stands in a chunk before the name of its compression: two times, its size, its checksum.
const BEFORE_COMPRESSION: usize = 28;

/// How a file ends.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum End {
    /// It was closed: with an index, and nothing is missing.
    Closed,
    /// It was not closed: all that is whole was read.
    Cut {
        /// The first byte of what is not whole, or was never written.
        at_byte: u64,
        /// Bytes from there on.
        lost_bytes: u64,
    },
}

/// A record as bytes.
#[derive(Debug)]
pub(super) struct Raw<'a> {
    /// What it is: `mcap::records::op`.
    pub(super) opcode: u8,
    /// Where it begins in the file.
    pub(super) offset: u64,
    /// What it says.
    pub(super) body: &'a [u8],
}

/// Reads records; those within chunks as if there were none.
#[derive(Debug)]
pub(super) struct Records {
    file: BufReader<File>,
    path: PathBuf,
    length: u64,
    /// Of what comes next.
    offset: u64,
    /// The record that was read last.
    body: Vec<u8>,
    chunk: Option<Chunk>,
    end: Option<End>,
}

/// Where in `body` the records of a chunk lie that were not yielded yet.
#[derive(Clone, Copy, Debug)]
struct Chunk {
    next: usize,
    until: usize,
    /// Of the first byte of `body` in the file.
    offset: u64,
    whole: bool,
}

impl Records {
    pub(super) fn open(path: &Path) -> Result<Self, ReadError> {
        let io = |source| ReadError::Io {
            path: path.to_owned(),
            offset: 0,
            source,
        };
        let mut file = File::open(path).map_err(io)?;
        let length = file.metadata().map_err(io)?.len();
        let mut start = Vec::new();
        (&mut file)
            .take(MAGIC.len() as u64)
            .read_to_end(&mut start)
            .map_err(io)?;
        if start != MAGIC {
            return Err(ReadError::NotMcap {
                path: path.to_owned(),
            });
        }
        Ok(Self {
            file: BufReader::new(file),
            path: path.to_owned(),
            length,
            offset: MAGIC.len() as u64,
            body: Vec::new(),
            chunk: None,
            end: None,
        })
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    /// How the file ends, once it has been read.
    pub(super) fn end(&self) -> Option<End> {
        self.end
    }

    /// Bytes that were not read, if it ends here.
    fn unread_bytes(&self) -> u64 {
        self.length.saturating_sub(self.offset)
    }

    /// The next record of the data section, or none at its end. After [`ReadError::Checksum`] the record after that chunk
    /// follows; after another error nothing.
    pub(super) fn next(&mut self) -> Result<Option<Raw<'_>>, ReadError> {
        loop {
            if let Some(chunk) = self.chunk {
                if let Some((opcode, from, to)) = self.within(chunk)? {
                    return Ok(Some(Raw {
                        opcode,
                        offset: chunk.offset + chunk.next as u64,
                        body: &self.body[from..to],
                    }));
                }
                continue;
            }
            if self.end.is_some() {
                return Ok(None);
            }
            let offset = self.offset;
            let Some((opcode, whole)) = self.read()? else {
                continue;
            };
            match opcode {
                op::DATA_END if whole => self.finish()?,
                op::CHUNK => self.enter(offset, whole)?,
                _ if !whole => {}
                opcode => {
                    return Ok(Some(Raw {
                        opcode,
                        offset,
                        body: &self.body,
                    }));
                }
            }
        }
    }

    /// Reads the record at `offset` into `body`: its opcode, and whether it is all there. None where nothing follows.
    fn read(&mut self) -> Result<Option<(u8, bool)>, ReadError> {
        let at_byte = self.offset;
        let cut = End::Cut {
            at_byte,
            lost_bytes: self.length.saturating_sub(at_byte),
        };
        self.fill(HEAD as u64)?;
        let Some((&opcode, length)) = self.body.split_first() else {
            self.end = Some(cut);
            return Ok(None);
        };
        let Ok(length) = <[u8; 8]>::try_from(length) else {
            self.end = Some(cut);
            return Ok(None);
        };
        let length = u64::from_le_bytes(length);
        if opcode == 0 {
            self.end = Some(cut);
            return Err(self.wrong(at_byte, "it has opcode 0, which no record has"));
        }
        if length > LIMIT {
            self.end = Some(cut);
            return Err(ReadError::TooLong {
                path: self.path.clone(),
                offset: at_byte,
                length,
                limit: LIMIT,
            });
        }
        self.fill(length)?;
        let whole = self.body.len() as u64 == length;
        if whole {
            self.offset = at_byte + HEAD as u64 + length;
        } else {
            self.end = Some(cut);
        }
        Ok(Some((opcode, whole)))
    }

    /// Reads so many bytes into `body`, or what there is.
    fn fill(&mut self, length: u64) -> Result<(), ReadError> {
        self.body.clear();
        let read = (&mut self.file).take(length).read_to_end(&mut self.body);
        read.map(drop).map_err(|source| {
            self.end = Some(End::Cut {
                at_byte: self.offset,
                lost_bytes: self.unread_bytes(),
            });
            ReadError::Io {
                path: self.path.clone(),
                offset: self.offset,
                source,
            }
        })
    }

    /// Goes into the chunk that is in `body`.
    fn enter(&mut self, offset: u64, whole: bool) -> Result<(), ReadError> {
        let Some(found) = ChunkHead::read(&self.body) else {
            return if whole {
                Err(self.wrong(offset, "the chunk is shorter than its head"))
            } else {
                Ok(())
            };
        };
        if !found.compression.is_empty() {
            let why = format!(
                "the chunk is compressed ({}), and chunks without compression are read: write the file anew with `mcap compress --compression none`",
                String::from_utf8_lossy(found.compression)
            );
            return Err(self.wrong(offset, &why));
        }
        let (records, expected) = (found.records, found.crc);
        let until = records.saturating_add(usize::try_from(found.length).unwrap_or(usize::MAX));
        if whole && until > self.body.len() {
            return Err(self.wrong(offset, "the chunk is shorter than it says"));
        }
        let until = until.min(self.body.len());
        if whole && expected != 0 {
            let got = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC)
                .checksum(self.body.get(records..until).unwrap_or_default());
            if got != expected {
                return Err(ReadError::Checksum {
                    path: self.path.clone(),
                    offset,
                    expected,
                    got,
                });
            }
        }
        self.chunk = Some(Chunk {
            next: records,
            until,
            offset: offset + HEAD as u64,
            whole,
        });
        Ok(())
    }

    /// The next record of a chunk: its opcode, and where its bytes lie in `body`. None after the last.
    fn within(&mut self, chunk: Chunk) -> Result<Option<(u8, usize, usize)>, ReadError> {
        let rest = self.body.get(chunk.next..chunk.until).unwrap_or_default();
        let head = rest.split_at_checked(HEAD).and_then(|(head, rest)| {
            let (&opcode, length) = head.split_first()?;
            let length = u64::from_le_bytes(length.try_into().ok()?);
            let length = usize::try_from(length).ok()?;
            (length <= rest.len()).then_some((opcode, length))
        });
        let at_byte = chunk.offset + chunk.next as u64;
        let Some((opcode, length)) = head else {
            self.chunk = None;
            if !rest.is_empty() && chunk.whole {
                return Err(self.wrong(at_byte, "it reaches beyond its chunk"));
            }
            if !chunk.whole {
                self.end = Some(End::Cut {
                    at_byte,
                    lost_bytes: self.length.saturating_sub(at_byte),
                });
            }
            return Ok(None);
        };
        let from = chunk.next + HEAD;
        let to = from + length;
        self.chunk = Some(Chunk { next: to, ..chunk });
        Ok(Some((opcode, from, to)))
    }

    /// The data ended: whether the file was closed too.
    fn finish(&mut self) -> Result<(), ReadError> {
        let io = |source| ReadError::Io {
            path: self.path.clone(),
            offset: self.offset,
            source,
        };
        let tail = MAGIC.len() as u64;
        let mut last = [0; MAGIC.len()];
        let closed = self.length >= self.offset + tail && {
            self.file
                .seek(SeekFrom::Start(self.length - tail))
                .map_err(io)?;
            self.file.read_exact(&mut last).map_err(io)?;
            last == *MAGIC
        };
        self.end = Some(if closed {
            End::Closed
        } else {
            End::Cut {
                at_byte: self.offset,
                lost_bytes: self.unread_bytes(),
            }
        });
        Ok(())
    }

    /// Nothing follows an error like this.
    fn wrong(&mut self, offset: u64, why: &str) -> ReadError {
        self.chunk = None;
        self.end = Some(End::Cut {
            at_byte: offset,
            lost_bytes: self.length.saturating_sub(offset),
        });
        ReadError::Record {
            path: self.path.clone(),
            offset,
            why: why.to_owned(),
        }
    }
}

/// What stands before the records of a chunk.
struct ChunkHead<'a> {
    crc: u32,
    compression: &'a [u8],
    /// Bytes of records.
    length: u64,
    /// Where in the chunk they begin.
    records: usize,
}

impl<'a> ChunkHead<'a> {
    fn read(body: &'a [u8]) -> Option<Self> {
        let (times, rest) = body.split_at_checked(BEFORE_COMPRESSION)?;
        let crc = u32::from_le_bytes(*times.last_chunk()?);
        let (&name, rest) = rest.split_first_chunk::<4>()?;
        let (compression, rest) =
            rest.split_at_checked(usize::try_from(u32::from_le_bytes(name)).ok()?)?;
        let (&length, rest) = rest.split_first_chunk::<8>()?;
        Some(Self {
            crc,
            compression,
            length: u64::from_le_bytes(length),
            records: body.len() - rest.len(),
        })
    }
}

/// What a record says, or what is wrong with it.
pub(super) fn parse(opcode: u8, body: &[u8]) -> Result<Record<'_>, String> {
    if opcode == op::ATTACHMENT && !attachment_fits(body) {
        return Err("the attachment is shorter than it says".to_owned());
    }
    mcap::parse_record(opcode, body).map_err(|error| error.to_string())
}

/// Whether an attachment's fields fit its record; the crate takes that for granted.
fn attachment_fits(body: &[u8]) -> bool {
    let text = |rest: &'_ [u8]| {
        let (&length, rest) = rest.split_first_chunk::<4>()?;
        Some(
            rest.len()
                - usize::try_from(u32::from_le_bytes(length))
                    .ok()?
                    .min(rest.len()),
        )
    };
    let after = |rest: usize| body.get(body.len() - rest..);
    body.split_at_checked(16)
        .and_then(|(_, rest)| text(rest))
        .and_then(after)
        .and_then(text)
        .is_some_and(|rest| rest >= 12)
}

//! Why a recording cannot be written or read.

use std::path::PathBuf;

use thiserror::Error;

/// Why nothing can be recorded.
#[derive(Debug, Error)]
pub enum RecordError {
    /// The file cannot be made.
    #[error("{}: cannot be recorded to: {source}; name another file, or free the place", .path.display())]
    Create {
        /// The file.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
    /// The file cannot be written any more.
    #[error("{}: recording stopped: {why}; what was written before can be read (tonus recover closes it)", .path.display())]
    Write {
        /// The file.
        path: PathBuf,
        /// What failed.
        why: String,
    },
}

/// Why a recording cannot be read, or no further. Offsets count from the file's first byte.
#[derive(Debug, Error)]
pub enum ReadError {
    /// The system refuses.
    #[error("{}: cannot be read at byte {offset}: {source}", .path.display())]
    Io {
        /// The file.
        path: PathBuf,
        /// Where.
        offset: u64,
        /// What the system says.
        source: std::io::Error,
    },
    /// Another kind of file.
    #[error("{}: is no recording: it does not begin as MCAP files do", .path.display())]
    NotMcap {
        /// The file.
        path: PathBuf,
    },
    /// Made by something else.
    #[error("{}: is an MCAP file, but none of Tonus: its profile is '{got}', 'tonus' is read", .path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// Its profile.
        got: String,
    },
    /// Cut before it says what it is.
    #[error("{}: ends at byte {offset}, before anything was recorded", .path.display())]
    CutInOpening {
        /// The file.
        path: PathBuf,
        /// Where it ends.
        offset: u64,
    },
    /// A later version wrote it.
    #[error("{}: has format {got}, this program reads format {expected}: use a newer tonus", .path.display())]
    Format {
        /// The file.
        path: PathBuf,
        /// Its format.
        got: String,
        /// What is read.
        expected: &'static str,
    },
    /// Longer than any record that is written.
    #[error("{}: the record at byte {offset} is said to be {length} bytes long, at most {limit} are read: the file is damaged (tonus recover keeps what is whole)", .path.display())]
    TooLong {
        /// The file.
        path: PathBuf,
        /// Where the record begins.
        offset: u64,
        /// Its length, bytes.
        length: u64,
        /// The greatest that is read, bytes.
        limit: u64,
    },
    /// A checksum does not agree.
    #[error("{}: the chunk at byte {offset} has checksum {got:08x}, {expected:08x} was written: the file is damaged (tonus recover keeps what is whole)", .path.display())]
    Checksum {
        /// The file.
        path: PathBuf,
        /// Where the chunk begins.
        offset: u64,
        /// As written.
        expected: u32,
        /// As read.
        got: u32,
    },
    /// A record that makes no sense.
    #[error("{}: the record at byte {offset} makes no sense: {why}", .path.display())]
    Record {
        /// The file.
        path: PathBuf,
        /// Where it begins.
        offset: u64,
        /// What is wrong.
        why: String,
    },
    /// A message that does not say what its channel promises.
    #[error("{}: the message of {topic} at byte {offset} makes no sense: {why}", .path.display())]
    Message {
        /// The file.
        path: PathBuf,
        /// Where its record begins.
        offset: u64,
        /// Its channel.
        topic: &'static str,
        /// What is wrong.
        why: String,
    },
}

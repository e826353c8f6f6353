//! Recordings written beside the engine, which never waits for them.

use std::collections::BTreeMap;
use std::fs::{File, OpenOptions};
use std::io::{self, Write};
use std::path::{Path, PathBuf};
use std::sync::atomic::{AtomicU64, Ordering};
use std::sync::mpsc::{Receiver, RecvTimeoutError, SyncSender, sync_channel};
use std::sync::{Arc, Mutex, PoisonError};
use std::thread::{Builder, JoinHandle};
use std::time::{Duration, Instant};

use mcap::records::{MessageHeader, Metadata};
use mcap::write::NoSeek;
use mcap::{Attachment, McapError, McapResult, WriteOptions, Writer};

use crate::live::{FileView, Message};

use super::channel::{CALIBRATION, CONFIGURATION, Channel, FORMAT, MODEL, OPENING, PROFILE};
use super::encode::encode;
use super::entry::{Entry, Opening};
use super::error::RecordError;

/// Entries that wait for the writer: some seconds of everything.
const QUEUE: usize = 8192;
/// A chunk is closed and written this often: what a killed program may lose.
const FLUSH_EVERY: Duration = Duration::from_millis(400);
/// The system is asked this often to bring to the disk what is written: what a power cut may lose.
const SYNC_EVERY: Duration = Duration::from_millis(500);
/// A chunk is closed before, when it is longer than this, bytes.
const CHUNK_BYTES: u64 = 1 << 20;

/// Writes a recording.
#[derive(Debug)]
pub struct Recorder {
    path: PathBuf,
    entries: Option<SyncSender<Entry>>,
    threads: Vec<JoinHandle<()>>,
    shared: Arc<Shared>,
}

/// What a recording came to.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Finished {
    /// Length of the file.
    pub bytes: u64,
    /// Entries in it.
    pub entries: u64,
    /// Entries that are missing: they found the queue full, or held numbers that are none.
    pub dropped: u64,
}

#[derive(Debug, Default)]
struct Shared {
    bytes: AtomicU64,
    entries: AtomicU64,
    dropped: AtomicU64,
    problem: Mutex<Option<String>>,
}

impl Shared {
    /// The first problem stays.
    fn fail(&self, why: String) {
        let mut problem = self.problem.lock().unwrap_or_else(PoisonError::into_inner);
        problem.get_or_insert(why);
    }

    fn problem(&self) -> Option<String> {
        let problem = self.problem.lock().unwrap_or_else(PoisonError::into_inner);
        problem.clone()
    }
}

impl Recorder {
    /// Begins a recording in a new file; the opening is on its way to the disk when this returns.
    ///
    /// # Errors
    /// [`RecordError::Create`] where the file exists or cannot be written.
    pub fn create(path: &Path, opening: &Opening) -> Result<Self, RecordError> {
        let create = |source| RecordError::Create {
            path: path.to_owned(),
            source,
        };
        let mut options = OpenOptions::new();
        options.write(true).create_new(true);
        // What was measured of a person is their own.
        #[cfg(unix)]
        std::os::unix::fs::OpenOptionsExt::mode(&mut options, 0o600);
        let file = options.open(path).map_err(create)?;
        let for_sync = file.try_clone().map_err(create)?;
        let shared = Arc::new(Shared::default());
        let out = Counted {
            file,
            shared: Arc::clone(&shared),
        };
        let writer = begin(out, opening).map_err(|error| create(into_io(error)))?;
        let (entries, receiver) = sync_channel(QUEUE);
        let (stop, stopped) = sync_channel(0);
        let (for_writer, for_syncer) = (Arc::clone(&shared), Arc::clone(&shared));
        let writing = Builder::new()
            .name("recorder".to_owned())
            .spawn(move || {
                // Dropped at the end, which stops the syncing.
                let _stop = stop;
                write(Some(writer), &receiver, &for_writer);
            })
            .map_err(create)?;
        let syncing = Builder::new()
            .name("recorder-sync".to_owned())
            .spawn(move || sync(&for_sync, &stopped, &for_syncer))
            .map_err(create)?;
        Ok(Self {
            path: path.to_owned(),
            entries: Some(entries),
            threads: vec![writing, syncing],
            shared,
        })
    }

    /// Takes an entry. Never waits: without room, or after a problem, it is dropped and counted.
    pub fn note(&self, entry: Entry) {
        let taken = (self.entries.as_ref()).is_some_and(|queue| queue.try_send(entry).is_ok());
        if !taken {
            self.shared.dropped.fetch_add(1, Ordering::Relaxed);
        }
    }

    /// How it goes, to be shown.
    #[must_use]
    pub fn state(&self) -> FileView {
        let dropped = self.shared.dropped.load(Ordering::Relaxed);
        let slow = || (dropped > 0).then(|| missing(dropped));
        FileView {
            path: self.path.display().to_string(),
            bytes: self.shared.bytes.load(Ordering::Relaxed),
            problem: self.shared.problem().or_else(slow),
        }
    }

    /// Entries written so far; those noted besides wait or were dropped.
    #[must_use]
    pub fn written(&self) -> u64 {
        self.shared.entries.load(Ordering::Relaxed)
    }

    /// Writes what waits, closes the file and brings it to the disk.
    ///
    /// # Errors
    /// [`RecordError::Write`] where writing stopped before; what was written can be read.
    pub fn finish(mut self) -> Result<Finished, RecordError> {
        self.close();
        if let Some(why) = self.shared.problem() {
            return Err(RecordError::Write {
                path: self.path.clone(),
                why,
            });
        }
        let count = |counter: &AtomicU64| counter.load(Ordering::Relaxed);
        Ok(Finished {
            bytes: count(&self.shared.bytes),
            entries: count(&self.shared.entries),
            dropped: count(&self.shared.dropped),
        })
    }

    fn close(&mut self) {
        self.entries = None;
        for thread in self.threads.drain(..) {
            if thread.join().is_err() {
                self.shared.fail("the writer panicked".to_owned());
            }
        }
    }
}

impl Drop for Recorder {
    fn drop(&mut self) {
        self.close();
    }
}

fn missing(dropped: u64) -> String {
    format!("{dropped} entries are missing from the recording: the disk is too slow for them")
}

fn into_io(error: McapError) -> io::Error {
    match error {
        McapError::Io(error) => error,
        other => io::Error::other(other),
    }
}

/// A file that counts what is written to it.
struct Counted {
    file: File,
    shared: Arc<Shared>,
}

impl Write for Counted {
    fn write(&mut self, bytes: &[u8]) -> io::Result<usize> {
        let written = self.file.write(bytes)?;
        self.shared
            .bytes
            .fetch_add(written as u64, Ordering::Relaxed);
        Ok(written)
    }

    fn flush(&mut self) -> io::Result<()> {
        self.file.flush()
    }
}

/// A file with its opening and its channels. A chunk is put together in memory and written at once.
fn begin(out: Counted, opening: &Opening) -> McapResult<Open> {
    let mut writer = WriteOptions::new()
        .profile(PROFILE)
        .library(format!("tonus {}", opening.version))
        .disable_seeking(true)
        .chunk_size(Some(CHUNK_BYTES))
        .create(NoSeek::new(out))?;
    let mut metadata = BTreeMap::from([
        ("format".to_owned(), FORMAT.to_owned()),
        ("version".to_owned(), opening.version.clone()),
        (
            "started_unix_us".to_owned(),
            opening.started_unix_us.to_string(),
        ),
    ]);
    if let Some(person) = &opening.subject {
        let text = serde_json::to_string(person).map_err(io::Error::other)?;
        metadata.insert("subject".to_owned(), text);
    }
    writer.write_metadata(&Metadata {
        name: OPENING.to_owned(),
        metadata,
    })?;
    let attachments = [
        (
            CONFIGURATION,
            "application/toml",
            Some(opening.configuration.as_bytes()),
        ),
        (
            CALIBRATION,
            "text/plain",
            opening.calibration.as_deref().map(str::as_bytes),
        ),
        (MODEL, "application/octet-stream", opening.model.as_deref()),
    ];
    for (name, media_type, bytes) in attachments {
        if let Some(bytes) = bytes {
            writer.attach(&Attachment {
                log_time: 0,
                create_time: opening.started_unix_us.saturating_mul(1000),
                name: name.to_owned(),
                media_type: media_type.to_owned(),
                data: bytes.into(),
            })?;
        }
    }
    let mut channels = Vec::with_capacity(Channel::ALL.len());
    for channel in Channel::ALL {
        let schema = match channel.schema() {
            Some((name, schema)) => {
                writer.add_schema(name, "jsonschema", schema.to_string().as_bytes())?
            }
            None => 0,
        };
        let id = writer.add_channel(
            schema,
            channel.topic(),
            channel.encoding(),
            &BTreeMap::new(),
        )?;
        channels.push((channel, id));
    }
    writer.flush()?;
    Ok(Open {
        writer,
        channels,
        sequence: 0,
    })
}

struct Open {
    writer: Writer<NoSeek<Counted>>,
    channels: Vec<(Channel, u16)>,
    /// Counts all messages, so that their order is in the file twice.
    sequence: u32,
}

impl Open {
    /// Whether it could be said.
    fn message(&mut self, entry: Entry) -> McapResult<bool> {
        // Nanoseconds: six hundred thousand years of session.
        let log_time = entry.at_us().saturating_mul(1000);
        let Some((channel, bytes)) = encode(entry) else {
            return Ok(false);
        };
        let id = (self.channels.iter()).find_map(|&(known, id)| (known == channel).then_some(id));
        let header = MessageHeader {
            channel_id: id.unwrap_or_default(),
            sequence: self.sequence,
            log_time,
            publish_time: log_time,
        };
        self.sequence = self.sequence.wrapping_add(1);
        self.writer.write_to_known_channel(&header, &bytes)?;
        Ok(true)
    }
}

/// The writer's thread: until nobody sends any more, or, after a problem, only empties the queue.
fn write(mut file: Option<Open>, entries: &Receiver<Entry>, shared: &Shared) {
    let mut flush_at = Instant::now() + FLUSH_EVERY;
    let mut told = 0;
    loop {
        let wait = flush_at.saturating_duration_since(Instant::now());
        let entry = match entries.recv_timeout(wait) {
            Ok(entry) => Some(entry),
            Err(RecvTimeoutError::Timeout) => None,
            Err(RecvTimeoutError::Disconnected) => break,
        };
        let Some(open) = &mut file else {
            shared
                .dropped
                .fetch_add(u64::from(entry.is_some()), Ordering::Relaxed);
            flush_at = Instant::now() + FLUSH_EVERY;
            continue;
        };
        let mut outcome = match entry {
            Some(entry) => take(open, entry, shared, &mut told),
            None => Ok(()),
        };
        if outcome.is_ok() && Instant::now() >= flush_at {
            outcome = open.writer.flush();
            flush_at = Instant::now() + FLUSH_EVERY;
        }
        if let Err(error) = outcome {
            shared.fail(into_io(error).to_string());
            file = None;
        }
    }
    if let Some(mut open) = file {
        let closed = open.writer.finish().map_err(into_io);
        let closed = closed.and_then(|_| open.writer.into_inner().into_inner().file.sync_all());
        if let Err(error) = closed {
            shared.fail(error.to_string());
        }
    }
}

/// Writes an entry, and before it, how many are missing where it is told for the first time.
fn take(file: &mut Open, entry: Entry, shared: &Shared, told: &mut u64) -> McapResult<()> {
    let dropped = shared.dropped.load(Ordering::Relaxed);
    if dropped > *told {
        *told = dropped;
        file.message(Entry::Message(Message {
            at_us: entry.at_us(),
            problem: true,
            text: missing(dropped),
        }))?;
    }
    let counter = if file.message(entry)? {
        &shared.entries
    } else {
        &shared.dropped
    };
    counter.fetch_add(1, Ordering::Relaxed);
    Ok(())
}

/// The syncing thread: apart, because a busy disk may take long, and writing must go on.
fn sync(file: &File, stopped: &Receiver<()>, shared: &Shared) {
    while stopped.recv_timeout(SYNC_EVERY) == Err(RecvTimeoutError::Timeout) {
        if let Err(error) = file.sync_data() {
            shared.fail(format!("what is written does not reach the disk: {error}"));
            return;
        }
    }
}

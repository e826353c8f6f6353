//! A stream of others that is listened to.

use std::ffi::{CStr, c_char, c_ulong};
use std::ptr;
use std::time::Duration;

use super::functions::{CLOCKSYNC, Handle, LOST, TIMEOUT};
use super::{ChannelDescription, Description, Lsl, LslError, text};

/// Seconds of samples that wait to be pulled.
const KEPT_S: i32 = 10;
/// Samples of one pull.
const PULLED: usize = 256;
/// No stream has more channels that are listened to, and no name is longer: what others announce is not trusted.
const MOST_CHANNELS: i32 = 1024;

/// A stream that somebody sends.
#[derive(Debug)]
pub struct Found {
    lsl: Lsl,
    info: Handle,
}

// SAFETY: a description is memory of its own; the library ties it to no thread.
unsafe impl Send for Found {}

/// Listens to a stream.
#[derive(Debug)]
pub struct Inlet {
    lsl: Lsl,
    inlet: Handle,
    description: Description,
    values: Vec<f32>,
    stamps: Vec<f64>,
}

// SAFETY: liblsl's inlets may be used from any thread (lsl_c.h, "thread-safe"); the handle is of nothing thread-local.
unsafe impl Send for Inlet {}

impl Found {
    /// The first stream that fits an XPath predicate: `type='EMG' and name='Tonus'`.
    ///
    /// # Errors
    /// [`LslError::NoStream`] when none is there in time.
    pub fn first(lsl: &Lsl, predicate: &str, limit: Duration) -> Result<Self, LslError> {
        let asked = text(predicate, "predicate")?;
        let mut info = ptr::null_mut();
        // SAFETY: room for one handle is given and said; the text ends in zero and outlives the call.
        let found = unsafe {
            (lsl.0.lsl_resolve_bypred)(&raw mut info, 1, asked.as_ptr(), 1, limit.as_secs_f64())
        };
        if found < 1 || info.is_null() {
            return Err(LslError::NoStream {
                predicate: predicate.to_owned(),
                seconds: limit.as_secs_f64(),
            });
        }
        Ok(Self {
            lsl: lsl.clone(),
            info,
        })
    }
}

impl Drop for Found {
    fn drop(&mut self) {
        // SAFETY: the description is live, is this value's own, and not used after.
        unsafe { (self.lsl.0.lsl_destroy_streaminfo)(self.info) };
    }
}

impl Inlet {
    /// Listens, once the sender has told everything about the stream. Stamps are by this computer's [`Lsl::clock_s`].
    ///
    /// # Errors
    /// [`LslError::Lost`] or [`LslError::Failed`] when it does not in time.
    pub fn open(found: &Found, limit: Duration) -> Result<Self, LslError> {
        let lsl = &found.lsl;
        // SAFETY: the description is live and copied. 0: chunks as they are sent; 0: no silent waiting for a lost sender.
        let inlet = unsafe { (lsl.0.lsl_create_inlet)(found.info, KEPT_S, 0, 0) };
        if inlet.is_null() {
            return Err(LslError::Refused("inlet"));
        }
        let mut this = Self {
            lsl: lsl.clone(),
            inlet,
            description: Description {
                name: String::new(),
                kind: String::new(),
                rate_hz: 0.0,
                source_id: String::new(),
                channels: Vec::new(),
            },
            values: Vec::new(),
            stamps: vec![0.0; PULLED],
        };
        let mut code = 0;
        // SAFETY: the inlet is live; `code` outlives the call.
        let info = unsafe { (lsl.0.lsl_get_fullinfo)(inlet, limit.as_secs_f64(), &raw mut code) };
        if info.is_null() || code != 0 {
            return Err(failure(code));
        }
        let whole = Found {
            lsl: lsl.clone(),
            info,
        };
        this.description = whole.description()?;
        this.values = vec![0.0; PULLED * this.description.channels.len()];
        // SAFETY: the inlet is live.
        unsafe { (lsl.0.lsl_set_postprocessing)(inlet, CLOCKSYNC) };
        // SAFETY: the inlet is live; `code` outlives the call.
        unsafe { (lsl.0.lsl_open_stream)(inlet, limit.as_secs_f64(), &raw mut code) };
        if code != 0 {
            return Err(failure(code));
        }
        Ok(this)
    }

    /// What the sender says of the stream. A channel that it does not describe has no texts.
    #[must_use]
    pub fn description(&self) -> &Description {
        &self.description
    }

    /// Hands every sample that comes within `limit` to `take`, with its time; nothing where none comes.
    ///
    /// # Errors
    /// [`LslError::Lost`] where the sender has gone, [`LslError::Failed`].
    pub fn pull(
        &mut self,
        limit: Duration,
        mut take: impl FnMut(&[f32], f64),
    ) -> Result<(), LslError> {
        let channels = self.description.channels.len();
        let mut code = 0;
        let (values, stamps) = (self.values.len() as c_ulong, self.stamps.len() as c_ulong);
        // SAFETY: the inlet is live; both buffers have the lengths said, and the first holds the second's number of
        // samples of the stream's channels; `code` outlives the call.
        let pulled = unsafe {
            (self.lsl.0.lsl_pull_chunk_f)(
                self.inlet,
                self.values.as_mut_ptr(),
                self.stamps.as_mut_ptr(),
                values,
                stamps,
                limit.as_secs_f64(),
                &raw mut code,
            )
        };
        // A timeout with samples before it is none.
        if code != 0 && code != TIMEOUT {
            return Err(failure(code));
        }
        let samples = self.values.chunks_exact(channels.max(1)).zip(&self.stamps);
        let count = usize::try_from(pulled).unwrap_or(usize::MAX) / channels.max(1);
        for (sample, &at_s) in samples.take(count) {
            take(sample, at_s);
        }
        Ok(())
    }
}

impl Drop for Inlet {
    fn drop(&mut self) {
        // SAFETY: the inlet is live, is this value's own, and not used after.
        unsafe { (self.lsl.0.lsl_destroy_inlet)(self.inlet) };
    }
}

impl Found {
    fn description(&self) -> Result<Description, LslError> {
        let functions = &self.lsl.0;
        // SAFETY: the description is live.
        let count = unsafe { (functions.lsl_get_channel_count)(self.info) };
        if !(1..=MOST_CHANNELS).contains(&count) {
            return Err(LslError::Refused("stream of one to 1024 channels"));
        }
        // SAFETY: the description is live.
        let rate_hz = unsafe { (functions.lsl_get_nominal_srate)(self.info) };
        // SAFETY: the description is live; what it returns lives as long.
        let name = unsafe { (functions.lsl_get_name)(self.info) };
        // SAFETY: as above.
        let kind = unsafe { (functions.lsl_get_type)(self.info) };
        // SAFETY: as above.
        let source_id = unsafe { (functions.lsl_get_source_id)(self.info) };
        Ok(Description {
            // SAFETY: a text of a live description that ends in zero.
            name: unsafe { read(name) },
            // SAFETY: as above.
            kind: unsafe { read(kind) },
            rate_hz,
            // SAFETY: as above.
            source_id: unsafe { read(source_id) },
            channels: self.channels(count),
        })
    }

    /// Descriptions of `count` channels: what the sender left out is empty.
    fn channels(&self, count: i32) -> Vec<ChannelDescription> {
        let functions = &self.lsl.0;
        // SAFETY: the description is live; what it returns lives as long. A node that is not there is an empty one.
        let root = unsafe { (functions.lsl_get_desc)(self.info) };
        // SAFETY: `root` is of a live description; the text ends in zero.
        let all = unsafe { (functions.lsl_child)(root, c"channels".as_ptr()) };
        // SAFETY: as above.
        let mut node = unsafe { (functions.lsl_child)(all, c"channel".as_ptr()) };
        let mut channels = Vec::new();
        for _ in 0..count {
            let value = |name: &CStr| {
                // SAFETY: `node` is of a live description, or empty; the text ends in zero.
                let value = unsafe { (functions.lsl_child_value_n)(node, name.as_ptr()) };
                // SAFETY: a text of a live description that ends in zero.
                unsafe { read(value) }
            };
            channels.push(ChannelDescription {
                label: value(c"label"),
                unit: value(c"unit"),
                kind: value(c"type"),
            });
            // SAFETY: as above.
            if unsafe { (functions.lsl_empty)(node) } == 0 {
                // SAFETY: as above; the sibling of the last is an empty node.
                node = unsafe { (functions.lsl_next_sibling)(node) };
            }
        }
        channels
    }
}

/// A copy of a text of the library.
///
/// # Safety
/// Null, or a text that ends in zero and lives during the call.
unsafe fn read(text: *const c_char) -> String {
    if text.is_null() {
        return String::new();
    }
    // SAFETY: not null, and the caller vouches for the rest.
    let text = unsafe { CStr::from_ptr(text) };
    text.to_string_lossy().into_owned()
}

fn failure(code: i32) -> LslError {
    match code {
        LOST => LslError::Lost,
        code => LslError::Failed(code),
    }
}

//! A stream that others listen to.

use std::ffi::c_int;

use super::functions::{FLOAT32, Handle};
use super::{Description, Lsl, LslError, text};

/// Seconds of samples that are kept for a listener that is slow.
const KEPT_S: i32 = 60;

/// Sends samples of 32-bit floats to whoever listens.
#[derive(Debug)]
pub struct Outlet {
    lsl: Lsl,
    outlet: Handle,
    channels: usize,
}

// SAFETY: liblsl's outlets may be used from any thread (lsl_c.h, "thread-safe"); the handle is of nothing thread-local.
unsafe impl Send for Outlet {}

impl Outlet {
    /// Announces a stream.
    ///
    /// # Errors
    /// [`LslError::Text`] and [`LslError::Refused`].
    pub fn open(lsl: &Lsl, description: &Description) -> Result<Self, LslError> {
        let functions = &lsl.0;
        let name = text(&description.name, "name")?;
        let kind = text(&description.kind, "type")?;
        let source_id = text(&description.source_id, "source id")?;
        let count =
            i32::try_from(description.channels.len()).map_err(|_| LslError::Refused("stream"))?;
        // SAFETY: the texts end in zero and outlive the call, which copies them; FLOAT32 is one of its formats.
        let info = unsafe {
            (functions.lsl_create_streaminfo)(
                name.as_ptr(),
                kind.as_ptr(),
                count,
                description.rate_hz,
                FLOAT32 as c_int,
                source_id.as_ptr(),
            )
        };
        if info.is_null() {
            return Err(LslError::Refused("stream"));
        }
        let described = describe(lsl, info, description);
        // SAFETY: `info` is live, and the outlet copies it. Zero leaves the size of chunks to the listener.
        let outlet = unsafe { (functions.lsl_create_outlet)(info, 0, KEPT_S) };
        // SAFETY: `info` is live, is this function's own, and not used after.
        unsafe { (functions.lsl_destroy_streaminfo)(info) };
        if outlet.is_null() {
            return Err(LslError::Refused("outlet"));
        }
        let outlet = Self {
            lsl: lsl.clone(),
            outlet,
            channels: description.channels.len(),
        };
        described.map(|()| outlet)
    }

    /// Sends a sample that was taken at `at_s` of [`Lsl::clock_s`].
    ///
    /// # Errors
    /// [`LslError::Channels`] and [`LslError::Failed`].
    pub fn push(&self, sample: &[f32], at_s: f64) -> Result<(), LslError> {
        if sample.len() != self.channels {
            return Err(LslError::Channels {
                got: sample.len(),
                expected: self.channels,
            });
        }
        // SAFETY: the outlet is live, and it reads as many floats as it has channels, which are there. 1: send at once.
        match unsafe { (self.lsl.0.lsl_push_sample_ftp)(self.outlet, sample.as_ptr(), at_s, 1) } {
            0 => Ok(()),
            code => Err(LslError::Failed(code)),
        }
    }

    /// Whether somebody listens.
    #[must_use]
    pub fn has_listeners(&self) -> bool {
        // SAFETY: the outlet is live.
        unsafe { (self.lsl.0.lsl_have_consumers)(self.outlet) != 0 }
    }
}

impl Drop for Outlet {
    fn drop(&mut self) {
        // SAFETY: the outlet is live, is this value's own, and not used after.
        unsafe { (self.lsl.0.lsl_destroy_outlet)(self.outlet) };
    }
}

/// Adds the channels as XDF wants them: `channels/channel/{label,unit,type}`.
fn describe(lsl: &Lsl, info: Handle, description: &Description) -> Result<(), LslError> {
    let functions = &lsl.0;
    // SAFETY: `info` is live; what it returns lives as long.
    let root = unsafe { (functions.lsl_get_desc)(info) };
    let maker = [("manufacturer", "Tonus")];
    add(lsl, root, &maker)?;
    // SAFETY: `root` is of a live `info`; the text ends in zero and is copied.
    let channels = unsafe { (functions.lsl_append_child)(root, c"channels".as_ptr()) };
    for channel in &description.channels {
        // SAFETY: as above.
        let node = unsafe { (functions.lsl_append_child)(channels, c"channel".as_ptr()) };
        let values = [
            ("label", channel.label.as_str()),
            ("unit", &channel.unit),
            ("type", &channel.kind),
        ];
        add(lsl, node, &values)?;
    }
    Ok(())
}

fn add(lsl: &Lsl, node: Handle, values: &[(&'static str, &str)]) -> Result<(), LslError> {
    for (name, value) in values {
        let (of, value) = (text(name, "description")?, text(value, name)?);
        // SAFETY: the callers' `node` is of a live description; the texts end in zero and are copied.
        unsafe { (lsl.0.lsl_append_child_value)(node, of.as_ptr(), value.as_ptr()) };
    }
    Ok(())
}

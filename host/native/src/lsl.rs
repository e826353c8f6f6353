//! The lab streaming layer (<https://labstreaminglayer.org>): streams of samples among programs of a network.
//!
//! Its library, liblsl, is the user's own. The functions and numbers are those of its C header, `lsl_c.h`, version 1.16.

mod functions;
mod inlet;
mod outlet;

use std::ffi::{CString, NulError};
use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;

use functions::Functions;

pub use inlet::{Found, Inlet};
pub use outlet::Outlet;

/// Names by which the system's loader finds the library.
const NAMES: [&str; 5] = [
    "liblsl.so",
    "liblsl.so.2",
    "liblsl.dylib",
    "lsl.dll",
    "liblsl64.dll",
];

/// liblsl, loaded.
#[derive(Clone, Debug)]
pub struct Lsl(Arc<Functions>);

/// A stream, as its outlet describes it.
#[derive(Clone, Debug, PartialEq)]
pub struct Description {
    /// For people.
    pub name: String,
    /// What it is: `EMG`.
    pub kind: String,
    /// Samples per second; 0 where they come as they come.
    pub rate_hz: f64,
    /// The same at every start, so that a listener finds it again.
    pub source_id: String,
    /// What is in a sample.
    pub channels: Vec<ChannelDescription>,
}

/// One number of a sample.
#[derive(Clone, Debug, Default, PartialEq, Eq)]
pub struct ChannelDescription {
    /// Its name.
    pub label: String,
    /// Its unit: `microvolts`, `N/m`.
    pub unit: String,
    /// What it is: `EMG`.
    pub kind: String,
}

/// Why there is no stream.
#[derive(Debug, Error)]
pub enum LslError {
    /// The library is not there.
    #[error(
        "liblsl cannot be loaded ({why}): install it (https://github.com/sccn/liblsl/releases), or name it by TONUS_LSL=/path/to/liblsl.so"
    )]
    Absent {
        /// What the loader says of each name tried.
        why: String,
    },
    /// It is something else.
    #[error("{}: is no liblsl: it lacks {function}", .path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// The function that is missing.
        function: &'static str,
    },
    /// A text that C cannot hold.
    #[error("a zero byte in the stream's {0}")]
    Text(&'static str),
    /// The library made none.
    #[error("liblsl made no {0}: look at what it says on standard error")]
    Refused(&'static str),
    /// Nobody sends such a stream.
    #[error(
        "no stream of {predicate} is there after {seconds} s: start it, and look whether a firewall blocks UDP 16571"
    )]
    NoStream {
        /// What was looked for.
        predicate: String,
        /// How long.
        seconds: f64,
    },
    /// The sender has gone.
    #[error("the stream's sender has gone")]
    Lost,
    /// Another failure, by the library's own number.
    #[error("liblsl fails with {0}")]
    Failed(i32),
    /// A sample of another length.
    #[error("a sample of {got} numbers for a stream of {expected}")]
    Channels {
        /// Numbers given.
        got: usize,
        /// Channels of the stream.
        expected: usize,
    },
}

impl Lsl {
    /// Loads the library from this file; without one, from what `TONUS_LSL` names, or from where the system's loader
    /// finds it.
    ///
    /// # Errors
    /// [`LslError::Absent`] and [`LslError::Foreign`].
    pub fn load(path: Option<&Path>) -> Result<Self, LslError> {
        let named = std::env::var_os("TONUS_LSL").filter(|named| !named.is_empty());
        let path = path.map(Path::to_owned).or(named.map(PathBuf::from));
        let names: Vec<PathBuf> = match path {
            Some(path) => vec![path],
            None => NAMES.iter().map(PathBuf::from).collect(),
        };
        let mut why = Vec::new();
        for name in names {
            match Functions::load(&name)? {
                Ok(functions) => return Ok(Self(Arc::new(functions))),
                Err(error) => why.push(error),
            }
        }
        // The names differ by system; the first one's error tells.
        why.truncate(1);
        Err(LslError::Absent {
            why: why.join("; "),
        })
    }

    /// Seconds of the library's clock, by which samples are stamped.
    #[must_use]
    pub fn clock_s(&self) -> f64 {
        self.0.clock_s()
    }

    /// Its version times a hundred: 116 for 1.16.
    #[must_use]
    pub fn version(&self) -> i32 {
        self.0.version()
    }
}

fn text(text: &str, of: &'static str) -> Result<CString, LslError> {
    CString::new(text).map_err(|_: NulError| LslError::Text(of))
}

//! LeapC (<https://docs.ultraleap.com/api-reference/tracking-api/>): hands as an Ultraleap or Leap Motion tracker sees
//! them.
//!
//! Its library is the user's own. The functions, numbers and layouts are those of its C header, `LeapC.h`, version 5,
//! as far as version 3 has them too.

mod connection;
mod functions;
mod layout;
mod places;

use std::path::{Path, PathBuf};
use std::sync::Arc;

use thiserror::Error;

use functions::Functions;

pub use connection::{Connection, Event, Frame, Hand, Side, Unreadable};

/// LeapC, loaded.
#[derive(Clone, Debug)]
pub struct LeapC(Arc<Functions>);

/// Why there are no hands.
#[derive(Debug, Error)]
pub enum LeapCError {
    /// The library is not there.
    #[error(
        "LeapC cannot be loaded ({why}): install Ultraleap's hand tracking software, Gemini or Hyperion \
         (https://www.ultraleap.com/downloads/), or name the library by TONUS_LEAPC=/path/to/libLeapC.so; looked for {looked_for}"
    )]
    Absent {
        /// What the loader says of the likeliest one.
        why: String,
        /// All names and files tried.
        looked_for: String,
    },
    /// It is something else.
    #[error("{}: is no LeapC: it lacks {function}", .path.display())]
    Foreign {
        /// The file.
        path: PathBuf,
        /// The function that is missing.
        function: &'static str,
    },
    /// The library has no service to speak with, or no longer.
    #[error("LeapC has no connection to the tracking service")]
    NotConnected,
    /// Another failure, by the library's own number.
    #[error("{call} of LeapC fails with {code:#010x}")]
    Failed {
        /// The function.
        call: &'static str,
        /// Of `eLeapRS`, as the header writes it.
        code: u32,
    },
}

impl LeapC {
    /// Loads the library from this file; without one, from what `TONUS_LEAPC` names, or from where Ultraleap's installers
    /// put it, or from where the system's loader finds it.
    ///
    /// # Errors
    /// [`LeapCError::Absent`] and [`LeapCError::Foreign`].
    pub fn load(path: Option<&Path>) -> Result<Self, LeapCError> {
        let named = std::env::var_os("TONUS_LEAPC").filter(|named| !named.is_empty());
        let path = path.map(Path::to_owned).or(named.map(PathBuf::from));
        let places = path.map_or_else(places::usual, |path| vec![path]);
        let mut why: Option<String> = None;
        for place in &places {
            match Functions::load(place)? {
                Ok(functions) => return Ok(Self(Arc::new(functions))),
                // A file that is there and cannot be loaded tells more than one that is not.
                Err(error) if why.is_none() || place.is_file() => why = Some(error),
                Err(_) => {}
            }
        }
        let looked_for: Vec<String> = (places.iter())
            .map(|place| place.display().to_string())
            .collect();
        Err(LeapCError::Absent {
            why: why.unwrap_or_default(),
            looked_for: looked_for.join(", "),
        })
    }

    /// What it was loaded from.
    #[must_use]
    pub fn path(&self) -> &Path {
        self.0.path()
    }

    /// The clock by which frames are stamped, microseconds.
    #[must_use]
    pub fn now_us(&self) -> i64 {
        self.0.now_us()
    }

    /// A connection to the service of this machine, which [`Connection::poll`] makes.
    ///
    /// # Errors
    /// [`LeapCError::Failed`].
    pub fn connect(&self) -> Result<Connection, LeapCError> {
        Connection::open(self)
    }
}

#[cfg(test)]
mod tests {
    use super::{LeapC, LeapCError};

    #[test]
    fn what_is_not_there_is_named_with_what_to_do() {
        let Err(error @ LeapCError::Absent { .. }) =
            LeapC::load(Some("/nowhere/libLeapC.so".as_ref()))
        else {
            panic!("a library of that name");
        };
        let text = error.to_string();
        for part in ["/nowhere/libLeapC.so", "install", "TONUS_LEAPC"] {
            assert!(text.contains(part), "{text}");
        }
    }
}

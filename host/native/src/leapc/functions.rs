//! The functions of LeapC that are used.

use std::ffi::c_void;
use std::fmt;
use std::path::{Path, PathBuf};

use libloading::Library;

use super::LeapCError;
use super::layout::Message;

/// `LEAP_CONNECTION`.
pub(super) type Handle = *mut c_void;

/// Codes of `eLeapRS`, as the header writes them.
pub(super) const SUCCESS: u32 = 0;
pub(super) const TIMEOUT: u32 = 0xE201_0004;
pub(super) const NOT_CONNECTED: u32 = 0xE201_0005;
pub(super) const HANDSHAKE_INCOMPLETE: u32 = 0xE201_0006;
pub(super) const UNEXPECTED_CLOSED: u32 = 0xE201_000A;
pub(super) const NOT_AVAILABLE: u32 = 0xE701_0002;

/// Bits of `eLeapPolicyFlag`: frames though another program has the focus; a tracker that is worn on the head.
pub(super) const BACKGROUND_FRAMES: u64 = 1;
pub(super) const OPTIMIZE_HMD: u64 = 4;

/// Makes the table: each function of the library with its C type. `system`: the header says `__stdcall` on Windows.
macro_rules! functions {
    ($($field:ident = $name:literal: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// The library and its functions, which are good for as long as it is loaded.
        pub(super) struct Functions {
            $(pub(super) $field: unsafe extern "system" fn($($argument),*) $(-> $result)?,)*
            path: PathBuf,
            _library: Library,
        }

        impl Functions {
            fn find(library: Library, path: &Path) -> Result<Self, LeapCError> {
                let foreign = |function| LeapCError::Foreign { path: path.to_owned(), function };
                $(
                    // SAFETY: the type is that of LeapC.h, which LeapC keeps since version 3.0; a library that has a
                    // function of this name is taken to be it.
                    let $field = *unsafe {
                        library.get::<unsafe extern "system" fn($($argument),*) $(-> $result)?>(
                            concat!($name, "\0").as_bytes(),
                        )
                    }
                    .map_err(|_| foreign($name))?;
                )*
                Ok(Self { $($field,)* path: path.to_owned(), _library: library })
            }
        }
    };
}

functions! {
    now = "LeapGetNow": fn() -> i64;
    // The configuration may be null.
    create = "LeapCreateConnection": fn(*const c_void, *mut Handle) -> u32;
    open = "LeapOpenConnection": fn(Handle) -> u32;
    set_policy = "LeapSetPolicyFlags": fn(Handle, u64, u64) -> u32;
    poll = "LeapPollConnection": fn(Handle, u32, *mut Message) -> u32;
    // Closes it too; LeapCloseConnection is of version 4.
    destroy = "LeapDestroyConnection": fn(Handle);
}

impl Functions {
    /// The library of this name, or what the loader says; an error where it is another library.
    pub(super) fn load(name: &Path) -> Result<Result<Self, String>, LeapCError> {
        // SAFETY: loading runs the library's own set-up code. The user installed or named it as LeapC, whose set-up asks
        // nothing of its caller.
        match unsafe { Library::new(name) } {
            Ok(library) => Self::find(library, name).map(Ok),
            Err(error) => Ok(Err(error.to_string())),
        }
    }

    pub(super) fn path(&self) -> &Path {
        &self.path
    }

    pub(super) fn now_us(&self) -> i64 {
        // SAFETY: takes nothing; may be called from any thread, with or without a connection.
        unsafe { (self.now)() }
    }
}

impl fmt::Debug for Functions {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        (out.debug_struct("Functions").field("path", &self.path)).finish_non_exhaustive()
    }
}

//! The functions of liblsl that are used, and the handles that they take.

use std::ffi::{c_char, c_double, c_float, c_int, c_ulong, c_void};
use std::fmt;
use std::path::{Path, PathBuf};

use libloading::Library;

use super::LslError;

/// A handle of the library: to a description, its XML, an outlet or an inlet.
pub(super) type Handle = *mut c_void;

/// The first three are channel formats in `lsl_channel_format_t`; the last is a bit of `lsl_processing_options_t`.
pub(super) const FLOAT32: c_int = 1;
/// Stamps by this computer's clock.
pub(super) const CLOCKSYNC: u32 = 1;

/// Codes of `lsl_error_code_t`.
pub(super) const TIMEOUT: i32 = -1;
pub(super) const LOST: i32 = -2;

type Text = *const c_char;

/// Makes the table: each function of the library with its C type.
macro_rules! functions {
    ($($name:ident: fn($($argument:ty),*) $(-> $result:ty)?;)*) => {
        /// The library and its functions, which are good for as long as it is loaded.
        pub(super) struct Functions {
            $(pub(super) $name: unsafe extern "C" fn($($argument),*) $(-> $result)?,)*
            _library: Library,
        }

        impl Functions {
            fn find(library: Library, path: &Path) -> Result<Self, LslError> {
                let foreign = |function| LslError::Foreign { path: path.to_owned(), function };
                $(
                    // SAFETY: the type is that of lsl_c.h, which liblsl keeps since version 1.0; a library that has a
                    // function of this name is taken to be it.
                    let $name = *unsafe {
                        library.get::<unsafe extern "C" fn($($argument),*) $(-> $result)?>(
                            concat!(stringify!($name), "\0").as_bytes(),
                        )
                    }
                    .map_err(|_| foreign(stringify!($name)))?;
                )*
                Ok(Self { $($name,)* _library: library })
            }
        }
    };
}

functions! {
    lsl_library_version: fn() -> i32;
    lsl_local_clock: fn() -> c_double;
    lsl_create_streaminfo: fn(Text, Text, i32, c_double, c_int, Text) -> Handle;
    lsl_destroy_streaminfo: fn(Handle);
    lsl_get_name: fn(Handle) -> Text;
    lsl_get_type: fn(Handle) -> Text;
    lsl_get_source_id: fn(Handle) -> Text;
    lsl_get_channel_count: fn(Handle) -> i32;
    lsl_get_nominal_srate: fn(Handle) -> c_double;
    lsl_get_desc: fn(Handle) -> Handle;
    lsl_append_child: fn(Handle, Text) -> Handle;
    lsl_append_child_value: fn(Handle, Text, Text) -> Handle;
    lsl_child: fn(Handle, Text) -> Handle;
    lsl_next_sibling: fn(Handle) -> Handle;
    lsl_empty: fn(Handle) -> i32;
    lsl_child_value_n: fn(Handle, Text) -> Text;
    lsl_create_outlet: fn(Handle, i32, i32) -> Handle;
    lsl_destroy_outlet: fn(Handle);
    lsl_push_sample_ftp: fn(Handle, *const c_float, c_double, i32) -> i32;
    lsl_have_consumers: fn(Handle) -> i32;
    lsl_resolve_bypred: fn(*mut Handle, u32, Text, i32, c_double) -> i32;
    lsl_create_inlet: fn(Handle, i32, i32, i32) -> Handle;
    lsl_destroy_inlet: fn(Handle);
    lsl_get_fullinfo: fn(Handle, c_double, *mut i32) -> Handle;
    lsl_set_postprocessing: fn(Handle, u32) -> i32;
    lsl_open_stream: fn(Handle, c_double, *mut i32);
    lsl_pull_chunk_f: fn(Handle, *mut c_float, *mut c_double, c_ulong, c_ulong, c_double, *mut i32) -> c_ulong;
}

impl Functions {
    /// The library of this name, or what the loader says; an error where it is another library.
    pub(super) fn load(name: &PathBuf) -> Result<Result<Self, String>, LslError> {
        // SAFETY: loading runs the library's own set-up code. The user installed or named it as liblsl, whose set-up reads
        // its configuration file and asks nothing of its caller.
        match unsafe { Library::new(name) } {
            Ok(library) => Self::find(library, name).map(Ok),
            Err(error) => Ok(Err(error.to_string())),
        }
    }

    pub(super) fn clock_s(&self) -> f64 {
        // SAFETY: takes nothing; may be called from any thread.
        unsafe { (self.lsl_local_clock)() }
    }

    pub(super) fn version(&self) -> i32 {
        // SAFETY: takes nothing; may be called from any thread.
        unsafe { (self.lsl_library_version)() }
    }
}

impl fmt::Debug for Functions {
    fn fmt(&self, out: &mut fmt::Formatter<'_>) -> fmt::Result {
        out.debug_struct("Functions").finish_non_exhaustive()
    }
}

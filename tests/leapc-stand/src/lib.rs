//! Stands in for LeapC: the functions that Tonus uses, with the types and signatures of `leap-sys`, which bindgen made out
//! of Ultraleap's own `LeapC.h`.
//!
//! It plays the script that lies beside it: `libLeapC.so` plays `libLeapC.so.json` (see [`script`]), one entry for each
//! connection that is made, and after the last there is no service any more. It is strict where the real library may be:
//! what an event points at is overwritten at the next poll, frames come only to who asked for them in the background, and
//! numbers of pictures and of tracking differ.
//!
//! What this rests on: that the header and its bindings are LeapC's. How the service behaves is as the header says it does.

mod event;
mod script;

use std::ffi::CStr;
use std::path::PathBuf;
use std::sync::Mutex;
use std::time::{Duration, Instant};

use leap_sys::{LEAP_CONNECTION, LEAP_CONNECTION_CONFIG, LEAP_CONNECTION_MESSAGE, eLeapRS};

use event::Told;
use script::{Act, Step};

/// What the clock shows when the library is first used, microseconds.
const BEGAN_US: i64 = 5_000_000_000;
const BACKGROUND: u64 = leap_sys::_eLeapPolicyFlag_eLeapPolicyFlag_BackgroundFrames as u64;

/// Of all connections.
struct Stand {
    began: Instant,
    /// Scripts of connections to come.
    scripts: std::vec::IntoIter<Vec<Step>>,
}

static STAND: Mutex<Option<Stand>> = Mutex::new(None);

/// Behind a `LEAP_CONNECTION`.
struct Connection {
    /// None where there is no service.
    steps: Option<std::vec::IntoIter<Step>>,
    next: Option<Step>,
    opened: Option<(Instant, i64)>,
    policy: u64,
    told: Option<Told>,
}

fn stand<T>(use_it: impl FnOnce(&mut Stand) -> T) -> T {
    let mut stand = STAND.lock().unwrap();
    use_it(stand.get_or_insert_with(|| Stand {
        began: Instant::now(),
        scripts: script::read(&own_path()).into_iter(),
    }))
}

/// Where this library was loaded from.
fn own_path() -> PathBuf {
    let here: unsafe extern "C" fn() -> i64 = LeapGetNow;
    // SAFETY: plain data, for which zero is a value.
    let mut info: libc::Dl_info = unsafe { std::mem::zeroed() };
    // SAFETY: any address may be asked for; `info` outlives the call.
    let found = unsafe { libc::dladdr(here as *const libc::c_void, &raw mut info) };
    assert!(found != 0 && !info.dli_fname.is_null());
    // SAFETY: not null; the loader's text ends in zero and stays.
    let path = unsafe { CStr::from_ptr(info.dli_fname) };
    PathBuf::from(path.to_str().unwrap())
}

fn now_us() -> i64 {
    let elapsed = stand(|stand| stand.began.elapsed());
    BEGAN_US + i64::try_from(elapsed.as_micros()).unwrap()
}

/// # Safety
/// None is asked for.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn LeapGetNow() -> i64 {
    now_us()
}

/// # Safety
/// `connection` has room for a handle.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn LeapCreateConnection(
    _config: *const LEAP_CONNECTION_CONFIG,
    connection: *mut LEAP_CONNECTION,
) -> eLeapRS {
    let steps = stand(|stand| stand.scripts.next()).map(Vec::into_iter);
    let made = Box::new(Connection {
        steps,
        next: None,
        opened: None,
        policy: 0,
        told: None,
    });
    // SAFETY: as the caller vouches.
    unsafe { connection.write(Box::into_raw(made).cast()) };
    leap_sys::_eLeapRS_eLeapRS_Success
}

/// # Safety
/// A live connection.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn LeapOpenConnection(connection: LEAP_CONNECTION) -> eLeapRS {
    // SAFETY: as the caller vouches; nobody else uses it.
    let connection = unsafe { &mut *connection.cast::<Connection>() };
    connection.opened = Some((Instant::now(), now_us()));
    leap_sys::_eLeapRS_eLeapRS_Success
}

/// # Safety
/// A live connection.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn LeapSetPolicyFlags(
    connection: LEAP_CONNECTION,
    set: u64,
    clear: u64,
) -> eLeapRS {
    // SAFETY: as the caller vouches; nobody else uses it.
    let connection = unsafe { &mut *connection.cast::<Connection>() };
    connection.policy = connection.policy & !clear | set;
    leap_sys::_eLeapRS_eLeapRS_Success
}

/// # Safety
/// A live connection that nobody else polls, and room for a message.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn LeapPollConnection(
    connection: LEAP_CONNECTION,
    timeout_ms: u32,
    message: *mut LEAP_CONNECTION_MESSAGE,
) -> eLeapRS {
    // SAFETY: as the caller vouches.
    let connection = unsafe { &mut *connection.cast::<Connection>() };
    let (code, told) = connection.poll(Duration::from_millis(timeout_ms.into()));
    // SAFETY: as the caller vouches.
    unsafe { message.write_unaligned(told) };
    code
}

/// # Safety
/// A live connection, which is none afterwards.
#[unsafe(no_mangle)]
pub unsafe extern "C" fn LeapDestroyConnection(connection: LEAP_CONNECTION) {
    // SAFETY: made by LeapCreateConnection, and destroyed once.
    let mut connection = unsafe { Box::from_raw(connection.cast::<Connection>()) };
    if let Some(mut told) = connection.told.take() {
        told.spoil();
    }
}

/// Ours and the header's functions have one type.
#[rustfmt::skip]
const _: () = {
    let _: [unsafe extern "C" fn() -> i64; 2] = [LeapGetNow, leap_sys::LeapGetNow];
    let _: [unsafe extern "C" fn(*const LEAP_CONNECTION_CONFIG, *mut LEAP_CONNECTION) -> eLeapRS; 2] =
        [LeapCreateConnection, leap_sys::LeapCreateConnection];
    let _: [unsafe extern "C" fn(LEAP_CONNECTION) -> eLeapRS; 2] = [LeapOpenConnection, leap_sys::LeapOpenConnection];
    let _: [unsafe extern "C" fn(LEAP_CONNECTION, u64, u64) -> eLeapRS; 2] =
        [LeapSetPolicyFlags, leap_sys::LeapSetPolicyFlags];
    let _: [unsafe extern "C" fn(LEAP_CONNECTION, u32, *mut LEAP_CONNECTION_MESSAGE) -> eLeapRS; 2] =
        [LeapPollConnection, leap_sys::LeapPollConnection];
    let _: [unsafe extern "C" fn(LEAP_CONNECTION); 2] = [LeapDestroyConnection, leap_sys::LeapDestroyConnection];
};

impl Connection {
    /// The next event and how the poll went.
    fn poll(&mut self, limit: Duration) -> (eLeapRS, LEAP_CONNECTION_MESSAGE) {
        if let Some(mut told) = self.told.take() {
            told.spoil();
        }
        let until = Instant::now() + limit;
        let (Some(steps), Some((opened, clock_us))) = (&mut self.steps, self.opened) else {
            // At once, as is worst for who asks again and again.
            return (leap_sys::_eLeapRS_eLeapRS_NotConnected, event::none());
        };
        loop {
            let Some(step) = self.next.take().or_else(|| steps.next()) else {
                sleep_until(until);
                return (leap_sys::_eLeapRS_eLeapRS_Timeout, event::none());
            };
            let due = opened + Duration::from_micros(step.at_us);
            if due > until {
                self.next = Some(step);
                sleep_until(until);
                return (leap_sys::_eLeapRS_eLeapRS_Timeout, event::none());
            }
            sleep_until(due);
            match step.act {
                Act::Code(code) => return (code.cast_signed(), event::none()),
                Act::Frame { .. } if self.policy & BACKGROUND == 0 => {}
                act => {
                    let told = self.told.insert(Told::new(act, clock_us));
                    return (leap_sys::_eLeapRS_eLeapRS_Success, told.message());
                }
            }
        }
    }
}

fn sleep_until(instant: Instant) {
    std::thread::sleep(instant.saturating_duration_since(Instant::now()));
}

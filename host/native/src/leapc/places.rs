//! Where the library is looked for.

use std::path::PathBuf;

/// Where Ultraleap's installers put it, newest layout first, then names for the system's loader.
#[cfg(target_os = "windows")]
const PLACES: &[&str] = &[
    r"C:\Program Files\Ultraleap\LeapSDK\lib\x64\LeapC.dll",
    "LeapC.dll",
];
#[cfg(target_os = "macos")]
const PLACES: &[&str] = &[
    "/Applications/Ultraleap Hand Tracking.app/Contents/LeapSDK/lib/libLeapC.dylib",
    "/Applications/Ultraleap Hand Tracking Service.app/Contents/LeapSDK/lib/libLeapC.dylib",
    "/Library/Application Support/Ultraleap/LeapSDK/lib/libLeapC.dylib",
    "libLeapC.5.dylib",
    "libLeapC.dylib",
];
#[cfg(not(any(target_os = "windows", target_os = "macos")))]
const PLACES: &[&str] = &[
    "/usr/lib/ultraleap-hand-tracking-service/libLeapC.so",
    "/usr/lib/ultraleap-hand-tracking-service/libLeapC.so.5",
    "/usr/share/doc/ultraleap-hand-tracking-service/LeapSDK/lib/x64/libLeapC.so",
    "/opt/ultraleap/LeapSDK/lib/libLeapC.so",
    "libLeapC.so.5",
    "libLeapC.so",
];

/// All of them, in the order in which they are tried.
pub(super) fn usual() -> Vec<PathBuf> {
    PLACES.iter().map(PathBuf::from).collect()
}

//! The portable part of the wearable: what it does, without the chip that does it.
//!
//! It is generic over the Bluetooth controller and the serial line and takes its time stamps as arguments, so all of
//! it is tested on the host. The binary beside it only wires pins, clocks and a transport to these pieces.
#![cfg_attr(not(test), no_std)]

#[cfg(all(
    target_os = "none",
    not(any(feature = "dk-ads129x", feature = "xiao-analog"))
))]
compile_error!("choose a board: --features dk-ads129x (the default) or --features xiao-analog");
#[cfg(all(target_os = "none", feature = "dk-ads129x", feature = "xiao-analog"))]
compile_error!(
    "choose one board only: --features xiao-analog goes together with --no-default-features"
);

#[cfg(all(target_os = "none", feature = "ble", feature = "wired"))]
compile_error!(
    "an image has one transport: build `wired` with --no-default-features (cargo firmware-wired)"
);
#[cfg(all(target_os = "none", not(feature = "ble"), not(feature = "wired")))]
compile_error!("an image needs a transport: the feature `ble` (default) or `wired`");

pub mod acquisition;
pub mod afe;
pub mod battery;
#[cfg(feature = "ble")]
pub mod ble;
pub mod imu;
pub mod inbox;
pub mod keeper;
pub mod last_words;
pub mod outbox;
pub mod recognition;
pub mod requests;
pub mod reset;
pub mod signal_path;
pub mod storage;
pub mod vitals;
pub mod wearable;
pub mod wired;

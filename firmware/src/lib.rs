//! The portable part of the wearable: what it does, without the chip that does it.
//!
//! It is generic over the Bluetooth controller and the serial line and takes its time stamps as arguments, so all of
//! it is tested on the host. The binary beside it only wires pins, clocks and a transport to these pieces.
#![cfg_attr(not(test), no_std)]

#[cfg(all(target_os = "none", feature = "ble", feature = "wired"))]
compile_error!(
    "an image has one transport: build `wired` with --no-default-features (cargo firmware-wired)"
);
#[cfg(all(target_os = "none", not(feature = "ble"), not(feature = "wired")))]
compile_error!("an image needs a transport: the feature `ble` (default) or `wired`");

pub mod acquisition;
#[cfg(feature = "ble")]
pub mod ble;
pub mod outbox;
pub mod signal_path;
pub mod wired;

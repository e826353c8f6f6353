//! The portable part of the wearable: what it does, without the chip that does it.
//!
//! It is generic over the Bluetooth controller and takes its time stamps as arguments, so all of it is
//! tested on the host. The binary beside it only wires pins, clocks and radio to these pieces.
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

pub mod acquisition;
pub mod afe;
pub mod ble;
pub mod imu;
pub mod outbox;
pub mod recognition;
pub mod signal_path;
pub mod storage;

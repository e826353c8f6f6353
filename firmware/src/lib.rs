//! The portable part of the wearable: what it does, without the chip that does it.
//!
//! It is generic over the Bluetooth controller and takes its time stamps as arguments, so all of it is
//! tested on the host. The binary beside it only wires pins, clocks and radio to these pieces.
#![cfg_attr(not(test), no_std)]

pub mod acquisition;
pub mod ble;
pub mod inbox;
pub mod outbox;
pub mod signal_path;

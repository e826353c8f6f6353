//! The portable part of the wearable, tested on the host.
#![cfg_attr(not(test), no_std)]

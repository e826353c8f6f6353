//! Emulated

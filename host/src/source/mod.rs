//! Devices that give inputs, each on a thread of its own: their frames and pictures go to the engine with their times,
//! its requests go to them, and who is lost is looked for again within seconds.
//!
//! Every source is a function that returns when its port says that the program ends.

mod backoff;
mod choice;
pub mod hand;
pub mod lsl;
pub mod myo;
pub mod replay;
pub mod serial;
pub mod simulated;
pub mod wearable;

pub use backoff::Backoff;
pub use choice::{LinkChoice, NoLink};

//! All of it joined: devices, engine, recording, page and robot.

mod beside;
pub mod doctor;
pub mod follows;
pub mod hands;
pub mod keep;
pub mod keyboard;
mod latency;
pub mod play;
pub mod real;
pub mod run;
pub mod setup;
pub mod story;
pub mod terminal;
pub mod virtually;

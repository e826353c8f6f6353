//! The only room that commands a robot: commands with an age, the one safety gate they pass through,
//! and a simulated robot that follows what comes out of it.
//!
//! ```text
//! Command --offer--> Gate --tick (1 kHz)--> Setpoint --step--> robot (simulated here)
//! ```

pub mod arm;
pub mod command;
pub mod gate;
pub mod limits;
pub mod simulated;
pub mod udp;

//! The host: joins the wearable's packets with the hand's position, learns and recognises skills, and
//! commands a robot as an impedance.

pub mod atomic;
pub mod baseline;
pub mod calibration;
pub mod clock;
pub mod demo;
pub mod demonstration;
pub mod envelope;
pub mod experiment;
pub mod leap;
pub mod link;
pub mod live;
pub mod model;
pub mod report;
pub mod robot;
pub mod session;
pub mod simulate;
mod statistics;
pub mod store;
pub mod table;
pub mod transform;

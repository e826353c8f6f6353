//! The host: joins the wearable's packets with the hand's position, learns and recognises skills, and
//! commands a robot as an impedance.

pub mod atomic;
pub mod baseline;
pub mod broadcast;
pub mod calibration;
pub mod clock;
pub mod config;
pub mod demo;
pub mod demonstration;
pub mod envelope;
pub mod experiment;
pub mod export;
pub mod leap;
pub mod library;
pub mod link;
pub mod live;
pub mod model;
pub mod page;
pub mod recording;
pub mod report;
pub mod robot;
pub mod session;
pub mod simulate;
pub mod source;
mod statistics;
pub mod store;
pub mod studio;
pub mod table;
pub mod transform;

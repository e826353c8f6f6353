//! What an engine is told once.

use crate::clock::ClockConfig;
use crate::robot::limits::{Fallback, Limits};
use crate::session::SessionConfig;
use crate::transform::{Shoulder, Transform};

/// How the engine works. The same configuration and the same inputs give the same run.
#[derive(Debug, Clone, PartialEq)]
pub struct EngineConfig {
    /// The wearable's link, as the command line names it.
    pub link: String,
    /// The robot, as the command line names it.
    pub robot: String,
    /// How the wearable's clock is read.
    pub clock: ClockConfig,
    /// Boot id of the frames that this host sends.
    pub boot_id: u32,
    /// Where the shoulder is in the tracker's frame; none where the tracker looks from it.
    pub shoulder: Option<Shoulder>,
    /// From the tracker's frame to the robot's, once it was taught.
    pub tracker_to_robot: Option<Transform>,
    /// Whether the wearable is asked to send raw sEMG.
    pub raw: bool,
    /// Share of known movements that may be held as unknown.
    pub false_alarm_rate: f64,
    /// How movements are observed, decided on and commanded.
    pub session: SessionConfig,
    /// What the robot must keep to.
    pub limits: Limits,
    /// How it waits.
    pub fallback: Fallback,
}

//! What the engine is told when the devices are simulated ones.

use nalgebra::Isometry3;

use crate::clock::ClockConfig;
use crate::live::EngineConfig;
use crate::robot::limits::{Fallback, Limits};
use crate::session::SessionConfig;
use crate::simulate::scripted::HOME_M;

/// Boot id of the frames that this host sends.
const HOST_BOOT_ID: u32 = 0x484f_5354;
/// The simulated link's shortest delay, microseconds: one connection interval.
const TRANSPORT_US: u32 = 7_500;

/// An engine for simulated devices.
#[must_use]
pub fn simulated_engine() -> EngineConfig {
    EngineConfig {
        link: "sim".to_owned(),
        robot: "simulated".to_owned(),
        clock: ClockConfig {
            transport_us: TRANSPORT_US,
            ..ClockConfig::default()
        },
        boot_id: HOST_BOOT_ID,
        // The simulated tracker looks from the shoulder.
        shoulder: Isometry3::identity(),
        taught: true,
        session: session(),
        limits: Limits::default(),
        fallback: Fallback::default(),
    }
}

/// How movements are observed, decided on and commanded.
#[must_use]
pub fn session() -> SessionConfig {
    SessionConfig {
        observations: 10,
        position_sigma_m: 0.003,
        stiffness_sigma: 0.05,
        use_semg: true,
        decide_at: 0.95,
        decide_after: 2,
        act_within_m: 0.06,
        home_m: HOME_M,
        home_stiffness_n_per_m: Fallback::default().stiffness_n_per_m,
        damping_ratio: 1.0,
    }
}

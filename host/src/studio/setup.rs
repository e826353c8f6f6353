//! From the configuration to what the engine and its devices are told.

use std::net::SocketAddr;

use rand::TryRng;
use rand::rngs::SysRng;

use crate::config::Config;
use crate::leap::{self, OriginError, Side, Wanted};
use crate::live::{Body, BodyError, EngineConfig, simulated};
use crate::robot::udp::{self, UdpError, UdpRobot};
use crate::session::SessionConfig;
use crate::source::LinkChoice;
use crate::source::simulated::SHOULDER;
use crate::transform::{Shoulder, ShoulderError, Transform, TransformError};
use tonus_shared::stiffness::ILLUSTRATIVE;

/// Boot id of the frames that this host sends.
const HOST_BOOT_ID: u32 = 0x484f_5354;

/// What a configuration names and there is not.
#[derive(Debug, thiserror::Error)]
pub enum SetupError {
    /// The robot.
    #[error("`{got}` is no robot: give simulated, or udp:ADDRESS:PORT, such as udp:127.0.0.1:5005")]
    Robot {
        /// What was given.
        got: String,
    },
    /// The address of the Leap service.
    #[error("[tracker] leap: {0}")]
    Leap(#[from] OriginError),
    /// The simulated robot.
    #[error(transparent)]
    Simulated(#[from] BodyError),
    /// The address of the robot's controller.
    #[error("[robot] to: {0}")]
    Udp(#[from] UdpError),
    /// Where the shoulder is.
    #[error("[tracker] shoulder: {0}")]
    Shoulder(#[from] ShoulderError),
    /// From the tracker to the robot.
    #[error("[tracker] robot: {0}")]
    Transform(#[from] TransformError),
}

/// Which robot follows.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub enum RobotChoice {
    /// The simulated one.
    Simulated,
    /// A controller that takes datagrams.
    Udp(SocketAddr),
}

/// The robot that the configuration names.
///
/// # Errors
/// [`SetupError::Robot`].
pub fn robot(config: &Config) -> Result<RobotChoice, SetupError> {
    let got = config.robot.to.as_str();
    if got == "simulated" {
        return Ok(RobotChoice::Simulated);
    }
    match got.strip_prefix("udp:") {
        Some(at) => Ok(RobotChoice::Udp(udp::address(at)?)),
        None => Err(SetupError::Robot {
            got: got.to_owned(),
        }),
    }
}

/// The body of that robot.
///
/// # Errors
/// [`SetupError`].
pub fn body(config: &Config) -> Result<Body, SetupError> {
    match robot(config)? {
        RobotChoice::Simulated => Ok(simulated(config.robot.home_m, config.robot.payload_kg)?),
        RobotChoice::Udp(_) => Ok(Body::External),
    }
}

/// The engine for this configuration and link.
///
/// # Errors
/// [`SetupError`].
pub fn engine(config: &Config, link: &LinkChoice) -> Result<EngineConfig, SetupError> {
    robot(config)?;
    let (limits, fallback) = config.limits();
    Ok(EngineConfig {
        link: link.to_string(),
        robot: config.robot.to.clone(),
        clock: config.clock(),
        boot_id: HOST_BOOT_ID,
        shoulder: shoulder(config, link)?,
        tracker_to_robot: (config.tracker.robot.as_ref())
            .map(Transform::from_stored)
            .transpose()?,
        raw: config.wearable.raw,
        false_alarm_rate: config.recognition.false_alarm_rate,
        session: session(config),
        limits,
        fallback,
    })
}

/// How the Leap service is followed.
///
/// # Errors
/// [`SetupError::Leap`].
pub fn tracker(config: &Config) -> Result<leap::Config, SetupError> {
    Ok(leap::Config {
        origin: config.tracker.leap.parse()?,
        wanted: match config.tracker.hand.as_str() {
            "left" => Wanted::Only(Side::Left),
            "right" => Wanted::Only(Side::Right),
            _ => Wanted::Either,
        },
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "checked: 0 to 1000 ms"
        )]
        transport_us: (config.tracker.transport_ms * 1e3) as u32,
        backoff: leap::Backoff::default(),
    })
}

/// Boot id of a wearable that this program makes.
#[must_use]
pub fn random_boot_id() -> u32 {
    // Any 32 bits will do; a system that gives none still gives a time.
    SysRng.try_next_u32().unwrap_or_else(|_| std::process::id())
}

/// The robot's controller, if it is elsewhere.
///
/// # Errors
/// [`SetupError`].
pub fn controller(config: &Config) -> Result<Option<UdpRobot>, SetupError> {
    match robot(config)? {
        RobotChoice::Simulated => Ok(None),
        RobotChoice::Udp(to) => Ok(Some(UdpRobot::open(to, config.robot.rate_hz)?)),
    }
}

/// Where the shoulder is in the tracker's frame.
fn shoulder(config: &Config, link: &LinkChoice) -> Result<Option<Shoulder>, SetupError> {
    if *link == LinkChoice::Simulated {
        return Ok(Some(SHOULDER));
    }
    if let Some(shoulder) = config.tracker.shoulder {
        shoulder.check()?;
        return Ok(Some(shoulder));
    }
    let left = config.tracker.hand == "left";
    Ok(Some(Shoulder::by_height(ILLUSTRATIVE.body_height_m, left)?))
}

/// How movements are observed, decided on and commanded.
fn session(config: &Config) -> SessionConfig {
    let told = &config.recognition;
    SessionConfig {
        observations: 10,
        position_sigma_m: told.position_sigma_mm * 1e-3,
        stiffness_sigma: told.stiffness_sigma,
        use_semg: true,
        decide_at: told.decide_at,
        // A second of a movement: few demonstrations make its beginning look surer than it is.
        decide_after: 5,
        act_within_m: told.act_within_mm * 1e-3,
        home_m: config.robot.home_m,
        home_stiffness_n_per_m: config.robot.fallback_n_per_m,
        damping_ratio: config.robot.damping_ratio,
    }
}

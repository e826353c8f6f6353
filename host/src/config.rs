//! The configuration: one TOML file, in which every key has a default that works.
//!
//! `tonus doctor` shows where it is looked for, and the whole of it as it is in use.

mod check;

use std::path::{Path, PathBuf};

use serde::{Deserialize, Serialize};

use crate::clock::ClockConfig;
use crate::robot::limits::{ConfigError as LimitsError, Fallback, Limits};
use crate::transform::{Shoulder, Stored};

/// Its name in the directory of configurations.
const FILE: &str = "tonus.toml";
/// Larger files are none, bytes.
const MAX_BYTES: u64 = 1024 * 1024;

/// Everything that can be configured.
#[derive(Clone, Debug, Default, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Config {
    /// The wearable.
    pub wearable: Wearable,
    /// The hand tracker.
    pub tracker: Tracker,
    /// When movements are recognised and acted on.
    pub recognition: Recognition,
    /// The robot.
    pub robot: Robot,
    /// The page.
    pub page: Page,
    /// The files.
    pub recording: Recording,
}

/// `[wearable]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Wearable {
    /// As `--link`: `sim`, `ble`, `ble:NAME`, `serial:PORT`, `myo`, `replay:FILE`, `lsl`.
    pub link: String,
    /// Shortest delay from a scan to its packet's arrival, ms: it cannot be observed.
    pub transport_ms: f64,
    /// Whether it is asked to send raw sEMG.
    pub raw: bool,
}

/// `[tracker]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Tracker {
    /// Address of the Leap service, `ws://HOST:PORT`; or `leapc`, `leapc:FILE`: Ultraleap's library.
    pub leap: String,
    /// `right`, `left` or `either`.
    pub hand: String,
    /// Shortest delay from a picture to its arrival over the WebSocket, ms: it cannot be observed.
    pub transport_ms: f64,
    /// Where the shoulder is in the tracker's frame; without it, where that of a person of 1.75 m is who sits before the
    /// tracker. `tonus teach --shoulder` and the page measure it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub shoulder: Option<Shoulder>,
    /// From the tracker's frame to the robot's. `tonus teach --point ...` and the page measure it.
    #[serde(skip_serializing_if = "Option::is_none")]
    pub robot: Option<Stored>,
}

/// `[recognition]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Recognition {
    /// Standard deviation of the tracker's white error, mm.
    pub position_sigma_mm: f64,
    /// Standard deviation of a stiffness as a share of it.
    pub stiffness_sigma: f64,
    /// Posterior probability at which a skill counts as decided on.
    pub decide_at: f64,
    /// Share of known movements that may be held as unknown: more of them are, and more of what is unknown is noticed.
    pub false_alarm_rate: f64,
    /// The robot holds while where it should be is less sure than this, mm.
    pub act_within_mm: f64,
}

/// `[robot]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Robot {
    /// As `--robot`: `simulated` or `udp:HOST:PORT`.
    pub to: String,
    /// Set-points a second for a controller elsewhere.
    pub rate_hz: f64,
    /// Where its hand waits, base frame, metres.
    pub home_m: [f64; 3],
    /// What the simulated robot's hand carries, kg: it sags by its weight over the stiffness.
    pub payload_kg: f64,
    /// Damping ratio of every command.
    pub damping_ratio: f64,
    /// Smallest and largest stiffness, N/m.
    pub stiffness_n_per_m: [f64; 2],
    /// Fastest change of stiffness, N/m per second.
    pub stiffness_rate_n_per_m_s: f64,
    /// Fastest motion, m/s.
    pub speed_m_per_s: f64,
    /// The box that its hand stays in: lower corner, metres.
    pub workspace_low_m: [f64; 3],
    /// Upper corner.
    pub workspace_high_m: [f64; 3],
    /// How stiff it waits, N/m: firm enough to bear its load.
    pub fallback_n_per_m: [f64; 3],
}

/// `[page]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Page {
    /// Port on 127.0.0.1; if it is taken, a free one.
    pub port: u16,
    /// Whether a browser is opened.
    pub open: bool,
}

/// `[recording]`
#[derive(Clone, Debug, PartialEq, Serialize, Deserialize)]
#[serde(default, deny_unknown_fields)]
pub struct Recording {
    /// Where files go; relative to where the program is started.
    pub directory: PathBuf,
    /// Where what was measured of people is kept, a file each; likewise relative.
    pub people: PathBuf,
}

impl Default for Wearable {
    fn default() -> Self {
        Self {
            link: "sim".to_owned(),
            transport_ms: 7.5,
            raw: true,
        }
    }
}

impl Default for Tracker {
    fn default() -> Self {
        Self {
            leap: "ws://127.0.0.1:6437".to_owned(),
            hand: "right".to_owned(),
            transport_ms: 10.0,
            shoulder: None,
            robot: None,
        }
    }
}

impl Default for Recognition {
    fn default() -> Self {
        Self {
            position_sigma_mm: 3.0,
            stiffness_sigma: 0.1,
            decide_at: 0.95,
            false_alarm_rate: 0.01,
            act_within_mm: 60.0,
        }
    }
}

impl Default for Robot {
    fn default() -> Self {
        let (limits, fallback) = (Limits::default(), Fallback::default());
        Self {
            to: "simulated".to_owned(),
            rate_hz: 200.0,
            home_m: [0.40, 0.0, 0.45],
            payload_kg: 0.0,
            damping_ratio: 1.0,
            stiffness_n_per_m: limits.stiffness_n_per_m,
            stiffness_rate_n_per_m_s: limits.stiffness_rate_n_per_m_s,
            speed_m_per_s: limits.speed_m_per_s,
            workspace_low_m: limits.workspace_low_m,
            workspace_high_m: limits.workspace_high_m,
            fallback_n_per_m: fallback.stiffness_n_per_m,
        }
    }
}

impl Default for Page {
    fn default() -> Self {
        Self {
            port: 8270,
            open: true,
        }
    }
}

impl Default for Recording {
    fn default() -> Self {
        Self {
            directory: PathBuf::from("recordings"),
            people: PathBuf::from("people"),
        }
    }
}

/// Why a configuration cannot be used.
#[derive(Debug, thiserror::Error)]
pub enum ConfigError {
    /// It cannot be read.
    #[error("{}: cannot be read: {source}", file.display())]
    Read {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// It cannot be written.
    #[error("{}: cannot be written: {source}", file.display())]
    Write {
        /// The file.
        file: PathBuf,
        /// The system's reason.
        source: std::io::Error,
    },
    /// Too large to be one.
    #[error("{}: {got} bytes, a configuration has at most {MAX_BYTES}: is it the right file?", file.display())]
    Size {
        /// The file.
        file: PathBuf,
        /// Its size.
        got: u64,
    },
    /// It is no TOML, or has a key that there is not, or a value of another type.
    #[error("{}: {problem}", file.display())]
    Parse {
        /// The file.
        file: PathBuf,
        /// Line, key and what was expected.
        problem: String,
    },
    /// A value outside its range.
    #[error("{}: {key} is {got}: give {expected}", file.display())]
    Value {
        /// The file.
        file: PathBuf,
        /// Table and key.
        key: &'static str,
        /// The value.
        got: String,
        /// What it may be.
        expected: &'static str,
    },
    /// Limits that contradict each other.
    #[error("{}: [robot]: {source}", file.display())]
    Limits {
        /// The file.
        file: PathBuf,
        /// Which.
        source: LimitsError,
    },
}

impl Config {
    /// Where a configuration is looked for when none is named: here, then in the user's own place.
    #[must_use]
    pub fn places() -> Vec<PathBuf> {
        let own = directories::ProjectDirs::from("", "", "tonus")
            .map(|dirs| dirs.config_dir().join(FILE));
        std::iter::once(PathBuf::from(FILE)).chain(own).collect()
    }

    /// The named file, or the first that there is, or the defaults; and the file it came from.
    ///
    /// # Errors
    /// [`ConfigError`]; a named file that there is not among them.
    pub fn find(named: Option<&Path>) -> Result<(Self, Option<PathBuf>), ConfigError> {
        let found = match named {
            Some(file) => Some(file.to_owned()),
            None => Self::places().into_iter().find(|place| place.is_file()),
        };
        let config = found.as_deref().map(Self::read).transpose()?;
        Ok((config.unwrap_or_default(), found))
    }

    /// Reads and checks a file.
    ///
    /// # Errors
    /// [`ConfigError`] names file, line and key.
    pub fn read(file: &Path) -> Result<Self, ConfigError> {
        let failed = |source| ConfigError::Read {
            file: file.to_owned(),
            source,
        };
        let got = std::fs::metadata(file).map_err(failed)?.len();
        if got > MAX_BYTES {
            let file = file.to_owned();
            return Err(ConfigError::Size { file, got });
        }
        Self::parse(&std::fs::read_to_string(file).map_err(failed)?, file)
    }

    /// Checks a text; `file` is for messages.
    ///
    /// # Errors
    /// [`ConfigError`].
    pub fn parse(text: &str, file: &Path) -> Result<Self, ConfigError> {
        let config: Self = toml::from_str(text).map_err(|error| ConfigError::Parse {
            file: file.to_owned(),
            problem: error.to_string().trim_end().to_owned(),
        })?;
        config.check(file)?;
        Ok(config)
    }

    /// With what was taught in the place of what was; none leaves what there is.
    #[must_use]
    pub fn taught(mut self, shoulder: Option<Shoulder>, robot: Option<Stored>) -> Self {
        self.tracker.shoulder = shoulder.or(self.tracker.shoulder);
        self.tracker.robot = robot.or(self.tracker.robot);
        self
    }

    /// Writes the whole of it, so that what the file says is what is used.
    ///
    /// # Errors
    /// [`ConfigError::Write`].
    pub fn keep(&self, file: &Path) -> Result<(), ConfigError> {
        let written = crate::atomic::write(file, self.text().as_bytes());
        written.map_err(|source| ConfigError::Write {
            file: file.to_owned(),
            source,
        })
    }

    /// The whole of it as text.
    #[must_use]
    pub fn text(&self) -> String {
        // Plain tables of numbers and texts.
        toml::to_string_pretty(self).unwrap_or_default()
    }

    /// How the wearable's clock is read.
    #[must_use]
    pub fn clock(&self) -> ClockConfig {
        ClockConfig {
            #[allow(
                clippy::cast_possible_truncation,
                clippy::cast_sign_loss,
                reason = "checked: 0 to 1000 ms"
            )]
            transport_us: (self.wearable.transport_ms * 1e3) as u32,
            ..ClockConfig::default()
        }
    }

    /// What the robot must keep to.
    #[must_use]
    pub fn limits(&self) -> (Limits, Fallback) {
        let limits = Limits {
            stiffness_n_per_m: self.robot.stiffness_n_per_m,
            stiffness_rate_n_per_m_s: self.robot.stiffness_rate_n_per_m_s,
            speed_m_per_s: self.robot.speed_m_per_s,
            workspace_low_m: self.robot.workspace_low_m,
            workspace_high_m: self.robot.workspace_high_m,
            ..Limits::default()
        };
        let fallback = Fallback {
            stiffness_n_per_m: self.robot.fallback_n_per_m,
            ..Fallback::default()
        };
        (limits, fallback)
    }
}

#[cfg(test)]
mod tests;

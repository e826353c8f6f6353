//! Ranges of the configuration's numbers.

use std::path::Path;

use super::{Config, ConfigError};

/// A number, by table and key.
struct Number {
    key: &'static str,
    of: fn(&Config) -> f64,
    /// Least and largest.
    range: [f64; 2],
    expected: &'static str,
}

const fn number(
    key: &'static str,
    of: fn(&Config) -> f64,
    range: [f64; 2],
    expected: &'static str,
) -> Number {
    Number {
        key,
        of,
        range,
        expected,
    }
}

const NUMBERS: [Number; 10] = [
    number(
        "wearable.transport_ms",
        |c| c.wearable.transport_ms,
        [0.0, 1e3],
        "0 to 1000 ms",
    ),
    number(
        "tracker.transport_ms",
        |c| c.tracker.transport_ms,
        [0.0, 1e3],
        "0 to 1000 ms",
    ),
    number(
        "recognition.position_sigma_mm",
        |c| c.recognition.position_sigma_mm,
        [0.01, 100.0],
        "0.01 to 100 mm",
    ),
    number(
        "recognition.stiffness_sigma",
        |c| c.recognition.stiffness_sigma,
        [1e-3, 1.0],
        "0.001 to 1",
    ),
    number(
        "recognition.decide_at",
        |c| c.recognition.decide_at,
        [0.5, 1.0],
        "0.5 to 1",
    ),
    number(
        "recognition.false_alarm_rate",
        |c| c.recognition.false_alarm_rate,
        [1e-3, 0.5],
        "0.001 to 0.5",
    ),
    number(
        "recognition.act_within_mm",
        |c| c.recognition.act_within_mm,
        [1.0, 1e3],
        "1 to 1000 mm",
    ),
    number(
        "robot.damping_ratio",
        |c| c.robot.damping_ratio,
        [0.5, 1.5],
        "0.5 to 1.5",
    ),
    number(
        "robot.payload_kg",
        |c| c.robot.payload_kg,
        [0.0, 5.0],
        "0 to 5 kg",
    ),
    number(
        "robot.rate_hz",
        |c| c.robot.rate_hz,
        [1.0, 1e3],
        "1 to 1000 Hz",
    ),
];

impl Config {
    /// Refuses the first value outside its range; `file` is for messages.
    pub(super) fn check(&self, file: &Path) -> Result<(), ConfigError> {
        let refused = |key, got, expected| ConfigError::Value {
            file: file.to_owned(),
            key,
            got,
            expected,
        };
        for number in &NUMBERS {
            let value = (number.of)(self);
            let [least, most] = number.range;
            // NaN is within nothing.
            if !(least..=most).contains(&value) {
                return Err(refused(number.key, value.to_string(), number.expected));
            }
        }
        if !["right", "left", "either"].contains(&self.tracker.hand.as_str()) {
            let got = format!("\"{}\"", self.tracker.hand);
            return Err(refused(
                "tracker.hand",
                got,
                "\"right\", \"left\" or \"either\"",
            ));
        }
        let (limits, fallback) = self.limits();
        let checked = limits.check(&fallback, &self.robot.home_m);
        checked.map_err(|source| ConfigError::Limits {
            file: file.to_owned(),
            source,
        })
    }
}

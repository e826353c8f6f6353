//! Any device that streams sEMG by the lab streaming layer, as a wearable: its samples through the wearable's own signal
//! path.

use thiserror::Error;
use tonus_shared::pipeline::{Board, CalibrationError, illustrative};
use tonus_shared::sample::{AdcScale, AdcScaleError, Scan};
use tonus_shared::wire::Muscle;

use super::bridge::Bridge;

/// Channels that are taken.
pub const CHANNELS: usize = 4;
/// What they stand for, in this order.
pub const MUSCLES: [Muscle; CHANNELS] = [
    Muscle::BicepsShort,
    Muscle::BicepsLong,
    Muscle::TricepsLateral,
    Muscle::TricepsLong,
];
/// Rates that devices in use have, and the signal path can be designed for, Hz.
pub const RATES_HZ: &[u32] = &[200, 250, 256, 500, 512, 1000, 1024, 2000, 2048];
/// Of the counts that samples are turned into: 24 bits of this span 0.4 V both ways, as electrodes may be offset.
const VOLTS_PER_COUNT: f64 = 50e-9;
const RAIL: i32 = 0x7f_ffff;
/// A sample that comes so many periods after its time marks a gap; jitter stays below.
const GAP_PERIODS: f64 = 10.0;

/// Why a stream cannot take a wearable's place.
#[derive(Clone, Debug, PartialEq, Error)]
pub enum StreamError {
    /// Too few channels.
    #[error(
        "the stream has {got} channels, 4 are needed: short and long head of the biceps, lateral and long head of the triceps, in this order or by their labels"
    )]
    Channels {
        /// Its channels.
        got: usize,
    },
    /// A rate that nobody designed filters for.
    #[error("the stream gives {got_hz} samples a second; those that can be used give {RATES_HZ:?}")]
    Rate {
        /// Its nominal rate.
        got_hz: f64,
    },
    /// A unit that is none of a voltage.
    #[error("channel {channel} is in '{unit}': volts, millivolts and microvolts are known")]
    Unit {
        /// Which, from 1.
        channel: usize,
        /// Its unit.
        unit: String,
    },
    /// The scale is none.
    #[error(transparent)]
    Scale(#[from] AdcScaleError),
    /// The signal path does not take its rate or levels.
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// What a stream says of one of its channels.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Channel<'a> {
    /// Its name.
    pub label: &'a str,
    /// Its unit; microvolts where it is empty.
    pub unit: &'a str,
}

/// A stream as a wearable.
#[derive(Debug)]
pub struct Streamed {
    bridge: Bridge<CHANNELS>,
    /// Of the stream's channels, those that are taken, with their volts.
    taken: [(usize, f64); CHANNELS],
    period_us: f64,
    newest: Option<Newest>,
}

#[derive(Clone, Copy, Debug)]
struct Newest {
    index: u32,
    at_us: u64,
}

impl Streamed {
    /// One that nobody has calibrated. `boot_id` tells one start of the program from another.
    ///
    /// # Errors
    /// [`StreamError`] where it is not fit.
    pub fn new(boot_id: u32, rate_hz: f64, channels: &[Channel<'_>]) -> Result<Self, StreamError> {
        let rate = RATES_HZ.iter().find(|&&rate| f64::from(rate) == rate_hz);
        let rate = *rate.ok_or(StreamError::Rate { got_hz: rate_hz })?;
        let places = places(channels)?;
        let mut taken = [(0, 0.0); CHANNELS];
        for (taken, (place, channel)) in taken.iter_mut().zip(places) {
            *taken = (place, volts(place, channel.unit)?);
        }
        let board = Board {
            boot_id,
            firmware_hash: [0; 8],
            adc: AdcScale::new(VOLTS_PER_COUNT, 0, -RAIL, RAIL)?,
            rates_hz: RATES_HZ,
        };
        Ok(Self {
            bridge: Bridge::new(board, &illustrative(MUSCLES, rate))?,
            taken,
            period_us: 1e6 / f64::from(rate),
            newest: None,
        })
    }

    /// Takes a sample of all channels that was taken at `at_us` of the stream's clock; frames leave through `send`.
    /// One that is not newer than the last is left out. What is no number counts as a channel at its rail.
    pub fn take(&mut self, sample: &[f32], at_us: u64, send: impl FnMut(&[u8])) {
        let index = match self.newest {
            None => 0,
            Some(newest) if at_us <= newest.at_us => return,
            Some(newest) => {
                let periods = (at_us - newest.at_us) as f64 / self.period_us;
                let step = if periods > GAP_PERIODS {
                    periods.round() as u32
                } else {
                    1
                };
                newest.index.wrapping_add(step)
            }
        };
        self.newest = Some(Newest { index, at_us });
        let counts = self.taken.map(|(place, volts)| {
            let value = sample.get(place).map_or(f64::NAN, |&value| value.into());
            let counts = (value * volts / VOLTS_PER_COUNT).round();
            if counts.is_nan() {
                RAIL
            } else {
                counts.clamp((-RAIL).into(), RAIL.into()) as i32
            }
        });
        let scan = Scan {
            index,
            acquired_us: at_us,
            counts,
        };
        // Indexes and times only rise; what the pipeline still refuses, it counts and the status tells.
        let _counted = self.bridge.push_scan(&scan, send);
    }

    /// Does what a frame of the host asks for at `now_us` of the stream's clock, and answers through `send`.
    pub fn request(&mut self, bytes: &[u8], now_us: u64, send: impl FnMut(&[u8])) {
        self.bridge.request(bytes, now_us, send);
    }

    /// The stream has come up.
    pub fn connected(&mut self) {
        self.bridge.connected();
    }
}

/// The channels that are taken: by their labels where these name all four, in their order otherwise.
fn places<'a>(channels: &[Channel<'a>]) -> Result<[(usize, Channel<'a>); CHANNELS], StreamError> {
    let too_few = StreamError::Channels {
        got: channels.len(),
    };
    let by_label = MUSCLES.map(|muscle| {
        (channels.iter().copied().enumerate()).find(|(_, channel)| names(channel.label, muscle))
    });
    if let [Some(a), Some(b), Some(c), Some(d)] = by_label {
        return Ok([a, b, c, d]);
    }
    let Some(&[a, b, c, d]) = channels.first_chunk() else {
        return Err(too_few);
    };
    Ok([(0, a), (1, b), (2, c), (3, d)])
}

fn names(label: &str, muscle: Muscle) -> bool {
    let label = label.to_lowercase();
    let (which, head) = match muscle {
        Muscle::BicepsShort => ("bic", "short"),
        Muscle::BicepsLong => ("bic", "long"),
        Muscle::TricepsLateral => ("tric", "lat"),
        Muscle::TricepsLong => ("tric", "long"),
        Muscle::Absent | Muscle::Other => return false,
    };
    label.contains(which) && label.contains(head)
}

/// Volts of one of a channel's units.
fn volts(place: usize, unit: &str) -> Result<f64, StreamError> {
    match unit.trim().to_lowercase().as_str() {
        "" | "microvolts" | "microvolt" | "uv" | "µv" | "μv" => Ok(1e-6),
        "millivolts" | "millivolt" | "mv" => Ok(1e-3),
        "volts" | "volt" | "v" => Ok(1.0),
        _ => Err(StreamError::Unit {
            channel: place + 1,
            unit: unit.to_owned(),
        }),
    }
}

#[cfg(test)]
mod tests;

//! Surface EMG as a converter would count it.
//!
//! ```text
//! v = MVC (tone + activation) n(t)  +  floor  +  offset + drift  +  hum  +  artefact   -> ADC counts
//! ```
//!
//! with `n(t)` Gaussian noise of unit variance, shaped by a 35 Hz high-pass and a 110 Hz low-pass (both 2nd
//! order): the interference of many motor units, whose median frequency over 20 to 450 Hz is near 80 Hz, as
//! in the recordings that the tests hold it against. Offset and drift are the electrodes', hum the mains',
//! and the artefact moves with the hand (cables pulled by acceleration) and jumps when a cable is tugged.

use super::muscle::{CHANNEL_NAMES, CHANNELS};
use super::seeded;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use std::f64::consts::TAU;
use tonus_shared::sample::{AdcScale, AdcScaleError, Scan};
use tonus_shared::semg::biquad::{Cascade, CascadeState};
use tonus_shared::semg::design::{self, DesignError};

/// Scans per second.
pub const RATE_HZ: f64 = 1000.0;
/// Time between scans, microseconds.
pub const SCAN_US: u64 = 1000;
/// Amplitude at maximum voluntary contraction, volts RMS: both heads of the biceps, both of the triceps.
const MVC_V: [f64; CHANNELS] = [5.5e-4, 4.5e-4, 3.5e-4, 3.0e-4];
/// Tone at rest, as a share of that.
const REST_TONE: f64 = 0.015;
/// Noise of electrodes and amplifier, volts RMS.
const FLOOR_V: f64 = 2.5e-6;
/// Spread of the electrodes' offsets, volts.
const OFFSET_SD_V: f64 = 1e-2;
/// Wander of the offset: standard deviation in volts, correlation time in seconds.
const DRIFT_SD_V: f64 = 5e-4;
const DRIFT_TIME_S: f64 = 8.0;
/// Mains hum: amplitude in volts, frequency in hertz.
const HUM_V: f64 = 3e-6;
const HUM_HZ: f64 = 50.0;
/// Artefact of the hand's acceleration, volts per m/s^2.
const SWAY_V_S2_PER_M: f64 = 3e-5;
/// Cable tugs: rate per second and channel, height in volts, and how long one lasts in seconds.
const TUG_RATE_HZ: f64 = 0.03;
const TUG_V: f64 = 3e-4;
const TUG_S: f64 = 0.12;

/// The electrodes, the amplifier and its converter, for one session.
#[derive(Debug, Clone)]
pub struct Electrodes {
    scale: AdcScale,
    high_pass: Cascade<f64>,
    low_pass: Cascade<f64>,
    unit_gain: f64,
    channels: [Channel; CHANNELS],
    index: u32,
}

#[derive(Debug, Clone)]
struct Channel {
    rng: ChaCha8Rng,
    high_pass: CascadeState<f64>,
    low_pass: CascadeState<f64>,
    offset_v: f64,
    drift_v: f64,
    hum_phase: f64,
    /// How strongly and which way acceleration along each axis pulls this channel's cable.
    sway: [f64; 3],
    /// Seconds left of a tug, and its sign.
    tug: (f64, f64),
}

/// A simulated front end that cannot be built: a constant of this file contradicts the sEMG code.
#[derive(Debug, Clone, Copy, PartialEq, thiserror::Error)]
pub enum ElectrodesError {
    /// The noise's shape cannot be designed.
    #[error("the simulated sEMG's spectrum: {0}")]
    Spectrum(#[from] DesignError),
    /// The converter's scale is none.
    #[error("the simulated converter: {0}")]
    Converter(#[from] AdcScaleError),
}

/// The converter: 24 bit, 2.4 V reference, gain 6, as an ADS1298 in its usual setting.
///
/// # Errors
/// None in practice: the constants are valid.
pub fn adc_scale() -> Result<AdcScale, AdcScaleError> {
    AdcScale::new(2.4 / 6.0 / 8_388_608.0, 0, -8_388_608, 8_388_607)
}

impl Electrodes {
    /// Electrodes freshly attached: offsets, hum phases and cables are drawn from the seed.
    ///
    /// # Errors
    /// [`ElectrodesError`]; none in practice.
    pub fn new(seed: u64) -> Result<Self, ElectrodesError> {
        let high_pass = design::high_pass(RATE_HZ, 35.0, 2)?;
        let low_pass = design::low_pass(RATE_HZ, 110.0, 2)?;
        Ok(Self {
            scale: adc_scale()?,
            unit_gain: unit_gain(&high_pass, &low_pass),
            high_pass,
            low_pass,
            channels: CHANNEL_NAMES.map(|name| Channel::new(seeded(seed, name))),
            index: 0,
        })
    }

    /// The scale of the counts.
    #[must_use]
    pub fn scale(&self) -> AdcScale {
        self.scale
    }

    /// The next scan, one millisecond after the last: each channel's activation (share of MVC) and the
    /// hand's acceleration in m/s^2.
    pub fn scan(
        &mut self,
        activation: [f64; CHANNELS],
        acceleration_m_per_s2: [f64; 3],
    ) -> Scan<CHANNELS> {
        let acquired_us = u64::from(self.index) * SCAN_US;
        let time_s = f64::from(self.index) / RATE_HZ;
        let mut counts = [0; CHANNELS];
        for (number, channel) in self.channels.iter_mut().enumerate() {
            let white = self.unit_gain * channel.normal();
            let shaped = self.high_pass.step(&mut channel.high_pass, white);
            let shaped = self.low_pass.step(&mut channel.low_pass, shaped);
            let muscle_v = MVC_V[number] * (REST_TONE + activation[number]) * shaped;
            counts[number] = count(
                &self.scale,
                muscle_v + channel.disturbance_v(time_s, acceleration_m_per_s2),
            );
        }
        let scan = Scan {
            index: self.index,
            acquired_us,
            counts,
        };
        self.index = self.index.wrapping_add(1);
        scan
    }
}

impl Channel {
    fn new(mut rng: ChaCha8Rng) -> Self {
        let mut normal = || -> f64 { StandardNormal.sample(&mut rng) };
        let (offset_v, drift_v) = (OFFSET_SD_V * normal(), DRIFT_SD_V * normal());
        let sway = [normal(), normal(), normal()];
        Self {
            high_pass: CascadeState::zero(),
            low_pass: CascadeState::zero(),
            offset_v,
            drift_v,
            hum_phase: rng.random(),
            sway,
            tug: (0.0, 1.0),
            rng,
        }
    }

    fn normal(&mut self) -> f64 {
        StandardNormal.sample(&mut self.rng)
    }

    /// Everything that is not muscle, volts.
    fn disturbance_v(&mut self, time_s: f64, acceleration_m_per_s2: [f64; 3]) -> f64 {
        let keep = (-1.0 / (RATE_HZ * DRIFT_TIME_S)).exp();
        self.drift_v =
            keep * self.drift_v + DRIFT_SD_V * (1.0 - keep * keep).sqrt() * self.normal();
        let begins = self.rng.random::<f64>() < TUG_RATE_HZ / RATE_HZ;
        if begins && self.tug.0 <= 0.0 {
            self.tug = (TUG_S, if self.rng.random() { 1.0 } else { -1.0 });
        }
        let (left_s, sign) = self.tug;
        self.tug.0 = (left_s - 1.0 / RATE_HZ).max(0.0);
        let tug_v = sign * TUG_V * (left_s / TUG_S * TAU / 2.0).sin();
        let sway: f64 = self
            .sway
            .iter()
            .zip(acceleration_m_per_s2)
            .map(|(c, a)| c * a)
            .sum();
        self.offset_v
            + self.drift_v
            + FLOOR_V * self.normal()
            + HUM_V * (TAU * (HUM_HZ * time_s + self.hum_phase)).sin()
            + SWAY_V_S2_PER_M * sway
            + tug_v
    }
}

/// The factor on white noise of unit variance that gives the filtered noise unit variance: one over the
/// root of the impulse response's energy.
fn unit_gain(high_pass: &Cascade<f64>, low_pass: &Cascade<f64>) -> f64 {
    let (mut first, mut second) = (CascadeState::zero(), CascadeState::zero());
    let mut energy = 0.0;
    for n in 0..2000 {
        let impulse = if n == 0 { 1.0 } else { 0.0 };
        let y = low_pass.step(&mut second, high_pass.step(&mut first, impulse));
        energy += y * y;
    }
    1.0 / energy.sqrt()
}

/// The count for a voltage at the electrode, at a rail when beyond it.
#[allow(
    clippy::cast_possible_truncation,
    reason = "clamped to the rails first"
)]
fn count(scale: &AdcScale, volts: f64) -> i32 {
    let (low, high) = scale.rails();
    (volts / scale.volts_per_count())
        .round()
        .clamp(f64::from(low), f64::from(high)) as i32
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Volts of channel `number` for `seconds` at constant activation and a still hand.
    fn record(seed: u64, activation: f64, number: usize, seconds: usize) -> Vec<f64> {
        let mut electrodes = Electrodes::new(seed).unwrap();
        let scale = electrodes.scale();
        (0..seconds * 1000)
            .map(|_| scale.volts(electrodes.scan([activation; CHANNELS], [0.0; 3]).counts[number]))
            .collect()
    }

    /// Root mean square of first differences: blind to offset and drift.
    fn roughness(volts: &[f64]) -> f64 {
        let sum: f64 = volts.windows(2).map(|w| (w[1] - w[0]).powi(2)).sum();
        (sum / (volts.len() - 1) as f64).sqrt()
    }

    #[test]
    fn the_muscle_noise_has_the_stated_amplitude() {
        // At full activation everything else is below 1 % of the power once offset and drift are taken off.
        let volts = record(1, 1.0, 0, 60);
        let mean_square = |v: &[f64]| {
            let mean = v.iter().sum::<f64>() / v.len() as f64;
            v.iter().map(|x| (x - mean).powi(2)).sum::<f64>() / v.len() as f64
        };
        let blocks = volts.chunks(500).map(mean_square).sum::<f64>() / 120.0;
        let expected = MVC_V[0] * (1.0 + REST_TONE);
        assert!(
            (blocks.sqrt() / expected - 1.0).abs() < 0.03,
            "{} against {expected}",
            blocks.sqrt()
        );
    }

    #[test]
    fn amplitude_is_proportional_to_activation() {
        let half = roughness(&record(2, 0.5, 2, 20));
        let whole = roughness(&record(2, 1.0, 2, 20));
        assert!(
            (whole / half - 1.015 / 0.515).abs() < 0.02,
            "{}",
            whole / half
        );
    }

    #[test]
    fn scans_are_numbered_and_timed_by_the_millisecond_and_stay_off_the_rails() {
        let mut electrodes = Electrodes::new(3).unwrap();
        for n in 0..5000_u32 {
            let scan = electrodes.scan([0.8; CHANNELS], [3.0, -2.0, 4.0]);
            assert_eq!((scan.index, scan.acquired_us), (n, u64::from(n) * 1000));
            assert!(scan.counts.iter().all(|&c| !electrodes.scale().at_rail(c)));
        }
    }

    #[test]
    fn channels_and_seeds_are_independent_and_a_seed_repeats_itself() {
        assert_eq!(record(4, 0.3, 1, 2), record(4, 0.3, 1, 2));
        assert_ne!(record(4, 0.3, 1, 2), record(5, 0.3, 1, 2));
        let (a, b) = (record(6, 0.5, 0, 20), record(6, 0.5, 1, 20));
        let d = |v: &[f64]| v.windows(2).map(|w| w[1] - w[0]).collect::<Vec<_>>();
        let (a, b) = (d(&a), d(&b));
        let product = |x: &[f64], y: &[f64]| x.iter().zip(y).map(|(x, y)| x * y).sum::<f64>();
        let correlation = product(&a, &b) / (product(&a, &a) * product(&b, &b)).sqrt();
        assert!(correlation.abs() < 0.05, "{correlation}");
    }

    #[test]
    fn beyond_the_rails_the_converter_saturates() {
        let scale = adc_scale().unwrap();
        assert_eq!(count(&scale, 1.0), 8_388_607);
        assert_eq!(count(&scale, -1.0), -8_388_608);
        assert_eq!(count(&scale, 0.1), 2_097_152);
    }
}

//! The samples of one step, and what they say.

use nalgebra::Vector3;
use tonus_shared::wire::{MAX_CHANNELS, Muscle};

use super::{Estimate, Measured, muscle_name};
use crate::statistics::{mean, median, median_and_spread};

/// Samples a second that are expected: one for each stream packet.
const SAMPLES_HZ: f64 = 100.0;
/// Fewer than this share of the expected samples say too little.
const LEAST_SHARE: f64 = 0.6;
/// A channel may be bad in this share of the samples.
const BAD_SHARE: f64 = 0.1;
/// Means are taken over windows of this many microseconds: the usual half second of a maximum contraction.
const WINDOW_US: u64 = 500_000;
/// Values of a smoothed envelope (5 Hz) that are independent, a second.
const INDEPENDENT_HZ: f64 = 10.0;
/// A hand that moves more while it is to be still: standard deviation on any axis, m. Above what a tracker wanders.
const STILL_M: f64 = 0.03;
/// A sample of the hand so many standard deviations (by the median) from the median is a blunder of the tracker.
const BLUNDER: f64 = 4.0;

#[derive(Debug, Clone, Copy)]
struct Sample {
    at_us: u64,
    envelope_v: [f64; MAX_CHANNELS],
    good: [bool; MAX_CHANNELS],
    hand_m: Option<[f64; 3]>,
}

/// What is collected of one step.
#[derive(Debug, Clone)]
pub(super) struct Measurement {
    settle_us: u64,
    measure_us: u64,
    began_us: Option<u64>,
    now_us: u64,
    samples: Vec<Sample>,
}

impl Measurement {
    pub(super) fn new((settle_s, measure_s): (f64, f64)) -> Self {
        #[allow(
            clippy::cast_possible_truncation,
            clippy::cast_sign_loss,
            reason = "a few seconds"
        )]
        let us = |seconds: f64| (seconds * 1e6) as u64;
        Self {
            settle_us: us(settle_s),
            measure_us: us(measure_s),
            began_us: None,
            now_us: 0,
            samples: Vec::new(),
        }
    }

    /// Takes one sample; the first one begins. True when all that is asked for is there.
    pub(super) fn take(&mut self, at_us: u64, measured: &Measured<'_>) -> bool {
        let began_us = *self.began_us.get_or_insert(at_us);
        self.now_us = self.now_us.max(at_us);
        let so_far_us = self.now_us - began_us;
        if so_far_us >= self.settle_us {
            let mut sample = Sample {
                at_us: self.now_us,
                envelope_v: [0.0; MAX_CHANNELS],
                good: [false; MAX_CHANNELS],
                hand_m: measured
                    .hand_m
                    .filter(|hand| hand.iter().all(|x| x.is_finite())),
            };
            let channels = measured.envelope_v.iter().zip(measured.good);
            for (channel, (&envelope, &good)) in channels.take(MAX_CHANNELS).enumerate() {
                sample.envelope_v[channel] = envelope;
                sample.good[channel] = good && envelope.is_finite();
            }
            self.samples.push(sample);
        }
        so_far_us >= self.settle_us + self.measure_us
    }

    /// Share of the time that is over.
    pub(super) fn progress(&self) -> f64 {
        let whole_us = self.settle_us + self.measure_us;
        let so_far_us = self
            .began_us
            .map_or(0, |began_us| self.now_us.saturating_sub(began_us));
        (so_far_us as f64 / whole_us.max(1) as f64).min(1.0)
    }

    /// What stands against using it: samples missing, channels bad.
    pub(super) fn problem(&self, muscles: &[Muscle]) -> Option<String> {
        let expected = self.measure_us as f64 * 1e-6 * SAMPLES_HZ;
        let got = self.samples.len() as f64;
        if got < LEAST_SHARE * expected {
            return Some(format!(
                "Only {got} of {expected} samples arrived: go nearer to the receiver, then do this step again."
            ));
        }
        let bad = muscles.iter().enumerate().filter_map(|(channel, muscle)| {
            let bad = self.samples.iter().filter(|sample| !sample.good[channel]);
            let share = bad.count() as f64 / got;
            (share > BAD_SHARE).then(|| {
                format!(
                    "{} ({:.0} % of the time)",
                    muscle_name(*muscle),
                    100.0 * share
                )
            })
        });
        let bad: Vec<String> = bad.collect();
        (!bad.is_empty()).then(|| {
            format!(
                "Saturated, flat or off the skin: {}. Clean the skin, press the electrodes on, keep cables still, then do \
                 this step again.",
                bad.join(", ")
            )
        })
    }

    fn envelope_v(&self, channel: usize) -> impl Iterator<Item = (u64, f64)> + '_ {
        let good = self
            .samples
            .iter()
            .filter(move |sample| sample.good[channel]);
        good.map(move |sample| (sample.at_us, sample.envelope_v[channel]))
    }

    /// A channel's mean, and how well the mean is known; zero samples give none.
    pub(super) fn mean(&self, channel: usize) -> Option<Estimate> {
        let values: Vec<f64> = self.envelope_v(channel).map(|(_, v)| v).collect();
        estimate(&values)
    }

    /// The highest mean over half a second.
    pub(super) fn peak(&self, channel: usize) -> Option<Estimate> {
        let samples: Vec<(u64, f64)> = self.envelope_v(channel).collect();
        let mut first = 0;
        let mut best: Option<Estimate> = None;
        for end in 1..=samples.len() {
            while samples[end - 1].0 - samples[first].0 >= WINDOW_US {
                first += 1;
            }
            let whole = samples[end - 1].0 - samples[0].0 >= WINDOW_US * 9 / 10;
            let values: Vec<f64> = samples[first..end].iter().map(|(_, v)| *v).collect();
            let enough = values.len() as f64 >= LEAST_SHARE * SAMPLES_HZ * 0.5;
            let here = estimate(&values).filter(|_| whole && enough);
            if here.is_some_and(|here| best.is_none_or(|best| here.value > best.value)) {
                best = here;
            }
        }
        best
    }

    /// How many times the median of the half-second means the highest one is.
    pub(super) fn unsteadiness(&self, channel: usize) -> Option<f64> {
        let samples: Vec<(u64, f64)> = self.envelope_v(channel).collect();
        let (first_us, _) = *samples.first()?;
        let mut means = Vec::new();
        for window in
            samples.chunk_by(|a, b| (a.0 - first_us) / WINDOW_US == (b.0 - first_us) / WINDOW_US)
        {
            let values: Vec<f64> = window.iter().map(|(_, v)| *v).collect();
            means.push(mean(&values));
        }
        let highest = means.iter().copied().fold(0.0, f64::max);
        let middle = median(&means);
        (middle > 0.0).then_some(highest / middle)
    }

    /// Where the hand was, blunders left out, or why that cannot be said.
    pub(super) fn hand(&self) -> Result<Vector3<f64>, String> {
        let hands: Vec<[f64; 3]> = self.samples.iter().filter_map(|s| s.hand_m).collect();
        if (hands.len() as f64) < 0.5 * self.samples.len() as f64 || hands.is_empty() {
            return Err(format!(
                "The hand was seen in {} of {} samples: hold it over the tracker, palm open, then do this step again.",
                hands.len(),
                self.samples.len()
            ));
        }
        let mut place = Vector3::zeros();
        for axis in 0..3 {
            let values: Vec<f64> = hands.iter().map(|hand| hand[axis]).collect();
            let (middle, std_m) = median_and_spread(&values);
            if std_m > STILL_M {
                return Err(format!(
                    "The hand moved by {:.0} mm: hold it still, then do this step again.",
                    1e3 * std_m
                ));
            }
            let near = |x: &f64| (x - middle).abs() <= BLUNDER * std_m;
            let sound: Vec<f64> = values.iter().copied().filter(near).collect();
            // More than half of them lie within one median deviation, so there are some.
            place[axis] = mean(&sound);
        }
        Ok(place)
    }
}

fn estimate(values: &[f64]) -> Option<Estimate> {
    if values.is_empty() {
        return None;
    }
    let count = values.len() as f64;
    let middle = mean(values);
    let square = values.iter().map(|v| (v - middle).powi(2)).sum::<f64>() / count;
    let independent = (count / SAMPLES_HZ * INDEPENDENT_HZ).max(1.0);
    Some(Estimate {
        value: middle,
        std: (square / independent).sqrt(),
    })
}

//! A simulated hand tracker, like a Leap Motion: irregular frames, jitter, a wandering bias, occlusions,
//! latency.
//!
//! White jitter of 1 to 2 mm says little about how hard recognition is: averaged over the 200 frames of
//! an action it shrinks to a tenth of a millimetre. What stays is everything that moves slowly: where the
//! frame's origin is thought to be, which point of the hand the model takes for its centre, how the
//! wearer happens to sit. It is modelled as an Ornstein-Uhlenbeck process on each axis,
//!
//! ```text
//! E b(t) = 0,   E b(t) b(t') = bias_sd^2 exp(-|t - t'| / bias_time),
//! ```
//!
//! with a correlation time of an action's length, so that one action sees about one bias. The **stated
//! noise** is [`TrackerNoise::STATED`]: 28 mm of bias, 1.5 mm of jitter.

use super::seeded;
use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Errors of the tracker's positions, alike and independent on the three axes.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackerNoise {
    /// Standard deviation of the white jitter, metres.
    pub jitter_sd_m: f64,
    /// Standard deviation of the slow bias, metres.
    pub bias_sd_m: f64,
    /// Correlation time of the bias, seconds.
    pub bias_time_s: f64,
}

impl TrackerNoise {
    /// The noise that objects are to be recognised under.
    pub const STATED: Self = Self {
        jitter_sd_m: 0.0015,
        bias_sd_m: 0.028,
        bias_time_s: 2.0,
    };
    /// Next to none: a hundredth of a millimetre of jitter, as a resolution.
    pub const NONE: Self = Self {
        jitter_sd_m: 1e-5,
        bias_sd_m: 0.0,
        bias_time_s: 2.0,
    };

    /// Covariance of the errors of two frames `apart_s` seconds apart on one axis, square metres; the jitter
    /// is not in it, it adds `jitter_sd_m^2` to a frame's variance.
    #[must_use]
    pub fn bias_covariance_m2(&self, apart_s: f64) -> f64 {
        self.bias_sd_m * self.bias_sd_m * (-apart_s.abs() / self.bias_time_s).exp()
    }
}

/// The errors of successive frames.
#[derive(Debug, Clone)]
pub struct NoiseSource {
    noise: TrackerNoise,
    bias_m: [f64; 3],
    last_us: u64,
    rng: ChaCha8Rng,
}

impl NoiseSource {
    /// Starts with a bias drawn from its stationary distribution.
    #[must_use]
    pub fn new(noise: TrackerNoise, seed: u64) -> Self {
        let mut rng = seeded(seed, "tracker noise");
        let bias_m = std::array::from_fn(|_| noise.bias_sd_m * normal(&mut rng));
        Self {
            noise,
            bias_m,
            last_us: 0,
            rng,
        }
    }

    /// The error of a frame at `at_us` (not earlier than the frame before), metres.
    pub fn error_m(&mut self, at_us: u64) -> [f64; 3] {
        #[allow(
            clippy::cast_precision_loss,
            reason = "frame intervals are far below 2^53 us"
        )]
        let apart_s = at_us.saturating_sub(self.last_us) as f64 * 1e-6;
        self.last_us = at_us;
        // The exact transition of the process: no error however long the gap.
        let keep = (-apart_s / self.noise.bias_time_s).exp();
        let fresh = self.noise.bias_sd_m * (1.0 - keep * keep).sqrt();
        for bias in &mut self.bias_m {
            *bias = keep * *bias + fresh * normal(&mut self.rng);
        }
        self.bias_m
            .map(|bias| bias + self.noise.jitter_sd_m * normal(&mut self.rng))
    }
}

fn normal(rng: &mut ChaCha8Rng) -> f64 {
    StandardNormal.sample(rng)
}

/// One frame in which the hand was seen.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct TrackedHand {
    /// Number of the frame; occluded frames count too.
    pub frame: u32,
    /// When the picture was taken, microseconds.
    pub exposed_us: u64,
    /// When the position reached the host, microseconds.
    pub arrived_us: u64,
    /// Position of the hand, shoulder frame, metres.
    pub position_m: [f64; 3],
}

/// Mean time between frames, microseconds: 110 Hz.
const FRAME_US: f64 = 9_091.0;
/// Standard deviation of that time, and the shortest, microseconds.
const FRAME_SD_US: f64 = 900.0;
const SHORTEST_FRAME_US: f64 = 6_000.0;
/// Occlusions begin at this rate while the hand is seen, per second, and last between these times.
const OCCLUSIONS_PER_S: f64 = 0.1;
const OCCLUSION_US: [u64; 2] = [50_000, 200_000];
/// From picture to host, microseconds: least, and the range on top.
const LATENCY_US: [u64; 2] = [10_000, 6_000];

/// The tracker: it decides when frames are taken.
#[derive(Debug, Clone)]
pub struct Tracker {
    source: NoiseSource,
    rng: ChaCha8Rng,
    frame: u32,
    next_us: u64,
    occluded_until_us: u64,
    last_arrival_us: u64,
}

impl Tracker {
    /// A tracker whose first frame comes within one interval of time zero.
    #[must_use]
    pub fn new(noise: TrackerNoise, seed: u64) -> Self {
        let mut rng = seeded(seed, "tracker frames");
        let next_us = rng.random_range(0..9_000);
        Self {
            source: NoiseSource::new(noise, seed),
            rng,
            frame: 0,
            next_us,
            occluded_until_us: 0,
            last_arrival_us: 0,
        }
    }

    /// When the next picture is taken, microseconds.
    #[must_use]
    pub fn next_us(&self) -> u64 {
        self.next_us
    }

    /// Takes the picture of a hand at `position_m` (metres, at [`Tracker::next_us`]); `None` when occluded.
    pub fn expose(&mut self, position_m: [f64; 3]) -> Option<TrackedHand> {
        let (frame, exposed_us) = (self.frame, self.next_us);
        let error_m = self.source.error_m(exposed_us);
        let interval_us = self.interval_us();
        let begins = self.rng.random::<f64>() < OCCLUSIONS_PER_S * FRAME_US * 1e-6;
        let lasts_us = self.rng.random_range(OCCLUSION_US[0]..=OCCLUSION_US[1]);
        let latency_us = LATENCY_US[0] + self.rng.random_range(0..=LATENCY_US[1]);
        self.frame = self.frame.wrapping_add(1);
        self.next_us += interval_us;
        if begins && exposed_us >= self.occluded_until_us {
            self.occluded_until_us = exposed_us + lasts_us;
        }
        if exposed_us < self.occluded_until_us {
            return None;
        }
        // One stream over a local socket: frames keep their order.
        self.last_arrival_us = self.last_arrival_us.max(exposed_us + latency_us);
        Some(TrackedHand {
            frame,
            exposed_us,
            arrived_us: self.last_arrival_us,
            position_m: std::array::from_fn(|axis| position_m[axis] + error_m[axis]),
        })
    }

    #[allow(
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "at least 6000, and normal noise stays far below 2^53"
    )]
    fn interval_us(&mut self) -> u64 {
        (FRAME_US + FRAME_SD_US * normal(&mut self.rng)).max(SHORTEST_FRAME_US) as u64
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn frames_are_about_110_a_second_irregular_late_and_in_order() {
        let mut tracker = Tracker::new(TrackerNoise::STATED, 1);
        let mut seen = Vec::new();
        while tracker.next_us() < 100_000_000 {
            seen.extend(tracker.expose([0.4, 0.0, -0.2]));
        }
        let total = seen.last().unwrap().frame + 1;
        assert!((10_900..11_100).contains(&total), "{total} frames in 100 s");
        let missing = 1.0 - seen.len() as f64 / f64::from(total);
        assert!((0.002..0.05).contains(&missing), "occluded share {missing}");
        for pair in seen.windows(2) {
            assert!(pair[1].exposed_us >= pair[0].exposed_us + 6_000);
            assert!(pair[1].arrived_us >= pair[0].arrived_us);
            assert!(
                pair[1].exposed_us - pair[0].exposed_us < 300_000,
                "occlusions are short"
            );
        }
        for hand in &seen {
            assert!((10_000..=16_000).contains(&(hand.arrived_us - hand.exposed_us)));
        }
    }

    #[test]
    fn errors_have_the_stated_covariance() {
        // 4000 independent sources, frames at 0, 0.5 and 2 s.
        let noise = TrackerNoise::STATED;
        let times_us = [0, 500_000, 2_000_000];
        const RUNS: u64 = 4000;
        let mut sums = [[0.0; 3]; 3];
        for seed in 0..RUNS {
            let mut source = NoiseSource::new(noise, seed);
            let errors = times_us.map(|at_us| source.error_m(at_us));
            for (i, a) in errors.iter().enumerate() {
                for (j, b) in errors.iter().enumerate() {
                    sums[i][j] +=
                        a.iter().zip(b).map(|(a, b)| a * b).sum::<f64>() / (3 * RUNS) as f64;
                }
            }
        }
        let variance = 0.028_f64.powi(2);
        for i in 0..3 {
            for j in 0..3 {
                let apart = (times_us[i].abs_diff(times_us[j])) as f64 * 1e-6;
                let jitter = if i == j { 0.0015_f64.powi(2) } else { 0.0 };
                let expected = variance * (-apart / 2.0).exp() + jitter;
                // Five standard errors of 12000 products.
                assert!(
                    (sums[i][j] - expected).abs() < 5.0 * variance * (2.0_f64 / 12_000.0).sqrt()
                );
            }
        }
    }

    #[test]
    fn without_noise_the_hand_is_where_it_is() {
        let mut tracker = Tracker::new(TrackerNoise::NONE, 3);
        for _ in 0..1000 {
            if let Some(hand) = tracker.expose([0.1, 0.2, 0.3]) {
                assert!(
                    hand.position_m
                        .iter()
                        .zip([0.1, 0.2, 0.3])
                        .all(|(a, b)| (a - b).abs() < 1e-4)
                );
            }
        }
    }
}

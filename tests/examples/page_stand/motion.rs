//! What moves: hand, robot, muscles, each a function of time.

use std::f64::consts::TAU;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus::live::{PathPoint, Trace};

/// A movement begins so often, and lasts so long, seconds.
pub(crate) const PERIOD_S: f64 = 5.0;
pub(crate) const MOVEMENT_S: f64 = 2.0;

/// Which movement this is, and how far it has come, if one is under way.
pub(crate) fn phase(t_s: f64) -> (usize, Option<f64>) {
    let number = (t_s / PERIOD_S).floor();
    let share = (t_s - number * PERIOD_S) / MOVEMENT_S;
    (number as usize, (share < 1.0).then_some(share))
}

/// From 0 to 1 and back, at rest at both ends.
fn there_and_back(share: f64) -> f64 {
    (1.0 - (TAU * share).cos()) / 2.0
}

/// The hand, shoulder frame, metres.
pub(crate) fn hand_m(share: f64) -> [f64; 3] {
    let way = there_and_back(share);
    [
        0.30 + 0.12 * way,
        -0.10 + 0.25 * way,
        -0.35 + 0.30 * way * (1.5 - 0.5 * way),
    ]
}

/// The robot's hand, base frame, metres.
pub(crate) fn robot_m(share: f64) -> [f64; 3] {
    let way = there_and_back(share);
    [0.55 - 0.15 * way, 0.20 - 0.30 * way, 0.35 + 0.20 * way]
}

/// A seven-jointed arm whose last joint is the hand: a picture of one, no kinematics.
pub(crate) fn joints_m(tool_m: [f64; 3]) -> Vec<[f64; 3]> {
    (0..=7)
        .map(|joint| {
            let along = f64::from(joint) / 7.0;
            let bend = 0.35 * (along * std::f64::consts::PI).sin();
            [
                tool_m[0] * along,
                tool_m[1] * along,
                tool_m[2] * along + bend,
            ]
        })
        .collect()
}

/// Robot stiffness, N/m.
pub(crate) fn firmness(share: f64) -> [f64; 3] {
    [1400.0, 1500.0, 1450.0 + 500.0 * there_and_back(share)]
}

/// What is expected of a path from here to its end, wider the later.
pub(crate) fn ahead(share: f64, place: fn(f64) -> [f64; 3]) -> Vec<PathPoint> {
    let points = 24;
    (0..=points)
        .map(|point| {
            let later = (1.0 - share) * f64::from(point) / f64::from(points);
            PathPoint {
                in_s: later * MOVEMENT_S,
                mean_m: place(share + later),
                std_m: [
                    0.006 + 0.02 * later,
                    0.006 + 0.03 * later,
                    0.006 + 0.015 * later,
                ],
            }
        })
        .collect()
}

/// Muscles as they would be measured.
pub(crate) struct Muscles {
    channels: usize,
    noise: ChaCha8Rng,
    /// Raw scans so far: a thousand a second.
    scans: u64,
}

impl Muscles {
    pub(crate) fn new(channels: usize) -> Self {
        Self {
            channels,
            noise: ChaCha8Rng::seed_from_u64(5),
            scans: 0,
        }
    }

    /// Share of the maximum in a channel.
    pub(crate) fn envelope(&self, channel: usize, t_s: f64, effort: f64) -> f64 {
        let pace = 0.9 + 0.1 * channel as f64;
        let moving = phase(t_s).1.map_or(0.0, there_and_back);
        0.03 + (0.35 * moving + 0.8 * effort) * (0.75 + 0.25 * (pace * t_s).sin()) / pace
    }

    /// All samples since the call before, with or without raw ones.
    pub(crate) fn trace(&mut self, at_us: u64, effort: f64, raw: bool) -> Trace {
        let mut trace = Trace {
            envelopes: vec![Vec::new(); self.channels],
            stiffness_n_per_m: vec![Vec::new(); 3],
            raw_uv: vec![Vec::new(); self.channels],
            ..Trace::default()
        };
        while self.scans * 1000 < at_us {
            let t_s = self.scans as f64 / 1e3;
            for channel in 0..self.channels {
                let level = self.envelope(channel, t_s, effort);
                // As between skin and electrode: much larger than the muscle.
                let offset_uv = 9_000.0 * (channel as f64 - 1.4);
                let white: f64 = self.noise.random_range(-1.0..1.0);
                if raw {
                    trace.raw_uv[channel].push((offset_uv + 900.0 * level * white) as f32);
                }
                if self.scans.is_multiple_of(10) {
                    trace.envelopes[channel].push(level as f32);
                }
            }
            if raw {
                trace.raw_t_s.push(t_s);
            }
            if self.scans.is_multiple_of(10) {
                let stiffness = self.stiffness(t_s, effort);
                for (row, value) in trace.stiffness_n_per_m.iter_mut().zip(stiffness) {
                    row.push(value as f32);
                }
                trace.t_s.push(t_s);
            }
            self.scans += 1;
        }
        trace
    }

    /// Stiffness of the hand, N/m.
    pub(crate) fn stiffness(&self, t_s: f64, effort: f64) -> [f64; 3] {
        let level = self.envelope(0, t_s, effort);
        [
            1180.0 + 900.0 * level,
            1140.0 + 500.0 * level,
            1120.0 + 400.0 * level,
        ]
    }
}

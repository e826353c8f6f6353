//! A guide that measures simulated people, and everything that they can do wrong.

use nalgebra::{Vector3, Vector4};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus_shared::stiffness::{ArmPosture, Segments, deflection};

use super::*;

mod back;
mod guide;
mod pattern;
mod profile;

const MUSCLES: [Muscle; 4] = [
    Muscle::BicepsShort,
    Muscle::BicepsLong,
    Muscle::TricepsLateral,
    Muscle::TricepsLong,
];

fn person() -> Person {
    Person {
        name: "S01".into(),
        body_mass_kg: 75.0,
        body_height_m: 1.75,
        mains_hz: Some(50),
    }
}

/// Someone who does what is asked.
struct Simulated {
    l1: f64,
    l2: f64,
    joints: [f64; 4],
    rest_v: [f64; 4],
    mvc_v: [f64; 4],
    /// How loud bending and stretching are, share of the maximum.
    flex: [f64; 4],
    extend: [f64; 4],
    hand_noise_m: f64,
    rng: ChaCha8Rng,
    at_us: u64,
}

impl Simulated {
    fn new(seed: u64) -> Self {
        Self {
            l1: 2.0,
            l2: 1.2,
            joints: [15.0, 12.0, 10.0, 14.0],
            rest_v: [4e-6, 6e-6, 3e-6, 5e-6],
            mvc_v: [300e-6, 420e-6, 250e-6, 180e-6],
            flex: [0.5, 0.4, 0.05, 0.06],
            extend: [0.06, 0.05, 0.4, 0.5],
            hand_noise_m: 0.0,
            rng: ChaCha8Rng::seed_from_u64(seed),
            at_us: 5_000_000,
        }
    }

    fn shares(&self, task: &Task) -> [f64; 4] {
        match task {
            Task::Free | Task::Rest => [0.0; 4],
            Task::Contract => [1.0; 4],
            Task::Flex => self.flex,
            Task::Extend => self.extend,
            Task::Hold(hold) => [hold.effort; 4],
        }
    }

    fn envelopes_v(&self, task: &Task) -> [f64; 4] {
        let shares = self.shares(task);
        std::array::from_fn(|c| self.rest_v[c] + shares[c] * (self.mvc_v[c] - self.rest_v[c]))
    }

    fn hand_m(&self, task: &Task) -> Option<[f64; 3]> {
        let Task::Hold(hold) = task else { return None };
        let segments = Segments::new(75.0, 1.75).unwrap();
        let there = Vector3::from(hold.hand_m);
        let posture = ArmPosture::from_hand_and_swivel(&segments, &there, 0.0).unwrap();
        let decay = (-self.l2 * 4.0 * hold.effort).exp();
        let c = 1.0 + self.l1 * (1.0 - decay) / (1.0 + decay);
        let joints = Vector4::from(self.joints) * c;
        let moved = deflection(&segments, &posture, &joints, &hold.force_n.into()).unwrap();
        Some((there + moved).into())
    }

    /// A hundred times a second for so long: what `spoil` leaves of the truth.
    fn give(
        &mut self,
        seconds: f64,
        task: &Task,
        mut take: impl FnMut(u64, &Measured<'_>),
        spoil: impl Fn(f64, &mut [f64; 4], &mut [bool; 4], &mut Option<[f64; 3]>),
    ) {
        let count = (seconds * 100.0) as u32;
        for tick in 0..count {
            self.at_us += 10_000;
            let mut envelopes = self.envelopes_v(task);
            let mut good = [true; 4];
            let noise = self.hand_noise_m;
            let hand = self.hand_m(task).map(|hand| {
                hand.map(|x| {
                    let error: f64 = StandardNormal.sample(&mut self.rng);
                    x + noise * error
                })
            });
            let mut hand = hand;
            spoil(f64::from(tick) * 0.01, &mut envelopes, &mut good, &mut hand);
            let measured = Measured {
                envelope_v: &envelopes,
                good: &good,
                hand_m: hand,
            };
            take(self.at_us, &measured);
        }
    }
}

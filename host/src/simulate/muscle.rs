//! How hard four muscles of the upper arm work, from the load in the hand.
//!
//! A simplified elbow: the muscle that works against the load (the flexors for a lift, the extensors for the
//! band) is activated in proportion to the load's moment over the person's strength; its antagonist
//! co-contracts at a fixed share. On grasping, nobody knows the weight exactly: activation overshoots,
//! then relaxes to what holding needs, so a heavy object overshoots by more. From trial to trial
//! everything varies by a gain.
//!
//! Channels: biceps short head, biceps long head, triceps lateral head, triceps long head.

use super::skills::{Latent, Skill, minimum_jerk};
use rand::Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus_shared::stiffness::GRAVITY_M_S2;

/// Channels of sEMG that the wearer carries.
pub const CHANNELS: usize = 4;
/// Their names, in their order.
pub const CHANNEL_NAMES: [&str; CHANNELS] = [
    "biceps short",
    "biceps long",
    "triceps lateral",
    "triceps long",
];
/// Moment of the elbow at maximum voluntary contraction, N m.
const STRENGTH_N_M: f64 = 35.0;
/// Horizontal distance from the elbow to the load, metres.
const LEVER_M: f64 = 0.33;
/// Moment that the raised forearm and hand need by themselves, N m.
const FOREARM_N_M: f64 = 1.8;
/// Elastic band: stiffness N/m, and the y beyond which it is taut, metres.
const BAND_N_PER_M: f64 = 130.0;
const BAND_TAUT_M: f64 = 0.0;
/// How far activation overshoots what holding needs, as a share of it (median over trials).
const OVERSHOOT: f64 = 0.5;
/// Share of each head when its muscle works, and when its antagonist does and it co-contracts.
const WORKING: [f64; 2] = [1.0, 0.9];
const CO_CONTRACTING: [f64; 2] = [0.55, 0.45];
/// Standard deviations of the logarithms of the gains, trial to trial.
const COMMON_GAIN_SD: f64 = 0.05;
const CHANNEL_GAIN_SD: f64 = 0.05;
const OVERSHOOT_SD: f64 = 0.2;
/// Activation is drawn from here: muscles cannot exceed a maximum contraction.
const LARGEST: f64 = 1.0;

/// How one execution's muscles differ from the usual.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Vigour {
    /// Gain of each channel.
    gains: [f64; CHANNELS],
    /// Overshoot on grasping, as a share of the load's activation.
    overshoot: f64,
}

impl Vigour {
    /// The median trial.
    pub const USUAL: Self = Self {
        gains: [1.0; CHANNELS],
        overshoot: OVERSHOOT,
    };

    /// Draws one trial's gains: log-normal, partly common to all channels.
    pub fn sample<R: Rng + ?Sized>(rng: &mut R) -> Self {
        let mut gain = |sd: f64| -> f64 {
            let z: f64 = StandardNormal.sample(rng);
            (sd * z).exp()
        };
        let common = gain(COMMON_GAIN_SD);
        let overshoot = OVERSHOOT * gain(OVERSHOOT_SD);
        Self {
            gains: std::array::from_fn(|_| common * gain(CHANNEL_GAIN_SD)),
            overshoot,
        }
    }
}

/// Mass of what a skill lifts, kg; none for the hand-over and the empty hand.
#[must_use]
pub fn load_kg(skill: Skill) -> f64 {
    match skill {
        Skill::LiftFilter => 3.5,
        Skill::LiftBook => 1.6,
        Skill::LiftBottle => 0.5,
        Skill::Pick | Skill::Place => 1.0,
        Skill::HandOver | Skill::Pull | Skill::Reach | Skill::Wave => 0.0,
    }
}

/// The moment that the elbow must bear at phase `s`, as a share of its strength, before gains.
///
/// Robot stiffness is scripted from this too: it is what person and robot have in common.
#[must_use]
pub fn demand(skill: Skill, latent: &Latent, overshoot: f64, s: f64) -> f64 {
    let forearm = FOREARM_N_M * minimum_jerk(s / 0.2);
    let weight = load_kg(skill) * GRAVITY_M_S2 * LEVER_M;
    let load = match skill {
        Skill::HandOver | Skill::Pull => {
            let y_m = skill.position_m(latent, s)[1];
            BAND_N_PER_M * (y_m - BAND_TAUT_M).max(0.0) * LEVER_M
        }
        Skill::LiftFilter | Skill::LiftBook | Skill::LiftBottle => {
            weight * (minimum_jerk((s - 0.42) / 0.12) + overshoot * surge((s - 0.44) / 0.10))
        }
        Skill::Reach | Skill::Wave => 0.0,
        Skill::Pick => {
            weight * (minimum_jerk((s - 0.02) / 0.12) + overshoot * surge((s - 0.04) / 0.10))
        }
        // In the hand already, at rest before; put down at the end.
        Skill::Place => weight * (minimum_jerk(s / 0.10) - minimum_jerk((s - 0.88) / 0.12)),
    };
    (forearm + load) / STRENGTH_N_M
}

/// Activation of each channel at phase `s`, as a share of maximum voluntary contraction, 0 to 1.
#[must_use]
pub fn activation(skill: Skill, latent: &Latent, vigour: &Vigour, s: f64) -> [f64; CHANNELS] {
    let demand = demand(skill, latent, vigour.overshoot, s);
    let (biceps, triceps) = match skill {
        Skill::HandOver | Skill::Pull => (CO_CONTRACTING, WORKING),
        Skill::LiftFilter
        | Skill::LiftBook
        | Skill::LiftBottle
        | Skill::Reach
        | Skill::Pick
        | Skill::Place
        | Skill::Wave => (WORKING, CO_CONTRACTING),
    };
    let shares = [biceps[0], biceps[1], triceps[0], triceps[1]];
    std::array::from_fn(|channel| (demand * shares[channel] * vigour.gains[channel]).min(LARGEST))
}

/// A quick rise to 1 at `u = 1` and a slower relaxation: `u^2 exp(2 (1 - u))` from `u = 0` on.
fn surge(u: f64) -> f64 {
    if u > 0.0 {
        u * u * (2.0 * (1.0 - u)).exp()
    } else {
        0.0
    }
}

#[cfg(test)]
mod tests {
    use super::*;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    fn biceps(skill: Skill, s: f64) -> f64 {
        activation(skill, &Latent::default(), &Vigour::USUAL, s)[0]
    }

    #[test]
    fn heavier_objects_take_more_and_overshoot_by_more() {
        let overshoot = |skill| {
            let peak = (0..=1000)
                .map(|n| biceps(skill, f64::from(n) / 1000.0))
                .fold(0.0, f64::max);
            peak - biceps(skill, 1.0)
        };
        for (heavier, lighter) in [
            (Skill::LiftFilter, Skill::LiftBook),
            (Skill::LiftBook, Skill::LiftBottle),
        ] {
            assert!(biceps(heavier, 1.0) > 1.5 * biceps(lighter, 1.0));
            assert!(overshoot(heavier) > 1.5 * overshoot(lighter));
        }
        // Statics: (3.5 kg * g * 0.33 m + 1.8 N m) / 35 N m.
        assert!((biceps(Skill::LiftFilter, 1.0) - 0.375_1).abs() < 0.005);
    }

    #[test]
    fn before_the_grasp_all_lifts_feel_alike() {
        for s in [0.0, 0.2, 0.4] {
            assert_eq!(biceps(Skill::LiftFilter, s), biceps(Skill::LiftBottle, s));
        }
        assert_eq!(biceps(Skill::LiftFilter, 0.0), 0.0);
    }

    #[test]
    fn a_longer_pull_works_the_extensors_more() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        let triceps = |y| {
            let latent = super::super::skills::hand_over_to(y, &mut rng);
            activation(Skill::HandOver, &latent, &Vigour::USUAL, 1.0)
        };
        let levels = [0.06, 0.2, 0.32].map(triceps);
        assert!(levels.windows(2).all(|pair| pair[1][2] > 1.4 * pair[0][2]));
        assert!(
            levels
                .iter()
                .all(|level| level[2] > level[0] && level[0] > 0.02)
        );
    }

    #[test]
    fn gains_vary_by_what_is_stated_and_activation_stays_within_a_contraction() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        let logs: Vec<f64> = (0..20_000)
            .map(|_| Vigour::sample(&mut rng).gains[1].ln())
            .collect();
        let variance = logs.iter().map(|l| l * l).sum::<f64>() / logs.len() as f64;
        assert!((variance.sqrt() - COMMON_GAIN_SD.hypot(CHANNEL_GAIN_SD)).abs() < 0.002);
        for _ in 0..200 {
            let (vigour, skill) = (
                Vigour::sample(&mut rng),
                Skill::ALL[rng.next_u32() as usize % 4],
            );
            let latent = skill.sample(&mut rng);
            for n in 0..=200 {
                let levels = activation(skill, &latent, &vigour, f64::from(n) / 200.0);
                assert!(
                    levels.iter().all(|a| (0.0..=1.0).contains(a)),
                    "{skill:?} {levels:?}"
                );
            }
        }
    }
}

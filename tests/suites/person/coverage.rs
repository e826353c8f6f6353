//! Intervals are as wide as they say.

use nalgebra::{Vector3, Vector4};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, Normal, Uniform};
use tonus::calibration::{Guide, Hold, Measured, PARAMETERS, Person, Task};
use tonus_shared::stiffness::{ArmPosture, Segments, deflection};
use tonus_shared::wire::Muscle;

const PEOPLE: usize = 200;
/// The tracker wanders by this much from hold to hold, m, on each axis.
const WANDER_M: f64 = 0.001;
/// And trembles by this much from picture to picture.
const JITTER_M: f64 = 0.0015;

const MUSCLES: [Muscle; 4] = [
    Muscle::BicepsShort,
    Muscle::BicepsLong,
    Muscle::TricepsLateral,
    Muscle::TricepsLong,
];
const REST_V: [f64; 4] = [4e-6, 6e-6, 3e-6, 5e-6];
const MVC_V: [f64; 4] = [300e-6, 420e-6, 250e-6, 180e-6];

/// `l1`, `l2`, four `Kbar`.
fn drawn(rng: &mut ChaCha8Rng) -> [f64; PARAMETERS] {
    let spans: [(f64, f64); PARAMETERS] = [
        (0.5, 5.0),
        (0.5, 3.0),
        (9.0, 22.0),
        (9.0, 22.0),
        (8.0, 20.0),
        (8.0, 20.0),
    ];
    spans.map(|(low, high)| Uniform::new(low.ln(), high.ln()).unwrap().sample(rng).exp())
}

/// Where the hand of these parameters is in a hold.
fn hand(parameters: &[f64; PARAMETERS], body: &Person, hold: &Hold) -> Vector3<f64> {
    let segments = Segments::new(body.body_mass_kg, body.body_height_m).unwrap();
    let there = Vector3::from(hold.hand_m);
    let posture = ArmPosture::from_hand_and_swivel(&segments, &there, 0.0).unwrap();
    let [l1, l2, k @ ..] = *parameters;
    // Eq. 8 as printed; the four heads at one effort make four times the activation.
    let decay = (-l2 * 4.0 * hold.effort).exp();
    let joints = Vector4::from(k) * (1.0 + l1 * (1.0 - decay) / (1.0 + decay));
    there + deflection(&segments, &posture, &joints, &hold.force_n.into()).unwrap()
}

fn share(task: &Task) -> f64 {
    match task {
        Task::Free | Task::Rest => 0.0,
        Task::Contract => 1.0,
        Task::Flex | Task::Extend => 0.3,
        Task::Hold(hold) => hold.effort,
    }
}

fn calibrated(parameters: &[f64; PARAMETERS], body: &Person, rng: &mut ChaCha8Rng) -> Guide {
    let (wander, jitter) = (
        Normal::new(0.0, WANDER_M).unwrap(),
        Normal::new(0.0, JITTER_M).unwrap(),
    );
    let mut guide = Guide::begin(body, &MUSCLES, 1000.0, 1).unwrap();
    let mut at_us = 0;
    while guide.result().is_none() {
        let task = guide.task();
        let share = share(&task);
        let envelope_v: [f64; 4] =
            std::array::from_fn(|c| REST_V[c] + share * (MVC_V[c] - REST_V[c]));
        let place = match &task {
            Task::Hold(hold) => {
                Some(hand(parameters, body, hold) + Vector3::from_fn(|_, _| wander.sample(rng)))
            }
            _ => None,
        };
        guide.start();
        while guide.view().measuring {
            at_us += 10_000;
            let hand_m = place.map(|place| place.map(|x| x + jitter.sample(rng)).into());
            guide.sample(
                at_us,
                &Measured {
                    envelope_v: &envelope_v,
                    good: &[true; 4],
                    hand_m,
                },
            );
        }
        assert!(guide.go_on(), "{:?}", guide.view());
    }
    guide
}

#[test]
fn intervals_of_95_percent_hold_as_many_of_200_people() {
    let mut rng = ChaCha8Rng::seed_from_u64(20_261_126);
    let mut inside = [0_usize; PARAMETERS];
    let mut std = [0.0; PARAMETERS];
    let mut left_out = 0;
    for _ in 0..PEOPLE {
        let parameters = drawn(&mut rng);
        let body = Person {
            name: String::new(),
            body_mass_kg: Uniform::new(50.0, 100.0).unwrap().sample(&mut rng),
            body_height_m: Uniform::new(1.55, 1.95).unwrap().sample(&mut rng),
            mains_hz: None,
        };
        let guide = calibrated(&parameters, &body, &mut rng);
        let fit = &guide.result().unwrap().fit;
        left_out += fit.left_out.len();
        for (at, truth) in parameters.into_iter().enumerate() {
            let [low, high] = fit.interval(at, 0.95);
            inside[at] += usize::from((low..=high).contains(&truth));
            std[at] += (high / low).ln() / 3.92 / PEOPLE as f64;
        }
    }
    println!(
        "95 % intervals hold {inside:?} of {PEOPLE}; widths {std:.3?} (of logarithms, one sigma); {left_out} loads left out"
    );
    let pooled = inside.iter().sum::<usize>() as f64 / (PEOPLE * PARAMETERS) as f64;
    assert!((0.90..=0.98).contains(&pooled), "{pooled}");
    // One parameter of 200 people varies by chance: 0.95 passes for 0.88 or 0.995 once in ten thousand.
    for (at, inside) in inside.into_iter().enumerate() {
        let share = inside as f64 / PEOPLE as f64;
        assert!((0.88..=0.995).contains(&share), "parameter {at}: {share}");
    }
    assert!(left_out <= 4, "sound loads are kept");
}

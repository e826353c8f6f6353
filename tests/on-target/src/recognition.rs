//! One instant of six observed DoFs: three skills at one tempo, and at eight tempi each.

use core::hint::black_box;

use tonus_shared::promp::{
    Bank, Basis, Hypothesis, Latent, Mixture, Observation, Observed, Quantity, Row, Skill,
    bank_len, mixture_len, root_len,
};

use crate::count::Counter;
use crate::model::{numbers, root};

const DOFS: usize = 6;
const BASIS: usize = 20;
const RANK: usize = 16;
const SKILLS: usize = 3;
const TEMPI: usize = 8;
const HYPOTHESES: usize = SKILLS * TEMPI;
const PERIOD_S: f32 = 0.02;

pub(crate) fn count(counter: &mut Counter) {
    let loading = numbers::<{ DOFS * BASIS * RANK }>(0.7);
    let latent = Latent::new(Basis::gaussian(BASIS).unwrap(), DOFS, RANK, &loading).unwrap();
    let means = [0.3, 0.31, 0.32].map(numbers::<{ DOFS * BASIS }>);
    let root = root::<{ root_len(RANK) }>(RANK);
    let skills = means
        .each_ref()
        .map(|mean| Skill::new(&latent, mean, Some(&root), &[0.01; DOFS], 0.0).unwrap());
    mixture(counter, latent, &skills);
    bank(counter, latent, &skills);
}

fn mixture(counter: &mut Counter, latent: Latent<'_, f32>, skills: &[Skill<'_, f32>]) {
    let storage = [0.0; mixture_len(SKILLS, BASIS, RANK)];
    let mut mixture = Mixture::new(latent, skills, storage).unwrap();
    let mut posterior = [0.0; SKILLS];
    counter.print("mixture_step_3x1_r16_6dof", || {
        for dof in 0..DOFS {
            let observation = Observation {
                row: Row::position(dof, black_box(0.4)),
                value: 0.2,
                variance: 1e-3,
            };
            mixture.observe(black_box(&observation)).unwrap();
        }
        mixture.log_posterior(&mut posterior).unwrap();
    });
}

fn bank(counter: &mut Counter, latent: Latent<'_, f32>, skills: &[Skill<'_, f32>]) {
    let slots = [Hypothesis::default(); HYPOTHESES];
    let storage = [0.0; bank_len(HYPOTHESES, BASIS, RANK)];
    let mut bank = Bank::new(latent, skills, slots, storage, None).unwrap();
    for index in 0..HYPOTHESES {
        let hypothesis = Hypothesis {
            skill: index % SKILLS,
            duration_s: 1.5 + 0.2 * (index / SKILLS) as f32,
            ..Hypothesis::default()
        };
        assert!(bank.add(hypothesis, &[]).unwrap());
    }
    for step in 1..=2 {
        let ((), instructions) = counter.instructions(|| {
            for dof in 0..DOFS {
                let seen = Observed {
                    dof,
                    quantity: Quantity::Position,
                    time_s: step as f32 * PERIOD_S + 0.4,
                    value: 0.2,
                    variance: 1e-3,
                };
                bank.observe(black_box(&seen)).unwrap();
            }
        });
        if step == 2 {
            counter.say("bank_step_3x8_r16_6dof", instructions);
        }
    }
}

//! One observed scalar: its row, and what it does to a belief.

use core::hint::black_box;

use tonus_shared::promp::{Basis, Belief, Latent, Row, Skill, belief_len, root_len};

use crate::count::Counter;
use crate::model::{numbers, root};

/// Observations before the one that is counted.
const BEFORE: usize = 3;

#[inline(never)]
pub(crate) fn count(counter: &mut Counter) {
    of_rank::<16, { root_len(16) }, { belief_len(16) }, 20, { 20 * 16 }>(
        counter,
        ["row_k20_r16", "condition_r16"],
    );
    of_rank::<29, { root_len(29) }, { belief_len(29) }, 30, { 30 * 29 }>(
        counter,
        ["row_k30_r29", "condition_r29"],
    );
}

fn of_rank<
    const RANK: usize,
    const ROOT: usize,
    const BELIEF: usize,
    const BASIS: usize,
    const LOADING: usize,
>(
    counter: &mut Counter,
    names: [&str; 2],
) {
    let (loading, mean) = (numbers::<LOADING>(0.7), numbers::<BASIS>(0.3));
    let basis = Basis::gaussian(BASIS).unwrap();
    let latent = Latent::new(basis, 1, RANK, &loading).unwrap();
    let root = root::<ROOT>(RANK);
    let skill = Skill::new(&latent, &mean, Some(&root), &[0.0], 0.0).unwrap();
    let mut belief = Belief::new(&skill, [0.0; BELIEF]).unwrap();
    let (mut psi, mut a) = ([0.0; BASIS], [0.0; RANK]);
    for step in 0..=BEFORE {
        let row = Row::position(0, 0.1 + 0.2 * step as f32);
        let ((), row_instructions) =
            counter.instructions(|| latent.row(black_box(&row), &mut psi, &mut a).unwrap());
        let offset = skill.offset(&basis, &row, &psi).unwrap();
        let (_, instructions) = counter.instructions(|| {
            belief
                .condition(black_box(&a), offset, black_box(0.3), black_box(1e-4))
                .unwrap()
        });
        if step == BEFORE {
            counter.say(names[0], row_instructions);
            counter.say(names[1], instructions);
        }
    }
}

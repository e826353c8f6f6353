//! Skills in directions of their own: against the same Gaussian in weight space, and against skills in the latent
//! space's coordinates.

use tonus_shared::promp::{
    Bank, Belief, Hypothesis, Latent, Mixture, ModelError, Moments, Observed, Order, Quantity, Row,
    Skill, Trajectory, bank_len, belief_len, curves_scratch_len, directions, mixture_len,
    own_loading, trajectory_scratch_len,
};

use crate::dense::{
    BASIS, DOFS, DURATION_S, Problem, RANK, equals_the_batch_formula, near, problems, questions,
};

/// The loading of a problem's skill in its own directions, and how many these are.
fn own(problem: &Problem) -> (usize, Vec<f64>) {
    let (latent, root) = (problem.latent(), problem.skill().root().unwrap());
    let count = directions(root, RANK);
    let mut loading = vec![f64::NAN; DOFS * BASIS * count];
    own_loading(&latent, root, count, &mut loading).unwrap();
    (count, loading)
}

#[test]
fn a_skill_of_few_directions_is_the_dense_gaussian() {
    for (index, problem) in problems().into_iter().enumerate() {
        let few = 1 + index % 3;
        let problem = problem.narrowed(few);
        let (count, loading) = own(&problem);
        assert_eq!(count, few);
        let skill = problem.skill();
        let skill = skill
            .with_loading(&problem.latent(), few, &loading)
            .unwrap();
        assert_eq!((skill.rank(), problem.skill().rank()), (few, RANK));
        equals_the_batch_formula(&problem, skill);
    }
}

#[test]
fn all_directions_are_still_the_dense_gaussian() {
    for problem in problems() {
        let (count, loading) = own(&problem);
        assert_eq!(count, RANK);
        let skill = problem.skill();
        let skill = skill
            .with_loading(&problem.latent(), count, &loading)
            .unwrap();
        equals_the_batch_formula(&problem, skill);
    }
}

/// Two skills, one narrow and Student-t: as they are, and the narrow one in its own directions, before, between and
/// after skills that share their rows.
fn alike<'a>(
    latent: &Latent<'_, f64>,
    [wide, narrow]: [Skill<'a, f64>; 2],
    loading: &'a [f64],
) -> [Vec<Skill<'a, f64>>; 2] {
    let count = directions(narrow.root().unwrap(), RANK);
    let narrow = narrow.with_freedom(6.5).unwrap();
    let own = narrow.with_loading(latent, count, loading).unwrap();
    [
        vec![narrow, wide, narrow, wide, wide],
        vec![own, wide, own, wide, wide],
    ]
}

#[test]
fn a_mixture_and_a_bank_of_both_kinds_say_the_same() {
    for problem in problems() {
        let narrow = problem.clone().narrowed(2);
        let (_, loading) = own(&narrow);
        let latent = problem.latent();
        let kinds = alike(&latent, [problem.skill(), narrow.skill()], &loading);
        let [expected, got] = kinds.each_ref().map(|skills| {
            let storage = vec![f64::NAN; mixture_len(skills.len(), BASIS, RANK)];
            let mut mixture = Mixture::new(latent, skills, storage).unwrap();
            let slots = vec![Hypothesis::default(); skills.len()];
            let storage = vec![f64::NAN; bank_len(skills.len(), BASIS, RANK)];
            let mut bank = Bank::new(latent, skills, slots, storage, None).unwrap();
            for skill in 0..skills.len() {
                let known = Hypothesis {
                    skill,
                    duration_s: DURATION_S,
                    ..Hypothesis::default()
                };
                assert!(bank.add(known, &[]).unwrap());
            }
            let inside = |row: &Row<f64>| (0.0..=1.0).contains(&row.phase);
            for seen in problem.observations.iter().filter(|seen| inside(&seen.row)) {
                mixture.observe(seen).unwrap();
                let quantity = match seen.row.order {
                    Order::Position => Quantity::Position,
                    Order::Velocity { .. } => Quantity::Velocity,
                };
                bank.observe(&Observed {
                    dof: seen.row.dof,
                    quantity,
                    time_s: seen.row.phase * DURATION_S,
                    value: seen.value,
                    variance: seen.variance,
                })
                .unwrap();
            }
            let joint = |skill| mixture.log_joint(skill).unwrap();
            let followed = |skill| bank.log_joint(skill).unwrap();
            let curves = (0..skills.len()).map(|skill| curves(mixture.trajectory(skill).unwrap()));
            let all: Vec<f64> = (0..skills.len())
                .flat_map(|skill| [joint(skill), followed(skill)])
                .chain(curves.flatten())
                .collect();
            all
        });
        assert_eq!(expected.len(), got.len());
        for (expected, got) in expected.iter().zip(&got) {
            near(*got, *expected, 10.0 + expected.abs());
        }
    }
}

/// Means and variances at a few phases, all at once and one by one.
fn curves(trajectory: Trajectory<'_, f64>) -> Vec<f64> {
    let phases = [0.0, 0.4, 1.0];
    let nothing = Moments {
        mean: f64::NAN,
        variance: f64::NAN,
    };
    let mut moments = vec![nothing; DOFS * phases.len()];
    let mut scratch = vec![f64::NAN; curves_scratch_len(DOFS, BASIS, RANK)];
    let drawn = trajectory.curves(Order::Position, &phases, &mut scratch, &mut moments);
    drawn.unwrap();
    let mut scratch = vec![f64::NAN; trajectory_scratch_len(BASIS, RANK)];
    moments.extend(
        questions()
            .iter()
            .map(|row| trajectory.moments(row, &mut scratch).unwrap()),
    );
    let numbers = moments
        .iter()
        .flat_map(|moments| [moments.mean, moments.variance]);
    numbers.collect()
}

#[test]
fn a_loading_or_a_belief_that_does_not_fit_is_refused() {
    let problem = problems().remove(0).narrowed(2);
    let (latent, skill) = (problem.latent(), problem.skill());
    let (count, mut loading) = own(&problem);
    let root = skill.root().unwrap();
    for (count, root, length) in [
        (RANK + 1, root, DOFS * BASIS * (RANK + 1)),
        (2, &root[1..], DOFS * BASIS * 2),
        (2, root, DOFS * BASIS * 2 - 1),
    ] {
        let made = own_loading(&latent, root, count, &mut vec![0.0; length]);
        assert!(matches!(made, Err(ModelError::Length { .. })), "{made:?}");
    }
    let none = own_loading(&latent, root, 0, &mut []);
    assert!(matches!(none, Err(ModelError::Empty { .. })));
    let wide = vec![0.0; DOFS * BASIS * (RANK + 1)];
    let refused = skill.with_loading(&latent, RANK + 1, &wide);
    assert!(matches!(refused, Err(ModelError::Length { .. })));
    let of = |rank, loading| problem.skill().with_loading(&latent, rank, loading);
    assert!(matches!(of(0, &[]), Err(ModelError::Empty { .. })));
    assert!(matches!(
        of(count, &loading[1..]),
        Err(ModelError::Length { .. })
    ));
    // A belief of two coordinates has not the room for one of five.
    let few = of(count, &loading).unwrap();
    let mut belief = Belief::new(&few, vec![0.0; belief_len(count)]).unwrap();
    assert_eq!(belief.rank(), count);
    let refused = belief.reset(&skill);
    assert!(matches!(refused, Err(ModelError::Storage { .. })));
    assert!(Trajectory::posterior(latent, skill, &belief).is_err());
    loading[3] = f64::NAN;
    let refused = problem.skill().with_loading(&latent, count, &loading);
    assert!(matches!(
        refused,
        Err(ModelError::NonFinite { index: 3, .. })
    ));
}

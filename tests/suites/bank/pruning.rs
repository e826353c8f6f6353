//! What is dropped, against a model whose likelihoods are known in closed form.

use tonus_shared::promp::{
    Bank, BankError, Basis, Dropped, Hypothesis, Latent, ModelError, Observed, Quantity, Skill,
    bank_len,
};

/// One DoF that is constant: skill `q` is the Gaussian of mean `q` and variance 1.
const MEANS: [f64; 3] = [0.0, 1.0, 2.0];

type Banks = Bank<'static, f64, Vec<Hypothesis<f64>>, Vec<f64>>;

fn parts() -> (Latent<'static, f64>, &'static [Skill<'static, f64>]) {
    let latent = Latent::new(Basis::bernstein(1).unwrap(), 1, 1, &[1.0]).unwrap();
    let skill =
        |mean: &'static f64| Skill::new(&latent, std::slice::from_ref(mean), None, &[0.0], 0.0);
    let skills = MEANS.iter().map(|mean| skill(mean).unwrap());
    (latent, skills.collect::<Vec<_>>().leak())
}

fn bank(capacity: usize, floor_nats: Option<f64>) -> Banks {
    let (latent, skills) = parts();
    let storage = vec![0.0; bank_len(capacity, 1, 1)];
    let slots = vec![Hypothesis::default(); capacity];
    Bank::new(latent, skills, slots, storage, floor_nats).unwrap()
}

fn of_skill(skill: usize, log_prior: f64) -> Hypothesis<f64> {
    Hypothesis {
        skill,
        log_prior,
        ..Hypothesis::default()
    }
}

fn seen(value: f64) -> Observed<f64> {
    Observed {
        dof: 0,
        quantity: Quantity::Position,
        time_s: 0.5,
        value,
        variance: 1.0,
    }
}

/// With `y` of variance 1 + 1 the log-odds of means `m` and `n` are `((y - n)^2 - (y - m)^2) / 4`.
#[test]
fn those_below_the_floor_are_dropped_and_counted() {
    // y = -1: squared distances 1, 4, 9; behind the best by 0, 0.75, 2.
    for (floor, left) in [(0.7, vec![0]), (0.8, vec![0, 1]), (2.1, vec![0, 1, 2])] {
        let mut bank = bank(3, Some(floor));
        for skill in 0..3 {
            bank.add(of_skill(skill, 0.0), &[]).unwrap();
        }
        bank.observe(&seen(-1.0)).unwrap();
        let skills: Vec<_> = bank.hypotheses().iter().map(|h| h.skill).collect();
        assert_eq!(skills, left);
        let expected = Dropped {
            full: 0,
            floor: 3 - left.len() as u32,
        };
        assert_eq!(bank.dropped(), expected);
        let mut posterior = [0.0; 3];
        bank.log_posterior(&mut posterior).unwrap();
        let weights = [0.0, -0.75, -2.0].map(f64::exp);
        let total: f64 = left.iter().map(|&skill| weights[skill]).sum();
        for (skill, got) in posterior.iter().enumerate() {
            if left.contains(&skill) {
                assert!((got.exp() - weights[skill] / total).abs() < 1e-12);
            } else {
                assert_eq!(*got, f64::NEG_INFINITY);
            }
        }
    }
}

#[test]
fn the_blocks_move_with_their_hypotheses() {
    let mut bank = bank(3, Some(0.7));
    for skill in 0..3 {
        bank.add(of_skill(skill, 0.0), &[]).unwrap();
    }
    // y = 3 leaves the last alone: its mean moves half of the way, (3 - 2) / 2, and its variance is halved.
    bank.observe(&seen(3.0)).unwrap();
    assert_eq!(bank.hypotheses(), [of_skill(2, 0.0)]);
    let belief = bank.belief(0).unwrap();
    assert!((belief.mean()[0] - 0.5).abs() < 1e-12);
    assert!((belief.shares()[0] * belief.root()[0].powi(2) - 0.5).abs() < 1e-12);
    assert!(bank.belief(1).is_none() && bank.trajectory(1).is_none());
    assert!(bank.log_joint(1).is_none() && bank.probability(1).is_none());
    assert!(bank.duration(Some(0)).is_none() && bank.duration(Some(2)).is_some());
}

#[test]
fn without_room_the_least_likely_goes() {
    let mut bank = bank(2, None);
    assert!(bank.add(of_skill(0, -1.0), &[]).unwrap());
    assert!(bank.add(of_skill(1, -3.0), &[]).unwrap());
    // Less likely than both: it is not taken. More likely than one: that one goes.
    assert!(!bank.add(of_skill(2, -4.0), &[]).unwrap());
    assert!(bank.add(of_skill(2, -2.0), &[]).unwrap());
    assert_eq!(bank.hypotheses(), [of_skill(0, -1.0), of_skill(2, -2.0)]);
    assert_eq!(bank.dropped(), Dropped { full: 2, floor: 0 });
    bank.observe(&seen(2.0)).unwrap();
    // Log joints now, up to what is common: -1 - 1, -2 - 0. A newcomer is weighed with the past: mean 1 has
    // -1/4, and so needs a prior above -1.75 to displace one of them.
    assert!(!bank.add(of_skill(1, -1.76), &[seen(2.0)]).unwrap());
    assert!(bank.add(of_skill(1, -1.74), &[seen(2.0)]).unwrap());
    assert_eq!(bank.dropped(), Dropped { full: 4, floor: 0 });
    let kept = bank.hypotheses().iter().position(|h| h.skill == 1).unwrap();
    let normal = -0.5 * (1.0 / 2.0 + 2.0_f64.ln() + std::f64::consts::TAU.ln());
    assert!((bank.log_joint(kept).unwrap() - (-1.74 + normal)).abs() < 1e-12);
}

#[test]
fn without_time_the_least_likely_go() {
    let mut bank = bank(3, None);
    for (skill, log_prior) in [(0, -1.0), (1, -3.0), (2, -2.0)] {
        bank.add(of_skill(skill, log_prior), &[]).unwrap();
    }
    bank.keep(3);
    assert_eq!(bank.dropped(), Dropped { full: 0, floor: 0 });
    // With y = 2 the log joints are -1 - 1, -3 - 1/4, -2, up to what is common: the second goes, then the first.
    bank.observe(&seen(2.0)).unwrap();
    bank.keep(2);
    assert_eq!(bank.hypotheses(), [of_skill(0, -1.0), of_skill(2, -2.0)]);
    // Blocks move with them: the mean of skill 2 has stayed, that of skill 0 moved by half of 2.
    assert!((bank.belief(0).unwrap().mean()[0] - 1.0).abs() < 1e-12);
    assert!(bank.belief(1).unwrap().mean()[0].abs() < 1e-12);
    bank.observe(&seen(2.0)).unwrap();
    bank.keep(0);
    assert_eq!(bank.hypotheses(), [of_skill(2, -2.0)]);
    assert_eq!(bank.dropped(), Dropped { full: 2, floor: 0 });
}

#[test]
fn what_cannot_be_is_refused_by_name() {
    let mut bank = bank(2, None);
    let fine = of_skill(0, 0.0);
    let text = |bank: &mut Banks, hypothesis| bank.add(hypothesis, &[]).unwrap_err().to_string();
    assert_eq!(
        text(&mut bank, of_skill(3, 0.0)),
        "skill 3 was named, the bank has 3 (from 0)"
    );
    for duration_s in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        let wrong = Hypothesis { duration_s, ..fine };
        assert!(text(&mut bank, wrong).ends_with("give a positive finite duration"));
    }
    let onset_s = f64::NAN;
    let wrong = Hypothesis { onset_s, ..fine };
    assert_eq!(
        text(&mut bank, wrong),
        "the time is NaN s: give a finite time"
    );
    assert!(text(&mut bank, of_skill(0, f64::NEG_INFINITY)).starts_with("the log prior is -inf"));
    assert!(bank.hypotheses().is_empty());
    bank.add(fine, &[]).unwrap();
    for time_s in [f64::NAN, f64::INFINITY] {
        let wrong = Observed {
            time_s,
            ..seen(0.0)
        };
        assert!(matches!(bank.observe(&wrong), Err(BankError::Time { .. })));
    }
    let (latent, skills) = parts();
    let make = |slots: usize, numbers: usize, floor| {
        let slots = vec![Hypothesis::default(); slots];
        Bank::new(latent, skills, slots, vec![0.0; numbers], floor).map(|_| ())
    };
    assert_eq!(
        make(0, 100, None),
        Err(ModelError::Empty { what: "hypothesis" })
    );
    let needed = bank_len(4, 1, 1);
    assert_eq!(
        make(4, needed - 1, None),
        Err(ModelError::Storage {
            what: "the bank's storage",
            needed,
            got: needed - 1
        })
    );
    for floor in [0.0, -1.0, f64::NAN, f64::INFINITY] {
        assert!(matches!(
            make(4, needed, Some(floor)),
            Err(ModelError::Floor { .. })
        ));
    }
}

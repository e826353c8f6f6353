//! Adding demonstrations to a stored model against training from all of them.
#![allow(
    missing_docs,
    clippy::unwrap_used,
    clippy::expect_used,
    reason = "test suite"
)]

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus::demonstration::Demonstration;
use tonus::model::recognise::Recogniser;
use tonus::model::{Dof, Hyperparameters, LearnError, Model, Shrinkage, Valid, extend, learn};
use tonus::store::{from_bytes, to_bytes};
use tonus_shared::promp::Basis;

/// Largest difference, in standard deviations or nats.
const TOLERANCE: f64 = 1e-9;

/// Movements of one label: a position in metres, another a thousand times as large, and a stiffness; of different
/// lengths and rates, irregularly sampled.
fn movements(label: &str, direction: f64, count: usize, seed: u64) -> Vec<Demonstration> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let one = |number: usize, random: &mut ChaCha8Rng| {
        let mut draw = |from: f64, to: f64| random.random_range(from..to);
        let samples = draw(15.0, 90.0) as usize;
        let (step_s, reach) = (draw(0.01, 0.05), direction + draw(-0.3, 0.3));
        let (bend, firm, start_s) = (draw(-0.5, 0.5), draw(0.8, 1.3), draw(0.0, 50.0));
        let mut time_s = start_s;
        let mut t_s = Vec::new();
        let mut values = vec![Vec::new(); 3];
        for index in 0..samples {
            let s = index as f64 / samples as f64;
            t_s.push(time_s);
            time_s += step_s * draw(0.3, 2.0);
            values[0].push(reach * s * s + 0.01 * draw(-1.0, 1.0));
            values[1].push(1e3 * (bend * (7.0 * s).sin() + direction * s));
            values[2].push(200.0 * firm * (1.0 + 0.5 * (5.0 * s).sin() * bend));
        }
        Demonstration::new(label, number.to_string(), "made.csv", t_s, values).unwrap()
    };
    (0..count).map(|number| one(number, &mut random)).collect()
}

fn given(shrinkage: Shrinkage, placement_m: f64) -> Valid {
    let dofs = vec![Dof::position("x"), Dof::position("y"), Dof::stiffness("k")];
    let given = Hyperparameters {
        shrinkage,
        placement_m,
        ..Hyperparameters::new(dofs, Basis::gaussian(9).unwrap())
    };
    given.check().unwrap()
}

fn all(lists: &[&[Demonstration]]) -> Vec<Demonstration> {
    lists.concat()
}

/// The same model to 1e-9: what it expects of every signal, before and after observations, and whom it believes.
fn same(one: &Model, other: &Model) {
    assert_eq!(one.labels(), other.labels());
    assert_eq!(one.parts().counts, other.parts().counts);
    assert_eq!(one.parts().pooled_share, other.parts().pooled_share);
    assert_eq!(one.parts().diagonal_share, other.parts().diagonal_share);
    for (a, b) in one.durations().iter().zip(other.durations()) {
        assert!((a.mean_s - b.mean_s).abs() + (a.std_s - b.std_s).abs() < TOLERANCE);
        assert_eq!((a.min_s, a.max_s), (b.min_s, b.max_s));
    }
    let views = (one.view().unwrap(), other.view().unwrap());
    let mut first = Recogniser::new(one, &views.0).unwrap();
    let mut second = Recogniser::new(other, &views.1).unwrap();
    let compare = |first: &mut Recogniser<'_>, second: &mut Recogniser<'_>| {
        for (a, b) in first.log_posterior().iter().zip(second.log_posterior()) {
            assert!((a - b).abs() < TOLERANCE * a.abs().max(1.0), "{a} {b}");
        }
        for skill in 0..one.labels().len() {
            for (dof, step) in (0..3).flat_map(|dof| (0..=10).map(move |step| (dof, step))) {
                let phase = f64::from(step) / 10.0;
                let a = first.predict(skill, dof, phase).unwrap();
                let b = second.predict(skill, dof, phase).unwrap();
                let off = (a.mean - b.mean).abs() + (a.std - b.std).abs();
                let unit = one.parts().scale[dof] * if dof == 2 { a.mean } else { 1.0 };
                assert!(off < TOLERANCE * unit, "{skill} {dof} {phase}: {a:?} {b:?}");
            }
        }
    };
    compare(&mut first, &mut second);
    for (dof, phase, value, std) in [
        (0, 0.2, 0.1, 0.05),
        (1, 0.4, -90.0, 20.0),
        (2, 0.5, 230.0, 9.0),
    ] {
        first.observe(dof, phase, value, std).unwrap();
        second.observe(dof, phase, value, std).unwrap();
        compare(&mut first, &mut second);
    }
}

/// The model as it comes back from a file.
fn stored(model: &Model) -> Model {
    from_bytes(&to_bytes(model, None).unwrap()).unwrap().0
}

#[test]
fn more_demonstrations_of_known_skills_give_the_model_of_all() {
    let (lift, push) = (movements("lift", 1.0, 9, 1), movements("push", -1.0, 8, 2));
    let fixed = Shrinkage::Fixed {
        pooled: 0.3,
        diagonal: 0.1,
    };
    for valid in [given(Shrinkage::LeaveOneOut, 0.0), given(fixed, 0.1)] {
        let first = all(&[&lift[..4], &push[..3]]);
        let second = all(&[&push[3..], &lift[4..]]);
        let both = learn(&all(&[&first, &second]), &valid).unwrap();
        let older = stored(&learn(&first, &valid).unwrap());
        same(&extend(&older, &second).unwrap(), &both);
        let newer = stored(&learn(&second, &valid).unwrap());
        same(&extend(&newer, &first).unwrap(), &both);
        // One after the other, through a file each time.
        let mut grown = older;
        for one in &second {
            grown = stored(&extend(&grown, std::slice::from_ref(one)).unwrap());
        }
        same(&grown, &both);
        assert_eq!(grown.parts().demonstrations.len(), 17);
    }
}

#[test]
fn a_new_skill_gives_the_model_of_all() {
    let (lift, push) = (movements("lift", 1.0, 6, 3), movements("push", -1.0, 5, 4));
    let wave = movements("brush", 0.2, 4, 5);
    let valid = given(Shrinkage::LeaveOneOut, 0.0);
    let known = learn(&all(&[&lift, &push]), &valid).unwrap();
    let both = learn(&all(&[&lift, &push, &wave]), &valid).unwrap();
    assert_eq!(both.labels(), ["brush", "lift", "push"]);
    same(&extend(&stored(&known), &wave).unwrap(), &both);
}

#[test]
fn shares_that_were_chosen_are_chosen_again() {
    let valid = given(Shrinkage::LeaveOneOut, 0.0);
    let (lift, push) = (
        movements("lift", 1.0, 30, 6),
        movements("push", -1.0, 30, 7),
    );
    let few = learn(&all(&[&lift[..3], &push[..3]]), &valid).unwrap();
    let many = extend(&few, &all(&[&lift[3..], &push[3..]])).unwrap();
    let shares = |model: &Model| (model.parts().pooled_share, model.parts().diagonal_share);
    assert_ne!(shares(&few), shares(&many), "the test says little");
    same(&many, &learn(&all(&[&lift, &push]), &valid).unwrap());
}

#[test]
fn what_does_not_fit_the_model_is_refused() {
    let valid = given(Shrinkage::LeaveOneOut, 0.0);
    let model = learn(&movements("lift", 1.0, 4, 8), &valid).unwrap();
    let narrow = Demonstration::new("lift", "1", "a", vec![0.0, 1.0], vec![vec![0.0, 1.0]]);
    let refused = extend(&model, &[narrow.unwrap()]).unwrap_err();
    assert!(matches!(
        refused,
        LearnError::Dofs {
            expected: 3,
            got: 1,
            ..
        }
    ));
    let refused = extend(&model, &movements("push", 1.0, 1, 9)).unwrap_err();
    assert!(matches!(refused, LearnError::TooFew { found: 1, .. }));
}

#[test]
fn components_of_a_class_share_its_posterior() {
    let valid = given(Shrinkage::LeaveOneOut, 0.0);
    let low = movements("lift", 0.5, 5, 10)
        .into_iter()
        .map(|one| one.component(1));
    let high = movements("lift", 2.0, 5, 11)
        .into_iter()
        .map(|one| one.component(2));
    let push = movements("push", -1.0, 5, 12);
    let demonstrations: Vec<_> = low.chain(high).chain(push).collect();
    let model = stored(&learn(&demonstrations, &valid).unwrap());
    assert_eq!(model.labels(), ["lift#1", "lift#2", "push"]);
    assert_eq!(model.classes(), ["lift", "push"]);
    assert_eq!(
        [0, 1, 2, 3].map(|skill| model.class_of(skill)),
        [Some(0), Some(0), Some(1), None]
    );
    // ln(0.2 + 0.3) and ln 0.5, and far below what exp can hold.
    for base in [0.0, -2000.0] {
        let skills = [0.2_f64, 0.3, 0.5].map(|p| p.ln() + base);
        let classes = model.class_log_posterior(&skills);
        assert!(
            classes
                .iter()
                .all(|log| (log - 0.5_f64.ln() - base).abs() < 1e-12),
            "{classes:?}"
        );
    }
    assert_eq!(
        model.class_log_posterior(&[f64::NEG_INFINITY; 3]),
        [f64::NEG_INFINITY; 2]
    );
    // A class of that very name is another class.
    let stray = movements("lift#1", 1.0, 2, 13);
    assert!(matches!(
        extend(&model, &stray),
        Err(LearnError::Classes { .. })
    ));
}

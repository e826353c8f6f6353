//! Plans of a learnt model: in the DoFs' units, stiffness by its logarithm.

use std::sync::OnceLock;

use tonus::demonstration::Demonstration;
use tonus::model::compose::{Joint, Part, Plan, PlanError, Present, Via, blend};
use tonus::model::recognise::Recogniser;
use tonus::model::{Dof, Hyperparameters, Model, learn};
use tonus_shared::promp::{Basis, hand_over};

use crate::random::near;

const DOFS: [&str; 6] = ["hx", "hz", "Khy", "rx", "rz", "Kry"];
const DURATION_S: f64 = 2.0;

/// Three skills of ten reference demonstrations each.
fn model() -> &'static Model {
    static MODEL: OnceLock<Model> = OnceLock::new();
    MODEL.get_or_init(|| {
        let all = tonus_tests::demos(&DOFS);
        let named = |one: &Demonstration| one.with_label(format!("skill_{}", one.label()));
        let all: Vec<_> = all.iter().map(named).collect();
        let dof = |name: &&str| {
            if name.starts_with('K') {
                Dof::stiffness(*name)
            } else {
                Dof::position(*name)
            }
        };
        let given =
            Hyperparameters::new(DOFS.iter().map(dof).collect(), Basis::gaussian(20).unwrap());
        learn(&all, &given.check().unwrap()).unwrap()
    })
}

/// Where the robot is and how it moves, away from what any demonstration did.
fn present() -> Vec<Present> {
    let at = |dof, value, rate| Present { dof, value, rate };
    vec![at(3, 0.52, -0.15), at(4, 0.11, 0.2), at(5, 700.0, -300.0)]
}

#[test]
fn a_start_is_met_exactly() {
    let view = model().view().unwrap();
    for phase in [0.0, 0.4] {
        for skill in 0..3 {
            let mut plan = Plan::new(model(), &view, skill, DURATION_S).unwrap();
            let overlap = 0.3;
            plan.start(&present(), Joint { phase, overlap }, 0.01)
                .unwrap();
            for now in present() {
                let (value, rate) = plan.reference(now.dof, phase).unwrap();
                near(value, now.value, 1e-12 * now.value.abs());
                near(rate, now.rate, 1e-12 * now.rate.abs().max(1.0));
            }
        }
    }
}

/// By differences over time: nothing jumps when the overlap ends, and the rate is the slope everywhere.
#[test]
fn rates_are_slopes_in_time() {
    const STEP: f64 = 1e-5;
    let view = model().view().unwrap();
    let mut plan = Plan::new(model(), &view, 1, DURATION_S).unwrap();
    let joint = Joint {
        phase: 0.1,
        overlap: 0.4,
    };
    plan.start(&present(), joint, 0.01).unwrap();
    for dof in 0..DOFS.len() {
        for phase in [0.11, 0.3, 0.49, 0.5, 0.51, 0.8] {
            let mut at = |phase| plan.reference(dof, phase).unwrap();
            let slope = (at(phase + STEP).0 - at(phase - STEP).0) / (2.0 * STEP * DURATION_S);
            let (value, rate) = at(phase);
            near(rate, slope, 1e-5 * (value.abs() + rate.abs()).max(1.0));
        }
    }
}

/// Position and velocity of all DoFs, before and after the hand-over of each pair of skills of different durations.
#[test]
fn one_skill_follows_another_without_a_jump() {
    let view = model().view().unwrap();
    for (first, second) in [(0, 1), (1, 2), (2, 0)] {
        let mut previous = Plan::new(model(), &view, first, DURATION_S).unwrap();
        let via = Via {
            dof: 3,
            phase: 0.7,
            value: 0.5,
            std: 0.001,
        };
        previous.via(&via).unwrap();
        let mut next = Plan::new(model(), &view, second, 1.3).unwrap();
        next.follow(&mut previous, 0.8, 0.25, 0.1).unwrap();
        for dof in 0..DOFS.len() {
            let (value, rate) = previous.reference(dof, 0.8).unwrap();
            let (there, moving) = next.reference(dof, 0.0).unwrap();
            near(there, value, 1e-6);
            near(moving, rate, 1e-6);
        }
    }
}

/// A start where the skill is anyway, moving as it does, changes no mean.
#[test]
fn a_start_on_the_skill_changes_nothing() {
    let view = model().view().unwrap();
    let mut plain = Plan::new(model(), &view, 0, DURATION_S).unwrap();
    let phase = 0.2;
    let on = (0..DOFS.len()).map(|dof| {
        let (value, rate) = plain.reference(dof, phase).unwrap();
        Present { dof, value, rate }
    });
    let on: Vec<_> = on.collect();
    let mut plan = Plan::new(model(), &view, 0, DURATION_S).unwrap();
    let overlap = 0.3;
    plan.start(&on, Joint { phase, overlap }, 0.01).unwrap();
    for dof in 0..DOFS.len() {
        for at in [0.0, 0.3, 0.6, 1.0] {
            let (value, rate) = plain.reference(dof, at).unwrap();
            let (planned, moving) = plan.reference(dof, at).unwrap();
            near(planned, value, 1e-8 * value.abs().max(1.0));
            near(moving, rate, 1e-7 * rate.abs().max(1.0));
        }
    }
}

/// What is coupled answers: the recogniser, told the same positions, moves the other DoFs the same way.
#[test]
fn a_plan_from_a_belief_goes_on_from_what_was_seen() {
    let view = model().view().unwrap();
    let mut seen = Recogniser::new(model(), &view).unwrap();
    let mut mixture = view.mixture().unwrap();
    for (dof, phase, value) in [(0, 0.1, 0.05), (2, 0.2, 300.0)] {
        let std = 0.01 * value;
        seen.observe(dof, phase, value, std).unwrap();
        let observation = model().observation(dof, phase, value, std).unwrap();
        mixture.observe(&observation.unwrap()).unwrap();
    }
    let belief = mixture.belief(1).unwrap();
    let mut plan = Plan::given(model(), &view, (1, DURATION_S), &belief).unwrap();
    for dof in 0..DOFS.len() {
        for phase in [0.0, 0.5, 1.0] {
            let expected = seen.predict(1, dof, phase).unwrap();
            let got = plan.predict(dof, phase).unwrap();
            near(got.mean, expected.mean, 1e-12 * expected.mean.abs());
            near(got.std, expected.std, 1e-12 * expected.std.abs());
            near(
                got.rate,
                expected.rate / DURATION_S,
                1e-9 * expected.rate.abs(),
            );
        }
    }
}

#[test]
fn what_is_refused_leaves_the_plan_as_it_was() {
    let view = model().view().unwrap();
    let mut plan = Plan::new(model(), &view, 0, DURATION_S).unwrap();
    let before: Vec<_> = (0..6).map(|d| plan.predict(d, 0.3).unwrap()).collect();
    let joint = Joint {
        phase: 0.0,
        overlap: 0.2,
    };
    let mut bad = present();
    bad[2].value = -1.0;
    let refused = plan.start(&bad, joint, 0.01).unwrap_err();
    assert!(matches!(refused, PlanError::NotPositive(_)), "{refused}");
    bad[2] = Present {
        dof: 6,
        ..present()[0]
    };
    let refused = plan.start(&bad, joint, 0.01).unwrap_err();
    assert!(matches!(refused, PlanError::Unknown { index: 6, .. }));
    let overlap = 0.0;
    let refused = plan.start(&present(), Joint { overlap, ..joint }, 0.01);
    assert!(matches!(refused.unwrap_err(), PlanError::Compose(_)));
    let after: Vec<_> = (0..6).map(|d| plan.predict(d, 0.3).unwrap()).collect();
    assert_eq!(after, before);
    assert!(Plan::new(model(), &view, 3, DURATION_S).is_err());
    assert!(Plan::new(model(), &view, 0, 0.0).is_err());
}

/// From one skill to the next over time: at the ends each alone, between them between, and stiffness positive.
#[test]
fn a_moving_activation_goes_from_skill_to_skill() {
    let view = model().view().unwrap();
    let one = Plan::new(model(), &view, 0, DURATION_S).unwrap();
    let other = Plan::new(model(), &view, 2, DURATION_S).unwrap();
    let dofs: Vec<_> = (0..DOFS.len()).collect();
    let at = |phase: f64, share: f64| {
        let parts = [(&one, 1.0 - share), (&other, share)];
        let part = |(plan, activation)| Part {
            plan,
            phase,
            activation,
        };
        blend(&parts.map(part), &dofs).unwrap()
    };
    let shares = [0.0, 0.25, 0.3, 0.45, 0.6, 0.7, 1.0].map(|phase: f64| {
        let share = hand_over(phase, 0.3, 0.3).unwrap();
        (phase, share)
    });
    assert_eq!(shares.map(|(_, share)| share)[..3], [0.0, 0.0, 0.0]);
    for (phase, share) in shares {
        let both = at(phase, share);
        for (planned, &dof) in both.iter().zip(&dofs) {
            assert!(planned.mean.is_finite() && planned.std > 0.0);
            if DOFS[dof].starts_with('K') {
                assert!(planned.mean > 0.0);
            }
            let mut alone = one.clone();
            if share == 1.0 {
                alone = other.clone();
            }
            if share == 0.0 || share == 1.0 {
                let expected = alone.predict(dof, phase).unwrap();
                // A log-normal's mean shows the tolerance: exp(m + (v + tolerance) / 2).
                let parts = model().parts();
                let tolerance = parts.residual_variance[dof] + (1e-3 * parts.scale[dof]).powi(2);
                let log = DOFS[dof].starts_with('K');
                let more = if log { (0.5 * tolerance).exp() } else { 1.0 };
                near(
                    planned.mean,
                    expected.mean * more,
                    1e-9 * expected.mean.abs(),
                );
                assert!(planned.std >= expected.std);
            }
        }
    }
    assert!(matches!(blend(&[], &dofs), Err(PlanError::Compose(_))));
}

use super::*;

pub(super) type Spoil = fn(f64, &mut [f64; 4], &mut [bool; 4], &mut Option<[f64; 3]>);

pub(super) const NOTHING: Spoil = |_, _, _, _| {};

pub(super) fn begin() -> Guide {
    Guide::begin(&person(), &MUSCLES, 1000.0, 7).unwrap()
}

/// Measures the step that is shown.
pub(super) fn measure(guide: &mut Guide, person: &mut Simulated, spoil: Spoil) {
    guide.start();
    let task = guide.task();
    assert!(guide.view().measuring);
    person.give(
        7.0,
        &task,
        |at_us, measured| guide.sample(at_us, measured),
        spoil,
    );
    assert!(
        !guide.view().measuring,
        "seven seconds are enough for any step"
    );
}

pub(super) fn measure_all(person: &mut Simulated) -> Guide {
    let mut guide = begin();
    while guide.result().is_none() {
        measure(&mut guide, person, NOTHING);
        let view = guide.view();
        assert!(view.done && view.progress == 1.0, "{view:?}");
        assert!(guide.go_on());
    }
    guide
}

#[test]
fn a_person_without_noise_is_found_exactly() {
    let mut simulated = Simulated::new(1);
    let guide = measure_all(&mut simulated);
    let view = guide.view();
    assert_eq!((view.name.as_str(), view.done), ("result", true));
    assert_eq!((view.number, view.of), (23, 23));
    let outcome = guide.result().unwrap();
    let close =
        |got: f64, expected: f64| assert!((got / expected - 1.0).abs() < 1e-6, "{got} {expected}");
    close(outcome.result.l1.value, 2.0);
    close(outcome.result.l2.value, 1.2);
    for (found, truth) in outcome
        .result
        .rest_stiffness_nm_per_rad
        .iter()
        .zip(simulated.joints)
    {
        close(found.value, truth);
    }
    assert!(
        outcome.result.notes.is_empty(),
        "{:?}",
        outcome.result.notes
    );
    for (channel, (rest, mvc)) in simulated.rest_v.iter().zip(simulated.mvc_v).enumerate() {
        close(outcome.result.rest_uv[channel].value, 1e6 * rest);
        close(outcome.result.mvc_uv[channel].value, 1e6 * mvc);
        close(
            outcome.pattern.flex_v[channel],
            rest + simulated.flex[channel] * (mvc - rest),
        );
    }
    let sent = outcome.calibration;
    assert_eq!(
        (sent.revision, sent.channels, sent.mains_hz, sent.semg_hz),
        (7, 4, Some(50), 1000.0)
    );
    assert_eq!(sent.muscles[..4], MUSCLES);
    assert!((sent.rest_v[1] - 6e-6).abs() < 1e-11 && sent.rest_v[4] == 0.0);
    assert!((sent.mvc_v[3] - 180e-6).abs() < 1e-9 && (sent.l1 - 2.0).abs() < 1e-5);
    assert!((sent.rest_stiffness_nm_per_rad[0] - 15.0).abs() < 1e-4);
    assert_eq!((sent.body_mass_kg, sent.body_height_m), (75.0, 1.75));
}

#[test]
fn a_jittering_tracker_leaves_the_truth_inside_the_intervals() {
    let mut simulated = Simulated::new(2);
    simulated.hand_noise_m = 0.0015;
    let guide = measure_all(&mut simulated);
    let fit = &guide.result().unwrap().fit;
    let truth = [2.0, 1.2, 15.0, 12.0, 10.0, 14.0];
    for (at, truth) in truth.into_iter().enumerate() {
        let [low, high] = fit.interval(at, 0.999);
        assert!((low..=high).contains(&truth), "{at}: {low} to {high}");
        assert!(fit.told(at) && high / low < 1.6);
    }
    // 200 samples of 1.5 mm.
    assert!((5e-5..2e-4).contains(&fit.residual_m), "{}", fit.residual_m);
}

#[test]
fn under_the_measuring_calibration_a_share_is_the_envelope() {
    let measuring = begin().measuring();
    assert_eq!((measuring.revision, measuring.channels), (0, 4));
    for envelope_v in [0.0, 0.4e-6, 3e-6, 500e-6, 0.1] {
        let share = (envelope_v - f64::from(measuring.rest_v[0]))
            / f64::from(measuring.mvc_v[0] - measuring.rest_v[0]);
        let back = volts(share as f32, measuring.rest_v[0], measuring.mvc_v[0]).unwrap();
        assert!((back - envelope_v).abs() <= 1e-6 * envelope_v);
    }
    assert_eq!(volts(0.0, 10e-6, 500e-6), None, "cut off: at most 10 uV");
    assert_eq!(volts(f32::NAN, 0.0, 1e-3), None);
    let half = volts(0.5, 10e-6, 500e-6).unwrap();
    assert!((half - 255e-6).abs() < 1e-10);
}

/// Measures with `spoil` until the step named, then that one with it.
fn problem_at(name: &str, spoil: Spoil) -> (String, Guide, Simulated) {
    let mut simulated = Simulated::new(3);
    let mut guide = begin();
    while guide.view().name != name {
        measure(&mut guide, &mut simulated, NOTHING);
        assert!(guide.go_on());
    }
    measure(&mut guide, &mut simulated, spoil);
    let view = guide.view();
    assert!(!view.done && !guide.go_on(), "{name} must not pass");
    (view.problem.expect("a problem"), guide, simulated)
}

#[test]
fn what_went_wrong_is_told_and_the_step_done_again() {
    let moved: Spoil = |t, v, _, _| v[2] *= if t > 2.0 && t < 3.0 { 6.0 } else { 1.0 };
    let weak: Spoil = |_, v, _, _| v[3] = 12e-6;
    let saturated: Spoil = |t, _, good, _| good[1] = !(1.5..=2.5).contains(&t);
    let nan: Spoil = |_, v, _, _| v[0] = f64::NAN;
    let unseen: Spoil = |t, _, _, hand| {
        if t > 1.8 {
            *hand = None;
        }
    };
    let shaking: Spoil = |t, _, _, hand| {
        if let Some([x, ..]) = hand {
            *x += 0.08 * (9.0 * t).sin();
        }
    };
    let far: Spoil = |_, _, _, hand| *hand = hand.map(|[x, y, z]| [x + 0.8, y, z]);
    let loose: Spoil = |_, v, _, _| *v = v.map(|v| 0.02 * v + 4e-6);
    let cases: [(&str, Spoil, &[&str]); 8] = [
        ("rest", moved, &["triceps lateral head", "Not at rest"]),
        (
            "contract",
            weak,
            &["triceps long head 12.0 uV against 5.0 uV", "all strength"],
        ),
        (
            "contract",
            saturated,
            &["biceps long head (25 % of the time)", "Clean the skin"],
        ),
        ("rest", nan, &["biceps short head (100 % of the time)"]),
        ("load", unseen, &["The hand was seen in"]),
        ("load", shaking, &["The hand moved by", "hold it still"]),
        ("load", far, &["check the shoulder's position"]),
        ("load", loose, &["10 % are wanted"]),
    ];
    for (name, spoil, words) in cases {
        let (problem, mut guide, mut simulated) = problem_at(name, spoil);
        for word in words {
            assert!(problem.contains(word), "{name}: {problem}");
        }
        measure(&mut guide, &mut simulated, NOTHING);
        assert!(
            guide.view().done && guide.view().problem.is_none(),
            "{name} again"
        );
        assert!(guide.go_on());
    }
}

#[test]
fn a_link_that_loses_most_is_a_problem_and_blunders_of_the_tracker_are_not() {
    let mut simulated = Simulated::new(4);
    let mut guide = begin();
    let task = guide.task();
    guide.start();
    let mut count = 0;
    simulated.give(
        7.0,
        &task,
        |at_us, measured| {
            count += 1;
            if count % 2 == 0 {
                guide.sample(at_us, measured);
            }
        },
        NOTHING,
    );
    let problem = guide.view().problem.unwrap();
    assert!(problem.contains("of 400 samples arrived"), "{problem}");
    let blunder: Spoil = |t, _, _, hand| {
        if (t * 100.0).round() % 5.0 == 0.0 {
            *hand = hand.map(|[x, y, z]| [x, y + 0.3, z]);
        }
    };
    let mut simulated = Simulated::new(5);
    simulated.hand_noise_m = 1e-4;
    let mut guide = begin();
    while guide.result().is_none() {
        measure(&mut guide, &mut simulated, blunder);
        assert!(guide.go_on(), "{:?}", guide.view());
    }
    let [low, high] = guide.result().unwrap().fit.interval(2, 0.999);
    assert!(
        low < 15.0 && 15.0 < high && high - low < 1.0,
        "{low} {high}"
    );
}

#[test]
fn nobody_is_calibrated_who_cannot_be() {
    let begin = |person: &Person, muscles: &[Muscle]| {
        Guide::begin(person, muscles, 1000.0, 1)
            .map(|_| ())
            .unwrap_err()
    };
    let small = Person {
        body_height_m: 175.0,
        ..person()
    };
    assert!(matches!(begin(&small, &MUSCLES), GuideError::Person(_)));
    let train = Person {
        mains_hz: Some(16),
        ..person()
    };
    assert_eq!(begin(&train, &MUSCLES), GuideError::Mains { got_hz: 16 });
    assert_eq!(
        begin(&person(), &[]),
        GuideError::Channels { got: 0, most: 8 }
    );
    assert_eq!(
        begin(&person(), &[Muscle::Other; 4]),
        GuideError::NoArmMuscle
    );
}

#[test]
fn samples_without_a_step_and_steps_without_samples_change_nothing() {
    let mut guide = begin();
    let before = guide.view();
    let measured = Measured {
        envelope_v: &[1e-6; 4],
        good: &[true; 4],
        hand_m: None,
    };
    guide.sample(1, &measured);
    assert_eq!(guide.view(), before);
    assert!(!guide.go_on());
    guide.start();
    guide.sample(1, &measured);
    // The clock stands, then goes back: nothing ends, nothing panics.
    for _ in 0..1000 {
        guide.sample(1, &measured);
        guide.sample(0, &measured);
    }
    assert!(guide.view().measuring && guide.view().progress == 0.0);
}

use super::*;

fn reference(person: &Simulated) -> Pattern {
    Pattern {
        rest_v: person.rest_v.to_vec(),
        flex_v: person.envelopes_v(&Task::Flex).to_vec(),
        extend_v: person.envelopes_v(&Task::Extend).to_vec(),
    }
}

/// A check in which the envelopes go through `worn` first.
fn check(worn: fn([f64; 4]) -> [f64; 4]) -> Verdict {
    let mut person = Simulated::new(11);
    let mut check = FitCheck::begin(reference(&person), &MUSCLES).unwrap();
    for name in ["fit_flex", "fit_extend"] {
        assert_eq!(check.view().name, name);
        let task = check.task();
        check.start();
        person.give(
            5.0,
            &task,
            |at_us, measured| check.sample(at_us, measured),
            |_, v, _, _| *v = worn(*v),
        );
        assert!(check.view().done);
        check.go_on();
    }
    check.verdict().unwrap().clone()
}

#[test]
fn what_happened_to_the_electrodes_is_named() {
    assert_eq!(check(|v| v).findings, []);
    assert_eq!(check(|v| v.map(|v| 1.7 * v)).findings, [], "worked harder");
    let dead = check(|[a, b, _, d]| [a, b, 3e-6, d]);
    assert_eq!(dead.findings, [Finding::Dead(vec![2])]);
    assert!(
        dead.text.contains("channel 3 (triceps lateral head)"),
        "{}",
        dead.text
    );
    let swapped = check(|[a, b, c, d]| [c, b, a, d]);
    assert_eq!(swapped.findings, [Finding::Swapped(vec![(0, 2), (2, 0)])]);
    assert!(
        swapped
            .text
            .contains("channel 1 (biceps short head) shows what channel 3"),
        "{}",
        swapped.text
    );
    let all = check(|[a, b, c, d]| [d, c, b, a]);
    assert_eq!(
        all.findings,
        [Finding::Swapped(vec![(0, 3), (1, 2), (2, 1), (3, 0)])]
    );
    let shifted = check(|[a, b, c, d]| [a, 0.2 * b, c, d]);
    assert!(
        matches!(shifted.findings[..], [Finding::Shifted(1, factor)] if (factor - 0.2).abs() < 0.05)
    );
    let nothing = check(|_| [4e-6; 4]);
    assert_eq!(nothing.findings, [Finding::Nothing]);
}

#[test]
fn a_pattern_of_another_wearable_is_refused() {
    let person = Simulated::new(12);
    let mut pattern = reference(&person);
    assert_eq!(
        FitCheck::begin(pattern.clone(), &MUSCLES[..3]).map(|_| ()),
        Err(FitCheckError::Channels {
            expected: 4,
            got: 3
        })
    );
    pattern.flex_v[1] = f64::NAN;
    assert_eq!(
        FitCheck::begin(pattern, &MUSCLES).map(|_| ()),
        Err(FitCheckError::Broken)
    );
}

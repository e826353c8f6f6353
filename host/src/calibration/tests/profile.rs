//! What is kept of a person, and what damage does.

use super::*;

fn profile() -> (Profile, Outcome) {
    let outcome = guide::measure_all(&mut Simulated::new(3));
    let outcome = outcome.result().unwrap().clone();
    (Profile::new(&person(), &outcome), outcome)
}

#[test]
fn a_profile_comes_back_with_the_calibration_that_was_measured() {
    let (profile, outcome) = profile();
    let again = Profile::parse(&profile.text()).unwrap();
    assert_eq!(again, profile);
    assert_eq!(again.calibration().unwrap(), outcome.calibration);
    assert_eq!(again.pattern, outcome.pattern);
    assert_eq!(again.result, outcome.result);
}

#[test]
fn what_is_no_profile_is_refused_and_said_why() {
    let (profile, _) = profile();
    let text = profile.text();
    let refused = |from: &str, to: &str| {
        let changed = text.replacen(from, to, 1);
        assert_ne!(changed, text, "{from}");
        Profile::parse(&changed).unwrap_err().to_string()
    };
    assert!(refused("\"schema_version\": 1", "\"schema_version\": 7").contains("version 7"));
    assert!(refused("biceps_short", "deltoid").contains("`deltoid`"));
    assert!(refused("\"biceps_short\",", "").contains("3 muscles, 4 rests"));
    assert!(refused("\"l1\":", "\"l3\":").contains("l3"));
    assert!(refused("\"body_mass_kg\": 75.0", "\"body_mass_kg\": -75.0").contains("no wearable"));
    for end in 0..text.trim_end().len() {
        if text.is_char_boundary(end) {
            assert!(Profile::parse(&text[..end]).is_err(), "cut at {end}");
        }
    }
}

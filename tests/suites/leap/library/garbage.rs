//! What no tracker sends is passed over.

use rand::{RngExt as _, SeedableRng as _};
use rand_chacha::ChaCha8Rng;
use serde_json::{Value, json};
use tonus::leap::{FrameError, Refusal, Update};
use tonus_native::leapc::Unreadable;

use super::{Library, PATIENCE, PERIOD_US, begin, is_lost, live, right, sights, step};
use crate::service::updates;

/// Frames that no tracker sends.
fn nonsense(random: &mut ChaCha8Rng, k: u64) -> Value {
    let mut hand = right([10.0, k as f64, -20.0]);
    let mut told = json!({ "id": k, "timestamp": k * PERIOD_US, "hands": [] });
    let field =
        ["palmPosition", "palmVelocity", "palmNormal", "direction"][random.random_range(0..4)];
    match random.random_range(0..9) {
        0 => return json!("no_frame"),
        1 => {
            told["count"] = json!(random.random_range(1..=u32::MAX));
            told["no_hands"] = json!(true);
        }
        // More than are there; as many as could be read would be as many as are checked.
        2 => told["count"] = json!(random.random_range(9..=1_000_000_000_u32)),
        3 => told["count"] = json!(1_000_000_000_u32),
        4 => {
            hand[field] = json!([0.0, null, 0.0]);
            told["hands"] = json!([hand]);
        }
        5 => {
            hand[field] = json!([1e39, 0.0, 0.0]);
            told["hands"] = json!([hand]);
        }
        6 => {
            hand["palmPosition"] = json!([0.0, 5_001.0, 0.0]);
            told["hands"] = json!([hand]);
        }
        7 => {
            hand["confidence"] = json!(-1.0);
            told["hands"] = json!([hand]);
        }
        _ => {
            told["absolute"] = json!(true);
            told["timestamp"] = json!(-random.random_range(1..=i64::MAX));
        }
    }
    json!({ "frame": told })
}

#[test]
fn garbage_is_passed_over() {
    let mut random = ChaCha8Rng::seed_from_u64(12);
    let mut script = begin();
    let mut garbage = 0;
    for k in 0..150 {
        script.extend(live(k..k + 1));
        for _ in 0..10 {
            let mut act = nonsense(&mut random, k);
            // A number that would be the newest, were it believed.
            if let Some(told) = act.get_mut("frame") {
                told["id"] = json!(random.random_range(1_000..=i64::MAX));
            }
            script.push(step(k * PERIOD_US, &act));
            garbage += 1;
        }
    }
    script.push(step(150 * PERIOD_US, &json!("connection_lost")));
    let library = Library::playing(&[script]);
    let mut leap = library.follow();
    let all = updates(&mut leap, PATIENCE, is_lost);
    assert_eq!(leap.counts().malformed, garbage, "{:?}", leap.counts());
    let given = sights(&all);
    assert!(given.len() > 60, "{:?}", leap.counts());
    for sight in given {
        assert!(
            (1e3 * sight.hand.palm_m[1] - sight.frame_id as f64).abs() < 1e-6,
            "{sight:?}"
        );
    }
    let kinds = |wanted: fn(&Unreadable) -> bool| {
        let told = |update: &&Update| match update {
            Update::Refused(Refusal::Frame(FrameError::LeapC(unreadable))) => wanted(unreadable),
            _ => false,
        };
        all.iter().filter(told).count()
    };
    assert!(kinds(|told| matches!(told, Unreadable::NoFrame)) > 50);
    assert!(
        kinds(|told| matches!(
            told,
            Unreadable::TooManyHands {
                count: 1_000_000_000
            }
        )) > 50
    );
    assert!(
        kinds(|told| matches!(
            told,
            Unreadable::NotFinite {
                field: "palm.position"
            }
        )) > 10
    );
}

#[test]
fn hands_that_are_counted_but_not_there_are_none() {
    let mut script = begin();
    for count in 1..=9_u32 {
        let told =
            json!({ "id": 1, "timestamp": 0, "hands": [], "count": count, "no_hands": true });
        script.push(step(0, &json!({ "frame": told })));
    }
    let library = Library::playing(&[script]);
    let all = updates(&mut library.follow(), PATIENCE, |all| all.len() == 10);
    for (count, update) in (1..=9_u32).zip(&all[1..]) {
        let Update::Refused(Refusal::Frame(FrameError::LeapC(got))) = update else {
            panic!("{update:?}");
        };
        let expected = match count {
            9 => Unreadable::TooManyHands { count },
            count => Unreadable::NoHands { count },
        };
        assert_eq!(*got, expected);
    }
}

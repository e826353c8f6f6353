//! Through LeapC: a library with its functions and layouts plays what a test writes (see `tests/leapc-stand`).

mod garbage;
mod program;

use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tempfile::TempDir;
use tonus::leap::{Leap, Loss, Origin, Protocol, Refusal, Sight, Update};
use tonus_native::leapc::LeapCError;
use tonus_tests::{leapc_stand, recordings};

use super::recorded::{agrees, messages, rows, stamp};
use super::service::{follow, seen, updates};

const PATIENCE: Duration = Duration::from_secs(20);
const PERIOD_US: u64 = 9_000;

/// A library that plays these connections, one after the other. It is a file of its own, so that its state is too.
struct Library {
    directory: TempDir,
}

impl Library {
    fn playing(connections: &[Vec<Value>]) -> Self {
        let this = Self {
            directory: TempDir::new().unwrap(),
        };
        std::fs::copy(leapc_stand(), this.file()).unwrap();
        let script = this.directory.path().join("libLeapC.so.json");
        std::fs::write(script, json!(connections).to_string()).unwrap();
        this
    }

    fn file(&self) -> std::path::PathBuf {
        self.directory.path().join("libLeapC.so")
    }

    fn follow(&self) -> Leap {
        follow(Origin::LeapC(Some(self.file())))
    }
}

fn step(at_us: u64, act: &Value) -> Value {
    json!({ "at_us": at_us, "act": act })
}

fn begin() -> Vec<Value> {
    vec![step(0, &json!("connection")), step(0, &json!("device"))]
}

fn right(palm_mm: [f64; 3]) -> Value {
    json!({ "id": 1, "type": "right", "palmPosition": palm_mm, "confidence": 1.0 })
}

/// A frame that comes in period `comes`, of the picture taken in period `k`.
fn frame(comes: u64, k: u64, hands: &[Value]) -> Value {
    let told = json!({ "id": k, "timestamp": k * PERIOD_US, "hands": hands });
    step(comes * PERIOD_US, &json!({ "frame": told }))
}

/// Right hands in time; the palm's height says which picture it is.
fn live(periods: std::ops::Range<u64>) -> impl Iterator<Item = Value> {
    periods.map(|k| frame(k, k, &[right([10.0, k as f64, -20.0])]))
}

fn sights(all: &[Update]) -> Vec<Sight> {
    let sight = |update: &Update| match update {
        Update::Seen(sight) => Some(*sight),
        _ => None,
    };
    all.iter().filter_map(sight).collect()
}

fn is_lost(all: &[Update]) -> bool {
    matches!(all.last(), Some(Update::Lost(_)))
}

#[test]
fn recorded_frames_give_the_recorded_path() {
    for name in ["pinch", "wave"] {
        let file = recordings().join(format!("leapjs_playback_v6/{name}_frames_v6.jsonl"));
        let (messages, rows) = (messages(name), rows(name));
        let (first, last) = (stamp(&messages[0]), stamp(messages.last().unwrap()));
        // Empty frames before it, from which the clock is learnt.
        let preface = (1..=40_u64).map(|back| {
            let told = json!({ "id": first.0 - 41 + back.cast_signed(), "timestamp": back * PERIOD_US, "hands": [] });
            step(back * PERIOD_US, &json!({ "frame": told }))
        });
        let mut script = begin();
        script.extend(preface);
        script.push(step(41 * PERIOD_US, &json!({ "recording": file })));
        let ends_us = 41 * PERIOD_US + last.1 - first.1 + 50_000;
        script.push(step(ends_us, &json!("connection_lost")));
        let library = Library::playing(&[script]);

        let mut leap = library.follow();
        let all = updates(&mut leap, PATIENCE, is_lost);
        assert!(
            matches!(
                all[0],
                Update::Connected {
                    protocol: Protocol::LeapC
                }
            ),
            "{:?}",
            all[0]
        );
        let given = sights(&all);
        let row = |sight: &Sight| &rows[usize::try_from(sight.frame_id - first.0).unwrap()];
        for sight in &given {
            agrees(sight, row(sight));
            // Both clocks are this computer's: what lies between pictures is known as well as the clocks are read.
            let since = sight.exposed_us as f64 - given[0].exposed_us as f64;
            let expected = 1e6 * (row(sight).t_s - row(&given[0]).t_s);
            assert!((since - expected).abs() <= 1_000.0, "{sight:?}");
        }
        let counts = leap.counts();
        let late = counts.stale + counts.settling.saturating_sub(40);
        assert_eq!(
            given.len() as u64 + late,
            messages.len() as u64,
            "{counts:?}"
        );
        assert!(given.len() >= 100, "{counts:?}");
    }
}

#[test]
fn frozen_frames_show_no_hand() {
    let mut script = begin();
    script.extend(live(0..61));
    // The picture of period 60 again and again, then live ones.
    script.extend((61..115).map(|k| frame(k, 60, &[right([10.0, 60.0, -20.0])])));
    script.extend(live(115..160));
    let library = Library::playing(&[script]);
    let mut leap = library.follow();
    let until = Instant::now() + PATIENCE;
    let mut frozen = 0;
    let mut given = Vec::new();
    while given.last() != Some(&159) && Instant::now() < until {
        match leap.receive(Duration::from_millis(20)) {
            Some(Update::Seen(sight)) => given.push(sight.frame_id),
            Some(Update::Refused(Refusal::Repeated {
                newest_id: 60,
                got_id: 60,
            })) => frozen += 1,
            _ => {}
        }
        // After ten of them, the last live one is 100 ms old.
        assert!(!(12..54).contains(&frozen) || leap.hand().is_none());
    }
    assert_eq!(frozen, 54);
    assert!(given.iter().all(|id| *id <= 60 || *id >= 115), "{given:?}");
    assert!(given.contains(&60) && given.contains(&159), "{given:?}");
}

#[test]
fn what_lags_from_the_first_frame_on_is_seen_to_be_old() {
    // Every frame 300 ms late: over the WebSocket nothing would show it.
    let mut script = begin();
    script.extend((0..120).map(|k| frame(k + 34, k, &[right([0.0, 200.0, 0.0])])));
    let library = Library::playing(&[script]);
    let mut leap = library.follow();
    let all = updates(&mut leap, PATIENCE, |all| all.len() > 120);
    assert_eq!(seen(&all), 0);
    let ages: Vec<u64> = (all.iter())
        .filter_map(|update| match update {
            Update::Refused(Refusal::Stale { age_us }) => Some(*age_us),
            _ => None,
        })
        .collect();
    assert!(ages.len() > 60, "{:?}", leap.counts());
    // A busy machine hands some over even later.
    assert!(ages.iter().all(|age| *age >= 306_000 - 2_000), "{ages:?}");
    assert!(ages.iter().any(|age| *age < 330_000), "{ages:?}");
}

#[test]
fn a_service_that_goes_is_said_to_be_gone_and_found_again() {
    let ended = |mut script: Vec<Value>, act: &Value| {
        script.extend(live(0..60));
        script.push(step(60 * PERIOD_US, act));
        script
    };
    let endings = [
        json!("connection_lost"),
        json!({ "code": 0xE201_0005_u32 }),
        json!("device_lost"),
        json!({ "device_failure": 0xE801_0003_u32 }),
        json!({ "code": 0xE201_0000_u32 }),
    ];
    let library = Library::playing(&endings.map(|act| ended(begin(), &act)));
    let mut leap = library.follow();
    for ending in 0..5 {
        let all = updates(&mut leap, PATIENCE, is_lost);
        let Some(Update::Lost(loss)) = all.last() else {
            panic!("{ending}: {all:?}");
        };
        let expected = match ending {
            0 | 1 => matches!(loss, Loss::ServiceGone),
            2 => matches!(loss, Loss::Unplugged),
            3 => matches!(
                loss,
                Loss::Failed {
                    status: 0xE801_0003
                }
            ),
            _ => matches!(
                loss,
                Loss::LeapC(LeapCError::Failed {
                    call: "LeapPollConnection",
                    code: 0xE201_0000
                })
            ),
        };
        assert!(expected, "{ending}: {loss:?}");
        assert!(leap.hand().is_none(), "{ending}");
        // The numbers begin again, the clock goes on; each time the hand is a new one.
        let given = sights(&all);
        assert!(given.len() >= 10, "{ending}: {:?}", leap.counts());
        assert!(given[0].new_hand && given.iter().skip(1).all(|sight| !sight.new_hand));
    }
    // Then there is none any more.
    let all = updates(&mut leap, PATIENCE, is_lost);
    assert!(
        matches!(all[..], [Update::Lost(Loss::NoService)]),
        "{all:?}"
    );
}

#[test]
fn a_service_without_a_tracker_is_left_and_asked_again() {
    let library = Library::playing(&[vec![step(0, &json!("connection"))]]);
    let began = Instant::now();
    let all = updates(&mut library.follow(), PATIENCE, is_lost);
    let Some(Update::Lost(loss @ Loss::Silent)) = all.last() else {
        panic!("{all:?}");
    };
    assert!(loss.to_string().contains("plugged in"), "{loss}");
    assert!(began.elapsed() >= Duration::from_secs(3));
}

#[test]
fn of_two_hands_the_wanted_one() {
    let hands = |k: u64| {
        let left = json!({ "id": 7, "type": "left", "palmPosition": [-100.0, 300.0, 0.0], "confidence": 1.0 });
        match k {
            // Alone, and then for a while hidden.
            40..60 => vec![right([10.0, k as f64, 0.0])],
            80..100 => vec![left],
            _ => vec![left, right([10.0, k as f64, 0.0])],
        }
    };
    let mut script = begin();
    script.extend((0..120).map(|k| frame(k, k, &hands(k))));
    script.push(step(120 * PERIOD_US, &json!("connection_lost")));
    let library = Library::playing(&[script]);
    let all = updates(&mut library.follow(), PATIENCE, is_lost);
    let given = sights(&all);
    assert!(given.len() > 40, "{}", given.len());
    for sight in given {
        assert_eq!(sight.hand.id, 1);
        assert!(!(80..100).contains(&sight.frame_id), "{sight:?}");
    }
    let unseen = all
        .iter()
        .filter(|update| matches!(update, Update::Unseen))
        .count();
    // Some may come too late on a busy machine.
    assert!((5..=20).contains(&unseen), "{unseen}");
}

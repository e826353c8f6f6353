//! Frames of a real service.

use std::time::Duration;

use serde_json::Value;
use tonus::leap::{Content, Follower, Message, Side, Sight, Update, Wanted, parse};
use tonus_tests::recordings;

use super::service::{Client, serve, updates};
use super::{VERSION, frame};

/// A row of the path that others read out of the same frames.
pub(crate) struct Row {
    pub(crate) t_s: f64,
    palm_m: [f64; 3],
    grab: f64,
    pinch: f64,
    confidence: f64,
    hand: i64,
}

pub(crate) fn rows(name: &str) -> Vec<Row> {
    let path = recordings().join(format!("leapjs_playback_v6/csv/{name}.csv"));
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader
        .records()
        .map(|record| {
            let record = record.unwrap();
            let number = |at: usize| record[at].parse::<f64>().unwrap();
            assert_eq!(&record[8], "right");
            Row {
                t_s: number(0),
                palm_m: [number(1), number(2), number(3)],
                grab: number(4),
                pinch: number(5),
                confidence: number(6),
                hand: record[7].parse().unwrap(),
            }
        })
        .collect()
}

/// Messages as the service sent them.
pub(crate) fn messages(name: &str) -> Vec<String> {
    let path = recordings().join(format!("leapjs_playback_v6/{name}_frames_v6.jsonl"));
    let text = std::fs::read_to_string(path).unwrap();
    text.lines().map(str::to_owned).collect()
}

pub(crate) fn stamp(message: &str) -> (i64, u64) {
    let value: Value = serde_json::from_str(message).unwrap();
    (
        value["id"].as_i64().unwrap(),
        value["timestamp"].as_u64().unwrap(),
    )
}

pub(crate) fn agrees(sight: &Sight, row: &Row) {
    let hand = &sight.hand;
    assert_eq!((hand.id, hand.side), (row.hand, Some(Side::Right)));
    let all = hand.palm_m.iter().zip(&row.palm_m);
    for (got, expected) in all {
        assert!((got - expected).abs() <= 1e-6, "{hand:?}");
    }
    for (got, expected) in [
        (hand.grab, row.grab),
        (hand.pinch, row.pinch),
        (hand.confidence, row.confidence),
    ] {
        assert!((got.unwrap() - expected).abs() <= 1e-6, "{hand:?}");
    }
}

/// Empty frames before a recording, from which the service's clock is learnt: number and time before its first.
const PREFACE: u64 = 40;
const PREFACE_US: u64 = 9_000;

fn preface(first: (i64, u64)) -> impl Iterator<Item = (u64, String)> {
    (1..=PREFACE).rev().map(move |back| {
        let at = first.1 - back * PREFACE_US;
        (at, frame(first.0 - back.cast_signed(), at, &[]))
    })
}

#[test]
fn recorded_frames_give_the_recorded_path() {
    for (name, expected_rows) in [("pinch", 120), ("wave", 111)] {
        let (messages, rows) = (messages(name), rows(name));
        assert_eq!(messages.len(), expected_rows);
        let first = stamp(&messages[0]);
        let mut follower = Follower::new(Wanted::Only(Side::Right), 0);
        follower.take(VERSION, 0).unwrap();
        // Host time is the service's plus a constant, and the frames come a millisecond late.
        let host = |service_us: u64| service_us + 5_001_000 - first.1;
        for (at, text) in preface(first) {
            let _ = follower.take(&text, host(at));
        }
        for (message, row) in messages.iter().zip(&rows) {
            let at = host(stamp(message).1);
            let Ok(Message::Seen(sight)) = follower.take(message, at) else {
                panic!("{name}: {row_t} s is not seen", row_t = row.t_s);
            };
            agrees(&sight, row);
            let since_first = sight.exposed_us as f64 - host(first.1) as f64;
            assert!((since_first - 1e6 * row.t_s).abs() <= 2.0, "{sight:?}");
        }
    }
}

#[test]
fn served_frames_give_the_recorded_path() {
    for name in ["pinch", "wave"] {
        let (messages, rows) = (messages(name), rows(name));
        let first = stamp(&messages[0]);
        let frames = messages.len();
        let (mut leap, service) = serve(move |listener| {
            let mut client = Client::accept(listener);
            assert_eq!(client.path, "/v6.json");
            client.say(VERSION);
            let recorded = messages
                .into_iter()
                .map(|message| (stamp(&message).1, message));
            let mut all = preface(first).chain(recorded);
            let began = std::time::Instant::now();
            let mut next = all.next();
            while let Some((at, text)) = next {
                let due = Duration::from_micros(at - (first.1 - PREFACE * PREFACE_US));
                std::thread::sleep(due.saturating_sub(began.elapsed()));
                client.say(text);
                next = all.next();
            }
        });
        let all = updates(&mut leap, Duration::from_secs(10), |all| {
            matches!(all.last(), Some(Update::Lost(_)))
        });
        service.join().unwrap();
        let mut given = 0;
        for update in &all {
            if let Update::Seen(sight) = update {
                let row = usize::try_from(sight.frame_id - first.0).unwrap();
                agrees(sight, &rows[row]);
                given += 1;
            }
        }
        // A busy machine may bring some too late, and says so; it may lose none.
        let counts = leap.counts();
        let late = counts.stale + counts.settling.saturating_sub(PREFACE);
        assert_eq!(given + late, frames as u64, "{counts:?}");
        assert!(given >= 100, "{counts:?}");
    }
}

#[test]
fn what_the_bridge_leaves_out_and_adds_is_no_matter() {
    let text = r#"{"id":7,"timestamp":90,"devices":[],"hands":[{"id":3,"type":"left","palmPosition":[1,2,3],
        "palmWidth":85.1,"grabAngle":0.2,"pinchDistance":31.0,"elbow":[0,0,0],"wrist":[0,0,0],"confidence":1,
        "armBasis":[[1,0,0],[0,1,0],[0,0,1]],"grabStrength":0.25,"palmNormal":null}],"pointables":[{"id":30,
        "bases":[[[1,0,0],[0,1,0],[0,0,1]],[[1,0,0],[0,1,0],[0,0,1]]]}]}"#;
    let Ok(Content::Frame(read)) = parse(text) else {
        panic!("{:?}", parse(text));
    };
    let hand = read.hands[0];
    assert_eq!((read.id, read.timestamp_us, hand.id), (7, 90, 3));
    assert_eq!(hand.side, Some(Side::Left));
    assert_eq!(hand.palm_m, [0.001, 0.002, 0.003]);
    assert_eq!((hand.grab, hand.pinch), (Some(0.25), None));
    assert_eq!((hand.palm_normal, hand.velocity_m_per_s), (None, None));
}

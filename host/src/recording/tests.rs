use std::path::{Path, PathBuf};

use rand::{Rng, RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;

use crate::live::{
    Act, HandSeen, Input, LinkEvent, Message, Person, RecognitionView, RobotSeen, Timed,
    TrackerEvent,
};
use crate::robot::command::{Command, Quality};
use crate::robot::gate::{Cause, State};
use crate::robot::limits::Setpoint;

use super::channel::Channel;
use super::decode::decode;
use super::encode::encode;
use super::{End, Entry, Opening, ReadError, Reading, RecordError, Recorder, recover};

fn opening() -> Opening {
    Opening {
        version: "0.1.0".to_owned(),
        started_unix_us: 1_790_000_000_123_456,
        subject: Some(Person {
            name: "p01".to_owned(),
            body_mass_kg: 71.3,
            body_height_m: 1.79,
            mains_hz: Some(50),
        }),
        configuration: "[page]\nport = 8080\n".to_owned(),
        calibration: Some("l1 = 0.1\n".to_owned()),
        model: Some((0..=255).collect()),
    }
}

/// Any bits, so also what is no number.
fn any(random: &mut ChaCha8Rng) -> f64 {
    f64::from_bits(random.next_u64())
}

fn three(random: &mut ChaCha8Rng) -> [f64; 3] {
    std::array::from_fn(|_| any(random))
}

fn finite(random: &mut ChaCha8Rng) -> f64 {
    loop {
        let value = any(random);
        if value.is_finite() {
            return value;
        }
    }
}

fn bytes(random: &mut ChaCha8Rng, longest: usize) -> Vec<u8> {
    let mut bytes = vec![0; random.random_range(0..=longest)];
    random.fill_bytes(&mut bytes);
    bytes
}

fn input(random: &mut ChaCha8Rng) -> Input {
    match random.random_range(0..11) {
        0 => Input::Link(LinkEvent::Up {
            name: "Tönus \"1\"\n".to_owned(),
            mtu: random.random_bool(0.5).then_some(247),
            interval_us: Some(random.next_u32()),
        }),
        1 => Input::Link(LinkEvent::Down {
            reason: "gone".to_owned(),
        }),
        2 => Input::Tracker(TrackerEvent::Up {
            name: "Leap".to_owned(),
        }),
        3 => Input::Hand(None),
        4 => Input::Hand(Some(HandSeen {
            exposed_us: random.next_u64(),
            position_m: three(random),
        })),
        5 => Input::Robot(RobotSeen {
            measured_us: random.next_u64(),
            position_m: three(random),
            stiffness_n_per_m: three(random),
        }),
        6 => Input::Act(Act::Trim {
            id: random.next_u32(),
            from_s: finite(random),
            to_s: finite(random),
        }),
        7 => Input::Learnt(Ok(bytes(random, 3000))),
        8 => Input::Learnt(Err("too few demonstrations".to_owned())),
        9 => Input::Stalled {
            since_us: random.next_u64(),
        },
        _ => Input::Frame(bytes(random, 250)),
    }
}

fn entry(random: &mut ChaCha8Rng, at_us: u64) -> Entry {
    match random.random_range(0..10) {
        0 => Entry::Command {
            at_us,
            command: Command {
                position_m: three(random),
                velocity_m_per_s: three(random),
                stiffness_n_per_m: three(random),
                damping_ratio: any(random),
                acquired_us: random.next_u64(),
                valid_until_us: random.next_u64(),
                sequence: random.next_u32(),
                boot_id: random.next_u32(),
                quality: Quality::Novel,
            },
        },
        1 => Entry::Setpoint {
            at_us,
            setpoint: Setpoint {
                position_m: three(random),
                velocity_m_per_s: three(random),
                stiffness_n_per_m: three(random),
                damping_ratio: any(random),
            },
            state: State::Disarmed(Cause::OtherBoot),
        },
        2 => Entry::Recognition {
            at_us,
            recognition: RecognitionView {
                labels: vec!["lift".to_owned()],
                posterior: vec![finite(random)],
                decision: Some(("lift".to_owned(), finite(random))),
                ..RecognitionView::default()
            },
        },
        3 => Entry::Message(Message {
            at_us,
            problem: random.random_bool(0.5),
            text: "välue".to_owned(),
        }),
        _ => Entry::Input(Timed {
            at_us,
            input: input(random),
        }),
    }
}

fn entries(seed: u64, count: usize) -> Vec<Entry> {
    let mut random = ChaCha8Rng::seed_from_u64(seed);
    let mut at_us = 0;
    let mut all = Vec::with_capacity(count);
    for _ in 0..count {
        at_us += random.random_range(0..20_000);
        all.push(entry(&mut random, at_us));
    }
    all
}

/// Bits, because NaN differs from itself: the debug form of a number that is none is one word, so messages are compared.
fn same(left: &Entry, right: &Entry) -> bool {
    left.at_us() == right.at_us() && encode(left.clone()) == encode(right.clone())
}

fn record(path: &Path, entries: &[Entry]) {
    let recorder = Recorder::create(path, &opening()).unwrap();
    for entry in entries {
        recorder.note(entry.clone());
    }
    let finished = recorder.finish().unwrap();
    assert_eq!(finished.entries, entries.len() as u64);
    assert_eq!(finished.dropped, 0);
    assert_eq!(finished.bytes, path.metadata().unwrap().len());
}

fn fresh(name: &str) -> (tempfile::TempDir, PathBuf) {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join(name);
    (folder, path)
}

#[test]
fn what_was_written_is_read_in_its_order_bit_for_bit() {
    let (_folder, path) = fresh("whole.mcap");
    let written = entries(1, 3000);
    record(&path, &written);
    let mut reading = Reading::open(&path).unwrap();
    assert_eq!(*reading.opening(), opening());
    let read: Vec<Entry> = reading.by_ref().collect::<Result<_, _>>().unwrap();
    assert_eq!(reading.end(), Some(End::Closed));
    assert_eq!(read.len(), written.len());
    assert!(read.iter().zip(&written).all(|(a, b)| same(a, b)));
    let inputs = written
        .iter()
        .filter(|entry| matches!(entry, Entry::Input(_)));
    assert_eq!(
        Reading::open(&path).unwrap().inputs().count(),
        inputs.count()
    );
}

#[test]
fn numbers_that_json_has_not_keep_their_bits() {
    for bits in [
        0x7ff8_0000_0000_0001_u64,
        0xfff0_0000_0000_0000,
        0x8000_0000_0000_0000,
        1,
    ] {
        let hand = HandSeen {
            exposed_us: u64::MAX,
            position_m: [f64::from_bits(bits), 0.1, -1e-300],
        };
        let input = Input::Hand(Some(hand));
        let (channel, message) = encode(Entry::Input(Timed { at_us: 5, input })).unwrap();
        let Ok(Entry::Input(Timed {
            at_us: 5,
            input: Input::Hand(Some(read)),
        })) = decode(channel, 5, &message)
        else {
            panic!("{message:?}");
        };
        assert_eq!(read.exposed_us, u64::MAX);
        let bits_of = |hand: &HandSeen| hand.position_m.map(f64::to_bits);
        assert_eq!(bits_of(&read), bits_of(&hand));
    }
}

#[test]
fn a_palm_is_what_foxglove_says_a_pose_in_a_frame_is() {
    let hand = HandSeen {
        exposed_us: 12_000_345,
        position_m: [0.25, -0.5, 1.0],
    };
    let input = Input::Hand(Some(hand));
    let (channel, message) = encode(Entry::Input(Timed { at_us: 0, input })).unwrap();
    assert_eq!(channel, Channel::Palm);
    assert_eq!(channel.schema().unwrap().0, "foxglove.PoseInFrame");
    let literal = concat!(
        r#"{"timestamp":{"sec":12,"nsec":345000},"frame_id":"tracker","pose":{"position":{"x":0.25,"y":-0.5,"z":1.0},"#,
        r#""orientation":{"x":0.0,"y":0.0,"z":0.0,"w":1.0}}}"#
    );
    let value = |bytes: &[u8]| serde_json::from_slice::<serde_json::Value>(bytes).unwrap();
    assert_eq!(value(&message), value(literal.as_bytes()));
}

#[test]
fn an_act_that_json_cannot_say_is_counted_not_written() {
    let (_folder, path) = fresh("act.mcap");
    let recorder = Recorder::create(&path, &opening()).unwrap();
    let input = Input::Act(Act::Trim {
        id: 1,
        from_s: f64::NAN,
        to_s: 1.0,
    });
    recorder.note(Entry::Input(Timed { at_us: 1, input }));
    let finished = recorder.finish().unwrap();
    assert_eq!((finished.entries, finished.dropped), (0, 1));
    assert_eq!(Reading::open(&path).unwrap().count(), 0);
}

#[test]
fn cut_at_any_byte_every_whole_message_is_read() {
    let (folder, path) = fresh("whole.mcap");
    // Frames that name themselves, so that each is found in the file.
    let frame = |number: u32| [b"frame".as_slice(), &number.to_le_bytes(), &[0xa5; 7]].concat();
    let written: Vec<Entry> = (0..40)
        .map(|number| {
            let input = Input::Frame(frame(number));
            Entry::Input(Timed {
                at_us: u64::from(number) * 100,
                input,
            })
        })
        .collect();
    record(&path, &written);
    let file = std::fs::read(&path).unwrap();
    let ends: Vec<usize> = (0..40)
        .map(|number| {
            let frame = frame(number);
            let at = file
                .windows(frame.len())
                .position(|window| window == frame)
                .unwrap();
            at + frame.len()
        })
        .collect();
    let (cut, mended) = (
        folder.path().join("cut.mcap"),
        folder.path().join("mended.mcap"),
    );
    let mut in_opening = 0;
    for length in 0..file.len() {
        std::fs::write(&cut, &file[..length]).unwrap();
        let whole = ends.iter().filter(|&&end| end <= length).count();
        let mut reading = match Reading::open(&cut) {
            Ok(reading) => reading,
            Err(ReadError::NotMcap { .. }) if length < 8 => continue,
            Err(ReadError::CutInOpening { offset, .. }) => {
                assert!(whole == 0 && offset <= length as u64);
                in_opening = length;
                continue;
            }
            Err(error) => panic!("cut at {length}: {error}"),
        };
        let read: Vec<Entry> = reading.by_ref().collect::<Result<_, _>>().unwrap();
        assert_eq!(read.len(), whole, "cut at {length}");
        assert!(read.iter().zip(&written).all(|(a, b)| same(a, b)));
        assert!(matches!(reading.end(), Some(End::Cut { .. })));
        if length % 293 == 0 {
            let recovered = recover(&cut, &mended).unwrap();
            assert_eq!(recovered.messages, whole as u64);
            let mut reading = Reading::open(&mended).unwrap();
            assert_eq!(reading.by_ref().count(), whole);
            assert_eq!(reading.end(), Some(End::Closed));
        }
    }
    assert!(in_opening > 500 && in_opening < ends[0]);
}

#[test]
fn damaged_bytes_are_an_error_or_harmless_never_a_panic() {
    let (folder, path) = fresh("whole.mcap");
    record(&path, &entries(2, 60));
    let file = std::fs::read(&path).unwrap();
    let (bad, mended) = (
        folder.path().join("bad.mcap"),
        folder.path().join("mended.mcap"),
    );
    let mut random = ChaCha8Rng::seed_from_u64(3);
    let mut found = 0;
    for number in 0..600 {
        let mut damaged = file.clone();
        for _ in 0..random.random_range(1..4) {
            let at = random.random_range(0..damaged.len());
            damaged[at] = damaged[at].wrapping_add(random.random_range(1..=255));
        }
        std::fs::write(&bad, &damaged).unwrap();
        match Reading::open(&bad) {
            Ok(reading) => found += usize::from(reading.into_iter().any(|entry| entry.is_err())),
            Err(_) => found += 1,
        }
        // Each recovered file goes to the disk, which takes its time.
        if number % 6 == 0
            && let Ok(recovered) = recover(&bad, &mended)
        {
            let read = Reading::open(&mended).map(|reading| reading.filter(Result::is_ok).count());
            assert!(read.is_err() || read.is_ok_and(|read| read as u64 <= recovered.messages));
        }
    }
    assert!(found > 300, "{found} damages of 600 found");
}

#[test]
fn a_damaged_chunk_says_where_and_recovering_passes_over_it() {
    let (folder, path) = fresh("whole.mcap");
    let frames = |number: u8| {
        let input = Input::Frame(vec![number; 1 << 19]);
        Entry::Input(Timed { at_us: 1, input })
    };
    // Chunks are closed when they exceed a megabyte: two frames each.
    record(&path, &(0..9).map(frames).collect::<Vec<_>>());
    let mut file = std::fs::read(&path).unwrap();
    let at = file.windows(64).position(|w| w == [4; 64]).unwrap();
    file[at] = 5;
    std::fs::write(&path, file).unwrap();
    let error = Reading::open(&path).unwrap().find_map(Result::err).unwrap();
    let ReadError::Checksum { offset, .. } = error else {
        panic!("{error}");
    };
    assert!(offset < at as u64 && at as u64 - offset < 2 << 20);
    let recovered = recover(&path, &folder.path().join("mended.mcap")).unwrap();
    assert_eq!((recovered.messages, recovered.damaged), (7, 1));
}

#[test]
fn a_recording_is_never_written_over() {
    let (_folder, path) = fresh("there.mcap");
    std::fs::write(&path, "mine").unwrap();
    let refused = Recorder::create(&path, &opening());
    assert!(matches!(refused, Err(RecordError::Create { .. })));
    assert_eq!(std::fs::read(&path).unwrap(), b"mine");
}

#[test]
fn entries_reach_the_file_while_it_is_open() {
    let (_folder, path) = fresh("open.mcap");
    let recorder = Recorder::create(&path, &opening()).unwrap();
    let opened = recorder.state().bytes;
    recorder.note(Entry::Input(Timed {
        at_us: 7,
        input: Input::Frame(vec![1, 2, 3]),
    }));
    let began = std::time::Instant::now();
    while recorder.state().bytes == opened {
        assert!(began.elapsed().as_secs() < 20, "nothing was flushed");
        std::thread::sleep(std::time::Duration::from_millis(5));
    }
    assert_eq!(Reading::open(&path).unwrap().count(), 1);
    assert_eq!(recorder.state().problem, None);
}

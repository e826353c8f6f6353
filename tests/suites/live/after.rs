//! A recording is the run: in real time too, to its last bit, and as far as it goes where it was cut.

use std::cell::RefCell;
use std::collections::HashMap;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;

use tonus::calibration::Profile;
use tonus::export::{Cell, Rows};
use tonus::library::Library;
use tonus::recording::{Entry, Reading};
use tonus::source::LinkChoice;
use tonus::studio::keep::Keeper;
use tonus::studio::play::{Verdict, play};
use tonus::studio::run::{Plan, run};

use crate::played::DayAfter;
use crate::world::config;

/// Plays what is left of a recording that was cut at this byte.
fn cut(file: &Path, bytes: &[u8], at: usize) -> tonus::studio::play::Played {
    let cut = file.with_extension("cut.mcap");
    std::fs::write(&cut, &bytes[..at]).unwrap();
    play(&cut, |_| {}).unwrap()
}

/// Of a recording that was cut anywhere, everything that it still holds comes out the same.
pub(crate) fn plays_as_far_as_it_goes(file: &Path) {
    let bytes = std::fs::read(file).unwrap();
    let name = b"\"acquired_us\":";
    let commands: Vec<usize> = (bytes.windows(name.len()).enumerate())
        // A schema has the name too, and no number behind it.
        .filter(|(at, window)| *window == name && bytes[at + name.len()].is_ascii_digit())
        .map(|(at, _)| at)
        .collect();
    assert!(commands.len() > 1_000);
    // In the midst of a command: the input that made it is still there.
    for at in [commands[0], commands[100], commands[400]] {
        let played = cut(file, &bytes, at);
        assert_eq!(played.unrecorded, 1, "{played:?}");
        assert!(played.cut.is_some() && played.verdict() != Verdict::Different);
    }
    // Anywhere; multiples of an irrational number lie everywhere.
    for number in 1..=6 {
        let share = (f64::from(number) * 0.618_033_988_75).fract();
        let at = commands[0] + ((commands[600] - commands[0]) as f64 * share) as usize;
        let played = cut(file, &bytes, at);
        assert!(played.cut.is_some(), "{played:?}");
        assert_ne!(played.verdict(), Verdict::Different, "at {at}: {played:?}");
    }
    // A command of another run is noticed, and so is a set-point.
    for name in [&b"/robot/command"[..], b"/robot/setpoint"] {
        let other = changed(file, name);
        let played = play(&other, |_| {}).unwrap();
        assert_eq!(played.verdict(), Verdict::Different, "{played:?}");
        assert!(played.first_different_us.is_some());
    }
}

/// The same recording, in whose midst one number is another one.
pub(crate) fn changed(file: &Path, topic: &[u8]) -> PathBuf {
    let reading = Reading::open(file).unwrap();
    let to = file.with_extension("changed.mcap");
    let _none = std::fs::remove_file(&to);
    let recorder = tonus::recording::Recorder::create(&to, reading.opening()).unwrap();
    let (mut noted, mut seen) = (0, 0);
    for entry in reading {
        let mut entry = entry.unwrap();
        match &mut entry {
            Entry::Command { command, .. } if topic == b"/robot/command" => {
                seen += 1;
                command.damping_ratio += if seen == 500 { f64::EPSILON } else { 0.0 };
            }
            Entry::Setpoint { setpoint, .. } if topic == b"/robot/setpoint" => {
                seen += 1;
                setpoint.position_m[2] += if seen == 500 { 1e-15 } else { 0.0 };
            }
            _ => {}
        }
        recorder.note(entry);
        noted += 1;
        while noted > recorder.written() + 1_000 {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    }
    assert!(seen > 500);
    assert_eq!(recorder.finish().unwrap().dropped, 0);
    to
}

/// Nobody, nothing and no file.
fn plan(link: LinkChoice) -> Plan {
    Plan {
        config: config(),
        link,
        hands: None,
        ends_with_hands: false,
        seconds: None,
        record: None,
        page: false,
        lsl: false,
        library: None,
        keeper: Keeper::default(),
        person: None,
        seed: 4,
        pace: 1.0,
        ask_passkey: Arc::new(|_| None),
        stop: Arc::default(),
    }
}

/// Devices in their threads, a clock on the wall: the same skills and person, for some seconds.
pub(crate) fn in_real_time(directory: &Path, profile: Profile, library: Library) {
    let file = directory.join("real.mcap");
    let seen = Rc::new(RefCell::new(Vec::new()));
    let watched = Rc::clone(&seen);
    let plan = Plan {
        hands: Some(Box::new(DayAfter::without_recall())),
        seconds: Some(32.0),
        record: Some(file.clone()),
        library: Some(Arc::new(library)),
        person: Some(profile),
        ..plan(LinkChoice::Simulated)
    };
    let ran = run(
        plan,
        |_| {},
        move |view| {
            let recognised = view.recognition.as_ref().map(|r| (r.under_way, r.unknown));
            let messages: Vec<String> = view.messages.iter().map(|m| m.text.clone()).collect();
            watched.borrow_mut().push((recognised, messages));
        },
    );
    let (_, finished) = ran.unwrap().file.unwrap();
    assert_eq!(finished.dropped, 0);
    let seen = seen.take();

    let played = play(&file, |_| {}).unwrap();
    println!("in real time: {played:?}");
    assert!(played.exact(), "{played:?}");
    assert!(
        played.recorded > 100 && played.setpoints > 1_000,
        "{played:?}"
    );

    // What was shown is recorded: every view of a movement, every message once.
    let under_way = |(recognised, _): &&(Option<(bool, bool)>, _)| {
        recognised.is_some_and(|(under_way, _)| under_way)
    };
    let shown = seen.iter().filter(under_way).count();
    let (mut moving, mut told) = (0, HashMap::<String, usize>::new());
    for entry in Reading::open(&file).unwrap() {
        match entry.unwrap() {
            Entry::Recognition { recognition, .. } => moving += usize::from(recognition.under_way),
            Entry::Message(message) => *told.entry(message.text).or_default() += 1,
            _ => {}
        }
    }
    assert!(shown > 20 && moving == shown, "{moving} of {shown}");
    let last = &seen.last().unwrap().1;
    assert!(last.iter().all(|text| told.contains_key(text)), "{told:?}");
    assert!(told.len() <= last.len() && !told.is_empty(), "{told:?}");
    assert!(told.values().all(|times| *times == 1), "{told:?}");
    skills(&file);
    four_times_as_fast(&file);
}

/// In the place of devices and faster, everything is as old and every clock as fast as it was.
fn four_times_as_fast(file: &Path) {
    let seen = Rc::new(RefCell::new(Vec::new()));
    let watched = Rc::clone(&seen);
    let plan = Plan {
        seconds: Some(20.0),
        pace: 4.0,
        ..plan(LinkChoice::Replay(file.to_owned()))
    };
    let began = std::time::Instant::now();
    let ran = run(
        plan,
        |_| {},
        move |view| {
            let rate_ppm = view.clock.as_ref().map(|clock| clock.rate_ppm);
            watched
                .borrow_mut()
                .push((view.at_us, view.link.age_ms, rate_ppm));
        },
    );
    ran.unwrap();
    assert!(
        began.elapsed().as_secs_f64() < 15.0,
        "20 s of session take 5"
    );
    let late = |(at_us, ..): &&(u64, _, _)| *at_us > 10_000_000;
    let seen: Vec<(u64, Option<f64>, Option<f64>)> = seen.take();
    let mut ages_ms: Vec<f64> = seen
        .iter()
        .filter(late)
        .filter_map(|(_, age, _)| *age)
        .collect();
    ages_ms.sort_by(f64::total_cmp);
    let middle_ms = ages_ms[ages_ms.len() / 2];
    let rate_ppm = seen.last().unwrap().2.unwrap();
    println!("four times as fast: {middle_ms:.1} ms old, {rate_ppm:.0} ppm");
    // A packet every 10 ms, 7.5 to 15 ms on its way; the thread that wakes has four times as much of a session to be late by.
    assert!((5.0..60.0).contains(&middle_ms), "{middle_ms} ms");
    // 40 ppm, after twenty seconds known to a hundred.
    assert!(rate_ppm.abs() < 300.0, "{rate_ppm} ppm");
}

/// The table says of each instant what was recognised.
fn skills(file: &Path) {
    let rows = Rows::open(file).unwrap();
    let column = rows
        .columns()
        .iter()
        .position(|c| c.name == "skill")
        .unwrap();
    let named = rows.filter(|row| matches!(row.as_ref().unwrap()[column], Cell::Text(_)));
    let named = named.count();
    assert!(named > 50, "{named} rows name what was recognised");
}

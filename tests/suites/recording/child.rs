//! The program that is killed: this suite again, recording in real time what can be checked entry by entry.

use std::io::{BufRead, BufReader, Write};
use std::path::{Path, PathBuf};
use std::process::{Child, ChildStdout, Command, Stdio};
use std::time::{Duration, Instant};

use tonus::live::{Act, HandSeen, Input, Person, RobotSeen, SessionClock, Timed};
use tonus::recording::{Entry, Opening, Recorder};
use tonus::robot::gate::State;
use tonus::robot::limits::Setpoint;

/// Names the file to the child, and says that it is one.
const TO: &str = "TONUS_TEST_RECORD_TO";

/// With a transport that is not the default's.
pub(crate) const CONFIGURATION: &str = "[page]\nport = 8080\n[wearable]\ntransport_ms = 2.0\n";

/// What every recording of this suite begins with.
pub(crate) fn opening() -> Opening {
    Opening {
        version: "0.1.0".to_owned(),
        started_unix_us: 1_790_000_000_000_000,
        subject: Some(Person {
            name: "p01".to_owned(),
            body_mass_kg: 71.5,
            body_height_m: 1.79,
            mains_hz: Some(50),
        }),
        configuration: CONFIGURATION.to_owned(),
        calibration: None,
        model: Some(vec![7; 20_000]),
    }
}

/// The entry with this number, and nothing but its number and its time decides what it holds.
pub(crate) fn entry(number: u64, at_us: u64) -> Entry {
    let third = number as f64 / 3.0;
    let input = match number % 8 {
        0 => {
            return Entry::Setpoint {
                at_us,
                setpoint: Setpoint {
                    position_m: [third, 0.1, -third],
                    velocity_m_per_s: [0.0; 3],
                    stiffness_n_per_m: [third + 1.0; 3],
                    damping_ratio: 1.0,
                },
                state: State::Following,
            };
        }
        1 => Input::Hand(Some(HandSeen {
            exposed_us: at_us.saturating_sub(number),
            position_m: [third, -third, 1.0 / (third + 1.0)],
        })),
        2 => Input::Hand(None),
        3 => Input::Robot(RobotSeen {
            measured_us: at_us,
            position_m: [third; 3],
            stiffness_n_per_m: [third; 3],
        }),
        4 => Input::Act(Act::Record {
            label: format!("lift {number}"),
        }),
        _ => Input::Frame([number.to_le_bytes().as_slice(), &[0x5a; 81]].concat()),
    };
    Entry::Input(Timed { at_us, input })
}

/// Says how many are recorded, and goes on until it is killed, or, where writing fails, a second longer.
#[test]
fn the_child_records() {
    let Some(path) = std::env::var_os(TO).map(PathBuf::from) else {
        return;
    };
    let clock = SessionClock::start();
    let recorder = Recorder::create(&path, &opening()).expect("a new file");
    let (mut slowest, mut failed_at) = (Duration::ZERO, None);
    let mut out = std::io::stdout();
    let mut number = 0;
    loop {
        // Eight entries in 5 ms: more than wearable, tracker and robot give together.
        for _ in 0..8 {
            let at_us = clock.now_us();
            let began = Instant::now();
            recorder.note(entry(number, at_us));
            slowest = slowest.max(began.elapsed());
            number += 1;
            writeln!(out, "noted {number} {at_us}").expect("the parent listens");
        }
        if let Some(problem) = recorder.state().problem {
            let since = failed_at.get_or_insert_with(Instant::now);
            if since.elapsed() > Duration::from_secs(1) {
                writeln!(out, "problem {} {problem}", slowest.as_micros()).expect("listens");
                writeln!(out, "finish {}", recorder.finish().expect_err("it failed"))
                    .expect("listens");
                return;
            }
        }
        std::thread::sleep(Duration::from_millis(5));
    }
}

/// The command line of a child that records to `path`.
pub(crate) fn command_line() -> [String; 4] {
    let suite = std::env::current_exe().expect("a running test has a path");
    let test = "child::the_child_records".to_owned();
    [
        suite.display().to_string(),
        "--exact".to_owned(),
        "--nocapture".to_owned(),
        test,
    ]
}

/// Starts a child by this command line.
pub(crate) fn start(line: &[String], path: &Path) -> (Child, BufReader<ChildStdout>) {
    let mut command = Command::new(&line[0]);
    command.args(&line[1..]).env(TO, path);
    command.stdout(Stdio::piped()).stderr(Stdio::null());
    let mut child = command.spawn().expect("the child starts");
    let out = BufReader::new(child.stdout.take().expect("piped"));
    (child, out)
}

/// The last number and time that the child said it had noted, from its whole output.
pub(crate) fn last_noted(out: impl BufRead) -> Option<(u64, u64)> {
    let mut last = None;
    for line in out.lines().map_while(Result::ok) {
        let mut words = line.split(' ');
        let noted = words.next() == Some("noted");
        let number = words.next().and_then(|word| word.parse().ok());
        let at_us = words.next().and_then(|word| word.parse().ok());
        if let (true, Some(number), Some(at_us)) = (noted, number, at_us) {
            last = Some((number, at_us));
        }
    }
    last
}

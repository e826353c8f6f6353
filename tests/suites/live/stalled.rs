//! A program that stalls while a robot elsewhere follows, in real time: its recording plays to the last bit of every set-point.

use std::cell::Cell;
use std::path::{Path, PathBuf};
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::channel;
use std::thread::sleep;
use std::time::{Duration, Instant};

use tonus::config::Config;
use tonus::live::{Act, Input, View};
use tonus::recording::{Entry, Reading, recover};
use tonus::studio::hands::Hands;
use tonus::studio::play::{Verdict, play};
use tonus::studio::run::{Plan, run};

use crate::elsewhere::{Heard, controller, plan};

/// Long enough that it falls back, that it is held, that nobody sees it, and that it is disarmed; milliseconds.
const STALLS_MS: [u64; 4] = [200, 90, 12, 650];

/// Arms, asks for a movement, makes the program stall, again and again; at last the robot falls silent.
struct Staller {
    talks: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
    done: Rc<Cell<usize>>,
    since: Instant,
}

impl Staller {
    fn next(&mut self, view: &View) -> Option<Vec<Act>> {
        let (passed, state) = (self.since.elapsed(), view.robot.state.as_str());
        let ask = |label: &str| {
            let label = label.to_owned();
            vec![Act::Ask { label }]
        };
        match self.done.get() {
            0 if view.robot.can_arm && view.at_us > 3_000_000 => Some(vec![Act::Arm]),
            1 if state == "following" => Some(ask("lift_bottle")),
            // While the hand moves, and the robot with it.
            2..=5 if passed > Duration::from_millis(1_200) && state != "disarmed" => {
                sleep(Duration::from_millis(STALLS_MS[self.done.get() - 2]));
                Some(ask("lift_book"))
            }
            6 if state == "disarmed" => Some(Vec::new()),
            7 if passed > Duration::from_millis(500) && state != "disarmed" => {
                self.talks.store(false, Ordering::Relaxed);
                Some(Vec::new())
            }
            8 if passed > Duration::from_millis(900) => {
                assert_eq!(state, "disarmed");
                self.stop.store(true, Ordering::Relaxed);
                Some(Vec::new())
            }
            _ => None,
        }
    }
}

impl Hands for Staller {
    /// The engine's thread calls this: where it sleeps, the program stalls.
    fn look(&mut self, view: &View) -> Vec<Act> {
        // Until it is granted: in a movement a command may be none to arm with.
        if self.done.get() == 7 && view.robot.state == "disarmed" && view.robot.can_arm {
            return vec![Act::Arm];
        }
        let acts = self.next(view);
        if acts.is_some() {
            self.done.set(self.done.get() + 1);
            self.since = Instant::now();
        }
        acts.unwrap_or_default()
    }

    fn over(&self) -> bool {
        false
    }
}

#[test]
fn a_robot_elsewhere_is_told_the_same_again_also_where_the_program_stalled() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("stalled.mcap");
    let done = Rc::new(Cell::new(0));
    let (talks, stop) = (Arc::new(AtomicBool::new(true)), Arc::default());
    let (over, ended) = channel();
    let port = controller(Heard::default(), Arc::clone(&talks), ended);
    let mut config = Config::default();
    config.robot.to = format!("udp:127.0.0.1:{port}");
    let person = Staller {
        talks,
        stop: Arc::clone(&stop),
        done: Rc::clone(&done),
        since: Instant::now(),
    };
    let plan = Plan {
        record: Some(file.clone()),
        ..plan(config, person, stop)
    };
    let (_, finished) = run(plan, |_| {}, |_| {}).unwrap().file.unwrap();
    over.send(()).unwrap();
    assert_eq!(finished.dropped, 0);
    assert_eq!(done.get(), 9, "everything was done in time");

    let told = Told::read(&file);
    for stall_ms in STALLS_MS {
        let longer = told.stalls_us.iter().filter(|us| **us >= 1_000 * stall_ms);
        assert!(longer.count() > 0, "{stall_ms} ms: {:?}", told.stalls_us);
    }
    assert!(told.moved && told.robot > 1_000, "{}", told.robot);

    let played = play(&file, |_| {}).unwrap();
    println!("{} stalls: {played:?}", told.stalls_us.len());
    assert_eq!(played.verdict(), Verdict::Exact, "{played:?}");
    assert_eq!(played.setpoints, told.setpoints);
    assert_eq!(played.uncompared_setpoints, 0);
    assert!(played.setpoints > 500 && played.recorded > 500);

    // A set-point of another run is noticed, also to a robot elsewhere.
    let other = play(&crate::after::changed(&file, b"/robot/setpoint"), |_| {}).unwrap();
    assert_eq!(other.verdict(), Verdict::Different, "{other:?}");

    // A recording that does not tell of stalls plays, and says what it cannot compare.
    let older = play(&of_an_earlier_version(&file), |_| {}).unwrap();
    assert_eq!(older.verdict(), Verdict::Exact, "{older:?}");
    assert_eq!(
        (older.setpoints, older.uncompared_setpoints, older.same),
        (0, told.setpoints, played.same)
    );
    let closed = directory.path().join("closed.mcap");
    recover(&of_an_earlier_version(&file), &closed).unwrap();
    assert_eq!(play(&closed, |_| {}).unwrap().setpoints, 0);
}

/// What the recording tells.
#[derive(Default)]
struct Told {
    stalls_us: Vec<u64>,
    robot: u64,
    setpoints: u64,
    moved: bool,
}

impl Told {
    fn read(file: &Path) -> Self {
        let (mut told, mut first_m) = (Self::default(), None);
        for entry in Reading::open(file).unwrap() {
            match entry.unwrap() {
                Entry::Input(timed) => match timed.input {
                    Input::Stalled { since_us } => told.stalls_us.push(timed.at_us - since_us),
                    Input::Robot(_) => told.robot += 1,
                    _ => {}
                },
                Entry::Setpoint { setpoint, .. } => {
                    told.setpoints += 1;
                    let first_m = *first_m.get_or_insert(setpoint.position_m);
                    told.moved |= (0..3).any(|i| (setpoint.position_m[i] - first_m[i]).abs() > 0.1);
                }
                _ => {}
            }
        }
        told
    }
}

/// The same recording as if it had been made before stalls were told of: the channel has a name that no reader knows.
fn of_an_earlier_version(file: &Path) -> PathBuf {
    let mut bytes = std::fs::read(file).unwrap();
    let (name, other) = (b"/program/stalled", b"/program/unknown");
    let mut at = 8;
    while at + 9 <= bytes.len() {
        let length = u64::from_le_bytes(bytes[at + 1..at + 9].try_into().unwrap()) as usize;
        let body = at + 9..(at + 9 + length).min(bytes.len());
        let places = bytes[body.clone()].windows(name.len()).enumerate();
        let places: Vec<usize> = places
            .filter(|(_, found)| found == name)
            .map(|(place, _)| body.start + place)
            .collect();
        for place in &places {
            bytes[*place..place + other.len()].copy_from_slice(other);
        }
        // A chunk without a checksum is taken as it is.
        if bytes[at] == 6 && !places.is_empty() {
            bytes[body.start + 24..body.start + 28].fill(0);
        }
        at = body.end;
    }
    let to = file.with_extension("earlier.mcap");
    std::fs::write(&to, bytes).unwrap();
    to
}

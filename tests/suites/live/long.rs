//! A long run: nothing grows.

use std::path::PathBuf;

use tonus::live::{Act, Input, Timed, View};
use tonus::recording::{Entry, Finished, Opening, Recorder};
use tonus::robot::command::Command;
use tonus::robot::gate::State;
use tonus::robot::limits::Setpoint;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::story::Story;
use tonus::studio::virtually::Someone;

use crate::world::{config, run};

/// From this minute the story is told, so that there are skills to follow; before it, demonstrations are recorded and forgotten.
const TOLD: u64 = 40;
/// Minutes in which everything is recorded.
const RECORDED: std::ops::Range<u64> = 48..59;
const LABELS: [&str; 3] = ["lift_filter", "lift_bottle", "hand_over"];

/// Asks for a movement every ten seconds, and looks at the memory.
struct Long {
    story: Story,
    told: bool,
    asked_us: u64,
    asked: usize,
    recorded: u64,
    /// Views that show the robot follow.
    followed: u64,
    file: PathBuf,
    recorder: Option<Recorder>,
    noted: u64,
    set_us: u64,
    finished: Option<Finished>,
    /// Resident bytes, once a virtual minute.
    resident: Vec<u64>,
    largest_trace: usize,
    most_messages: usize,
    longest_history: usize,
}

impl Long {
    fn new(file: PathBuf) -> Self {
        Self {
            story: Story::default(),
            told: false,
            asked_us: 0,
            asked: 0,
            recorded: 0,
            followed: 0,
            file,
            recorder: None,
            noted: 0,
            set_us: 0,
            finished: None,
            resident: Vec::new(),
            largest_trace: 0,
            most_messages: 0,
            longest_history: 0,
        }
    }

    fn measure(&mut self, view: &View) {
        let minute = view.at_us / 60_000_000;
        if minute > self.resident.len() as u64 {
            self.resident.push(resident_bytes());
        }
        self.largest_trace = self.largest_trace.max(view.trace.raw_t_s.len());
        self.most_messages = self.most_messages.max(view.messages.len());
        let history = view.recognition.as_ref().map_or(0, |r| r.history.len());
        self.longest_history = self.longest_history.max(history);
        self.followed += u64::from(view.robot.state == "following");
        if RECORDED.contains(&minute) && self.recorder.is_none() {
            let opening = Opening {
                configuration: config().text(),
                ..Opening::default()
            };
            self.recorder = Some(Recorder::create(&self.file, &opening).unwrap());
        }
        if minute >= RECORDED.end
            && let Some(recorder) = self.recorder.take()
        {
            self.finished = Some(recorder.finish().unwrap());
        }
    }

    /// Virtual time runs faster than any disk: the queue must not drop anything here.
    fn note(&mut self, entry: impl FnOnce() -> Entry) {
        let Some(recorder) = &self.recorder else {
            return;
        };
        recorder.note(entry());
        self.noted += 1;
        while self.noted > recorder.written() + 1_000 {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    }

    /// A demonstration now and then, forgotten at once.
    fn shows(&mut self, view: &View) -> Option<Act> {
        if let Some(kept) = view.demonstrations.first() {
            self.recorded += 1;
            return Some(Act::Discard { id: kept.id });
        }
        if view.recording.is_some() {
            let over = view.at_us > self.asked_us + 5_000_000;
            return over.then_some(Act::Stop);
        }
        let label = self.next(view)?;
        Some(Act::Record { label })
    }

    /// The next movement, if it is time for it.
    fn next(&mut self, view: &View) -> Option<String> {
        if view.at_us < self.asked_us + 10_000_000 {
            return None;
        }
        self.asked_us = view.at_us;
        self.asked += 1;
        Some(LABELS[self.asked % LABELS.len()].to_owned())
    }
}

impl Someone for Long {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.measure(view);
        let shows = view.recording.is_some() || !view.demonstrations.is_empty();
        if view.at_us < TOLD * 60_000_000 || (!self.told && shows) {
            return self.shows(view).into_iter().collect();
        }
        self.told = true;
        if !self.story.over() {
            return self.story.look(view);
        }
        if view.robot.state == "disarmed" && view.robot.can_arm {
            return vec![Act::Arm];
        }
        let label = self.next(view);
        label.map(|label| Act::Ask { label }).into_iter().collect()
    }

    fn input(&mut self, at_us: u64, input: &Input) {
        self.note(|| {
            let input = input.clone();
            Entry::Input(Timed { at_us, input })
        });
    }

    fn commanded(&mut self, _devices: &SimulatedDevices, at_us: u64, command: &Command) {
        let command = *command;
        self.note(|| Entry::Command { at_us, command });
    }

    fn set(&mut self, at_us: u64, setpoint: &Setpoint, state: State) {
        if at_us >= self.set_us + 10_000 {
            self.set_us = at_us;
            let setpoint = *setpoint;
            self.note(|| Entry::Setpoint {
                at_us,
                setpoint,
                state,
            });
        }
    }
}

fn resident_bytes() -> u64 {
    let text = std::fs::read_to_string("/proc/self/statm").unwrap();
    let pages: u64 = text.split_whitespace().nth(1).unwrap().parse().unwrap();
    pages * 4096
}

/// An hour: demonstrations, then the story, then a robot that follows.
#[test]
fn memory_is_flat_and_no_queue_grows() {
    let minutes = 60;
    let directory = tempfile::tempdir().unwrap();
    let long = Long::new(directory.path().join("long.mcap"));
    let long = run(SimulatedConfig::default(), long, minutes * 60 + 1);
    assert_eq!(long.story.told().stuck, None);
    let resident = &long.resident;
    // Before the story, which learns; and after it, with the recording, which needs its queue.
    let [early, before, after, late] = [2, 39, 47, 59].map(|minute| resident[minute]);
    println!(
        "{minutes} min: {} demonstrations, {} views follow, {} and {} kB without skills, {} and {} kB with them, {:?}",
        long.recorded,
        long.followed,
        early / 1024,
        before / 1024,
        after / 1024,
        late / 1024,
        long.finished
    );
    assert!(long.recorded > 60);
    // Of some 14 minutes in which a movement of two seconds is asked for every ten.
    assert!(long.followed > 1_000, "{}", long.followed);
    let finished = long.finished.unwrap();
    // A hundred stream packets and a hundred set-points a second, in eleven minutes.
    assert!(finished.dropped == 0 && finished.entries > 11 * 60 * 200);
    // Other tests share the process; a leak of a byte for each scan alone would be 3.6 MB in an hour.
    assert!(
        before < early + 16 * 1024 * 1024,
        "{early} to {before} bytes"
    );
    assert!(late < after + 16 * 1024 * 1024, "{after} to {late} bytes");
    // A view comes every 40 ms: forty scans, and what a lost packet holds back.
    assert!(long.largest_trace <= 400, "{}", long.largest_trace);
    assert!(long.most_messages <= 30 && long.longest_history <= 12);
}

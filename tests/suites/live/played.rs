//! A recording of the whole story, played again.

use std::collections::HashMap;
use std::path::Path;
use std::time::Duration;

use tonus::live::{Act, Input, Inputs, LinkEvent, SessionClock, Timed, View};
use tonus::recording::{Entry, Opening, Reading, Recorder};
use tonus::robot::command::Command;
use tonus::source::replay;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::play::play;
use tonus::studio::story::Story;
use tonus::studio::virtually::Someone;

use crate::taught::Teaches;
use crate::world::{config, run};

struct Recorded {
    /// First shoulder and robot are taught, then the story is told.
    teaches: Teaches,
    story: Story,
    recorder: Recorder,
    noted: u64,
    places: Places,
}

/// Where hands are in the robot's frame by where they are in the shoulder's, both as bits.
type Places = HashMap<[u64; 3], [u64; 3]>;

fn note(places: &mut Places, view: &View) {
    if let Some(hand) = &view.hand
        && let Some(in_robot_m) = hand.in_robot_m
    {
        places.insert(
            hand.position_m.map(f64::to_bits),
            in_robot_m.map(f64::to_bits),
        );
    }
}

impl Recorded {
    /// Virtual time runs faster than any disk: the queue must not drop anything here.
    fn note(&mut self, entry: Entry) {
        self.recorder.note(entry);
        self.noted += 1;
        while self.noted > self.recorder.written() + 1_000 {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    }
}

impl Someone for Recorded {
    fn look(&mut self, view: &View) -> Vec<Act> {
        note(&mut self.places, view);
        if self.teaches.used_us.is_none() {
            return self.teaches.look(view);
        }
        self.story.look(view)
    }

    fn over(&self) -> bool {
        self.story.over()
    }

    fn input(&mut self, at_us: u64, input: &Input) {
        let input = input.clone();
        self.note(Entry::Input(Timed { at_us, input }));
    }

    fn commanded(&mut self, _devices: &SimulatedDevices, at_us: u64, command: &Command) {
        let command = *command;
        self.note(Entry::Command { at_us, command });
    }
}

#[test]
fn the_same_inputs_give_the_same_commands_bit_for_bit() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("story.mcap");
    let opening = Opening {
        configuration: config().text(),
        ..Opening::default()
    };
    let person = Recorded {
        teaches: Teaches::default(),
        places: Places::default(),
        story: Story::default(),
        recorder: Recorder::create(&file, &opening).unwrap(),
        noted: 0,
    };
    let devices = SimulatedConfig {
        seed: 4,
        ..SimulatedConfig::default()
    };
    let person = run(devices, person, 400);
    assert_eq!(person.story.told().stuck, None);
    let recorded = person.places;
    let finished = person.recorder.finish().unwrap();
    assert_eq!(finished.dropped, 0);
    let mut places = Places::default();
    let played = play(&file, None, |view| note(&mut places, view)).unwrap();
    // Views come at other moments, of which many are the same picture of the hand.
    let both = places.iter().filter_map(|(hand, place)| {
        let recorded = recorded.get(hand)?;
        Some(recorded == place)
    });
    let both: Vec<bool> = both.collect();
    assert!(
        both.len() > 200 && both.iter().all(|same| *same),
        "what was touched teaches the same again: {} hands",
        both.len()
    );
    println!("{played:?}, {} bytes", finished.bytes);
    assert!(played.exact(), "{played:?}");
    assert!(
        played.recorded > 3_000 && played.inputs > 20_000,
        "{played:?}"
    );
    again_as_devices(&file);
}

/// The same recording in the place of devices, a hundred times as fast: every frame comes, in order.
fn again_as_devices(file: &Path) {
    let frames = |input: Input| match input {
        Input::Frame(bytes) => Some(bytes),
        _ => None,
    };
    let recorded = Reading::open(file).unwrap().inputs();
    let recorded: Vec<Vec<u8>> = recorded
        .filter_map(|timed| frames(timed.unwrap().input))
        .collect();
    let inputs = Inputs::new(SessionClock::start());
    let (port, _plug) = inputs.port();
    let reading = replay::open(file).unwrap();
    let replaying = std::thread::spawn(move || replay::run(reading, 100.0, &port));
    let mut came = Vec::new();
    let mut acts = 0;
    loop {
        let timed = inputs
            .next(Duration::from_secs(10))
            .expect("the recording goes on");
        match timed.input {
            Input::Link(LinkEvent::Down { reason }) => {
                assert_eq!(reason, "the recording is over");
                break;
            }
            Input::Act(_) | Input::Learnt(_) => acts += 1,
            input => came.extend(frames(input)),
        }
    }
    replaying.join().unwrap();
    assert_eq!(acts, 0, "what people did then is not done again");
    assert!(
        came == recorded,
        "{} of {} frames",
        came.len(),
        recorded.len()
    );
}

//! A recording of the whole story, played again.

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

use crate::world::{config, run};

struct Recorded {
    story: Story,
    recorder: Recorder,
    noted: u64,
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
    let finished = person.recorder.finish().unwrap();
    assert_eq!(finished.dropped, 0);
    let played = play(&file, None, |_| {}).unwrap();
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

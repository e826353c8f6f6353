//! A recording of the whole story, played again.

use tonus::live::{Act, Input, Timed, View};
use tonus::recording::{Entry, Opening, Recorder};
use tonus::robot::command::Command;
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
}

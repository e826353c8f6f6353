//! A recording of the whole story, played again.

use std::collections::HashMap;
use std::path::Path;
use std::time::Duration;

use tonus::calibration::Profile;
use tonus::export::Scans;
use tonus::library::Library;
use tonus::live::{Act, Input, Inputs, LinkEvent, SessionClock, Timed, View};
use tonus::recording::{Entry, Opening, Reading, Recorder};
use tonus::robot::command::Command;
use tonus::robot::gate::State;
use tonus::robot::limits::Setpoint;
use tonus::source::replay;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::hands::Hands;
use tonus::studio::keep::{self, Keeper};
use tonus::studio::play::play;
use tonus::studio::story::Story;
use tonus::studio::virtually::Someone;

use crate::after::{in_real_time, plays_as_far_as_it_goes};
use crate::taught::Teaches;
use crate::terminal::arms_and_disarms;
use crate::world::{config, run, run_with};

/// First shoulder and robot are taught, then the story is told.
#[derive(Default)]
struct Whole {
    teaches: Teaches,
    story: Story,
    places: Places,
}

impl Hands for Whole {
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

struct Recorded<Hands> {
    hands: Hands,
    recorder: Recorder,
    noted: u64,
    set_us: u64,
    measured: Option<Profile>,
    learnt: Option<Vec<u8>>,
}

impl<Hands> Recorded<Hands> {
    fn new(hands: Hands, file: &Path, opening: &Opening) -> Self {
        Self {
            hands,
            recorder: Recorder::create(file, opening).unwrap(),
            noted: 0,
            set_us: 0,
            measured: None,
            learnt: None,
        }
    }

    /// Virtual time runs faster than any disk: the queue must not drop anything here.
    fn note(&mut self, entry: Entry) {
        self.recorder.note(entry);
        self.noted += 1;
        while self.noted > self.recorder.written() + 1_000 {
            std::thread::sleep(std::time::Duration::from_millis(1));
        }
    }
}

impl<H: Hands> Someone for Recorded<H> {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.hands.look(view)
    }

    fn over(&self) -> bool {
        self.hands.over()
    }

    fn measured(&mut self, profile: &Profile) {
        self.measured = Some(profile.clone());
    }

    fn input(&mut self, at_us: u64, input: &Input) {
        if let Input::Learnt(Ok(bytes)) = input {
            self.learnt = Some(bytes.clone());
        }
        let input = input.clone();
        self.note(Entry::Input(Timed { at_us, input }));
    }

    fn commanded(&mut self, _devices: &SimulatedDevices, at_us: u64, command: &Command) {
        let command = *command;
        self.note(Entry::Command { at_us, command });
    }

    /// So often as a real run notes it.
    fn set(&mut self, at_us: u64, setpoint: &Setpoint, state: State) {
        if at_us >= self.set_us + 10_000 {
            self.set_us = at_us;
            let setpoint = *setpoint;
            self.note(Entry::Setpoint {
                at_us,
                setpoint,
                state,
            });
        }
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
    let person = Recorded::new(Whole::default(), &file, &opening);
    let devices = SimulatedConfig {
        seed: 4,
        ..SimulatedConfig::default()
    };
    let person = run(devices, person, 400);
    assert_eq!(person.hands.story.told().stuck, None);
    let recorded = person.hands.places;
    let finished = person.recorder.finish().unwrap();
    assert_eq!(finished.dropped, 0);
    let mut places = Places::default();
    let played = play(&file, |view| note(&mut places, view)).unwrap();
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
        played.recorded > 3_000 && played.inputs > 20_000 && played.setpoints > 10_000,
        "{played:?}"
    );
    let scans = Scans::read(&file).unwrap();
    assert_eq!(scans.opening.subject.unwrap().name, "simulated");
    again_as_devices(&file);
    the_day_after(
        directory.path(),
        person.measured.unwrap(),
        person.learnt.unwrap(),
    );
}

/// Nobody is calibrated, nothing is learnt: both are there from the day before.
pub(crate) struct DayAfter {
    profile: Option<Profile>,
    armed: bool,
    asked_us: u64,
    performed: usize,
    followed: usize,
    in_use: Option<String>,
}

impl DayAfter {
    /// Whoever is there recalls the person beforehand.
    pub(crate) fn without_recall() -> Self {
        Self {
            profile: None,
            armed: false,
            asked_us: 0,
            performed: 0,
            followed: 0,
            in_use: None,
        }
    }
}

impl Hands for DayAfter {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.in_use.clone_from(&view.calibration.in_use);
        self.followed += usize::from(view.robot.state == "following");
        if let Some(profile) = self.profile.take() {
            return vec![Act::Recall {
                name: profile.person.name.clone(),
                profile: Some(Box::new(profile)),
            }];
        }
        if self.in_use.as_deref() != Some("simulated") || view.at_us < 12_000_000 {
            return Vec::new();
        }
        if !self.armed && view.robot.can_arm {
            self.armed = true;
            return vec![Act::Arm];
        }
        if self.armed && view.at_us >= self.asked_us + 7_000_000 {
            self.asked_us = view.at_us;
            self.performed += 1;
            let label = "lift_bottle".to_owned();
            return vec![Act::Ask { label }];
        }
        Vec::new()
    }

    fn over(&self) -> bool {
        self.performed > 3
    }
}

/// A run that begins with skills and with a person measured before, and is played from its recording alone.
fn the_day_after(directory: &Path, profile: Profile, skills: Vec<u8>) {
    let kept = directory.join("skills.safetensors");
    std::fs::write(&kept, &skills).unwrap();
    let library = Library::load(&kept).unwrap();
    assert_eq!(library.to_bytes().unwrap(), skills);
    let people = directory.join("people");
    let keeper = Keeper::new(None, Some(people.clone()));
    keeper.person(&profile);
    assert_eq!(keeper.problem(), None);
    #[cfg(unix)]
    for (path, mode) in [(&people, 0o700), (&people.join("simulated.json"), 0o600)] {
        use std::os::unix::fs::PermissionsExt;
        let found = std::fs::metadata(path).unwrap().permissions().mode();
        assert_eq!(found & 0o777, mode, "{}", path.display());
    }
    let file = directory.join("after.mcap");
    let opening = Opening {
        configuration: config().text(),
        model: Some(skills),
        subject: Some(profile.person.clone()),
        calibration: Some(profile.text()),
        ..Opening::default()
    };
    let hands = DayAfter {
        profile: Some(keep::read(&people, &profile.person.name).unwrap()),
        ..DayAfter::without_recall()
    };
    let person = Recorded::new(hands, &file, &opening);
    let devices = SimulatedConfig {
        seed: 4,
        ..SimulatedConfig::default()
    };
    let person = run_with(Some(library.into()), devices, person, 60);
    assert_eq!(person.hands.in_use.as_deref(), Some("simulated"));
    assert!(
        person.hands.followed > 50,
        "{} views show it follow",
        person.hands.followed
    );
    person.recorder.finish().unwrap();
    let played = play(&file, |_| {}).unwrap();
    println!("the day after: {played:?}");
    assert!(played.exact() && played.recorded > 1_000, "{played:?}");
    plays_as_far_as_it_goes(&file);
    arms_and_disarms(&kept);
    let library = Library::load(&kept).unwrap();
    in_real_time(directory, profile, library);
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
    let inputs = Inputs::new(SessionClock::at_pace(100.0));
    let (port, _plug) = inputs.port();
    let reading = replay::open(file).unwrap();
    let replaying = std::thread::spawn(move || replay::run(reading, &port));
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

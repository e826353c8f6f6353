//! Shoulder and robot taught by touching, with simulated devices, whose true frames are known.

use tonus::live::{Act, Engine, TeachingView, View, simulated};
use tonus::simulate::scripted::in_robot_frame;
use tonus::simulate::tracker::TrackerNoise;
use tonus::source::LinkChoice;
use tonus::source::simulated::{SHOULDER, SimulatedConfig, SimulatedDevices};
use tonus::studio::setup;
use tonus::studio::virtually::{Someone, Virtual};
use tonus::transform::Shoulder;

use crate::world::config;

/// Places that the robot's hand is driven to, base frame, metres: a line of three, and one beside it.
pub(crate) const PLACES_M: [[f64; 3]; 4] = [
    [0.55, 0.10, 0.45],
    [0.65, 0.10, 0.45],
    [0.75, 0.10, 0.45],
    [0.65, -0.10, 0.55],
];

/// Somebody who touches the shoulder and then each place, and uses what that teaches.
#[derive(Debug, Default)]
pub(crate) struct Teaches {
    pressed: usize,
    /// What was there to see of it when it was not yet used.
    pub(crate) seen: TeachingView,
    pub(crate) used_us: Option<u64>,
}

impl Teaches {
    pub(crate) fn look(&mut self, view: &View) -> Vec<Act> {
        let it = &view.teaching;
        let ready = view.link.up && view.tracker.up && view.hand.is_some();
        if it.touching.is_some() || (!ready && self.pressed == 0) || self.used_us.is_some() {
            return Vec::new();
        }
        let touched = usize::from(it.shoulder_m.is_some()) + it.points.len();
        if touched < self.pressed && it.problem.is_none() {
            return Vec::new();
        }
        self.pressed = touched + 1;
        vec![match touched {
            0 => Act::TeachShoulder,
            at if at <= PLACES_M.len() => Act::TeachPoint {
                robot_m: Some(PLACES_M[at - 1]),
            },
            _ => {
                self.seen = it.clone();
                self.used_us = Some(view.at_us);
                Act::TeachUse
            }
        }]
    }
}

/// Watches what is taught against the truth.
#[derive(Default)]
struct Watches {
    teaches: Teaches,
    true_m: [f64; 3],
    now_us: u64,
    /// How far the hand lies from where it truly is: shoulder frame and robot's, metres.
    off_m: Vec<[f64; 2]>,
    messages: Vec<String>,
    taught: bool,
}

fn apart_m(a: [f64; 3], b: [f64; 3]) -> f64 {
    let square: f64 = (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum();
    square.sqrt()
}

impl Someone for Watches {
    fn look(&mut self, view: &View) -> Vec<Act> {
        self.now_us = view.at_us;
        self.taught = view.tracker.taught;
        self.messages = view.messages.iter().map(|m| m.text.clone()).collect();
        // The hand has gone back to rest by then.
        let rests = self
            .teaches
            .used_us
            .is_some_and(|us| view.at_us > us + 3_000_000);
        if let Some(hand) = view.hand.as_ref().filter(|_| rests) {
            let in_robot_m = hand.in_robot_m.expect("the robot's frame is taught");
            self.off_m.push([
                apart_m(hand.position_m, self.true_m),
                apart_m(in_robot_m, in_robot_frame(self.true_m)),
            ]);
        }
        self.teaches.look(view)
    }

    fn over(&self) -> bool {
        self.off_m.len() >= 50
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        self.true_m = devices.hand_m(now_us);
    }
}

/// Runs with an engine that takes the shoulder to be a hand's breadth and more from where it is.
fn run<Person: Someone>(devices: SimulatedConfig, person: Person) -> Person {
    let config = config();
    let mut told = setup::engine(&config, &LinkChoice::Simulated).unwrap();
    let [right, up, back] = SHOULDER.centre_m;
    told.shoulder = Some(Shoulder {
        centre_m: [right + 0.1, up - 0.05, back + 0.08],
        turned_left_rad: 0.0,
    });
    let body = simulated(config.robot.home_m, config.robot.payload_kg).unwrap();
    let mut engine = Engine::new(told, body, None).unwrap();
    let devices = SimulatedDevices::new(devices).unwrap();
    let mut world = Virtual::new(devices, person, 120_000_000);
    engine.run(&mut world).unwrap();
    world.into_person()
}

fn taught(devices: SimulatedConfig) -> Watches {
    let watches = run(devices, Watches::default());
    assert!(watches.over() && watches.taught, "{:?}", watches.messages);
    assert_eq!(watches.teaches.seen.points.len(), PLACES_M.len());
    watches
}

fn worst(off_m: &[[f64; 2]], of: usize) -> f64 {
    off_m.iter().map(|off| off[of]).fold(0.0, f64::max)
}

#[test]
fn without_noise_what_is_taught_is_the_simulation_itself() {
    let watches = taught(SimulatedConfig {
        noise: TrackerNoise::NONE,
        ..SimulatedConfig::default()
    });
    let seen = &watches.teaches.seen;
    let centre_m = seen.shoulder_m.unwrap();
    let shoulder_m = apart_m(centre_m, SHOULDER.centre_m);
    let residual_mm = seen.residual_mm.unwrap();
    let worst_m = [0, 1].map(|of| worst(&watches.off_m, of));
    println!("shoulder {shoulder_m:.5} m off, residual {residual_mm:.3} mm, hand {worst_m:.5?} m");
    // What the hand still settles by when a look begins.
    assert!(shoulder_m < 3e-4 && residual_mm < 0.3);
    assert!(worst_m.iter().all(|off| *off < 5e-4), "{worst_m:?}");
}

#[test]
fn with_the_trackers_noise_it_is_that_within_the_noise() {
    for seed in 1..=5 {
        let watches = taught(SimulatedConfig {
            seed,
            ..SimulatedConfig::default()
        });
        let residual_mm = watches.teaches.seen.residual_mm.unwrap();
        let worst_m = [0, 1].map(|of| worst(&watches.off_m, of));
        println!("seed {seed}: residual {residual_mm:.2} mm, hand {worst_m:.4?} m");
        // The bias wanders by 3 mm on each axis between touch and look, the jitter of one picture is 1.5: four deviations of
        // their root sum of squares over three axes and two looks.
        let bound_m = 4.0 * (3.0_f64 * (2.0 * 0.003_f64.powi(2) + 0.0015_f64.powi(2))).sqrt();
        assert!(residual_mm < 15.0);
        assert!(worst_m.iter().all(|off| *off < bound_m), "{worst_m:?}");
    }
}

/// Somebody whose tracker is covered, or who presses what makes no sense.
#[derive(Default)]
struct Fails {
    pressed: usize,
    since_us: u64,
    problems: Vec<String>,
}

impl Someone for Fails {
    fn look(&mut self, view: &View) -> Vec<Act> {
        const ACTS: [Act; 4] = [
            Act::TeachUse,
            Act::TeachRemove { point: 1 },
            Act::TeachPoint {
                robot_m: Some([f64::NAN, 0.0, 0.0]),
            },
            Act::TeachShoulder,
        ];
        let told = view.messages.iter().filter(|message| message.problem);
        let told = told.map(|message| message.text.clone());
        self.problems = told.chain(view.teaching.problem.clone()).collect();
        if !view.tracker.up || view.at_us < self.since_us + 500_000 {
            return Vec::new();
        }
        self.since_us = view.at_us;
        let act = ACTS.get(self.pressed).cloned();
        self.pressed += 1;
        act.into_iter().collect()
    }

    fn over(&self) -> bool {
        self.problems.len() == 4
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, _now_us: u64) {
        devices.cover(true);
    }
}

#[test]
fn what_teaches_nothing_is_said_and_nobody_is_waited_for_for_ever() {
    let fails = run(SimulatedConfig::default(), Fails::default());
    let words = [
        "nothing is taught yet",
        "there is no point 1; 0 were touched",
        "type the place",
        "saw no hand that was still for 1.4 s within 15 s",
    ];
    assert_eq!(fails.problems.len(), words.len(), "{:?}", fails.problems);
    for (problem, word) in fails.problems.iter().zip(words) {
        assert!(problem.contains(word), "{problem}");
    }
}

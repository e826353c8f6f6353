//! The whole story, told by simulated devices and a simulated person.

use tonus::config::Config;
use tonus::live::{Act, Engine, View, simulated};
use tonus::source::LinkChoice;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::setup;
use tonus::studio::story::Story;
use tonus::studio::virtually::{Someone, Virtual};

/// One movement as the engine saw it, and what the person truly did.
#[derive(Debug, Default, Clone)]
struct Movement {
    truth: Option<&'static str>,
    decided: Option<String>,
    unknown: bool,
    novelty: f64,
    from_s: f64,
    to_s: f64,
}

#[derive(Default)]
struct Scored {
    story: Story,
    truth: Option<&'static str>,
    now: Option<Movement>,
    movements: Vec<Movement>,
}

impl Someone for Scored {
    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        self.truth = devices
            .performing(now_us)
            .filter(|(_, s)| (0.3..0.7).contains(s))
            .map(|(label, _)| label);
    }

    fn look(&mut self, view: &View) -> Vec<Act> {
        match view.recognition.as_ref().filter(|r| r.under_way) {
            None => self.movements.extend(self.now.take()),
            Some(recognition) => {
                let at_s = view.at_us as f64 * 1e-6;
                let now = self.now.get_or_insert_with(|| Movement {
                    from_s: at_s,
                    ..Movement::default()
                });
                now.truth = now.truth.or(self.truth);
                now.decided = recognition
                    .decision
                    .as_ref()
                    .map(|(label, _)| label.clone());
                now.unknown = recognition.unknown;
                now.novelty = now.novelty.max(recognition.novelty.unwrap_or(0.0));
                now.to_s = at_s;
            }
        }
        self.story.look(view)
    }

    fn over(&self) -> bool {
        self.story.over()
    }
}

fn told(seed: u64) -> Scored {
    let config = Config::default();
    let told = setup::engine(&config, &LinkChoice::Simulated).unwrap();
    let body = simulated(config.robot.home_m).unwrap();
    let mut engine = Engine::new(told, body, None).unwrap();
    let devices = SimulatedDevices::new(SimulatedConfig {
        seed,
        ..SimulatedConfig::default()
    });
    let mut world = Virtual::new(devices.unwrap(), Scored::default(), 400_000_000);
    engine.run(&mut world).unwrap();
    world.into_person()
}

#[test]
fn story() {
    for seed in 1..=6 {
        let scored = told(seed);
        println!("{:?}", scored.story.told());
        for m in &scored.movements {
            println!("   {m:?}");
        }
    }
}

//! The whole story, told by simulated devices and a simulated person.

use tonus::live::{Engine, simulated};
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::story::Story;
use tonus::studio::virtually::Virtual;

#[test]
fn story() {
    let config = tonus::studio::setup::engine(
        &tonus::config::Config::default(),
        &tonus::source::LinkChoice::Simulated,
    )
    .unwrap();
    let home = config.session.home_m;
    let mut engine = Engine::new(config, simulated(home).unwrap(), None).unwrap();
    let devices = SimulatedDevices::new(SimulatedConfig::default()).unwrap();
    let mut world = Virtual::new(devices, Watched::default(), 400_000_000);
    engine.run(&mut world).unwrap();
    let told = world.into_person().0.told();
    println!("{told:?}");
}

#[derive(Default)]
struct Watched(Story, String, Option<String>);

impl tonus::studio::virtually::Someone for Watched {
    fn look(&mut self, view: &tonus::live::View) -> Vec<tonus::live::Act> {
        let text = self.0.text();
        if text != self.1 {
            println!("{:.1} s {text}", view.at_us as f64 * 1e-6);
            self.1 = text;
        }
        if let Some(step) = &view.calibration.step {
            if step.problem != self.2 {
                println!("   {} {:?}", step.number, step.problem);
                self.2 = step.problem.clone();
            }
        }
        for message in view
            .messages
            .iter()
            .filter(|m| m.at_us + 40_000 > view.at_us)
        {
            println!("   {:?}", message);
        }
        if let Some(result) = &view.calibration.result {
            println!("{result:?}");
        }
        self.0.look(view)
    }
    fn over(&self) -> bool {
        self.0.over()
    }
}

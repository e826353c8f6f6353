//! The whole story, told by simulated devices and a simulated person.

use tonus::live::{Engine, simulated};
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::story::Story;
use tonus::studio::virtually::Virtual;

#[test]
fn story() {
    let config = tonus::studio::setup::simulated_engine();
    let home = config.session.home_m;
    let mut engine = Engine::new(config, simulated(home).unwrap(), None).unwrap();
    let devices = SimulatedDevices::new(SimulatedConfig::default()).unwrap();
    let mut world = Virtual::new(devices, Story::default(), 400_000_000);
    engine.run(&mut world).unwrap();
    let told = world.into_person().told();
    println!("{told:?}");
}

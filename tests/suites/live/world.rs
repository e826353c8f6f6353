//! A program in virtual time.

use std::sync::Arc;

use tonus::config::Config;
use tonus::library::Library;
use tonus::live::{Engine, Person, simulated};
use tonus::source::LinkChoice;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::setup;
use tonus::studio::virtually::{Someone, Virtual};

/// The configuration that recordings of these runs carry.
pub(crate) fn config() -> Config {
    let mut config = Config::default();
    config.wearable.link = "sim".to_owned();
    config
}

/// Somebody to be measured.
pub(crate) fn somebody() -> Person {
    Person {
        name: "Zoë".to_owned(),
        body_mass_kg: 75.0,
        body_height_m: 1.75,
        mains_hz: None,
    }
}

/// Runs until the person is done, at most `seconds`; gives the person back.
pub(crate) fn run<Person: Someone>(
    devices: SimulatedConfig,
    person: Person,
    seconds: u64,
) -> Person {
    run_with(None, devices, person, seconds)
}

/// The same with skills from its start.
pub(crate) fn run_with<Person: Someone>(
    library: Option<Arc<Library>>,
    devices: SimulatedConfig,
    person: Person,
    seconds: u64,
) -> Person {
    let config = config();
    let told = setup::engine(&config, &LinkChoice::Simulated).unwrap();
    let body = simulated(config.robot.home_m, config.robot.payload_kg).unwrap();
    let mut engine = Engine::new(told, body, library).unwrap();
    let devices = SimulatedDevices::new(devices).unwrap();
    let mut world = Virtual::new(devices, person, seconds * 1_000_000);
    engine.run(&mut world).unwrap();
    world.into_person()
}

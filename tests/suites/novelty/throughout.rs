//! A gate that is asked at every moment of a movement is wrong about whole movements as rarely as it is told to be.

use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tonus::demonstration::Demonstration;
use tonus::model::novelty::{Gate, GateConfig, GateSettings};

use super::learnt::{config, library, movement};
use super::valid;

/// Whether a movement is unknown after any of its samples.
fn ever(gate: &Gate, movement: &Demonstration) -> bool {
    let mut stream = gate.stream().unwrap();
    let samples = movement.phases().zip(&movement.values()[0]);
    let mut ever = false;
    for (phase, value) in samples {
        stream.observe(0, phase, *value).unwrap();
        ever |= stream.novelty().is_some_and(|novelty| novelty.unknown());
    }
    ever
}

#[test]
fn as_many_whole_movements_are_ever_unknown_as_were_asked_for() {
    let mut random = ChaCha8Rng::seed_from_u64(6);
    let throughout = |false_alarm_rate| GateConfig {
        throughout: true,
        false_alarm_rate,
        ..config()
    };
    // Judged once at 2 %; throughout at 10 %, 2 %, and 0.5 %, which 50 demonstrations cannot show.
    let asked = [
        config(),
        throughout(0.1),
        throughout(0.02),
        throughout(0.005),
    ];
    let (mut unknown, mut total) = ([0; 4], 0);
    for _ in 0..30 {
        let known = library(&mut random);
        let learn = |config: &GateConfig| {
            Gate::with_settings(&known, &valid(&["x"]), &GateSettings::default(), config).unwrap()
        };
        let gates = asked.each_ref().map(learn);
        let rates = gates.each_ref().map(|gate| gate.parts().false_alarm_rate);
        assert_eq!(rates, [0.02, 0.1, 0.02, 0.005]);
        for trial in 0..100 {
            let new = movement(trial % 5, trial, &mut random);
            for (count, gate) in unknown.iter_mut().zip(&gates) {
                *count += usize::from(ever(gate, &new));
            }
            total += 1;
        }
    }
    let shares = unknown.map(|count| count as f64 / f64::from(total));
    println!("ever unknown: judged once {shares:?}");
    // Of 3000, as beside: independent ones scatter by 0.0055, 0.0026 and 0.0013, the libraries about as much.
    let [once, tenth, fiftieth, rare] = shares;
    assert!(once > 0.04, "{once}: five instants, each at 2 %");
    assert!((0.075..0.125).contains(&tenth), "{tenth}");
    assert!((0.008..0.035).contains(&fiftieth), "{fiftieth}");
    assert!((0.0005..0.012).contains(&rare), "{rare}");
}

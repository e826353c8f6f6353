//! Properties under commands, ages and faults of every kind.

use proptest::prelude::*;
use tonus::robot::command::{Command, Quality};
use tonus::robot::gate::{DISARM_AGE_US, Gate, State};
use tonus::robot::limits::{Fallback, Limits, Setpoint};

#[derive(Debug, Clone)]
enum Event {
    Tick { after_us: u64 },
    Offer { command: Command, age_us: u64 },
    Disconnect,
    Disarm,
}

/// Finite, huge, tiny, negative, NaN and infinite alike.
fn any_value() -> impl Strategy<Value = f64> {
    prop_oneof![
        4 => -5.0..5.0,
        4 => 1.0..5000.0,
        1 => any::<f64>(),
        1 => Just(f64::NAN),
        1 => Just(f64::INFINITY),
    ]
}

fn any_command() -> impl Strategy<Value = Command> {
    let quality = prop_oneof![8 => Just(Quality::Good), 1 => Just(Quality::Undecided), 1 => Just(Quality::Novel), 1 => Just(Quality::SignalFault)];
    let boot = prop_oneof![30 => Just(1_u32), 1 => Just(2_u32)];
    (
        prop::array::uniform3(prop_oneof![8 => -2.0..2.0, 1 => any_value()]),
        prop::array::uniform3(prop_oneof![8 => -3.0..3.0, 1 => any_value()]),
        prop::array::uniform3(prop_oneof![8 => 1.0..6000.0, 1 => any_value()]),
        prop_oneof![8 => 0.1..3.0, 1 => any_value()],
        quality,
        boot,
        prop_oneof![8 => Just(u64::MAX), 1 => any::<u64>()],
    )
        .prop_map(
            |(
                position_m,
                velocity_m_per_s,
                stiffness_n_per_m,
                damping_ratio,
                quality,
                boot_id,
                valid_until_us,
            )| {
                Command {
                    position_m,
                    velocity_m_per_s,
                    stiffness_n_per_m,
                    damping_ratio,
                    acquired_us: 0,
                    valid_until_us,
                    sequence: 0,
                    boot_id,
                    quality,
                }
            },
        )
}

fn any_event() -> impl Strategy<Value = Event> {
    let age = prop_oneof![6 => 0_u64..60_000, 2 => 60_000_u64..110_000, 1 => 100_000_u64..700_000];
    prop_oneof![
        20 => prop_oneof![8 => 500_u64..2_000, 2 => 2_000_u64..80_000, 1 => 80_000_u64..600_000]
            .prop_map(|after_us| Event::Tick { after_us }),
        8 => (any_command(), age).prop_map(|(command, age_us)| Event::Offer { command, age_us }),
        1 => Just(Event::Disconnect),
        1 => Just(Event::Disarm),
    ]
}

fn distance(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
}

/// The promises that hold at every tick, whatever came before.
fn check(
    before: &Setpoint,
    after: &Setpoint,
    period_us: u64,
    state: State,
) -> Result<(), TestCaseError> {
    let limits = Limits::default();
    let period_s = (period_us as f64 * 1e-6).min(0.01);
    for axis in 0..3 {
        let (k, k0) = (
            after.stiffness_n_per_m[axis],
            before.stiffness_n_per_m[axis],
        );
        prop_assert!((10.0..=3000.0).contains(&k), "stiffness {k}");
        prop_assert!((k - k0).abs() <= limits.stiffness_rate_n_per_m_s * period_s + 1e-9);
        let x = after.position_m[axis];
        prop_assert!(
            (limits.workspace_low_m[axis]..=limits.workspace_high_m[axis]).contains(&x),
            "position {x}"
        );
        if state == State::Holding {
            prop_assert!(k <= k0, "a hold made axis {axis} stiffer");
        }
    }
    prop_assert!(
        distance(after.position_m, before.position_m) <= limits.speed_m_per_s * period_s + 1e-12
    );
    prop_assert!(
        distance(after.velocity_m_per_s, [0.0; 3]) <= limits.speed_m_per_s * (1.0 + 1e-12)
    );
    prop_assert!((0.5..=1.5).contains(&after.damping_ratio));
    if state != State::Following {
        prop_assert_eq!(after.position_m, before.position_m, "only following moves");
        prop_assert_eq!(after.velocity_m_per_s, [0.0; 3]);
    }
    Ok(())
}

proptest! {
    #![proptest_config(tonus_tests::seeded(400))]

    #[test]
    fn limits_hold_and_nothing_but_a_person_arms(events in prop::collection::vec(any_event(), 1..120)) {
        let mut gate = Gate::new(Limits::default(), Fallback::default(), [0.4, 0.0, 0.3]).unwrap();
        let mut now_us = 1_000_000_u64;
        let mut sequence = 0_u32;
        let sound = Command {
            position_m: [0.5, 0.1, 0.4], velocity_m_per_s: [0.0; 3], stiffness_n_per_m: [500.0; 3], damping_ratio: 1.0,
            acquired_us: now_us, valid_until_us: u64::MAX, sequence, boot_id: 1, quality: Quality::Good,
        };
        gate.offer(&sound, now_us).unwrap();
        gate.arm([0.4, 0.0, 0.3], now_us).unwrap();
        gate.tick(now_us);
        let mut disarmed = false;
        let mut newest_us = now_us;
        for event in events {
            match event {
                Event::Tick { after_us } => {
                    let before = gate.setpoint();
                    now_us += after_us;
                    let after = gate.tick(now_us);
                    check(&before, &after, after_us, gate.state())?;
                    if now_us - newest_us > DISARM_AGE_US {
                        prop_assert!(matches!(gate.state(), State::Disarmed(_)));
                    }
                }
                Event::Offer { command, age_us } => {
                    sequence += 1;
                    let acquired_us = now_us - age_us;
                    let before = gate.setpoint();
                    if gate.offer(&Command { acquired_us, sequence, ..command }, now_us).is_ok() {
                        newest_us = acquired_us;
                    }
                    prop_assert_eq!(gate.setpoint().position_m, before.position_m, "an offer alone moves nothing");
                    prop_assert_eq!(gate.setpoint().stiffness_n_per_m, before.stiffness_n_per_m);
                }
                Event::Disconnect => gate.disconnect(),
                Event::Disarm => gate.disarm(),
            }
            let now_disarmed = matches!(gate.state(), State::Disarmed(_));
            prop_assert!(now_disarmed || !disarmed, "armed by itself");
            disarmed = now_disarmed;
        }
    }

    #[test]
    fn with_no_more_commands_every_gate_ends_disarmed_at_the_fallback(command in any_command()) {
        let mut gate = Gate::new(Limits::default(), Fallback::default(), [0.4, 0.0, 0.3]).unwrap();
        let first = Command { acquired_us: 1_000_000, sequence: 1, ..command };
        if gate.offer(&first, 1_000_000).is_ok() {
            let _ = gate.arm([0.4, 0.0, 0.3], 1_000_000);
        }
        for ms in 1..2000 {
            gate.tick(1_000_000 + ms * 1000);
        }
        prop_assert!(matches!(gate.state(), State::Disarmed(_)));
        prop_assert_eq!(gate.setpoint().stiffness_n_per_m, Fallback::default().stiffness_n_per_m);
    }
}

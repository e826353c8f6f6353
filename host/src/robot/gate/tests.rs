use super::*;

const START: [f64; 3] = [0.4, 0.0, 0.3];
const T0: u64 = 10_000_000;

fn gate() -> Gate {
    Gate::new(Limits::default(), Fallback::default(), START).unwrap()
}

fn command(sequence: u32, acquired_us: u64) -> Command {
    Command {
        position_m: [0.5, 0.1, 0.4],
        velocity_m_per_s: [0.1, 0.0, 0.0],
        stiffness_n_per_m: [800.0, 700.0, 900.0],
        damping_ratio: 0.8,
        acquired_us,
        valid_until_us: u64::MAX,
        sequence,
        boot_id: 7,
        quality: Quality::Good,
    }
}

/// An armed gate that has followed one command, acquired at `T0`, for `ms` milliseconds.
fn armed_for(ms: u64) -> Gate {
    let mut gate = gate();
    gate.offer(&command(1, T0), T0).unwrap();
    gate.arm(START, T0).unwrap();
    for n in 1..=ms {
        gate.tick(T0 + n * 1000);
    }
    gate
}

#[test]
fn age_alone_walks_through_the_table() {
    let mut gate = armed_for(60);
    assert_eq!(gate.state(), State::Following);
    let followed = gate.setpoint();
    gate.tick(T0 + 60_001);
    assert_eq!(gate.state(), State::Holding);
    let held = gate.tick(T0 + 100_000);
    assert_eq!(gate.state(), State::Holding);
    assert_eq!(
        held,
        Setpoint {
            velocity_m_per_s: [0.0; 3],
            ..followed
        }
    );
    gate.tick(T0 + 100_001);
    assert_eq!(gate.state(), State::FallingBack);
    gate.tick(T0 + 500_000);
    assert_eq!(gate.state(), State::FallingBack);
    gate.tick(T0 + 500_001);
    assert_eq!(gate.state(), State::Disarmed(Cause::Stale));
}

#[test]
fn the_fallback_is_reached_at_the_configured_rate_and_kept() {
    let mut gate = armed_for(60);
    let from = gate.setpoint();
    // 60 ms at 3000 N/m/s from (200, 200, 400): 180 N/m up.
    for (k, start) in from.stiffness_n_per_m.iter().zip([200.0, 200.0, 400.0]) {
        assert!((k - (start + 180.0)).abs() < 1e-9);
    }
    gate.tick(T0 + 100_000);
    for ms in 101..=130 {
        gate.tick(T0 + ms * 1000);
    }
    assert!(
        (gate.setpoint().stiffness_n_per_m[0] - 290.0).abs() < 1e-9,
        "30 ms down"
    );
    for ms in 131..=1000 {
        gate.tick(T0 + ms * 1000);
    }
    assert_eq!(
        gate.setpoint().stiffness_n_per_m,
        Fallback::default().stiffness_n_per_m
    );
    assert_eq!(gate.setpoint().position_m, from.position_m);
    assert_eq!(gate.setpoint().damping_ratio, 1.0);
}

#[test]
fn a_fresh_command_ends_a_hold_and_a_fallback_but_not_a_disarm() {
    for (silence_ms, state) in [
        (80, State::Following),
        (300, State::Following),
        (600, State::Disarmed(Cause::Stale)),
    ] {
        let mut gate = armed_for(silence_ms);
        let now = T0 + silence_ms * 1000;
        gate.offer(&command(2, now), now).unwrap();
        gate.tick(now + 1000);
        assert_eq!(gate.state(), state, "after {silence_ms} ms of silence");
    }
}

#[test]
fn what_was_never_armed_is_not_disarmed_either() {
    let mut gate = gate();
    gate.disarm();
    gate.disconnect();
    gate.lose_robot();
    gate.mistime();
    gate.tick(T0);
    assert_eq!(gate.state(), State::Disarmed(Cause::Start));
    // So it is still to be where it is.
    gate.rests_at([0.5, 0.2, 0.3]);
    assert_eq!(gate.setpoint().position_m, [0.5, 0.2, 0.3]);
    // Once armed it is the gate's, also when it is disarmed.
    gate.offer(&command(1, T0), T0).unwrap();
    gate.arm(START, T0).unwrap();
    gate.disarm();
    gate.rests_at([0.5, 0.2, 0.3]);
    assert_eq!(gate.state(), State::Disarmed(Cause::Person));
    assert_eq!(gate.setpoint().position_m, START);
}

#[test]
fn only_a_person_arms_again_after_a_lost_link() {
    let mut gate = armed_for(20);
    gate.disconnect();
    for n in 2..100 {
        let now = T0 + u64::from(n) * 10_000;
        gate.offer(&command(n, now), now).unwrap();
        gate.tick(now + 500);
        assert_eq!(gate.state(), State::Disarmed(Cause::Disconnected));
    }
    gate.arm([0.45, 0.05, 0.35], T0 + 1_000_000).unwrap();
    assert_eq!(
        gate.setpoint().position_m,
        [0.45, 0.05, 0.35],
        "it starts from where the robot is"
    );
    assert_eq!(gate.state(), State::Following);
}

#[test]
fn arming_needs_a_fresh_sound_command_and_a_robot_in_its_workspace() {
    let mut gate = gate();
    assert_eq!(gate.arm(START, T0), Err(ArmRefusal::NoFreshCommand));
    gate.offer(&command(1, T0), T0).unwrap();
    assert_eq!(
        gate.arm(START, T0 + 60_001),
        Err(ArmRefusal::NoFreshCommand)
    );
    gate.offer(
        &Command {
            quality: Quality::Novel,
            ..command(2, T0 + 70_000)
        },
        T0 + 70_000,
    )
    .unwrap();
    assert_eq!(
        gate.arm(START, T0 + 70_000),
        Err(ArmRefusal::NoFreshCommand)
    );
    gate.offer(&command(3, T0 + 80_000), T0 + 80_000).unwrap();
    for bad in [1.5, f64::NAN] {
        assert!(matches!(
            gate.arm([0.4, bad, 0.3], T0 + 80_000),
            Err(ArmRefusal::OutsideWorkspace { axis: 1, .. })
        ));
    }
    assert_eq!(gate.state(), State::Disarmed(Cause::Start));
    gate.arm(START, T0 + 80_000).unwrap();
}

#[test]
fn bad_quality_and_expiry_hold_fresh_commands_and_not_for_ever() {
    for flaw in [
        Command {
            quality: Quality::Novel,
            ..command(0, 0)
        },
        Command {
            quality: Quality::SignalFault,
            ..command(0, 0)
        },
        Command {
            valid_until_us: 0,
            ..command(0, 0)
        },
    ] {
        let mut gate = armed_for(20);
        let before = gate.setpoint();
        for n in 3..=200_u32 {
            let now = T0 + u64::from(n) * 10_000;
            gate.offer(
                &Command {
                    sequence: n,
                    acquired_us: now,
                    ..flaw
                },
                now,
            )
            .unwrap();
            let setpoint = gate.tick(now);
            if now - T0 <= LONGEST_HOLD_US {
                assert_eq!(gate.state(), State::Holding);
                assert_eq!(setpoint.stiffness_n_per_m, before.stiffness_n_per_m);
            } else {
                assert_eq!(gate.state(), State::FallingBack);
            }
        }
        assert_ne!(gate.setpoint().stiffness_n_per_m, before.stiffness_n_per_m);
    }
}

#[test]
fn unusable_late_doubled_and_foreign_commands_are_refused_by_reason() {
    let mut gate = armed_for(10);
    let now = T0 + 10_000;
    let nan = Command {
        stiffness_n_per_m: [1.0, f64::NAN, 1.0],
        ..command(2, now)
    };
    assert!(matches!(
        gate.offer(&nan, now),
        Err(Refusal::Unusable(CommandError::NotFinite {
            field: "stiffness",
            ..
        }))
    ));
    let slack = Command {
        stiffness_n_per_m: [1.0, 0.0, 1.0],
        ..command(2, now)
    };
    assert_eq!(
        gate.offer(&slack, now),
        Err(Refusal::Unusable(CommandError::NotPositive {
            value_n_per_m: 0.0
        }))
    );
    let undamped = Command {
        damping_ratio: -0.1,
        ..command(2, now)
    };
    assert_eq!(
        gate.offer(&undamped, now),
        Err(Refusal::Unusable(CommandError::NotDamped { value: -0.1 }))
    );
    assert_eq!(
        gate.offer(&command(1, now), now),
        Err(Refusal::NotNewer { got: 1, newest: 1 })
    );
    assert_eq!(
        gate.offer(&command(0, now), now),
        Err(Refusal::NotNewer { got: 0, newest: 1 })
    );
    assert!(matches!(
        gate.offer(&command(2, T0 - 1), now),
        Err(Refusal::OlderEvidence { .. })
    ));
    assert!(matches!(
        gate.offer(&command(2, now + 5_001), now),
        Err(Refusal::FromTheFuture { .. })
    ));
    assert_eq!(gate.refused(), 7);
    gate.tick(now);
    assert_eq!(
        gate.state(),
        State::Following,
        "a refused command changes nothing"
    );
    let foreign = Command {
        boot_id: 8,
        ..command(2, now)
    };
    assert_eq!(
        gate.offer(&foreign, now),
        Err(Refusal::OtherBoot { got: 8, armed: 7 })
    );
    assert_eq!(gate.state(), State::Disarmed(Cause::OtherBoot));
    gate.offer(&foreign, now).unwrap();
    gate.tick(now + 1000);
    assert_eq!(gate.state(), State::Disarmed(Cause::OtherBoot));
}

#[test]
fn the_sequence_may_wrap() {
    let mut gate = gate();
    gate.offer(&command(u32::MAX, T0), T0).unwrap();
    gate.offer(&command(0, T0 + 10_000), T0 + 10_000).unwrap();
    assert!(
        gate.offer(&command(u32::MAX, T0 + 20_000), T0 + 20_000)
            .is_err()
    );
}

#[test]
fn a_stall_of_the_caller_is_no_licence_to_jump() {
    let mut gate = armed_for(1);
    let before = gate.setpoint();
    gate.offer(&command(2, T0 + 400_000), T0 + 400_000).unwrap();
    let after = gate.tick(T0 + 401_000);
    // Ten milliseconds' worth at 1 m/s and 3000 N/m/s.
    let moved: f64 = (0..3)
        .map(|i| (after.position_m[i] - before.position_m[i]).powi(2))
        .sum::<f64>()
        .sqrt();
    assert!(moved <= 0.01 + 1e-12);
    assert!(after.stiffness_n_per_m[0] - before.stiffness_n_per_m[0] <= 30.0 + 1e-9);
}

#[test]
fn contradictory_configurations_are_refused() {
    let limits = Limits::default();
    let bad_limits = [
        Limits {
            stiffness_n_per_m: [0.0, 3000.0],
            ..limits
        },
        Limits {
            stiffness_n_per_m: [100.0, 10.0],
            ..limits
        },
        Limits {
            damping_ratio: [0.5, f64::INFINITY],
            ..limits
        },
        Limits {
            workspace_high_m: [0.0; 3],
            ..limits
        },
        Limits {
            speed_m_per_s: f64::NAN,
            ..limits
        },
        Limits {
            stiffness_rate_n_per_m_s: 0.0,
            ..limits
        },
    ];
    for bad in bad_limits {
        assert!(
            Gate::new(bad, Fallback::default(), START).is_err(),
            "{bad:?}"
        );
    }
    let limp = Fallback {
        stiffness_n_per_m: [0.0; 3],
        damping_ratio: 1.0,
    };
    assert!(matches!(
        Gate::new(limits, limp, START),
        Err(ConfigError::Outside { .. })
    ));
    assert!(Gate::new(limits, Fallback::default(), [f64::NAN; 3]).is_err());
}

#[test]
fn another_clock_disarms_and_fresh_commands_do_not_arm() {
    let mut gate = armed_for(10);
    gate.mistime();
    assert_eq!(gate.state(), State::Disarmed(Cause::Clock));
    assert!(!gate.may_arm(T0 + 11_000));
    // By the new clock commands may seem older than those of before.
    for n in 0..100 {
        let now_us = T0 + 20_000 + 10_000 * n;
        let fresh = command(2 + u32::try_from(n).unwrap(), now_us - 15_000);
        gate.offer(&fresh, now_us).unwrap();
        gate.tick(now_us);
        assert_eq!(gate.state(), State::Disarmed(Cause::Clock));
    }
    gate.arm(START, T0 + 1_010_000).unwrap();
    assert_eq!(gate.state(), State::Following);
    // Nobody has armed this one: why it is disarmed stays.
    let mut idle = self::gate();
    idle.mistime();
    assert_eq!(idle.state(), State::Disarmed(Cause::Start));
}

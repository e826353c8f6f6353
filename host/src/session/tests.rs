mod inferred;
mod novelty;

use super::{COMMAND_LIFE_US, DOFS, Event, Session, SessionConfig, SessionError};
use crate::demonstration::Demonstration;
use crate::model::recognise::Recogniser;
use crate::model::{Dof, Hyperparameters, Model, Valid, learn};
use crate::robot::command::{Command, Quality};
use crate::robot::gate::{Cause, Gate, Refusal, State};
use crate::robot::limits::{Fallback, Limits};
use tonus_shared::promp::Basis;
use tonus_shared::semg::quality::Quality as ChannelQuality;
use tonus_shared::wire::{Frame, Header, Packet, Stream, StreamFlags};

const CONFIG: SessionConfig = SessionConfig {
    observations: 5,
    position_sigma_m: 0.002,
    stiffness_sigma: 0.05,
    use_semg: true,
    decide_at: 0.95,
    decide_after: 1,
    act_within_m: 0.05,
    home_m: [0.4, 0.0, 0.45],
    home_stiffness_n_per_m: [200.0; 3],
    damping_ratio: 1.0,
};
/// When the tests' movement begins, and how long it takes.
const BEGAN_US: u64 = 10_000_000;
const LASTS_US: u64 = 2_000_000;

/// How far a DoF of position has gone at phase `s`, metres: 0.1 for the first skill, 0.3 for the second.
fn way_m(skill: usize, s: f64) -> f64 {
    (0.1 + 0.2 * skill as f64) * s
}

/// Stiffness at phase `s`, N/m: the second skill ends four times as firm.
fn firmness(skill: usize, s: f64) -> f64 {
    200.0 * (1.0 + 3.0 * skill as f64 * s)
}

/// Two skills, `far` (1) and `near` (0), that differ more and more from their start: six demonstrations of each.
fn demonstrations(dofs: &[&str]) -> (Vec<Demonstration>, Valid) {
    let labels = ["a_near", "b_far"];
    let mut all = Vec::new();
    for n in 0..12 {
        let skill = n % 2;
        let t_s: Vec<f64> = (0..=40).map(|i| f64::from(i) / 20.0).collect();
        let values = dofs.iter().enumerate().map(|(d, name)| {
            let varies = ((n * 5 + d * 3) as f64).sin();
            let at = |t: &f64| {
                let s = t / 2.0;
                if name.contains("_k") {
                    firmness(skill, s) * (0.03 * varies).exp()
                } else {
                    way_m(skill, s) + 0.005 * varies
                }
            };
            t_s.iter().map(at).collect()
        });
        let values = values.collect();
        let trial = n.to_string();
        all.push(Demonstration::new(labels[skill], trial, "tests", t_s, values).unwrap());
    }
    let dof = |name: &&str| match name.contains("_k") {
        true => Dof::stiffness(*name),
        false => Dof::position(*name),
    };
    let dofs = dofs.iter().map(dof).collect();
    let valid = Hyperparameters::new(dofs, Basis::gaussian(6).unwrap()).check();
    (all, valid.unwrap())
}

fn model(dofs: &[&str]) -> Model {
    let (all, valid) = demonstrations(dofs);
    learn(&all, &valid).unwrap()
}

/// Runs `test` on a session of that model.
fn with_session(config: SessionConfig, test: impl FnOnce(&mut Session<'_>)) {
    let model = model(&DOFS);
    let view = model.view().unwrap();
    let recogniser = Recogniser::new(&model, &view).unwrap();
    test(&mut Session::new(recogniser, config).unwrap());
}

fn stream(stiffness_n_per_m: f64) -> Stream {
    Stream {
        describes_before_us: 64_000,
        envelopes: [0.0; 8],
        activation: 0.1,
        co_contraction: 1.2,
        stiffness_n_per_m: [stiffness_n_per_m as f32; 3],
        quality: [ChannelQuality::GOOD; 8],
        channels: 4,
        flags: StreamFlags::from_bits(0),
    }
}

fn frame(boot_id: u32, sequence: u32, device_us: u64, stream: Stream) -> Frame {
    Frame {
        header: Header {
            boot_id,
            sequence,
            device_us,
        },
        packet: Packet::Stream(stream),
    }
}

fn give(session: &mut Session<'_>, frame: &Frame, now_us: u64) -> Option<Command> {
    session.handle(Event::Frame(frame), now_us).unwrap()
}

fn begin(session: &mut Session<'_>) {
    let began = Event::Began {
        at_us: BEGAN_US,
        duration_us: LASTS_US,
    };
    session.handle(began, BEGAN_US).unwrap();
}

fn see_hand(session: &mut Session<'_>, exposed_us: u64, position_m: [f64; 3]) {
    let hand = Event::Hand {
        exposed_us,
        position_m,
    };
    session.handle(hand, exposed_us + 12_000).unwrap();
}

/// What the first skill expects of a DoF at half way.
fn place(session: &mut Session<'_>, dof: usize) -> f64 {
    let super::Follower::Announced { recogniser, .. } = &mut session.follower else {
        panic!("these movements are announced");
    };
    recogniser.predict(0, dof, 0.5).unwrap().mean
}

#[test]
fn a_model_without_one_of_the_signals_is_refused() {
    let model = model(&DOFS[..11]);
    let view = model.view().unwrap();
    let recogniser = Recogniser::new(&model, &view).unwrap();
    let refused = Session::new(recogniser, CONFIG).unwrap_err();
    assert!(
        matches!(&refused, SessionError::MissingDof { name: "robot_kz", present } if present.len() == 11),
        "{refused}"
    );
}

#[test]
fn a_command_is_aged_by_the_newest_scan_and_waits_at_home() {
    with_session(CONFIG, |session| {
        let command = give(session, &frame(1, 7, 5_000_000, stream(300.0)), 5_012_000).unwrap();
        assert_eq!(command.acquired_us, 5_000_000, "not what it describes");
        assert_eq!(command.valid_until_us, 5_100_000);
        assert_eq!(command.position_m, CONFIG.home_m);
        assert_eq!(command.stiffness_n_per_m, CONFIG.home_stiffness_n_per_m);
        assert_eq!((command.boot_id, command.quality), (1, Quality::Good));
    });
}

#[test]
fn repeated_and_overtaken_packets_command_nothing() {
    with_session(CONFIG, |session| {
        let at = |n: u32| frame(1, n, 5_000_000 + u64::from(n) * 10_000, stream(300.0));
        let first = give(session, &at(3), 5_040_000).unwrap();
        assert!(give(session, &at(3), 5_041_000).is_none(), "repeated");
        let second = give(session, &at(6), 5_070_000).unwrap();
        assert!(give(session, &at(5), 5_072_000).is_none(), "overtaken");
        assert_eq!(second.sequence, first.sequence + 1);
        let counts = session.frames();
        assert_eq!((counts.duplicate, counts.late, counts.lost), (1, 1, 1));
    });
}

#[test]
fn the_last_moment_of_the_clock_overflows_nothing() {
    with_session(CONFIG, |session| {
        let began = Event::Began {
            at_us: u64::MAX - 5,
            duration_us: u64::MAX,
        };
        session.handle(began, u64::MAX).unwrap();
        see_hand(session, u64::MAX - 20_000, [0.0; 3]);
        let last = frame(1, u32::MAX, u64::MAX, stream(300.0));
        let command = give(session, &last, u64::MAX).unwrap();
        assert_eq!(command.valid_until_us, u64::MAX);
    });
}

#[test]
fn bad_signals_are_marked_and_never_observed() {
    let mut unworn = stream(800.0);
    unworn.quality[2] = ChannelQuality::LEAD_OFF;
    let held = |flags: StreamFlags| Stream {
        flags,
        ..stream(800.0)
    };
    let faults = [
        unworn,
        held(StreamFlags::STIFFNESS_HELD),
        held(StreamFlags::ACTIVATION_HELD),
    ];
    for fault in faults {
        with_session(CONFIG, |session| {
            begin(session);
            let before = session.posterior();
            let bad = frame(1, 1, BEGAN_US + 1_900_000, fault);
            let command = give(session, &bad, BEGAN_US + 1_910_000).unwrap();
            assert_eq!(command.quality, Quality::SignalFault);
            assert_eq!(session.posterior(), before, "stiffness is never invented");
            let good = frame(1, 2, BEGAN_US + 1_910_000, stream(800.0));
            give(session, &good, BEGAN_US + 1_920_000);
            assert_ne!(session.posterior(), before, "the sound one counts");
        });
    }
}

#[test]
fn observations_belong_to_the_instant_they_describe() {
    with_session(CONFIG, |session| {
        begin(session);
        let prior = session.posterior();
        // Acquired after the beginning, but the muscle's state of before it; then after the end.
        let early = frame(1, 1, BEGAN_US + 63_999, stream(800.0));
        give(session, &early, BEGAN_US + 70_000);
        let late = frame(1, 2, BEGAN_US + LASTS_US + 64_000, stream(800.0));
        give(session, &late, BEGAN_US + LASTS_US + 70_000);
        see_hand(session, BEGAN_US - 1, [0.3; 3]);
        assert_eq!(session.posterior(), prior);
        // Described inside, by one microsecond.
        let first = frame(1, 3, BEGAN_US + LASTS_US + 63_999, stream(800.0));
        give(session, &first, BEGAN_US + LASTS_US + 70_000);
        assert!(session.posterior()[1] > 0.99, "{:?}", session.posterior());
    });
}

/// How many of these frames of the hand are observed: the robot's expected place shifts with every one.
fn observed(times_ms: impl Iterator<Item = u64>) -> u32 {
    let mut shifts = 0;
    with_session(CONFIG, |session| {
        begin(session);
        let dof = session.dofs[6];
        let mut last = place(session, dof);
        for ms in times_ms {
            let x = way_m(0, ms as f64 / 2000.0) + 0.002;
            see_hand(session, BEGAN_US + ms * 1000, [x; 3]);
            let now = place(session, dof);
            shifts += u32::from(now != last);
            last = now;
        }
    });
    shifts
}

#[test]
fn each_sensor_is_observed_as_often_as_configured() {
    assert_eq!(observed((0..=2000).step_by(10)), 5);
    // Hidden for the first 1.2 s, which are three of five parts: they are not made up for.
    assert_eq!(observed((1200..=2000).step_by(10)), 2);
    assert_eq!(observed([0, 399, 400, 1999, 2000].into_iter()), 3);
}

#[test]
fn without_semg_stiffness_tells_nothing() {
    let config = SessionConfig {
        use_semg: false,
        ..CONFIG
    };
    with_session(config, |session| {
        begin(session);
        let before = session.posterior();
        let firm = frame(1, 1, BEGAN_US + 1_000_000, stream(500.0));
        give(session, &firm, BEGAN_US + 1_010_000);
        assert_eq!(session.posterior(), before);
    });
}

#[test]
fn the_robot_waits_for_agreement_then_follows_the_skill_that_is_seen() {
    with_session(CONFIG, |session| {
        begin(session);
        // Halfway between 0.09 and 0.27 m, so 0.09 m from either: more than the 0.05 m that may be acted within.
        let held = Stream {
            flags: StreamFlags::STIFFNESS_HELD,
            ..stream(300.0)
        };
        let doubtful = frame(1, 1, BEGAN_US + 1_800_000, held);
        let command = give(session, &doubtful, BEGAN_US + 1_800_000).unwrap();
        assert_eq!(command.quality, Quality::SignalFault, "the graver reason");
        assert!((command.position_m[0] - 0.18).abs() < 0.01, "{command:?}");
        assert!(session.decision().is_none());

        // The hand alone, then the muscles: both are needed to decide.
        see_hand(session, BEGAN_US + 1_000_000, [way_m(1, 0.5); 3]);
        assert!(session.decision().is_none());
        let firm = frame(1, 2, BEGAN_US + 1_064_000, stream(firmness(1, 0.5)));
        let command = give(session, &firm, BEGAN_US + 1_100_000).unwrap();
        let decision = session.decision().unwrap();
        assert_eq!(decision.skill, 1);
        assert!((decision.after_s - 1.1).abs() < 1e-9);
        assert!(decision.posterior >= CONFIG.decide_at);
        assert_eq!(command.quality, Quality::Good);
        // At the phase of now (0.55): place, velocity over 2 s, and stiffness, within what the demonstrations vary.
        for axis in 0..3 {
            assert!((command.position_m[axis] - way_m(1, 0.55)).abs() < 0.01);
            assert!((command.velocity_m_per_s[axis] - 0.15).abs() < 0.03);
            let share = command.stiffness_n_per_m[axis] / firmness(1, 0.55);
            assert!((share - 1.0).abs() < 0.06, "{share}");
        }
        session.handle(Event::Ended, BEGAN_US + LASTS_US).unwrap();
        assert!(session.decision().is_none());
    });
}

#[test]
fn doubt_alone_is_undecided() {
    let config = SessionConfig {
        use_semg: false,
        ..CONFIG
    };
    with_session(config, |session| {
        begin(session);
        let late = frame(1, 1, BEGAN_US + 1_800_000, stream(300.0));
        let command = give(session, &late, BEGAN_US + 1_800_000).unwrap();
        assert_eq!(command.quality, Quality::Undecided);
        begin(session);
        let early = frame(1, 2, BEGAN_US + 1_810_000, stream(300.0));
        let command = give(session, &early, BEGAN_US + 100_000).unwrap();
        assert_eq!(command.quality, Quality::Good, "the skills still agree");
    });
}

#[test]
fn a_restarted_wearable_disarms_and_stays_disarmed() {
    with_session(CONFIG, |session| {
        let mut gate = Gate::new(Limits::default(), Fallback::default(), CONFIG.home_m).unwrap();
        let first = give(session, &frame(1, 9, 5_000_000, stream(300.0)), 5_010_000).unwrap();
        gate.offer(&first, 5_010_000).unwrap();
        gate.arm(CONFIG.home_m, 5_010_000).unwrap();
        let other = give(session, &frame(2, 0, 5_020_000, stream(300.0)), 5_030_000).unwrap();
        let refused = gate.offer(&other, 5_030_000);
        assert_eq!(refused, Err(Refusal::OtherBoot { got: 2, armed: 1 }));
        for n in 1..20 {
            let now_us = 5_030_000 + u64::from(n) * 10_000;
            let next = frame(2, n, now_us - 10_000, stream(300.0));
            let command = give(session, &next, now_us).unwrap();
            gate.offer(&command, now_us).unwrap();
            gate.tick(now_us);
            assert_eq!(gate.state(), State::Disarmed(Cause::OtherBoot));
        }
    });
    assert_eq!(COMMAND_LIFE_US, 100_000);
}

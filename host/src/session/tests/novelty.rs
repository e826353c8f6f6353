//! A session that watches for what is in no library.

use super::{
    BEGAN_US, CONFIG, DOFS, LASTS_US, begin, demonstrations, firmness, frame, give, model, stream,
    way_m,
};
use crate::demonstration::Demonstration;
use crate::model::novelty::{Gate, GateConfig, GateSettings};
use crate::model::recognise::Recogniser;
use crate::model::tempo::{TempoConfig, TempoRecogniser};
use crate::robot::command::{Command, Quality};
use crate::robot::gate;
use crate::robot::limits::{Fallback, Limits};
use crate::session::{Event, Session, SessionConfig, SessionError};
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::StandardNormal;
use tonus_shared::onset::OnsetConfig;
use tonus_shared::wire::StreamFlags;

const STEP_US: u64 = 10_000;

/// Twenty of each skill; each signal varies by itself, as a whole and in the course of the movement.
fn varied(names: &[&str], spread_m: f64) -> Vec<Demonstration> {
    let mut random = ChaCha8Rng::seed_from_u64(4);
    let mut normal = || random.sample::<f64, _>(StandardNormal);
    let mut one = |n: usize| {
        let skill = n % 2;
        let t_s: Vec<f64> = (0..=40).map(|i| f64::from(i) / 20.0).collect();
        let values = names.iter().map(|name| {
            let (whole, course) = (normal(), normal());
            let at = |t: &f64| {
                let s = t / 2.0;
                let varies = whole + course * (std::f64::consts::TAU * s).sin();
                if name.contains("_k") {
                    firmness(skill, s) * (6.0 * spread_m * varies).exp()
                } else {
                    way_m(skill, s) + spread_m * varies
                }
            };
            t_s.iter().map(at).collect()
        });
        let (values, label) = (values.collect(), ["a_near", "b_far"][skill]);
        Demonstration::new(label, n.to_string(), "tests", t_s, values).unwrap()
    };
    (0..40).map(&mut one).collect()
}

fn learnt(names: &[&str], dofs: &[usize]) -> Gate {
    learnt_of(names, dofs, 0.005)
}

fn learnt_of(names: &[&str], dofs: &[usize], spread_m: f64) -> Gate {
    let (_, valid) = demonstrations(names);
    let all = varied(names, spread_m);
    let config = GateConfig {
        dofs: dofs.to_vec(),
        throughout: true,
        ..GateConfig::of(dofs.len())
    };
    Gate::with_settings(&all, &valid, &GateSettings::default(), &config).unwrap()
}

/// Runs `test` on a session with that gate on the person's signals.
fn watching(config: SessionConfig, test: impl FnOnce(&mut Session<'_>)) {
    let model = model(&DOFS);
    let view = model.view().unwrap();
    let recogniser = Recogniser::new(&model, &view).unwrap();
    let seen: Vec<usize> = (0..if config.use_semg { 6 } else { 3 }).collect();
    let gate = learnt(&DOFS, &seen);
    let session = Session::new(recogniser, config).unwrap();
    test(&mut session.watching(&gate).unwrap());
}

/// Where the hand is and how firm, at a phase; what cannot be seen is `None`.
type Seen = (Option<f64>, Option<f64>);

/// One announced movement; `each` sees the session and every command with its phase.
fn live(
    session: &mut Session<'_>,
    person: impl Fn(f64) -> Seen,
    mut each: impl FnMut(&Session<'_>, &Command, f64),
) {
    begin(session);
    for at_us in (0..LASTS_US).step_by(STEP_US as usize) {
        let s = at_us as f64 / LASTS_US as f64;
        let (hand, firm) = person(s);
        let now_us = BEGAN_US + at_us;
        if let Some(x) = hand {
            let seen = Event::Hand {
                exposed_us: now_us,
                position_m: [x; 3],
            };
            session.handle(seen, now_us).unwrap();
        }
        let mut shown = stream(firm.unwrap_or(1.0));
        if firm.is_none() {
            shown.flags = StreamFlags::STIFFNESS_HELD;
        }
        let frame = frame(1, session.commands, now_us + 64_000, shown);
        let command = give(session, &frame, now_us + 76_000).unwrap();
        each(session, &command, s);
    }
}

/// As the skill was shown: in the middle of what the demonstrations vary.
fn known(skill: usize, s: f64) -> Seen {
    (Some(way_m(skill, s) + 0.001), Some(firmness(skill, s)))
}

/// The far skill until a quarter of it; then the hand goes back and beyond, by as much as the far skill goes forth.
fn turned(s: f64) -> Seen {
    let x = way_m(1, s.min(0.25)) - way_m(1, 2.0 * (s - 0.25).max(0.0));
    (Some(x), Some(firmness(1, s)))
}

#[test]
fn known_movements_are_followed_as_without_a_gate() {
    for skill in [0, 1] {
        let (mut plain, mut decided) = (Vec::new(), None);
        super::with_session(CONFIG, |session| {
            live(session, |s| known(skill, s), |_, c, _| plain.push(*c));
            assert!(session.novelty().is_none() && !session.unknown());
            decided = session.decision();
        });
        let mut watched = Vec::new();
        watching(CONFIG, |session| {
            assert!(session.novelty().is_none(), "at rest");
            live(session, |s| known(skill, s), |_, c, _| watched.push(*c));
            let novelty = session.novelty().unwrap();
            assert_eq!(novelty.nearest, ["a_near", "b_far"][skill]);
            assert!(novelty.score <= novelty.threshold && !novelty.unknown);
            assert_eq!(session.decision(), decided);
            session.handle(Event::Ended, BEGAN_US + LASTS_US).unwrap();
            assert!(session.novelty().is_none(), "at rest again");
        });
        assert_eq!(watched, plain);
    }
}

#[test]
fn an_unknown_movement_has_no_decision_and_the_robot_stays_where_it_is_until_the_end() {
    watching(CONFIG, |session| {
        let mut robot = gate::Gate::new(Limits::default(), Fallback::default(), CONFIG.home_m);
        let robot = robot.as_mut().unwrap();
        let (mut decided, mut first, mut held_m) = (false, None, None);
        live(session, turned, |session, command, s| {
            let now_us = command.acquired_us + 12_000;
            robot.offer(command, now_us).unwrap();
            let _already = robot.arm(CONFIG.home_m, now_us);
            let at_m = robot.tick(now_us).position_m;
            if s <= 0.25 {
                assert!(!session.unknown(), "{s}");
                decided |= session.decision().is_some();
            }
            if s >= 0.5 {
                // A phase after it has turned, which is 0.3 m from anything known, it is named.
                assert!(session.unknown() && session.novelty().unwrap().unknown);
                assert_eq!(command.quality, Quality::Novel);
                assert!(session.decision().is_none());
                assert_eq!(*held_m.get_or_insert(at_m), at_m, "{s}");
                first.get_or_insert(s);
            }
        });
        assert!(decided, "before it turned, it was the far skill");
        assert!(first.is_some() && held_m.is_some_and(|at_m| at_m != CONFIG.home_m));
        session.handle(Event::Ended, BEGAN_US + LASTS_US).unwrap();
        assert!(!session.unknown());
        let rest = frame(1, 900, BEGAN_US + LASTS_US + 100_000, stream(200.0));
        let home = give(session, &rest, BEGAN_US + LASTS_US + 110_000).unwrap();
        assert_eq!(
            (home.quality, home.position_m),
            (Quality::Good, CONFIG.home_m)
        );
    });
}

#[test]
fn what_was_unknown_once_stays_so_until_the_next_movement() {
    // For a fifth of the movement the hand is 0.4 m away, then where the far skill has it.
    let strayed = |s: f64| {
        let away = if (0.2..0.4).contains(&s) { 0.4 } else { 0.0 };
        (Some(way_m(1, s) + away), Some(firmness(1, s)))
    };
    watching(CONFIG, |session| {
        let mut last = None;
        live(session, strayed, |session, command, _| {
            last = Some((session.unknown(), command.quality));
        });
        assert_eq!(last, Some((true, Quality::Novel)));
        // Announced anew without an end between: judged anew.
        live(
            session,
            |s| known(1, s),
            |session, command, s| {
                assert!(!session.unknown(), "{s}");
                assert_ne!(command.quality, Quality::Novel, "{s}");
            },
        );
        assert!(session.decision().is_some());
    });
}

#[test]
fn what_cannot_be_seen_for_a_while_is_not_unknown() {
    for skill in [0, 1] {
        // From a phase on, a tenth, a third or half of the movement.
        for (from, lasts) in (1..9).flat_map(|n| [(n, 0.1), (n, 0.33), (n, 0.5)]) {
            let from = 0.1 * f64::from(from);
            let hidden = from..from + lasts;
            let away = |s: f64| hidden.contains(&s);
            let (hand, firm) = (
                |s: f64| if away(s) { None } else { known(skill, s).0 },
                |s: f64| if away(s) { None } else { known(skill, s).1 },
            );
            let gaps: [&dyn Fn(f64) -> Seen; 3] = [
                &|s| (hand(s), known(skill, s).1),
                &|s| (known(skill, s).0, firm(s)),
                &|s| (hand(s), firm(s)),
            ];
            for gap in gaps {
                watching(CONFIG, |session| {
                    live(session, gap, |session, _, s| {
                        assert!(!session.unknown(), "{skill} {hidden:?} {s}");
                    });
                });
            }
        }
    }
}

/// A hand that leaves the demonstrated way while nobody looks, and a firmness that cannot be used for as long: after either the
/// movement may be anything, and nothing is followed before it is over.
#[test]
fn a_movement_that_was_missed_for_too_long_is_not_followed() {
    let away = |s: f64| (0.25..0.65).contains(&s);
    let gaps: [&dyn Fn(f64) -> Seen; 2] = [
        &|s| (known(0, s).0.filter(|_| !away(s)), known(0, s).1),
        &|s| (known(0, s).0, known(0, s).1.filter(|_| !away(s))),
    ];
    for gap in gaps {
        watching(CONFIG, |session| {
            let mut good = 0;
            live(session, gap, |session, command, s| {
                good += u32::from(command.quality == Quality::Good && s < 0.25);
                if s > 0.66 {
                    assert!(session.unjudged() && !session.unknown(), "{s}");
                    assert_ne!(command.quality, Quality::Good, "{s}");
                }
            });
            assert!(good > 0, "followed before");
            session.handle(Event::Ended, BEGAN_US + LASTS_US).unwrap();
            assert!(!session.unjudged());
            live(
                session,
                |s| known(1, s),
                |session, _, s| {
                    assert!(!session.unjudged(), "{s}");
                },
            );
        });
    }
}

#[test]
fn samples_that_are_no_news_or_no_numbers_change_nothing() {
    watching(CONFIG, |session| {
        begin(session);
        let mut see = |ms: u64, x: f64| {
            let exposed_us = BEGAN_US + 1000 * ms;
            let position_m = [x; 3];
            let seen = Event::Hand {
                exposed_us,
                position_m,
            };
            session.handle(seen, exposed_us + 12_000).map(|_| ())
        };
        see(0, way_m(0, 0.0)).unwrap();
        see(200, way_m(0, 0.1)).unwrap();
        // Overtaken, repeated, before the movement: 9 m away, and not handed on.
        for ms in [100, 200] {
            see(ms, 9.0).unwrap();
        }
        let refused = see(220, f64::NAN).unwrap_err();
        assert!(matches!(refused, SessionError::Novelty(_)), "{refused}");
        see(400, way_m(0, 0.2)).unwrap();
        for ms in (0..=400).step_by(20) {
            let soft = frame(
                1,
                1 + ms as u32,
                BEGAN_US + ms * 1000 + 64_000,
                stream(200.0),
            );
            give(session, &soft, BEGAN_US + ms * 1000 + 70_000);
        }
        assert!(session.novelty().is_some_and(|novelty| !novelty.unknown));
        // Farther than a number can say is far.
        let far = Event::Hand {
            exposed_us: BEGAN_US + 500_000,
            position_m: [1e200; 3],
        };
        // Whether or not the recogniser wanted it.
        let _either = session.handle(far, BEGAN_US + 512_000);
        let next = frame(1, 900, BEGAN_US + 564_000, stream(200.0));
        give(session, &next, BEGAN_US + 570_000);
        assert!(session.unknown());
    });
}

#[test]
fn a_gate_that_does_not_fit_is_refused() {
    let model = model(&DOFS);
    let view = model.view().unwrap();
    let session = |use_semg| {
        let recogniser = Recogniser::new(&model, &view).unwrap();
        Session::new(recogniser, SessionConfig { use_semg, ..CONFIG }).unwrap()
    };
    // Its first DoF is the robot's x.
    let mut others = DOFS;
    others.rotate_left(6);
    let foreign = learnt(&others, &[0, 1]);
    let refused = session(true).watching(&foreign).unwrap_err();
    let text = refused.to_string();
    assert!(
        matches!(&refused, SessionError::ForeignGate { name, index: 0 } if name == "robot_x"),
        "{text}"
    );
    let robot = learnt(&DOFS, &[0, 6]);
    let refused = session(true).watching(&robot).unwrap_err();
    assert!(
        matches!(&refused, SessionError::Unobserved { name, observed } if name == "robot_x" && observed.len() == 6),
        "{refused}"
    );
    let firm = learnt(&DOFS, &[0, 3]);
    let refused = session(false).watching(&firm).unwrap_err();
    assert!(
        matches!(&refused, SessionError::Unobserved { name, observed } if name == "human_kx" && observed.len() == 3),
        "{refused}"
    );
    let fits = learnt(&DOFS, &[0, 1, 2]);
    assert!(session(false).watching(&fits).is_ok());
}

/// The commands of a movement that nobody announces, and whether it was ever unknown.
fn inferred(person: impl Fn(f64) -> Seen) -> (Vec<Quality>, bool) {
    /// A fifth faster than it was shown.
    const FASTER_US: u64 = 1_600_000;
    let model = model(&DOFS);
    let view = model.view().unwrap();
    let recogniser = TempoRecogniser::new(&model, &view, TempoConfig::default()).unwrap();
    // A phase that is a few percent off puts the hand centimetres off: it can be told from such as vary by as much.
    let gate = learnt_of(&DOFS, &[0, 1, 2, 3, 4, 5], 0.03);
    let session = Session::inferring(recogniser, &OnsetConfig::default(), 100_000, CONFIG);
    let mut session = session.unwrap().watching(&gate).unwrap();
    let (mut qualities, mut ever) = (Vec::new(), false);
    let instants = (BEGAN_US - 1_000_000..BEGAN_US + FASTER_US).step_by(STEP_US as usize);
    for (sequence, now_us) in (0..).zip(instants) {
        let s = now_us.saturating_sub(BEGAN_US) as f64 / FASTER_US as f64;
        let (hand, firm) = person(s);
        let seen = Event::Hand {
            exposed_us: now_us,
            position_m: [hand.unwrap(); 3],
        };
        session.handle(seen, now_us + 12_000).unwrap();
        // It does not listen, nor does this make it forget.
        begin(&mut session);
        let frame = frame(1, sequence, now_us + 64_000, stream(firm.unwrap()));
        qualities.push(give(&mut session, &frame, now_us + 76_000).unwrap().quality);
        ever |= session.unknown();
    }
    (qualities, ever)
}

#[test]
fn an_unannounced_movement_is_judged_at_the_phase_that_is_inferred() {
    let (qualities, ever) = inferred(|s| known(1, s));
    assert!(!ever && !qualities.contains(&Quality::Novel));
    let (qualities, ever) = inferred(turned);
    assert!(ever);
    let since = qualities.iter().position(|q| *q == Quality::Novel).unwrap();
    assert!(qualities[since..].iter().all(|q| *q == Quality::Novel));
}

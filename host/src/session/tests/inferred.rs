//! A session to which nothing is announced.

use super::{BEGAN_US, CONFIG, DOFS, firmness, frame, give, model, see_hand, stream, way_m};
use crate::model::tempo::{TempoConfig, TempoRecogniser};
use crate::robot::command::{Command, Quality};
use crate::session::{Event, Session, SessionError};
use tonus_shared::onset::OnsetConfig;

/// The second skill, a fifth faster than it was ever shown.
const LASTS_US: u64 = 1_600_000;
const STEP_US: u64 = 10_000;
const INTERVAL_US: u64 = 100_000;

/// The hand rests until [`BEGAN_US`], moves, rests again; `each` sees the session and the command of every instant.
fn live(skill: usize, mut each: impl FnMut(&Session<'_>, &Command, f64)) {
    let model = model(&DOFS);
    let view = model.view().unwrap();
    let recogniser = TempoRecogniser::new(&model, &view, TempoConfig::default()).unwrap();
    let onset = OnsetConfig::default();
    let mut session = Session::inferring(recogniser, &onset, INTERVAL_US, CONFIG).unwrap();
    // Announced or not: it does not listen.
    let began = Event::Began {
        at_us: 1,
        duration_us: 1,
    };
    session.handle(began, 1).unwrap();
    let instants = (BEGAN_US - 1_000_000..BEGAN_US + 4_000_000).step_by(STEP_US as usize);
    for (sequence, now_us) in (0..).zip(instants) {
        let since = now_us.saturating_sub(BEGAN_US).min(LASTS_US);
        let s = since as f64 / LASTS_US as f64;
        see_hand(&mut session, now_us, [way_m(skill, s); 3]);
        let frame = frame(1, sequence, now_us + 64_000, stream(firmness(skill, s)));
        let command = give(&mut session, &frame, now_us + 76_000).unwrap();
        each(&session, &command, s);
    }
}

#[test]
fn motion_begins_the_movement_and_the_bank_follows_it() {
    let (mut followed, mut errors) = (0, Vec::new());
    let mut last = None;
    live(1, |session, command, s| {
        if s == 0.0 {
            assert!(!session.under_way() && session.decision().is_none());
            assert_eq!(command.position_m, CONFIG.home_m);
            assert_eq!(command.quality, Quality::Good);
        }
        if (0.5..0.9).contains(&s) {
            assert!(session.under_way());
            assert!(session.posterior()[1] > 0.95, "{s}");
            assert_eq!(session.decision().unwrap().skill, 1);
            followed += usize::from(command.quality == Quality::Good);
            // The command is for 76 ms after what the hand shows.
            let now = (s + 76_000.0 / LASTS_US as f64).min(1.0);
            errors.push((command.position_m[0] - way_m(1, now)).abs());
        }
        last = Some((session.under_way(), command.position_m));
    });
    assert!(followed > 0 && errors.len() == followed, "{followed}");
    // 20 mm are a tenth of a second.
    let worst = errors.into_iter().fold(0.0, f64::max);
    assert!(worst < 0.03, "{worst} m");
    assert_eq!(last, Some((false, CONFIG.home_m)));
}

#[test]
fn what_is_below_the_threshold_is_no_movement() {
    // The first skill at this pace: 0.1 m on three axes in 1.6 s, 0.11 m/s.
    live(0, |session, command, _| {
        assert!(!session.under_way());
        assert_eq!(command.position_m, CONFIG.home_m);
    });
}

#[test]
fn a_detector_that_cannot_be_is_refused() {
    let model = model(&DOFS);
    let view = model.view().unwrap();
    let recogniser = TempoRecogniser::new(&model, &view, TempoConfig::default()).unwrap();
    let onset = OnsetConfig {
        release: 1.0,
        ..OnsetConfig::default()
    };
    let refused = Session::inferring(recogniser, &onset, INTERVAL_US, CONFIG).unwrap_err();
    assert!(matches!(refused, SessionError::Onset(_)), "{refused}");
}

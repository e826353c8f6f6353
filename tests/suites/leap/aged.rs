//! In virtual time: a hand that is given was there, and not long ago.

use proptest::prelude::*;
use tonus::leap::{Follower, Message, Refusal, Side, Wanted};
use tonus_tests::seeded;

use super::{VERSION, frame};

const PERIOD_US: u64 = 9_000;
const HOST_US: u64 = 1_000_000;
/// The limit, a lag that passes for the service's own, the jitter below, and what a rate that is not known yet does over
/// the longest silence.
const AGE_US: u64 = 100_000 + 10_000 + 4_000 + 12_000;

fn following(wanted: Wanted) -> Follower {
    let mut follower = Follower::new(wanted, 0);
    follower.take(VERSION, HOST_US).unwrap();
    follower
}

/// A service whose clock is learnt, from frames without a hand until number `frames`.
fn settled(wanted: Wanted, frames: u64) -> Follower {
    let mut follower = following(wanted);
    for k in 0..frames {
        let _ = follower.take(
            &frame(k.cast_signed(), k * PERIOD_US, &[]),
            HOST_US + k * PERIOD_US,
        );
    }
    follower
}

fn at(k: u64) -> u64 {
    HOST_US + k * PERIOD_US
}

fn right(k: u64) -> String {
    frame(k.cast_signed(), k * PERIOD_US, &[(1, "right", 200.0)])
}

#[test]
fn the_first_quarter_of_a_second_gives_nothing() {
    let mut follower = following(Wanted::Either);
    let first = (0..100).find(|k| follower.take(&right(*k), at(*k)).is_ok());
    assert_eq!(first, Some(250_000_u64.div_ceil(PERIOD_US)));
}

#[test]
fn a_backlog_after_connecting_is_not_taken_for_now() {
    let mut follower = following(Wanted::Either);
    // 2 s of frames that waited come within 20 ms, then frames as they are taken.
    for k in 0..222 {
        let came = at(222) + k * 90;
        assert_eq!(follower.take(&right(k), came), Err(Refusal::Settling));
    }
    let mut given = 0;
    for k in 222..300 {
        let came = at(k) + 21_000;
        if let Ok(Message::Seen(sight)) = follower.take(&right(k), came) {
            assert!(sight.exposed_us.abs_diff(came) <= 1_000, "{sight:?}");
            given += 1;
        }
    }
    assert!(given > 40, "{given}");
}

#[test]
fn a_frozen_service_shows_nothing() {
    let mut follower = settled(Wanted::Either, 100);
    assert!(matches!(
        follower.take(&right(100), at(100)),
        Ok(Message::Seen(_))
    ));
    for later in 1..1_000 {
        let now = at(100) + later * PERIOD_US;
        let repeated = Refusal::Repeated {
            newest_id: 100,
            got_id: 100,
        };
        assert_eq!(follower.take(&right(100), now), Err(repeated));
        assert_eq!(follower.hand(now).is_some(), later * PERIOD_US <= 100_000);
    }
    // A number that goes on without its time stamp, and the other way about, say no more.
    for (id, k) in [(101, 100), (100, 101)] {
        let text = frame(id, k * PERIOD_US, &[(1, "right", 200.0)]);
        let refused = follower.take(&text, at(1_100));
        assert!(
            matches!(refused, Err(Refusal::Repeated { .. })),
            "{refused:?}"
        );
    }
}

#[test]
fn a_lag_is_age_however_long_it_lasts() {
    let mut follower = settled(Wanted::Either, 2_000);
    for k in 2_000..20_000 {
        let refused = follower.take(&right(k), at(k) + 300_000);
        assert!(
            matches!(refused, Err(Refusal::Stale { age_us }) if age_us.abs_diff(300_000) < 2_000),
            "{k}: {refused:?}"
        );
    }
    // After three minutes without a frame in time, its clock is learnt anew.
    let mut caught_up = |k: &u64| matches!(follower.take(&right(*k), at(*k)), Ok(Message::Seen(_)));
    assert_eq!((20_000..20_100).find(&mut caught_up), Some(20_028));
}

#[test]
fn a_service_that_begins_again_behind_a_bridge_is_followed_again() {
    let mut follower = settled(Wanted::Either, 1_000);
    let mut given = Vec::new();
    for k in 0..100 {
        if let Ok(Message::Seen(sight)) = follower.take(&right(k), at(1_500 + k)) {
            assert!(sight.exposed_us.abs_diff(at(1_500 + k)) <= 1_000);
            given.push(k);
        }
    }
    // Ten frames to be sure, a quarter of a second to learn its clock.
    assert_eq!(given.first(), Some(&(9 + 28)));
    assert_eq!(given.len(), 100 - 37);
}

#[test]
fn the_same_service_after_a_lost_connection_is_aged_at_once() {
    let mut follower = settled(Wanted::Either, 1_000);
    follower.reconnect();
    assert_eq!(
        follower.take(&right(1_100), at(1_100)),
        Err(Refusal::NoVersion)
    );
    follower.take(VERSION, at(1_100)).unwrap();
    // What it kept for the client is two seconds old, and is known to be.
    let refused = follower.take(&right(1_101), at(1_101) + 2_000_000);
    assert!(matches!(refused, Err(Refusal::Stale { .. })), "{refused:?}");
    let now = follower.take(&right(1_400), at(1_400));
    assert!(
        matches!(now, Ok(Message::Seen(sight)) if sight.new_hand),
        "{now:?}"
    );
}

#[test]
fn of_two_hands_the_wanted_and_the_one_followed_before() {
    let both = |k: u64, first: (i64, f64), second: (i64, f64)| {
        let hand = |(id, confidence): (i64, f64)| {
            format!(
                r#"{{"id":{id},"type":"right","palmPosition":[0,200,0],"confidence":{confidence}}}"#
            )
        };
        let (first, second) = (hand(first), hand(second));
        let left = r#"{"id":9,"type":"left","palmPosition":[0,100,0],"confidence":1}"#;
        let id = k;
        format!(
            r#"{{"id":{id},"timestamp":{},"hands":[{left},{first},{second}]}}"#,
            k * PERIOD_US
        )
    };
    let mut follower = settled(Wanted::Only(Side::Right), 100);
    let mut take = |k: u64, text: String| match follower.take(&text, at(k)) {
        Ok(Message::Seen(sight)) => Some((sight.hand.id, sight.new_hand)),
        Ok(Message::Unseen) => None,
        other => panic!("{other:?}"),
    };
    assert_eq!(take(100, both(100, (1, 0.4), (2, 0.6))), Some((2, true)));
    assert_eq!(take(101, both(101, (1, 0.9), (2, 0.6))), Some((2, false)));
    assert_eq!(take(102, right(102)), Some((1, true)));
    let hidden = frame(103, 103 * PERIOD_US, &[(9, "left", 100.0)]);
    assert_eq!(take(103, hidden), None);
    assert_eq!(take(104, right(104)), Some((1, true)));
}

#[test]
fn a_hand_whose_side_is_not_told_is_nobodys_in_particular() {
    let text = format!(
        r#"{{"id":100,"timestamp":{},"hands":[{{"id":1,"palmPosition":[0,200,0]}}]}}"#,
        100 * PERIOD_US
    );
    let mut only = settled(Wanted::Only(Side::Right), 100);
    assert_eq!(only.take(&text, at(100)), Ok(Message::Unseen));
    let mut either = settled(Wanted::Either, 100);
    assert!(matches!(either.take(&text, at(100)), Ok(Message::Seen(_))));
}

/// What a service does for a while.
#[derive(Debug, Clone)]
enum Act {
    Live(u64),
    /// Frames come so much later than they should, microseconds.
    Lagging(u64, u64),
    /// So many frames wait, then come at once.
    HeldBack(u64),
    Frozen(u64),
    Silent(u64),
    Garbage(Vec<String>),
    /// The service begins to count at 0 again.
    Restart,
    Reconnect,
}

fn acts() -> impl Strategy<Value = Act> {
    prop_oneof![
        4 => (1_u64..300).prop_map(Act::Live),
        1 => (1_u64..900, 0_u64..3_000_000).prop_map(|(frames, by)| Act::Lagging(frames, by)),
        1 => (1_u64..400).prop_map(Act::HeldBack),
        1 => (1_u64..200).prop_map(Act::Frozen),
        1 => (1_u64..2_000).prop_map(Act::Silent),
        1 => prop::collection::vec(".{0,60}", 1..20).prop_map(Act::Garbage),
        1 => Just(Act::Restart),
        1 => Just(Act::Reconnect),
    ]
}

/// A service, its client, and the truth.
struct Stage {
    follower: Follower,
    /// Periods since the beginning, by host time.
    k: u64,
    /// Period at which the service began to count.
    began: u64,
    /// Frames since then.
    frames: u64,
    newest_seen_at: u64,
    now: u64,
}

impl Stage {
    /// The frame taken in period `k` comes at `came`; the height of its palm says when it was taken.
    fn comes(&mut self, k: u64, came: u64) -> Result<(), TestCaseError> {
        self.now = self.now.max(came);
        self.frames += 1;
        let count = k - self.began;
        let text = frame(
            count.cast_signed(),
            count * PERIOD_US,
            &[(1, "right", k as f64 * 1e-3)],
        );
        if let Ok(Message::Seen(sight)) = self.follower.take(&text, self.now) {
            self.newest_seen_at = self.now;
            let taken = (1e6 * sight.hand.palm_m[1]).round() as u64;
            prop_assert_eq!(taken, k);
        }
        self.ages()
    }

    fn ages(&self) -> Result<(), TestCaseError> {
        if let Some(sight) = self.follower.hand(self.now) {
            let taken = (1e6 * sight.hand.palm_m[1]).round() as u64;
            let age = self.now - at(taken);
            prop_assert!(age <= AGE_US, "{age} us old at {}", self.now);
        }
        Ok(())
    }

    fn act(&mut self, act: &Act) -> Result<(), TestCaseError> {
        match act {
            Act::Live(frames) => {
                for _ in 0..*frames {
                    self.k += 1;
                    self.comes(self.k, at(self.k) + (self.k * 7_919) % 4_000)?;
                }
            }
            Act::Lagging(frames, by) => {
                for _ in 0..*frames {
                    self.k += 1;
                    self.comes(self.k, at(self.k) + by)?;
                }
                self.k = self.k.max((self.now - HOST_US) / PERIOD_US + 1);
            }
            Act::HeldBack(frames) => {
                let first = self.k + 1;
                self.k += frames;
                for k in first..=self.k {
                    self.comes(k, at(self.k) + (k - first) * 50)?;
                }
                self.k += frames * 50 / PERIOD_US + 1;
            }
            Act::Frozen(frames) => {
                let stuck = self.k;
                for _ in 0..*frames {
                    self.k += 1;
                    self.comes(stuck, at(self.k))?;
                }
            }
            Act::Silent(frames) => {
                self.k += frames;
                self.now = self.now.max(at(self.k));
                self.ages()?;
            }
            Act::Garbage(texts) => {
                for text in texts {
                    let _ = self.follower.take(text, self.now);
                    self.ages()?;
                }
            }
            Act::Restart => {
                (self.began, self.frames) = (self.k, 0);
                self.act(&Act::Live(20))?;
            }
            Act::Reconnect => {
                self.follower.reconnect();
                prop_assert!(self.follower.hand(self.now).is_none());
                self.follower.take(VERSION, self.now).unwrap();
            }
        }
        Ok(())
    }
}

proptest! {
    #![proptest_config(seeded(96))]

    #[test]
    fn no_hand_is_ever_stale(acts in prop::collection::vec(acts(), 1..20)) {
        let mut stage = Stage {
            follower: following(Wanted::Only(Side::Right)),
            k: 0,
            began: 0,
            frames: 0,
            newest_seen_at: 0,
            now: HOST_US,
        };
        stage.act(&Act::Live(100))?;
        for act in &acts {
            // A lag or a wait that is there from the first frames on is no host's to see, and a service that dies at once
            // leaves nothing to tell it from the next.
            let young = stage.frames < 100;
            if !(young && matches!(act, Act::Lagging(..) | Act::HeldBack(_) | Act::Restart)) {
                stage.act(act)?;
            }
        }
        // And it comes back: a restart may have to be noticed, a clock to be learnt.
        stage.act(&Act::Live(200))?;
        prop_assert_eq!(stage.newest_seen_at, stage.now);
    }
}

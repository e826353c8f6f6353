//! A simulated person who does what is asked next, for as long as the program runs.
//!
//! The scripted [`super::wearer`] knows its whole day beforehand; this one does not. Hand and muscles never jump: a new wish
//! begins where the old one is interrupted.

use std::collections::VecDeque;

use rand_chacha::ChaCha8Rng;

use super::muscle::CHANNELS;
use super::seeded;
use super::skills::{DURATION_US, Skill, minimum_jerk};
use super::wearer::{Action, REST_M, Truth};

/// Muscles go from one level to another within this time, microseconds.
const RAMP_US: u64 = 400_000;
/// The hand goes to a place at this mean speed, m/s, and takes at least so long, microseconds.
const GOES_M_PER_S: f64 = 0.35;
const GOES_US: u64 = 700_000;
/// The hand rests before and after a movement, microseconds.
const BEFORE_US: u64 = 900_000;
const AFTER_US: u64 = 900_000;

/// What the person is asked to do.
#[derive(Debug, Clone, PartialEq)]
pub enum Wish {
    /// Lie still, all muscles at rest.
    Rest,
    /// Contract all muscles with all strength.
    Contract,
    /// Hold the hand at a place, all muscles at these shares of their maximum.
    Hold {
        /// Where, shoulder frame, metres.
        hand_m: [f64; 3],
        /// Share of each channel.
        activation: [f64; CHANNELS],
    },
    /// Go to where a movement begins, rest, perform it, rest, come back.
    Perform(Action),
}

/// What is done in one stretch of time.
#[derive(Debug, Clone)]
enum Doing {
    /// The hand goes in a straight line.
    Go {
        from_m: [f64; 3],
        to_m: [f64; 3],
    },
    /// It stays.
    Stay {
        hand_m: [f64; 3],
        activation: [f64; CHANNELS],
    },
    Perform(Action),
}

#[derive(Debug, Clone)]
struct Stretch {
    from_us: u64,
    to_us: u64,
    doing: Doing,
}

/// The person.
#[derive(Debug, Clone)]
pub struct Puppet {
    stretches: VecDeque<Stretch>,
    /// What the muscles did when the present wish came, and when that was.
    before: ([f64; CHANNELS], u64),
    last: ([f64; 3], [f64; CHANNELS]),
    rng: ChaCha8Rng,
}

impl Puppet {
    /// A person at rest.
    #[must_use]
    pub fn new(seed: u64) -> Self {
        Self {
            stretches: VecDeque::new(),
            before: ([0.0; CHANNELS], 0),
            last: (REST_M, [0.0; CHANNELS]),
            rng: seeded(seed, "puppet"),
        }
    }

    /// An execution of a skill as this person does it today; `None` for what they cannot do.
    pub fn draw(&mut self, label: &str) -> Option<Action> {
        let known = Skill::ALL.into_iter().chain([Skill::Wave]);
        let skill = known.into_iter().find(|skill| skill.label() == label)?;
        Some(Action::sample(skill, &mut self.rng))
    }

    /// Does something else from `now_us` on.
    pub fn wish(&mut self, wish: Wish, now_us: u64) {
        let now = self.truth(now_us);
        self.before = (now.activation, now_us);
        self.stretches.clear();
        let slack = [0.0; CHANNELS];
        let stay = |hand_m, activation| Doing::Stay { hand_m, activation };
        let mut at_us = now_us;
        let mut then = |doing, lasts_us| {
            let from_us = at_us;
            at_us += lasts_us;
            let to_us = at_us;
            self.stretches.push_back(Stretch {
                from_us,
                to_us,
                doing,
            });
        };
        let (end_m, end) = match wish {
            Wish::Rest => (REST_M, slack),
            Wish::Contract => (now.hand_m, [1.0; CHANNELS]),
            Wish::Hold { hand_m, activation } => (hand_m, activation),
            Wish::Perform(action) => {
                let (start_m, stop_m) = (action.hand_m(0.0), action.hand_m(1.0));
                then(go(now.hand_m, start_m), lasts_us(now.hand_m, start_m));
                then(stay(start_m, slack), BEFORE_US);
                then(Doing::Perform(action), DURATION_US);
                then(stay(stop_m, slack), AFTER_US);
                then(go(stop_m, REST_M), lasts_us(stop_m, REST_M));
                (REST_M, slack)
            }
        };
        if self.stretches.is_empty() {
            let lasts_us = lasts_us(now.hand_m, end_m);
            self.stretches.push_back(Stretch {
                from_us: now_us,
                to_us: now_us + lasts_us,
                doing: match wish {
                    // The hold begins at once, the hand goes there meanwhile.
                    _ if end_m == now.hand_m => stay(end_m, end),
                    _ => go(now.hand_m, end_m),
                },
            });
        }
        self.last = (end_m, end);
    }

    /// What is true at `at_us`, which is not before the newest wish.
    #[must_use]
    pub fn truth(&self, at_us: u64) -> Truth {
        let under_way = self.stretches.iter().find(|s| at_us < s.to_us);
        let (hand_m, activation) = under_way.map_or(self.last, |stretch| {
            let way = share(
                at_us.saturating_sub(stretch.from_us),
                stretch.to_us - stretch.from_us,
            );
            match &stretch.doing {
                Doing::Go { from_m, to_m } => {
                    let way = minimum_jerk(way);
                    let hand_m = std::array::from_fn(|axis| {
                        from_m[axis] + way * (to_m[axis] - from_m[axis])
                    });
                    (hand_m, [0.0; CHANNELS])
                }
                Doing::Stay { hand_m, activation } => (*hand_m, *activation),
                Doing::Perform(action) => (action.hand_m(way), action.activation(way)),
            }
        });
        // Muscles take their time when a stretch gives way to the next.
        let since_us = under_way.map_or_else(
            || self.stretches.back().map_or(self.before.1, |s| s.to_us),
            |stretch| stretch.from_us,
        );
        let from = self.level_before(since_us);
        let way = minimum_jerk(share(at_us.saturating_sub(since_us), RAMP_US));
        Truth {
            hand_m,
            activation: std::array::from_fn(|channel| {
                from[channel] + way * (activation[channel] - from[channel])
            }),
        }
    }

    /// Where the muscles were when the stretch that begins at `since_us` began.
    fn level_before(&self, since_us: u64) -> [f64; CHANNELS] {
        let before = self.stretches.iter().rfind(|s| s.to_us == since_us);
        match before.map(|stretch| &stretch.doing) {
            None => self.before.0,
            Some(Doing::Go { .. }) => [0.0; CHANNELS],
            Some(Doing::Stay { activation, .. }) => *activation,
            Some(Doing::Perform(action)) => action.activation(1.0),
        }
    }

    /// The movement under way and how far it is.
    #[must_use]
    pub fn performing(&self, at_us: u64) -> Option<(Action, f64)> {
        let stretch = self.stretches.iter().find(|s| at_us < s.to_us)?;
        let Doing::Perform(action) = &stretch.doing else {
            return None;
        };
        let since_us = at_us.checked_sub(stretch.from_us)?;
        Some((*action, share(since_us, stretch.to_us - stretch.from_us)))
    }

    /// The movement that was wished for last and is not over: its robot's part stands still before and after.
    #[must_use]
    pub fn showing(&self, at_us: u64) -> Option<(Action, f64)> {
        let place = |s: &Stretch| matches!(s.doing, Doing::Perform(_));
        let stretch = self.stretches.iter().find(|s| place(s))?;
        let Doing::Perform(action) = &stretch.doing else {
            return None;
        };
        let since_us = at_us.saturating_sub(stretch.from_us);
        let way = share(since_us, stretch.to_us - stretch.from_us).min(1.0);
        Some((*action, way))
    }
}

fn go(from_m: [f64; 3], to_m: [f64; 3]) -> Doing {
    Doing::Go { from_m, to_m }
}

#[allow(
    clippy::cast_possible_truncation,
    clippy::cast_sign_loss,
    reason = "an arm's reach"
)]
fn lasts_us(from_m: [f64; 3], to_m: [f64; 3]) -> u64 {
    let square: f64 = (0..3).map(|axis| (to_m[axis] - from_m[axis]).powi(2)).sum();
    ((square.sqrt() / GOES_M_PER_S * 1e6) as u64).max(GOES_US)
}

#[allow(clippy::cast_precision_loss, reason = "durations of seconds")]
fn share(part_us: u64, whole_us: u64) -> f64 {
    part_us as f64 / whole_us.max(1) as f64
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn hand_and_muscles_never_jump_whatever_is_asked_when() {
        let mut puppet = Puppet::new(3);
        let mut last = puppet.truth(0);
        let labels = ["lift_filter", "hand_over", "wave"];
        for ms in 0..40_000_u64 {
            let at_us = ms * 1_000;
            // At odd times, within whatever is under way.
            if ms % 2_345 == 0 {
                let wish = match (ms / 2_345) % 5 {
                    0 => Wish::Contract,
                    1 => Wish::Rest,
                    2 => Wish::Hold {
                        hand_m: [0.3, 0.0, -0.2],
                        activation: [0.3; CHANNELS],
                    },
                    _ => {
                        let label = labels[usize::try_from(ms).unwrap() % 3];
                        Wish::Perform(puppet.draw(label).unwrap())
                    }
                };
                puppet.wish(wish, at_us);
            }
            let truth = puppet.truth(at_us);
            for axis in 0..3 {
                assert!(
                    (truth.hand_m[axis] - last.hand_m[axis]).abs() < 0.003,
                    "{ms}"
                );
            }
            for channel in 0..CHANNELS {
                let step = (truth.activation[channel] - last.activation[channel]).abs();
                assert!(step < 0.01, "{ms}: {step}");
            }
            last = truth;
        }
    }

    #[test]
    fn a_movement_is_performed_whole_and_the_hand_comes_back() {
        let mut puppet = Puppet::new(4);
        let action = puppet.draw("lift_book").unwrap();
        puppet.wish(Wish::Perform(action), 1_000_000);
        let times = (1_000..12_000_u64).map(|ms| ms * 1_000);
        let performed: Vec<f64> = times
            .filter_map(|at_us| Some(puppet.performing(at_us)?.1))
            .collect();
        assert_eq!(performed.len(), 2_000);
        assert!(performed.windows(2).all(|pair| pair[1] > pair[0]));
        assert_eq!(puppet.truth(20_000_000).hand_m, REST_M);
        assert_eq!(puppet.truth(20_000_000).activation, [0.0; CHANNELS]);
    }

    #[test]
    fn what_they_cannot_do_is_not_done() {
        assert_eq!(Puppet::new(1).draw("juggle"), None);
    }
}

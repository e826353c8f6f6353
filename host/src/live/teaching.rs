//! Where the shoulder and the robot are in the tracker's frame, taught by touching: what `tonus teach` does at the terminal.
//!
//! A touch counts once the hand has been still for a while; its middle over the last second is the place. What is taught is
//! used only when somebody says so, and then at once: it follows from the inputs, so that a recording plays as it ran.

use std::collections::VecDeque;

use super::engine::Engine;
use super::input::{Act, HandSeen};
use super::request::{Prompt, Request};
use super::view::{PointView, TeachingView, TouchView};
use super::world::World;
use crate::transform::{LEAST_POINTS, Shoulder, Taught, Touched, Transform, TransformError};

/// The hand is looked at for so long, microseconds.
const LOOK_US: u64 = 1_000_000;
/// Before that it settles: a movement's last millimetres pass for stillness.
const SETTLE_US: u64 = 400_000;
/// So it is still for so long.
const STILL_US: u64 = SETTLE_US + LOOK_US;
/// Still is a hand whose places lie so near to their middle, root mean square, metres: twice a tracker's jitter.
const STILL_M: f64 = 0.005;
/// Fewer pictures in that time are too few to tell: a tracker takes about a hundred a second.
const LEAST_PICTURES: usize = 30;
/// Nobody is waited for longer than this, microseconds.
const WITHIN_US: u64 = 15_000_000;
/// More points teach nothing more.
const MOST_POINTS: usize = 20;

/// What was taught; none for what was not.
#[derive(Debug, Clone, Copy, Default, PartialEq)]
pub struct Frames {
    /// Where the shoulder is in the tracker's frame.
    pub shoulder: Option<Shoulder>,
    /// From the tracker's frame to the robot's.
    pub robot: Option<Transform>,
}

/// What is touched.
#[derive(Debug, Clone, Copy)]
enum Target {
    Shoulder,
    /// A place in the robot's base frame, metres; none for where its hand is.
    Point(Option<[f64; 3]>),
}

/// A touch on its way.
#[derive(Debug)]
struct Touch {
    target: Target,
    since_us: u64,
    /// Where the hand was while it was still: times, and places in the tracker's frame, metres.
    still: VecDeque<(u64, [f64; 3])>,
}

/// What is held of teaching.
#[derive(Debug, Default)]
pub(super) struct Teaching {
    touch: Option<Touch>,
    shoulder: Option<Shoulder>,
    points: Vec<Touched>,
    /// Why the last touch gave nothing.
    problem: Option<String>,
}

impl Touch {
    /// One picture; the places of the hand once it was still for long enough.
    fn see(&mut self, hand: &HandSeen) -> Option<Vec<[f64; 3]>> {
        let newest_us = self.still.back().map_or(self.since_us, |(us, _)| *us);
        // Pictures from before it was asked for are of something else.
        if hand.exposed_us <= newest_us {
            return None;
        }
        self.still.push_back((hand.exposed_us, hand.position_m));
        while spread_m(&self.still) > STILL_M {
            self.still.pop_front();
        }
        if self.lasted_us() < STILL_US {
            return None;
        }
        let settled = |us: u64| us + LOOK_US >= hand.exposed_us;
        let seen = self.still.iter().filter(|(us, _)| settled(*us));
        let seen: Vec<[f64; 3]> = seen.map(|(_, place)| *place).collect();
        (seen.len() >= LEAST_PICTURES).then_some(seen)
    }

    fn lasted_us(&self) -> u64 {
        let ends = self.still.front().zip(self.still.back());
        ends.map_or(0, |((first_us, _), (last_us, _))| last_us - first_us)
    }
}

impl Teaching {
    /// Whether the other hand is what the tracker sees: it is no hand to follow.
    pub(super) fn other_hand(&self) -> bool {
        let target = self.touch.as_ref().map(|touch| touch.target);
        matches!(target, Some(Target::Shoulder))
    }

    /// Tracker to robot by the points; none before there are enough to ask.
    fn taught(&self) -> Option<Result<Taught, TransformError>> {
        (self.points.len() >= LEAST_POINTS).then(|| Transform::teach(&self.points))
    }

    /// What is to be seen.
    #[allow(clippy::cast_precision_loss, reason = "a second")]
    pub(super) fn view(&self) -> TeachingView {
        let taught = self.taught();
        let transform = taught.as_ref().and_then(|taught| taught.as_ref().ok());
        let points = self.points.iter().map(|point| PointView {
            robot_m: point.robot_m,
            tracker_m: point.tracker_m,
            off_mm: transform.map(|taught| {
                1e3 * apart_m(&taught.transform.point_m(point.tracker_m), &point.robot_m)
            }),
        });
        let refused = taught.as_ref().and_then(|taught| taught.as_ref().err());
        TeachingView {
            touching: self.touch.as_ref().map(|touch| TouchView {
                what: touch.target.name(),
                still: (touch.lasted_us() as f64 / STILL_US as f64).min(1.0),
            }),
            shoulder_m: self.shoulder.map(|shoulder| shoulder.centre_m),
            points: points.collect(),
            residual_mm: transform.map(|taught| 1e3 * taught.residual_m),
            problem: (self.problem.clone()).or_else(|| refused.map(ToString::to_string)),
            may_use: refused.is_none() && (self.shoulder.is_some() || transform.is_some()),
            kept: None,
        }
    }
}

impl Target {
    fn name(self) -> String {
        match self {
            Self::Shoulder => "the shoulder".to_owned(),
            Self::Point(None) => "the robot's hand".to_owned(),
            Self::Point(Some([x, y, z])) => format!("{x:.3}, {y:.3}, {z:.3} m"),
        }
    }
}

impl Engine {
    /// An act of teaching.
    pub(super) fn teach(&mut self, act: Act, world: &mut impl World) -> Result<(), String> {
        match act {
            Act::TeachShoulder => self.touch(Target::Shoulder, world),
            Act::TeachPoint { robot_m } => self.touch(Target::Point(robot_m), world),
            Act::TeachRemove { point } => {
                let count = self.teaching.points.len();
                let known = point.checked_sub(1).filter(|at| *at < count);
                let at = known
                    .ok_or_else(|| format!("there is no point {point}; {count} were touched"))?;
                self.teaching.points.remove(at);
                self.teaching.problem = None;
                Ok(())
            }
            Act::TeachUse => self.use_frames(world),
            _ => {
                self.teaching = Teaching::default();
                world.ask(self.now_us, Request::Prompt(Prompt::Free));
                Ok(())
            }
        }
    }

    fn touch(&mut self, target: Target, world: &mut impl World) -> Result<(), String> {
        if self.calibrating.busy() {
            return Err("somebody is being measured: finish or cancel that first".to_owned());
        }
        if self.take.is_some() {
            return Err("a demonstration is being recorded: stop it first".to_owned());
        }
        let prompt = match target {
            Target::Shoulder => Prompt::TouchShoulder,
            Target::Point(_) if self.teaching.points.len() >= MOST_POINTS => {
                return Err(format!("{MOST_POINTS} points are enough: remove one first"));
            }
            Target::Point(given) => Prompt::TouchPoint {
                robot_m: self.place_m(given)?,
            },
        };
        // A robot that is touched follows nobody.
        self.follow.disarm();
        self.teaching.problem = None;
        self.teaching.touch = Some(Touch {
            target,
            since_us: self.now_us,
            still: VecDeque::new(),
        });
        world.ask(self.now_us, Request::Prompt(prompt));
        Ok(())
    }

    /// A place in the robot's frame: as given, or where its hand is now.
    fn place_m(&self, given: Option<[f64; 3]>) -> Result<[f64; 3], String> {
        let place_m = given.or_else(|| self.follow.position_m(self.now_us));
        let place_m = place_m.filter(|place| place.iter().all(|x| x.is_finite()));
        place_m.ok_or_else(|| {
            "the robot does not tell where its hand is: start its receiver, or type the place"
                .to_owned()
        })
    }

    /// A picture of the hand while something may be touched.
    pub(super) fn touched(&mut self, hand: &HandSeen, world: &mut impl World) {
        let touch = self.teaching.touch.as_mut();
        let Some((target, seen)) = touch.and_then(|touch| Some((touch.target, touch.see(hand)?)))
        else {
            return;
        };
        let outcome = match target {
            Target::Shoulder => Shoulder::by_touch(&seen)
                .map(|shoulder| self.teaching.shoulder = Some(shoulder))
                .map_err(|error| error.to_string()),
            // The robot may have given way to the touch: where it is now is what was touched.
            Target::Point(given) => self.place_m(given).map(|robot_m| {
                let tracker_m = middle_m(seen.iter());
                self.teaching.points.push(Touched { tracker_m, robot_m });
            }),
        };
        self.end_touch(outcome.err(), world);
    }

    /// Nobody is waited for for ever.
    #[allow(clippy::cast_precision_loss, reason = "a second")]
    pub(super) fn touch_is_due(&mut self, world: &mut impl World) {
        let touch = self.teaching.touch.as_ref();
        if touch.is_some_and(|touch| self.now_us > touch.since_us + WITHIN_US) {
            let problem = format!(
                "the tracker saw no hand that was still for {:.1} s within {} s: hold it within its sight, and press again",
                STILL_US as f64 * 1e-6,
                WITHIN_US / 1_000_000
            );
            self.end_touch(Some(problem), world);
        }
    }

    fn end_touch(&mut self, problem: Option<String>, world: &mut impl World) {
        self.teaching.touch = None;
        self.teaching.problem = problem;
        world.ask(self.now_us, Request::Prompt(Prompt::Rest));
    }

    fn use_frames(&mut self, world: &mut impl World) -> Result<(), String> {
        if self.take.is_some() {
            return Err("a demonstration is being recorded: stop it first".to_owned());
        }
        let taught = self.teaching.taught().transpose();
        let taught = taught.map_err(|error| error.to_string())?;
        let frames = Frames {
            shoulder: self.teaching.shoulder,
            robot: taught.map(|taught| taught.transform),
        };
        if frames == Frames::default() {
            return Err(format!(
                "nothing is taught yet: touch the shoulder, or {LEAST_POINTS} points or more"
            ));
        }
        self.follow.disarm();
        self.config.shoulder = frames.shoulder.or(self.config.shoulder);
        self.config.tracker_to_robot = frames.robot.or(self.config.tracker_to_robot);
        self.teaching = Teaching::default();
        // The hand is elsewhere now without having moved: whoever follows it begins anew.
        self.hand = None;
        self.hand_in_robot_m = None;
        self.reframed = true;
        world.taught(&frames);
        let elsewhere =
            frames.shoulder.is_some() && !(self.kept.is_empty() && self.library.is_none());
        self.tell(
            elsewhere,
            if elsewhere {
                "the shoulder is elsewhere now: record again and train again what was shown before"
            } else {
                "what was taught is in use"
            }
            .to_owned(),
        );
        Ok(())
    }
}

#[allow(clippy::cast_precision_loss, reason = "a second of pictures")]
fn middle_m<'a>(places: impl ExactSizeIterator<Item = &'a [f64; 3]>) -> [f64; 3] {
    let count = places.len().max(1) as f64;
    let sum = places.fold([0.0; 3], |sum, place| {
        std::array::from_fn(|axis| sum[axis] + place[axis])
    });
    sum.map(|sum| sum / count)
}

/// Root mean square distance from the middle, metres.
#[allow(clippy::cast_precision_loss, reason = "a second of pictures")]
fn spread_m(places: &VecDeque<(u64, [f64; 3])>) -> f64 {
    let middle = middle_m(places.iter().map(|(_, place)| place));
    let squares = places
        .iter()
        .map(|(_, place)| apart_m(place, &middle).powi(2));
    (squares.sum::<f64>() / places.len().max(1) as f64).sqrt()
}

fn apart_m(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let square: f64 = (0..3).map(|axis| (a[axis] - b[axis]).powi(2)).sum();
    square.sqrt()
}

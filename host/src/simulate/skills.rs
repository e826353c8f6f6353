//! What the simulated person can do, and the Gaussian that every hand path is drawn from.
//!
//! A path is a sum of smooth shapes with random weights, each axis by itself:
//!
//! ```text
//! p(s) = sum_j shape_j(s) (mean_j + sd_j * z_j),   z_j ~ N(0, 1) per axis,   s in [0, 1]
//! ```
//!
//! so mean and covariance at any phases are known exactly ([`Skill::mean_m`], [`Skill::covariance_m2`]),
//! and [`super::difficulty`] can say how well anybody could recognise a skill from positions. Shapes are
//! made of the minimum-jerk step, as unhurried hands move.
//!
//! The three lifts share every number but one: the height of the grasp, 8 mm apart (the book 8 mm below
//! the water filter, the bottle 8 mm below the book). A person meets that height within 2.5 mm; start,
//! bows and end vary much more, alike for all three. Only the muscles tell the objects apart
//! ([`super::muscle`]).

mod paths;

use rand::{Rng, RngExt};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// How long every skill takes, microseconds.
pub const DURATION_US: u64 = 2_000_000;
/// Shapes that a path is made of at most.
pub const SHAPES: usize = 5;

/// A skill of the simulated person.
#[derive(Debug, Clone, Copy, PartialEq, Eq, PartialOrd, Ord, Hash)]
pub enum Skill {
    /// Lifts the heavy water filter.
    LiftFilter,
    /// Lifts the book.
    LiftBook,
    /// Lifts the light bottle.
    LiftBottle,
    /// Pulls one end of an elastic band to a target, where the robot meets the hand.
    HandOver,
    /// The same in a horizontal plane along given lines: what the hand-over experiment demonstrates.
    Pull,
    /// Moves the empty hand from home to an object that lies anywhere in a circle.
    Reach,
    /// Grasps that object and takes it to a place above the table.
    Pick,
    /// Takes the object from there to where it is put down.
    Place,
    /// Raises the empty hand and waves: what nobody demonstrates to the robot.
    Wave,
}

/// One smooth function of the phase.
#[derive(Debug, Clone, Copy, PartialEq)]
enum Shape {
    /// From 1 to 0 between two phases.
    Fall(f64, f64),
    /// From 0 to 1 between two phases.
    Rise(f64, f64),
    /// From 0 over 1 back to 0 between two phases.
    Bow(f64, f64),
}

/// A shape and the distribution of its weight on each axis, metres.
#[derive(Debug, Clone, Copy, PartialEq)]
struct Term {
    shape: Shape,
    mean_m: [f64; 3],
    sd_m: [f64; 3],
}

const fn term(shape: Shape, mean_m: [f64; 3], sd_m: [f64; 3]) -> Term {
    Term {
        shape,
        mean_m,
        sd_m,
    }
}

/// Index of the shape whose weight is where the hand starts.
const START: usize = 0;
/// Index of the shape whose weight is the grasp (lifts), the target (hand-over, pull) or the end of the path.
const GOAL: usize = 2;

/// How exactly a pull meets the end of its line, standard deviation on each axis, metres.
pub const PULL_SD_M: f64 = 0.004;

/// The random part of one execution of a path: a standard normal number for each shape and axis.
pub type Latent = [[f64; 3]; SHAPES];

impl Skill {
    /// The demo's skills.
    pub const ALL: [Self; 4] = [
        Self::LiftFilter,
        Self::LiftBook,
        Self::LiftBottle,
        Self::HandOver,
    ];
    /// The lifts, which positions can hardly tell apart.
    pub const LIFTS: [Self; 3] = [Self::LiftFilter, Self::LiftBook, Self::LiftBottle];

    /// The three actions of the pick-and-place experiment.
    pub const PICK_AND_PLACE: [Self; 3] = [Self::Reach, Self::Pick, Self::Place];

    /// The name that demonstrations and models carry.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::LiftFilter => "lift_filter",
            Self::LiftBook => "lift_book",
            Self::LiftBottle => "lift_bottle",
            Self::HandOver => "hand_over",
            Self::Pull => "pull_band",
            Self::Reach => "reach",
            Self::Pick => "pick",
            Self::Place => "place",
            Self::Wave => "wave",
        }
    }

    fn terms(self) -> &'static [Term; SHAPES] {
        match self {
            Self::LiftFilter => &paths::LIFT_FILTER,
            Self::LiftBook => &paths::LIFT_BOOK,
            Self::LiftBottle => &paths::LIFT_BOTTLE,
            Self::HandOver => &paths::HAND_OVER,
            Self::Pull => &paths::PULL,
            Self::Reach => &paths::REACH,
            Self::Pick => &paths::PICK,
            Self::Place => &paths::PLACE,
            Self::Wave => &paths::WAVE,
        }
    }

    /// Expected position of the hand at phase `s`: shoulder frame (x forward, y left, z up), metres.
    #[must_use]
    pub fn mean_m(self, s: f64) -> [f64; 3] {
        self.position_m(&Latent::default(), s)
    }

    /// Covariance of the hand's positions at phases `s` and `t` on each axis, square metres. Axes are
    /// independent of each other.
    #[must_use]
    pub fn covariance_m2(self, s: f64, t: f64) -> [f64; 3] {
        let mut covariance = [0.0; 3];
        for term in self.terms() {
            let both = term.shape.value(s) * term.shape.value(t);
            for (sum, sd) in covariance.iter_mut().zip(term.sd_m) {
                *sum += sd * sd * both;
            }
        }
        covariance
    }

    /// Position of the hand at phase `s` of the execution with these latents, metres.
    #[must_use]
    pub fn position_m(self, latent: &Latent, s: f64) -> [f64; 3] {
        let mut position = [0.0; 3];
        for (term, z) in self.terms().iter().zip(latent) {
            let value = term.shape.value(s);
            for axis in 0..3 {
                position[axis] += value * (term.mean_m[axis] + term.sd_m[axis] * z[axis]);
            }
        }
        position
    }

    /// Draws one execution.
    pub fn sample<R: Rng + ?Sized>(self, rng: &mut R) -> Latent {
        std::array::from_fn(|_| std::array::from_fn(|_| StandardNormal.sample(rng)))
    }
}

/// Latents of a hand-over to the target `y_m` (shoulder frame, metres), all else drawn.
///
/// Targets are normal around 0.20 m with 0.06 m, so 0.05 to 0.35 m are usual ones.
pub fn hand_over_to(y_m: f64, rng: &mut ChaCha8Rng) -> Latent {
    let mut latent = Skill::HandOver.sample(rng);
    let goal = &paths::HAND_OVER[GOAL];
    latent[GOAL][1] = (y_m - goal.mean_m[1]) / goal.sd_m[1];
    latent
}

/// Latents of a pull along the line `case`: 0, 1 and 2 are the demonstrated ones, what is between them lies
/// between. The hand meets the line's end within [`PULL_SD_M`] on each axis; all else is drawn.
pub fn pull_along(case: f64, rng: &mut ChaCha8Rng) -> Latent {
    let mut latent = Skill::Pull.sample(rng);
    let (target_m, goal) = (pull_target_m(case), &paths::PULL[GOAL]);
    for axis in 0..3 {
        let off_m = target_m[axis] - goal.mean_m[axis];
        latent[GOAL][axis] = (off_m + PULL_SD_M * latent[GOAL][axis]) / goal.sd_m[axis];
    }
    latent
}

/// Where the line `case` ends, shoulder frame, metres; see [`pull_along`].
#[must_use]
pub fn pull_target_m(case: f64) -> [f64; 3] {
    let case = case.clamp(0.0, 2.0);
    let [near, far] = if case < 1.0 { [0, 1] } else { [1, 2] };
    let way = if case < 1.0 { case } else { case - 1.0 };
    let [from, to] = [near, far].map(|line: usize| paths::PULL_TARGETS_M[line]);
    std::array::from_fn(|axis| from[axis] + way * (to[axis] - from[axis]))
}

/// Latents of one of [`Skill::PICK_AND_PLACE`]: the object lies anywhere in its circle, evenly; all else is drawn.
pub fn with_object_anywhere(skill: Skill, rng: &mut ChaCha8Rng) -> Latent {
    let mut latent = skill.sample(rng);
    // Even over a disc, scaled to unit variance on each axis: radius 2.
    let radius = 2.0 * rng.random::<f64>().sqrt();
    let angle = rng.random_range(0.0..std::f64::consts::TAU);
    let at = match skill {
        Skill::Reach => Some(GOAL),
        Skill::Pick => Some(START),
        _ => None,
    };
    if let Some(shape) = at {
        latent[shape][0] = radius * angle.cos();
        latent[shape][1] = radius * angle.sin();
    }
    latent
}

/// The same execution without its bows: start and goal alone.
#[must_use]
pub fn straightened(latent: &Latent) -> Latent {
    let mut straight = Latent::default();
    for shape in [START, GOAL] {
        straight[shape] = latent[shape];
    }
    straight
}

/// Where this execution grasps the object or meets the robot: shoulder frame, metres.
#[must_use]
pub fn goal_m(skill: Skill, latent: &Latent) -> [f64; 3] {
    let goal = &skill.terms()[GOAL];
    std::array::from_fn(|axis| goal.mean_m[axis] + goal.sd_m[axis] * latent[GOAL][axis])
}

impl Shape {
    fn value(self, s: f64) -> f64 {
        match self {
            Self::Rise(from, to) => minimum_jerk((s - from) / (to - from)),
            Self::Fall(from, to) => 1.0 - minimum_jerk((s - from) / (to - from)),
            Self::Bow(from, to) => {
                let rise = minimum_jerk((s - from) / (to - from));
                4.0 * rise * (1.0 - rise)
            }
        }
    }
}

/// The minimum-jerk step from 0 at `u = 0` to 1 at `u = 1`, constant outside:
/// `10 u^3 - 15 u^4 + 6 u^5` (Flash and Hogan 1985).
#[must_use]
pub fn minimum_jerk(u: f64) -> f64 {
    let u = u.clamp(0.0, 1.0);
    u * u * u * (10.0 - u * (15.0 - 6.0 * u))
}

#[cfg(test)]
mod tests;

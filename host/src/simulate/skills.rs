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

use rand::Rng;
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

/// Spacing of the objects' grasp heights, metres.
const GRASP_STEP_M: f64 = 0.008;

/// Terms of a lift whose grasp lies `steps` grasp heights above the book's: where the hand starts, bow of the
/// reach, the grasp, the lift from there, bow of the lift.
const fn lift(steps: f64) -> [Term; SHAPES] {
    [
        term(
            Shape::Fall(0.0, 0.45),
            [0.24, -0.10, -0.34],
            [0.025, 0.025, 0.030],
        ),
        term(
            Shape::Bow(0.0, 0.45),
            [0.0, -0.02, 0.03],
            [0.008, 0.012, 0.010],
        ),
        term(
            Shape::Rise(0.0, 0.45),
            [0.42, -0.02, -0.26 + steps * GRASP_STEP_M],
            [0.010, 0.012, 0.0025],
        ),
        term(
            Shape::Rise(0.50, 0.92),
            [-0.04, 0.05, 0.15],
            [0.012, 0.015, 0.020],
        ),
        term(
            Shape::Bow(0.50, 0.92),
            [0.0, 0.01, 0.0],
            [0.005, 0.008, 0.006],
        ),
    ]
}

const LIFT_FILTER: [Term; SHAPES] = lift(1.0);
const LIFT_BOOK: [Term; SHAPES] = lift(0.0);
const LIFT_BOTTLE: [Term; SHAPES] = lift(-1.0);
/// The hand-over: start, bow, target; two shapes lie idle.
const HAND_OVER: [Term; SHAPES] = [
    term(
        Shape::Fall(0.0, 0.90),
        [0.26, -0.12, -0.30],
        [0.015, 0.020, 0.015],
    ),
    term(
        Shape::Bow(0.0, 0.90),
        [0.03, 0.0, 0.02],
        [0.008, 0.008, 0.008],
    ),
    term(
        Shape::Rise(0.0, 0.90),
        [0.38, 0.20, -0.22],
        [0.012, HAND_OVER_TARGET_SD_M, 0.010],
    ),
    term(Shape::Bow(0.45, 0.90), [0.0; 3], [0.004; 3]),
    term(Shape::Bow(0.20, 0.70), [0.0; 3], [0.004; 3]),
];
/// Index of the shape whose weight is the grasp (lifts) or the target (hand-over).
const GOAL: usize = 2;
const HAND_OVER_TARGET_SD_M: f64 = 0.06;

/// The random part of one execution of a path: a standard normal number for each shape and axis.
pub type Latent = [[f64; 3]; SHAPES];

impl Skill {
    /// Every skill.
    pub const ALL: [Self; 4] = [
        Self::LiftFilter,
        Self::LiftBook,
        Self::LiftBottle,
        Self::HandOver,
    ];
    /// The lifts, which positions can hardly tell apart.
    pub const LIFTS: [Self; 3] = [Self::LiftFilter, Self::LiftBook, Self::LiftBottle];

    /// The name that demonstrations and models carry.
    #[must_use]
    pub fn label(self) -> &'static str {
        match self {
            Self::LiftFilter => "lift_filter",
            Self::LiftBook => "lift_book",
            Self::LiftBottle => "lift_bottle",
            Self::HandOver => "hand_over",
        }
    }

    fn terms(self) -> &'static [Term; SHAPES] {
        match self {
            Self::LiftFilter => &LIFT_FILTER,
            Self::LiftBook => &LIFT_BOOK,
            Self::LiftBottle => &LIFT_BOTTLE,
            Self::HandOver => &HAND_OVER,
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
    let goal = &HAND_OVER[GOAL];
    latent[GOAL][1] = (y_m - goal.mean_m[1]) / goal.sd_m[1];
    latent
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
mod tests {
    use super::*;
    use rand::SeedableRng;

    #[test]
    fn sampled_paths_have_the_stated_mean_and_covariance() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let phases = [0.0, 0.1, 0.22, 0.4, 0.5, 0.63, 0.77, 1.0];
        const RUNS: usize = 20_000;
        for skill in Skill::ALL {
            let mut deviations = vec![[[0.0; 3]; 8]; RUNS];
            for run in &mut deviations {
                let latent = skill.sample(&mut rng);
                for (deviation, s) in run.iter_mut().zip(phases) {
                    let (at, mean) = (skill.position_m(&latent, s), skill.mean_m(s));
                    *deviation = std::array::from_fn(|axis| at[axis] - mean[axis]);
                }
            }
            for (i, s) in phases.into_iter().enumerate() {
                for (j, t) in phases.into_iter().enumerate() {
                    for axis in 0..3 {
                        let truth = |s, t| skill.covariance_m2(s, t)[axis];
                        let sample: f64 = deviations
                            .iter()
                            .map(|run| run[i][axis] * run[j][axis])
                            .sum::<f64>()
                            / RUNS as f64;
                        // Standard error of a sample covariance: sqrt((c_ii c_jj + c_ij^2) / n); five of them.
                        let error = ((truth(s, s) * truth(t, t) + truth(s, t).powi(2))
                            / RUNS as f64)
                            .sqrt();
                        assert!(
                            (sample - truth(s, t)).abs() <= 5.0 * error + 1e-15,
                            "{skill:?} {s} {t} {axis}"
                        );
                    }
                }
                for axis in 0..3 {
                    let mean: f64 =
                        deviations.iter().map(|run| run[i][axis]).sum::<f64>() / RUNS as f64;
                    assert!(
                        mean.abs()
                            <= 5.0 * (skill.covariance_m2(s, s)[axis] / RUNS as f64).sqrt() + 1e-12
                    );
                }
            }
        }
    }

    #[test]
    fn lifts_differ_by_the_grasp_height_alone() {
        for s in [0.0, 0.2, 0.45, 0.7, 1.0] {
            let [filter, book, bottle] = Skill::LIFTS.map(|skill| skill.mean_m(s));
            let reached = minimum_jerk(s / 0.45);
            for (upper, lower) in [(filter, book), (book, bottle)] {
                assert!((upper[2] - lower[2] - 0.008 * reached).abs() < 1e-15);
                assert_eq!(upper[..2], lower[..2]);
            }
            for t in [0.1, 0.5, 0.9] {
                assert_eq!(
                    Skill::LiftFilter.covariance_m2(s, t),
                    Skill::LiftBottle.covariance_m2(s, t)
                );
            }
        }
    }

    #[test]
    fn hands_move_smoothly_and_stay_within_reach() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        for skill in Skill::ALL {
            for _ in 0..2000 {
                let latent = skill.sample(&mut rng);
                let mut last = skill.position_m(&latent, 0.0);
                for ms in 1..=2000 {
                    let at = skill.position_m(&latent, f64::from(ms) / 2000.0);
                    let norm = |v: [f64; 3]| v.iter().map(|x| x * x).sum::<f64>().sqrt();
                    let step = norm(std::array::from_fn(|axis| at[axis] - last[axis]));
                    assert!(step < 0.0015, "{skill:?} moves faster than 1.5 m/s");
                    assert!((0.25..0.62).contains(&norm(at)), "{skill:?} at {at:?}");
                    last = at;
                }
            }
        }
    }

    #[test]
    fn a_hand_over_ends_where_it_was_sent() {
        let mut rng = ChaCha8Rng::seed_from_u64(6);
        for y in [0.05, 0.2, 0.33] {
            let latent = hand_over_to(y, &mut rng);
            assert!((Skill::HandOver.position_m(&latent, 1.0)[1] - y).abs() < 1e-12);
            assert_eq!(
                goal_m(Skill::HandOver, &latent),
                Skill::HandOver.position_m(&latent, 1.0)
            );
        }
    }

    #[test]
    fn the_minimum_jerk_step_rests_at_both_ends() {
        assert_eq!(
            [
                minimum_jerk(-1.0),
                minimum_jerk(0.0),
                minimum_jerk(1.0),
                minimum_jerk(2.0)
            ],
            [0.0, 0.0, 1.0, 1.0]
        );
        assert!((minimum_jerk(0.5) - 0.5).abs() < 1e-15);
        // Peak speed 15/8 at the middle.
        assert!(
            ((minimum_jerk(0.5 + 1e-5) - minimum_jerk(0.5 - 1e-5)) / 2e-5 - 1.875).abs() < 1e-6
        );
        assert!(minimum_jerk(1e-3) < 1.1e-8);
    }
}

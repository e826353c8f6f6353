//! The numbers of each skill's path.

use super::{SHAPES, Shape, Term, term};

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

pub(super) const LIFT_FILTER: [Term; SHAPES] = lift(1.0);
pub(super) const LIFT_BOOK: [Term; SHAPES] = lift(0.0);
pub(super) const LIFT_BOTTLE: [Term; SHAPES] = lift(-1.0);
/// The hand-over: start, bow, target; two shapes lie idle.
pub(super) const HAND_OVER: [Term; SHAPES] = [
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
        [0.012, 0.06, 0.010],
    ),
    term(Shape::Bow(0.45, 0.90), [0.0; 3], [0.004; 3]),
    term(Shape::Bow(0.20, 0.70), [0.0; 3], [0.004; 3]),
];
/// Ends of the three demonstrated pulls, metres: farther in y is closer in x, as an arm swings.
pub(super) const PULL_TARGETS_M: [[f64; 3]; 3] = [
    [0.42, 0.10, -0.26],
    [0.39, 0.20, -0.26],
    [0.34, 0.30, -0.26],
];
/// The pull: start, bow, target (over all lines), two more bows. People follow lines that they are given, in a plane.
pub(super) const PULL: [Term; SHAPES] = [
    term(
        Shape::Fall(0.0, 0.90),
        [0.26, -0.12, -0.26],
        [0.006, 0.006, 0.004],
    ),
    term(
        Shape::Bow(0.0, 0.90),
        [0.03, 0.0, 0.0],
        [0.006, 0.006, 0.003],
    ),
    term(
        Shape::Rise(0.0, 0.90),
        [0.39, 0.20, -0.26],
        [0.04, 0.08, 0.004],
    ),
    term(Shape::Bow(0.45, 0.90), [0.0; 3], [0.004, 0.004, 0.002]),
    term(Shape::Bow(0.20, 0.70), [0.0; 3], [0.004, 0.004, 0.002]),
];
/// Where the object may lie: middle of the circle, metres, and half its radius (the standard deviation on each axis).
const CIRCLE_M: [f64; 3] = [0.40, 0.06, -0.28];
const HALF_RADIUS_M: f64 = 0.035;
const OBJECT_SD_M: [f64; 3] = [HALF_RADIUS_M, HALF_RADIUS_M, 0.004];
/// Where the empty hand starts, where the object is taken to, and where it is put down, metres.
const EMPTY_M: [f64; 3] = [0.30, -0.06, -0.28];
const RAISED_M: [f64; 3] = [0.33, 0.08, -0.22];
const PUT_DOWN_M: [f64; 3] = [0.39, -0.06, -0.27];
/// How exactly a hand comes back to such a place.
const PLACE_SD_M: [f64; 3] = [0.015, 0.015, 0.010];
/// Bows of the three paths, which bring them together in the middle: about (0.36, 0.01, -0.25) half-way.
const BOW_SD_M: [f64; 3] = [0.015, 0.015, 0.015];
const WOBBLE_SD_M: [f64; 3] = [0.010, 0.010, 0.010];

const fn between(
    from: ([f64; 3], [f64; 3]),
    bow_m: [f64; 3],
    to: ([f64; 3], [f64; 3]),
) -> [Term; SHAPES] {
    [
        term(Shape::Fall(0.05, 0.95), from.0, from.1),
        term(Shape::Bow(0.05, 0.95), bow_m, BOW_SD_M),
        term(Shape::Rise(0.05, 0.95), to.0, to.1),
        term(Shape::Bow(0.05, 0.55), [0.0; 3], WOBBLE_SD_M),
        term(Shape::Bow(0.45, 0.95), [0.0; 3], WOBBLE_SD_M),
    ]
}

pub(super) const REACH: [Term; SHAPES] = between(
    (EMPTY_M, PLACE_SD_M),
    [0.01, 0.01, 0.03],
    (CIRCLE_M, OBJECT_SD_M),
);
pub(super) const PICK: [Term; SHAPES] = between(
    (CIRCLE_M, OBJECT_SD_M),
    [-0.005, -0.06, 0.0],
    (RAISED_M, PLACE_SD_M),
);
pub(super) const PLACE: [Term; SHAPES] = between(
    (RAISED_M, PLACE_SD_M),
    [0.0, 0.0, -0.005],
    (PUT_DOWN_M, PLACE_SD_M),
);
/// The wave: start, to the left, the raised hand, to the right, to the left again.
pub(super) const WAVE: [Term; SHAPES] = [
    term(
        Shape::Fall(0.0, 0.45),
        [0.24, -0.10, -0.34],
        [0.025, 0.025, 0.030],
    ),
    term(
        Shape::Bow(0.30, 0.60),
        [0.0, 0.10, 0.0],
        [0.005, 0.015, 0.005],
    ),
    term(
        Shape::Rise(0.0, 0.45),
        [0.36, -0.12, 0.05],
        [0.020, 0.020, 0.020],
    ),
    term(
        Shape::Bow(0.50, 0.80),
        [0.0, -0.10, 0.0],
        [0.005, 0.015, 0.005],
    ),
    term(
        Shape::Bow(0.70, 1.0),
        [0.0, 0.10, 0.0],
        [0.005, 0.015, 0.005],
    ),
];

//! What the robot is shown to do beside the person: scripted demonstrations.
//!
//! In the demo this script takes an operator's place; in the experiments an operator follows its path
//! ([`super::operator`]). The robot's motion
//! follows the same latents as the hand's, and its stiffness the effort of the person's muscles, so that what
//! is to be learnt (motion of one tells motion of the other, effort tells stiffness) is there to be learnt.
//!
//! Robot base frame: x forward, y left, z up, metres. The person sits opposite: their shoulder frame is turned
//! half round the vertical and lies at [`SHOULDER_M`].
//!
//! - Hand-over: the robot goes from its home to where the person's hand will be, and meets it.
//! - Reach, pick, place: the robot does the same on its own table, from the same start to the same end.
//! - Lifts: the robot picks its own copy of the object, displaced as the person's grasp is, and carries it to
//!   that object's shelf.
//! - Wave: the robot has no part in it.

use super::muscle::CHANNELS;
use super::skills::{Skill, goal_m, minimum_jerk, straightened};
use super::wearer::Action;

/// The person's shoulder in the robot's base frame, metres.
pub const SHOULDER_M: [f64; 3] = [1.05, 0.0, 0.75];
/// Where the robot's hand waits, metres.
pub const HOME_M: [f64; 3] = [0.40, 0.0, 0.45];
/// Where the robot picks when the person grasps at the usual place, metres.
const PICK_M: [f64; 3] = [0.55, -0.25, 0.15];
/// The origin of the robot's own table in pick-and-place: where its shoulder would be if it were a person's, metres.
const TABLE_M: [f64; 3] = [0.10, 0.0, 0.60];
/// How the robot is stiff without effort, N/m, and how much each unit of mean activation adds.
const SOFT_N_PER_M: [f64; 3] = [250.0, 250.0, 300.0];
const EFFORT_N_PER_M: [f64; 3] = [900.0, 900.0, 2500.0];

/// One instant of the robot's part.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct RobotPoint {
    /// Position of the hand, base frame, metres.
    pub position_m: [f64; 3],
    /// Diagonal stiffness, N/m.
    pub stiffness_n_per_m: [f64; 3],
}

/// A point of the person's shoulder frame in the robot's base frame, metres.
#[must_use]
pub fn in_robot_frame(shoulder_m: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = shoulder_m;
    [SHOULDER_M[0] - x, SHOULDER_M[1] - y, SHOULDER_M[2] + z]
}

/// A point of the robot's base frame in the person's shoulder frame, metres: back from [`in_robot_frame`].
#[must_use]
pub fn in_shoulder_frame(robot_m: [f64; 3]) -> [f64; 3] {
    let [x, y, z] = robot_m;
    [SHOULDER_M[0] - x, SHOULDER_M[1] - y, z - SHOULDER_M[2]]
}

/// The robot's part at phase `s` of the person's action: free of noise, the truth to score against.
#[must_use]
pub fn robot(action: &Action, s: f64) -> RobotPoint {
    #[allow(clippy::cast_precision_loss, reason = "four channels")]
    let effort = action.activation(s).iter().sum::<f64>() / CHANNELS as f64;
    RobotPoint {
        position_m: position(action, s),
        stiffness_n_per_m: std::array::from_fn(|axis| {
            SOFT_N_PER_M[axis] + EFFORT_N_PER_M[axis] * effort
        }),
    }
}

fn position(action: &Action, s: f64) -> [f64; 3] {
    let latent = &action.latent;
    if Skill::PICK_AND_PLACE.contains(&action.skill) {
        let hand_m = action.skill.position_m(&straightened(latent), s);
        return std::array::from_fn(|axis| TABLE_M[axis] + hand_m[axis]);
    }
    if action.skill == Skill::Wave {
        return HOME_M;
    }
    let goal = in_robot_frame(goal_m(action.skill, latent));
    let Some(shelf_m) = shelf_m(action.skill) else {
        return between(HOME_M, goal, minimum_jerk(s / 0.9));
    };
    let usual = in_robot_frame(action.skill.mean_m(0.47));
    let pick_m: [f64; 3] = std::array::from_fn(|axis| PICK_M[axis] + goal[axis] - usual[axis]);
    let at_pick = between(HOME_M, pick_m, minimum_jerk(s / 0.42));
    between(at_pick, shelf_m, minimum_jerk((s - 0.5) / 0.45))
}

/// Where the robot puts each object, metres; none for what has no shelf.
fn shelf_m(skill: Skill) -> Option<[f64; 3]> {
    match skill {
        Skill::LiftFilter => Some([0.50, 0.30, 0.22]),
        Skill::LiftBook => Some([0.50, 0.30, 0.42]),
        Skill::LiftBottle => Some([0.50, 0.30, 0.62]),
        Skill::HandOver | Skill::Pull | Skill::Reach | Skill::Pick | Skill::Place | Skill::Wave => {
            None
        }
    }
}

fn between(from: [f64; 3], to: [f64; 3], way: f64) -> [f64; 3] {
    std::array::from_fn(|axis| from[axis] + way * (to[axis] - from[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::robot::limits::Limits;
    use rand::SeedableRng;
    use rand_chacha::ChaCha8Rng;

    #[test]
    fn the_robot_meets_the_hand() {
        let mut rng = ChaCha8Rng::seed_from_u64(3);
        for y in [0.08, 0.2, 0.31] {
            let action = Action::hand_over(y, &mut rng);
            let (hand, robot) = (
                in_robot_frame(action.hand_m(1.0)),
                robot(&action, 1.0).position_m,
            );
            assert!((0..3).all(|axis| (hand[axis] - robot[axis]).abs() < 1e-12));
            assert!(
                (robot[1] + y).abs() < 1e-12,
                "the person's left is the robot's right"
            );
        }
    }

    #[test]
    fn each_object_has_its_shelf_and_a_heavier_one_a_firmer_hand() {
        let mut rng = ChaCha8Rng::seed_from_u64(4);
        let ends = Skill::LIFTS.map(|skill| robot(&Action::sample(skill, &mut rng), 1.0));
        assert!(
            ends[0].position_m[2] < ends[1].position_m[2]
                && ends[1].position_m[2] < ends[2].position_m[2]
        );
        for (axis, soft) in SOFT_N_PER_M.into_iter().enumerate() {
            let k = ends.map(|end| end.stiffness_n_per_m[axis]);
            assert!(k[0] > k[1] && k[1] > k[2] && k[2] > soft);
        }
    }

    #[test]
    fn scripts_stay_within_the_robots_limits() {
        let mut rng = ChaCha8Rng::seed_from_u64(5);
        let limits = Limits::default();
        for n in 0..2000 {
            let action = Action::sample(Skill::ALL[n % 4], &mut rng);
            let mut last = robot(&action, 0.0).position_m;
            for ms in (0..=2000).step_by(10) {
                let point = robot(&action, f64::from(ms) / 2000.0);
                assert_eq!(limits.inside(&point.position_m), point.position_m);
                assert!(
                    point
                        .stiffness_n_per_m
                        .iter()
                        .all(|k| (10.0..3000.0).contains(k))
                );
                let step: f64 = (0..3)
                    .map(|axis| (point.position_m[axis] - last[axis]).powi(2))
                    .sum();
                assert!(step.sqrt() < 0.016, "faster than 1.6 m/s");
                last = point.position_m;
            }
        }
    }
}

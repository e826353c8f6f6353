//! The simulated arm and its controller: kinematics against hand-computed poses and a product of exponentials, the
//! controller against its closed form and SciPy (`golden/teleoperation.py`), limits as properties.

use proptest::prelude::*;
use std::f64::consts::FRAC_PI_2;
use tonus::robot::arm::{Arm, ArmError, JOINTS, READY_RAD};
use tonus::simulate::scripted::{HOME_M, in_robot_frame};
use tonus::simulate::skills::{Skill, minimum_jerk};
use tonus::simulate::teleoperation::{Teleoperation, TeleoperationConfig, TeleoperationError};

const DT_S: f64 = 0.01;

fn golden(name: &str) -> Vec<Vec<f64>> {
    let path = format!("{}/golden/{name}", env!("CARGO_MANIFEST_DIR"));
    let mut reader = csv::Reader::from_path(path).unwrap();
    reader
        .records()
        .map(|row| {
            row.unwrap()
                .iter()
                .map(|cell| cell.parse().unwrap())
                .collect()
        })
        .collect()
}

fn apart(a: [f64; 3], b: [f64; 3]) -> f64 {
    a.iter()
        .zip(b)
        .map(|(a, b)| (a - b).powi(2))
        .sum::<f64>()
        .sqrt()
}

#[test]
fn poses_computed_by_hand() {
    let mut arm = Arm::new().unwrap();
    let forearm_m = 0.20 + 0.21;
    let hand_m = 0.16;
    // Upper arm upright: the elbow's axis is at (0.03, 0, 0.76). The forearm, 0.03 m behind it, forward at a right angle.
    let bent = [0.0, 0.0, 0.0, FRAC_PI_2, 0.0, 0.0, 0.0];
    let at = arm.tool_m(&bent).unwrap();
    assert!(apart(at, [0.03 + forearm_m + hand_m, 0.0, 0.76 + 0.03]) < 1e-12);
    // The whole arm turned a quarter to the left, the hand hanging straight down from the wrist.
    let down = [FRAC_PI_2, 0.0, 0.0, FRAC_PI_2, 0.0, FRAC_PI_2, 0.0];
    let at = arm.tool_m(&down).unwrap();
    assert!(apart(at, [0.0, 0.03 + forearm_m, 0.79 - hand_m]) < 1e-12);
    // The upper arm forward too: then the bent forearm points down, and 0.03 m of the elbow cancel in neither axis.
    let low = [0.0, FRAC_PI_2, 0.0, FRAC_PI_2, 0.0, 0.0, 0.0];
    let at = arm.tool_m(&low).unwrap();
    assert!(apart(at, [0.43 + 0.03, 0.0, 0.33 - 0.03 - forearm_m - hand_m]) < 1e-12);
}

#[test]
fn poses_equal_a_product_of_exponentials() {
    let mut arm = Arm::new().unwrap();
    let rows = golden("arm_poses.csv");
    assert_eq!(rows.len(), 24);
    for row in rows {
        let joints: [f64; JOINTS] = std::array::from_fn(|k| row[k]);
        let at = arm.tool_m(&joints).unwrap();
        assert!(
            apart(at, [row[7], row[8], row[9]]) < 1e-12,
            "{joints:?} {at:?}"
        );
    }
}

#[test]
fn the_tool_goes_wherever_the_work_is() {
    let mut arm = Arm::new().unwrap();
    let mut goals = vec![HOME_M, [0.55, -0.25, 0.15]];
    for z in [0.22, 0.42, 0.62] {
        goals.push([0.50, 0.30, z]);
    }
    for skill in Skill::ALL {
        for s in [0.0, 0.3, 0.6, 1.0] {
            // Three standard deviations of where hands are, and a wandering tracker's error, to every side.
            for corner in 0..8_u32 {
                let sign = |bit: u32| if corner >> bit & 1 == 1 { 1.0 } else { -1.0 };
                let sd_m = skill.covariance_m2(s, s).map(f64::sqrt);
                let hand_m = skill.mean_m(s);
                goals.push(in_robot_frame(std::array::from_fn(|axis| {
                    hand_m[axis] + sign(axis as u32) * 3.0 * sd_m[axis].hypot(0.028)
                })));
            }
        }
    }
    for goal in goals {
        let joints = arm
            .joints_for(goal, &READY_RAD)
            .unwrap_or_else(|error| panic!("{error}"));
        assert!(apart(arm.tool_m(&joints).unwrap(), goal) < 1e-5);
    }
}

#[test]
fn a_proportional_controller_decays_as_its_closed_form() {
    let config = TeleoperationConfig {
        proportional_per_s: 10.0,
        integral_per_s2: 0.0,
        derivative: 0.0,
        ..TeleoperationConfig::default()
    };
    let mut robot = Teleoperation::new(&config).unwrap();
    // 2 cm, so that no joint meets its speed.
    let goal = [HOME_M[0] + 0.012, HOME_M[1] - 0.016, HOME_M[2]];
    for step in 1..=200 {
        let tool = robot.step(goal, DT_S).unwrap();
        let left_m = 0.02 * (1.0_f64 - 10.0 * DT_S).powi(step);
        // Inverse kinematics stops within 10 um, which the loop divides by P dt at most.
        assert!((apart(tool, goal) - left_m).abs() < 1e-4, "{step}");
    }
    assert!(apart(robot.tool_m(), goal) < 1e-4);
}

#[test]
fn the_default_controller_settles_from_across_the_workspace() {
    let mut robot = Teleoperation::new(&TeleoperationConfig::default()).unwrap();
    for goal in [[0.67, -0.35, 0.53], [0.50, 0.30, 0.22], HOME_M] {
        robot.reset(HOME_M).unwrap();
        for _ in 0..300 {
            robot.step(goal, DT_S).unwrap();
        }
        assert!(
            apart(robot.tool_m(), goal) < 1e-3,
            "{goal:?} {:?}",
            robot.tool_m()
        );
    }
}

#[test]
fn a_minimum_jerk_path_is_followed_as_scipy_filters_it() {
    let mut robot = Teleoperation::new(&TeleoperationConfig::default()).unwrap();
    let goal: [f64; 3] = [0.62, -0.28, 0.50];
    let rows = golden("teleoperation.csv");
    let (mut worst_m, mut lag_m) = (0.0_f64, 0.0_f64);
    let between = |way: f64| -> [f64; 3] {
        std::array::from_fn(|axis| HOME_M[axis] + way * (goal[axis] - HOME_M[axis]))
    };
    for k in 0..200_usize {
        let before = robot.tool_m();
        let way = minimum_jerk(k as f64 * DT_S / 1.6);
        if k % 5 == 0 {
            let row = &rows[k / 5];
            assert!((row[0] - way).abs() < 1e-12);
            worst_m = worst_m.max(apart(before, between(row[1])));
        }
        lag_m = lag_m.max(apart(robot.step(between(way), DT_S).unwrap(), between(way)));
    }
    assert!(worst_m < 1e-4, "{worst_m}");
    // Peak speed 15/8 of the mean speed, behind by the time constant of (1 + D) / P.
    let peak_m_per_s = 1.875 * apart(goal, HOME_M) / 1.6;
    let behind_s = lag_m / peak_m_per_s;
    assert!((0.04..0.075).contains(&behind_s), "{behind_s} s behind");
    assert!(apart(robot.tool_m(), goal) < 2e-3);
}

#[test]
fn what_cannot_be_reached_is_refused_and_changes_nothing() {
    let mut robot = Teleoperation::new(&TeleoperationConfig::default()).unwrap();
    assert!(matches!(
        robot.reset([1.5, 0.0, 0.5]),
        Err(TeleoperationError::Arm(ArmError::Unreachable { missed_m, .. })) if missed_m > 0.1
    ));
    assert!(apart(robot.tool_m(), HOME_M) < 1e-5);
    // The arm stretches towards a goal outside and is refused where it can go no further: no more than the sum of its
    // segments (0.43 + 0.41 + 0.16 m) from the shoulder.
    let refused = (0..500).find_map(|_| robot.step([1.5, 0.0, 0.5], DT_S).err());
    assert!(
        matches!(
            refused,
            Some(TeleoperationError::Arm(ArmError::Unreachable { .. }))
        ),
        "{refused:?}"
    );
    let reach_m = apart(robot.tool_m(), [0.0, 0.0, 0.33]);
    assert!((0.85..1.0).contains(&reach_m), "{reach_m}");
    let stays = robot.tool_m();
    robot.step([1.5, 0.0, 0.5], DT_S).unwrap_err();
    assert_eq!(robot.tool_m(), stays);
    // And comes back.
    for _ in 0..400 {
        robot.step(HOME_M, DT_S).unwrap();
    }
    assert!(apart(robot.tool_m(), HOME_M) < 2e-3);
}

#[test]
fn bad_steps_and_gains_are_refused() {
    let usual = TeleoperationConfig::default();
    for (proportional_per_s, integral_per_s2, derivative) in [
        (0.0, 0.0, 0.0),
        (f64::NAN, 0.0, 0.0),
        (10.0, -1.0, 0.0),
        (10.0, 0.0, 1.0),
        (10.0, 0.0, f64::NAN),
    ] {
        let config = TeleoperationConfig {
            proportional_per_s,
            integral_per_s2,
            derivative,
            ..usual
        };
        assert_eq!(
            Teleoperation::new(&config).unwrap_err(),
            TeleoperationError::Gains
        );
    }
    let mut robot = Teleoperation::new(&usual).unwrap();
    for dt_s in [0.0, -0.01, f64::NAN, f64::INFINITY, 0.2] {
        assert!(matches!(
            robot.step(HOME_M, dt_s),
            Err(TeleoperationError::Step { .. })
        ));
    }
    assert!(matches!(
        robot.step([0.4, f64::NAN, 0.4], DT_S),
        Err(TeleoperationError::Desired(_))
    ));
    let mut arm = Arm::new().unwrap();
    assert!(matches!(
        arm.tool_m(&[0.0; JOINTS]),
        Err(ArmError::OutsideLimits { joint: 3, .. })
    ));
    assert_eq!(
        arm.joints_for([f64::NAN; 3], &READY_RAD),
        Err(ArmError::NotFinite)
    );
}

#[test]
fn the_same_motion_after_a_reset() {
    let mut robot = Teleoperation::new(&TeleoperationConfig::default()).unwrap();
    let goal = [0.6, 0.2, 0.3];
    let run = |robot: &mut Teleoperation| -> Vec<[f64; 3]> {
        robot.reset([0.5, -0.1, 0.4]).unwrap();
        (0..50).map(|_| robot.step(goal, DT_S).unwrap()).collect()
    };
    let first = run(&mut robot);
    assert_eq!(run(&mut robot), first);
}

proptest! {
    #![proptest_config(tonus_tests::seeded(48))]

    #[test]
    fn joints_never_leave_their_limits_nor_outrun_their_speed(
        goals in prop::collection::vec((-1.2..1.2_f64, -1.2..1.2_f64, -0.3..1.5_f64), 6),
        dt_s in 0.002..0.05_f64,
    ) {
        let mut robot = Teleoperation::new(&TeleoperationConfig::default()).unwrap();
        let limits = *Arm::new().unwrap().limits();
        let mut moved = 0;
        for (x, y, z) in goals {
            for _ in 0..40 {
                let before = robot.joints_rad();
                // Goals out of reach among them: refused steps must leave the joints alone.
                let refused = robot.step([x, y, z], dt_s).is_err();
                for (joint, limit) in limits.iter().enumerate() {
                    let now = robot.joints_rad()[joint];
                    prop_assert!((limit.lower_rad..=limit.upper_rad).contains(&now));
                    let speed = (now - before[joint]).abs() / dt_s;
                    prop_assert!(speed <= limit.speed_rad_per_s * (1.0 + 1e-9));
                }
                if refused { prop_assert_eq!(robot.joints_rad(), before); } else { moved += 1; }
            }
        }
        prop_assert!(moved > 0);
    }
}

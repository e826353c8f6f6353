//! The simulated arm on two hundred ways through its workspace: it stays with its set-point, whatever its joints' stops.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus::robot::arm::ImpedanceArm;
use tonus::robot::limits::Setpoint;

const HOME_M: [f64; 3] = [0.40, 0.0, 0.45];

fn distance_m(a: &[f64; 3], b: &[f64; 3]) -> f64 {
    let square: f64 = a.iter().zip(b).map(|(a, b)| (a - b).powi(2)).sum();
    square.sqrt()
}

#[test]
fn the_arm_stays_with_its_set_point_on_any_way() {
    let mut rng = ChaCha8Rng::seed_from_u64(20);
    let mut arm = ImpedanceArm::at(HOME_M).unwrap();
    let mut told_m = HOME_M;
    let mut farthest_m: f64 = 0.0;
    for way in 0..200 {
        let goal_m = if way % 3 == 2 {
            HOME_M
        } else {
            [
                rng.random_range(0.35..0.70),
                rng.random_range(-0.35..0.35),
                rng.random_range(0.12..0.67),
            ]
        };
        let stiffness = rng.random_range(200.0..1000.0);
        let speed = rng.random_range(0.3..1.0);
        for _ in 0..rng.random_range(400..1900) {
            let left_m = distance_m(&goal_m, &told_m);
            let moving = if left_m > 0.002 { speed } else { 0.0 };
            let step_m = (moving * 1e-3_f64).min(left_m);
            let ahead: [f64; 3] =
                std::array::from_fn(|axis| (goal_m[axis] - told_m[axis]) / left_m.max(1e-9));
            told_m = std::array::from_fn(|axis| told_m[axis] + step_m * ahead[axis]);
            let setpoint = Setpoint {
                position_m: told_m,
                velocity_m_per_s: ahead.map(|part| part * moving),
                stiffness_n_per_m: [stiffness, stiffness, 2.0 * stiffness],
                damping_ratio: 1.0,
            };
            arm.step(&setpoint, [0.0; 3], 1e-3).unwrap();
            farthest_m = farthest_m.max(distance_m(&arm.position_m(), &told_m));
        }
    }
    println!("at most {farthest_m:.3} m from its set-point");
    // 1 m/s started and stopped at once, by springs of 200 N/m.
    assert!(farthest_m < 0.15, "{farthest_m} m");
}

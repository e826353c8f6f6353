//! The arm takes a small part of one core at a thousand steps a second.

use std::time::Instant;

use tonus::robot::arm::ImpedanceArm;
use tonus::robot::limits::Setpoint;

#[test]
fn a_thousand_steps_a_second_are_less_than_a_twentieth_of_a_core() {
    let mut arm = ImpedanceArm::new().unwrap();
    let mut quickest_us = f64::INFINITY;
    for round in 0..50 {
        let x = 0.4 + 0.001 * f64::from(round);
        let setpoint = Setpoint {
            position_m: [x, 0.1, 0.35],
            velocity_m_per_s: [0.0; 3],
            stiffness_n_per_m: [300.0, 500.0, 800.0],
            damping_ratio: 0.9,
        };
        let started = Instant::now();
        for _ in 0..100 {
            arm.step(&setpoint, [1.0, 0.0, -2.0], 0.001).unwrap();
        }
        quickest_us = quickest_us.min(started.elapsed().as_secs_f64() * 1e4);
    }
    println!("a step of the arm takes {quickest_us:.1} us of 1000");
    assert!(quickest_us < 50.0);
}

use super::*;

const START_M: [f64; 3] = [0.45, 0.1, 0.35];

fn keep(position_m: [f64; 3], stiffness: [f64; 3], damping_ratio: f64) -> Setpoint {
    Setpoint {
        position_m,
        velocity_m_per_s: [0.0; 3],
        stiffness_n_per_m: stiffness,
        damping_ratio,
    }
}

fn run(arm: &mut ImpedanceArm, setpoint: &Setpoint, force_n: [f64; 3], seconds: f64) {
    for _ in 0..(seconds * 1000.0) as u32 {
        arm.step(setpoint, force_n, 0.001).unwrap();
    }
}

fn close(got: [f64; 3], expected: [f64; 3], within_m: f64) {
    let apart = (Vector3::from(got) - Vector3::from(expected)).norm();
    assert!(apart < within_m, "{got:?}, expected {expected:?}");
}

#[test]
fn dynamics_and_inverse_kinematics_are_of_one_arm() {
    let arm = ImpedanceArm::at(START_M).unwrap();
    close(arm.position_m(), START_M, 2e-5);
    let mut other = Arm::new().unwrap();
    close(
        other.tool_m(&arm.angles_rad()).unwrap(),
        arm.position_m(),
        1e-12,
    );
    let places = arm.joint_places_m();
    close(places[0], [0.0, 0.0, 0.15], 1e-12);
    close(places[1], [0.0, 0.0, 0.33], 1e-12);
    close(places[7], arm.position_m(), 1e-12);
}

#[test]
fn a_payload_sags_by_weight_over_stiffness() {
    let mut arm = ImpedanceArm::at(START_M).unwrap();
    let setpoint = keep(START_M, [400.0, 500.0, 800.0], 1.0);
    run(&mut arm, &setpoint, [0.0; 3], 3.0);
    close(arm.position_m(), START_M, 1e-6);
    arm.carry(2.0).unwrap();
    run(&mut arm, &setpoint, [0.0; 3], 8.0);
    let [x, y, z] = START_M;
    close(arm.position_m(), [x, y, z - 2.0 * 9.806_65 / 800.0], 1e-5);
    arm.carry(0.0).unwrap();
    run(&mut arm, &setpoint, [8.0, -5.0, 4.0], 8.0);
    close(arm.position_m(), [x + 0.02, y - 0.01, z + 0.005], 1e-5);
}

/// The hand at rest, and a direction in which it weighs so much: there its motion is that of one mass on one spring.
fn settled(mode: usize) -> (ImpedanceArm, Vector3<f64>, f64) {
    let mut arm = ImpedanceArm::at(START_M).unwrap();
    run(&mut arm, &keep(START_M, [1000.0; 3], 1.0), [0.0; 3], 5.0);
    let mass = arm.bodies.mass(&arm.motion, 0.0);
    let moves = arm.motion.tool_moves();
    let mobility = moves * mass.try_inverse().unwrap() * moves.transpose();
    let modes = SymmetricEigen::new(mobility);
    let along: Vector3<f64> = modes.eigenvectors.column(mode).into();
    (arm, along, 1.0 / modes.eigenvalues[mode])
}

/// How far along the direction the hand is, of a step of 4 mm, after each millisecond.
fn stepped(mode: usize, stiffness: f64, ratio: f64) -> (Vec<f64>, f64) {
    let (mut arm, along, kg) = settled(mode);
    let start = Vector3::from(arm.position_m());
    let setpoint = keep((start + along * 0.004).into(), [stiffness; 3], ratio);
    let step = |_| {
        arm.step(&setpoint, [0.0; 3], 0.001).unwrap();
        (Vector3::from(arm.position_m()) - start).dot(&along) / 0.004
    };
    ((0..3000).map(step).collect(), kg)
}

/// A critically damped mass is at `1 - (1 + w t) exp(-w t)`.
#[test]
fn critical_damping_never_overshoots() {
    for mode in 0..3 {
        for stiffness in [100.0, 600.0, 2000.0] {
            let (shares, kg) = stepped(mode, stiffness, 1.0);
            let rate = (stiffness / kg).sqrt();
            for (ms, share) in shares.into_iter().enumerate() {
                assert!(
                    share < 1.01,
                    "{share} after {ms} ms, {kg} kg on {stiffness} N/m"
                );
                let wt = rate * (ms as f64 + 1.0) * 1e-3;
                let expected = 1.0 - (1.0 + wt) * (-wt).exp();
                assert!(
                    (share - expected).abs() < 0.03,
                    "{share}, {expected} after {ms} ms"
                );
            }
        }
    }
}

/// One damped by half overshoots by `exp(-pi z / sqrt(1 - z^2))`, 16.3 %.
#[test]
fn half_damping_overshoots_by_the_closed_form() {
    for mode in 0..3 {
        let (shares, kg) = stepped(mode, 400.0, 0.5);
        let peak = shares.into_iter().fold(0.0, f64::max);
        let expected = 1.0 + (-std::f64::consts::PI * 0.5 / 0.75_f64.sqrt()).exp();
        assert!((peak - expected).abs() < 0.02, "{peak} with {kg} kg");
    }
}

#[test]
fn drives_end_at_their_torque_and_joints_at_their_stops() {
    let mut arm = ImpedanceArm::at(START_M).unwrap();
    let far = keep([5.0, 5.0, 5.0], [3000.0; 3], 0.7);
    for _ in 0..5000 {
        let torques = arm.torques(&far);
        for (torque, most) in torques.iter().zip(&arm.effort_nm) {
            assert!(torque.abs() <= *most);
        }
        arm.step(&far, [30.0, 0.0, -30.0], 0.001).unwrap();
        for (angle, limits) in arm.angles_rad().iter().zip(&arm.limits) {
            assert!((limits.lower_rad..=limits.upper_rad).contains(angle));
        }
        assert!(arm.position_m().iter().all(|x| x.abs() < 1.4));
    }
    let home = keep(START_M, [300.0; 3], 1.0);
    run(&mut arm, &home, [0.0; 3], 10.0);
    close(arm.position_m(), START_M, 1e-3);
}

#[test]
fn what_is_no_number_is_refused_and_moves_nothing() {
    let mut arm = ImpedanceArm::new().unwrap();
    let before = arm.angles_rad();
    let good = keep(START_M, [300.0; 3], 1.0);
    assert_eq!(
        arm.step(&good, [f64::NAN, 0.0, 0.0], 0.001),
        Err(ArmError::NotFinite)
    );
    let bad = keep([f64::INFINITY, 0.0, 0.0], [300.0; 3], 1.0);
    assert_eq!(arm.step(&bad, [0.0; 3], 0.001), Err(ArmError::NotFinite));
    assert_eq!(arm.angles_rad(), before);
    assert!(arm.carry(f64::NAN).is_err() && arm.carry(-1.0).is_err());
    // A long stall is not caught up with, and a step without time moves nothing.
    arm.step(&good, [0.0; 3], 0.0).unwrap();
    assert_eq!(arm.angles_rad(), before);
    arm.step(&good, [0.0; 3], 1e6).unwrap();
    assert!(arm.position_m().iter().all(|x| x.is_finite()));
}

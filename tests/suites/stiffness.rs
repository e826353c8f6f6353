//! The arm against finite differences, closed forms and independent linear algebra, over random postures.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "test suite: helpers outside the tests fail by panicking too"
)]

use nalgebra::{Matrix3, Matrix4, Quaternion, UnitQuaternion, Vector3, Vector4};
use rand::RngExt;
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tonus_shared::stiffness::{
    ArmPosture, ArmStiffness, ELBOW_MAX_RAD, GRAVITY_M_S2, Segments, StiffnessError,
    cartesian_stiffness,
};

/// A uniformly random orientation.
fn orientation(rng: &mut ChaCha8Rng) -> UnitQuaternion<f64> {
    loop {
        let candidate = Quaternion::new(
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0),
            rng.random_range(-1.0..1.0),
        );
        let norm: f64 = candidate.norm();
        if (0.1..1.0).contains(&norm) {
            return UnitQuaternion::from_quaternion(candidate);
        }
    }
}

/// An elbow angle: a third near straight, a third near fully bent, the rest anywhere.
fn elbow(rng: &mut ChaCha8Rng) -> f64 {
    match rng.random_range(0..3) {
        0 => rng.random_range(0.0..0.1),
        1 => rng.random_range(ELBOW_MAX_RAD - 0.1..ELBOW_MAX_RAD),
        _ => rng.random_range(0.0..ELBOW_MAX_RAD),
    }
}

/// A posture of handling something in front of the trunk, elbow bent 60 to 120 degrees.
fn working(rng: &mut ChaCha8Rng) -> ArmPosture<f64> {
    ArmPosture::from_angles([
        rng.random_range(0.0..1.2),
        rng.random_range(-0.5..0.2),
        rng.random_range(-0.5..0.8),
        rng.random_range(1.05..2.1),
    ])
    .unwrap()
}

/// The posture reached from an orientation and elbow angle by the displacement `q` of the joint table in
/// the room's documentation, written here with a quaternion exponential.
fn displaced(orientation: &UnitQuaternion<f64>, elbow: f64, q: &Vector4<f64>) -> ArmPosture<f64> {
    let turn = UnitQuaternion::from_scaled_axis(Vector3::new(q[1], -q[0], q[2]));
    ArmPosture::from_upper_arm((orientation * turn).quaternion(), elbow + q[3]).unwrap()
}

fn unit(i: usize) -> Vector4<f64> {
    Vector4::ith(i, 1.0)
}

fn eigenvalues3(matrix: &Matrix3<f64>) -> [f64; 3] {
    let mut values: [f64; 3] = matrix.symmetric_eigenvalues().into();
    values.sort_by(f64::total_cmp);
    values
}

#[test]
fn jacobian_and_gravity_torque_agree_with_finite_differences() {
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let segments = Segments::new(82.0, 1.81).unwrap();
    let h = 1e-5;
    for _ in 0..1000 {
        let (r, t) = (orientation(&mut rng), rng.random_range(0.01..2.6));
        let posture = displaced(&r, t, &Vector4::zeros());
        let jacobian = posture.jacobian(&segments);
        let torque = posture.gravity_torque(&segments);
        for i in 0..4 {
            let (ahead, behind) = (
                displaced(&r, t, &(unit(i) * h)),
                displaced(&r, t, &(unit(i) * -h)),
            );
            let velocity =
                (ahead.hand_position(&segments) - behind.hand_position(&segments)) / (2.0 * h);
            assert!((velocity - jacobian.column(i)).norm() < 1e-8);
            let slope = (ahead.potential_energy(&segments) - behind.potential_energy(&segments))
                / (2.0 * h);
            assert!((torque[i] + slope).abs() < 1e-7);
        }
    }
}

#[test]
fn gravity_stiffness_is_the_hessian_of_the_potential() {
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let segments = Segments::new(75.0, 1.75).unwrap();
    let h = 3e-4;
    for _ in 0..1000 {
        let (r, t) = (orientation(&mut rng), rng.random_range(0.01..2.6));
        let potential = |q: Vector4<f64>| displaced(&r, t, &q).potential_energy(&segments);
        let hessian = displaced(&r, t, &Vector4::zeros()).gravity_stiffness(&segments);
        assert_eq!(hessian, hessian.transpose());
        for i in 0..4 {
            for j in 0..4 {
                let (a, b) = (unit(i) * h, unit(j) * h);
                let numeric = (potential(a + b) - potential(a - b) - potential(b - a)
                    + potential(-a - b))
                    / (4.0 * h * h);
                assert!(
                    (numeric - hessian[(i, j)]).abs() < 1e-6,
                    "{i} {j}: {numeric} against {}",
                    hessian[(i, j)]
                );
            }
        }
    }
}

/// Muscles hold the posture (their torque cancels gravity's there) with stiffness K about it; the net
/// torque after a small displacement tells the sign of G apart from any matrix convention.
#[test]
fn net_restoring_torque_is_larger_hanging_and_smaller_inverted() {
    let segments = Segments::new(75.0, 1.75).unwrap();
    let muscle = Vector4::new(16.0, 16.0, 15.0, 15.0);
    let (small, h) = (1e-3, 1e-5);
    let restoring = |r: &UnitQuaternion<f64>, t: f64, joint: usize| {
        let holding = -displaced(r, t, &Vector4::zeros()).gravity_torque(&segments);
        let energy = |angle: f64| {
            let q = unit(joint) * angle;
            displaced(r, t, &q).potential_energy(&segments) + 0.5 * q.component_mul(&muscle).dot(&q)
                - holding.dot(&q)
        };
        (energy(small + h) - energy(small - h)) / (2.0 * h) / small
    };
    let hanging = UnitQuaternion::identity();
    let inverted = UnitQuaternion::from_scaled_axis(Vector3::new(std::f64::consts::PI, 0.0, 0.0));
    for (joint, bent) in [(0, 0.3), (1, 0.3), (3, 0.3), (0, 1.5), (1, 1.5)] {
        for (r, stiffer) in [(&hanging, true), (&inverted, false)] {
            let net = restoring(r, bent, joint);
            assert_eq!(
                net > muscle[joint],
                stiffer,
                "joint {joint} at {bent}: {net}"
            );
            let expected = muscle[joint]
                + displaced(r, bent, &Vector4::zeros()).gravity_stiffness(&segments)
                    [(joint, joint)];
            assert!((net - expected).abs() < 0.02, "{net} against {expected}");
        }
    }
    // The same at the hand: pushing a hanging arm sideways is harder than an inverted one.
    let at = |r: &UnitQuaternion<f64>| {
        let posture = displaced(r, 1.0, &Vector4::zeros());
        cartesian_stiffness(&segments, &posture, &muscle).unwrap()[(1, 1)]
    };
    assert!(at(&hanging) > 1.5 * at(&inverted));
}

#[test]
fn gravity_stiffness_of_a_straight_hanging_arm_is_a_pendulums() {
    let segments = Segments::new(75.0, 1.75).unwrap();
    let all = GRAVITY_M_S2
        * (1.9725 * 0.513 * 0.3255
            + 1.2075 * (0.3255 + 0.3896 * 0.2555)
            + 0.4875 * (0.3255 + 0.2555 + 0.1802 * 0.189));
    let forearm = GRAVITY_M_S2 * (1.2075 * 0.3896 * 0.2555 + 0.4875 * (0.2555 + 0.1802 * 0.189));
    let pendulum = Matrix4::new(
        all, 0.0, 0.0, forearm, //
        0.0, all, 0.0, 0.0, //
        0.0, 0.0, 0.0, 0.0, //
        forearm, 0.0, 0.0, forearm,
    );
    let hanging = ArmPosture::from_angles([0.0; 4]).unwrap();
    assert!((hanging.gravity_stiffness(&segments) - pendulum).norm() < 1e-12);
    let inverted = ArmPosture::from_angles([std::f64::consts::PI, 0.0, 0.0, 0.0]).unwrap();
    assert!((inverted.gravity_stiffness(&segments) + pendulum).norm() < 1e-12);
    let level = ArmPosture::from_angles([std::f64::consts::FRAC_PI_2, 0.0, 0.0, 0.0]).unwrap();
    assert!(
        (level.gravity_torque(&segments) - Vector4::new(-all, 0.0, 0.0, -forearm)).norm() < 1e-12
    );

    // Gravity is not small beside 12 to 22 N m/rad.
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let largest = (0..2000)
        .map(|_| working(&mut rng).gravity_stiffness(&segments).amax())
        .fold(0.0, f64::max);
    println!(
        "largest entry of G in working postures: {largest:.2} N m/rad, hanging straight {all:.2}"
    );
    assert!((6.0..10.0).contains(&largest));
}

#[test]
fn stiffness_is_symmetric_positive_definite_in_ten_thousand_postures() {
    let mut rng = ChaCha8Rng::seed_from_u64(4);
    let arm = ArmStiffness::illustrative();
    let (mut smallest, mut largest) = (f64::INFINITY, 0.0_f64);
    for round in 0..10_000 {
        let r = match round % 10 {
            0 => UnitQuaternion::identity(),
            1 => UnitQuaternion::from_scaled_axis(Vector3::x() * std::f64::consts::PI),
            2 => UnitQuaternion::from_scaled_axis(Vector3::y() * -std::f64::consts::PI),
            _ => orientation(&mut rng),
        };
        let t = match round % 7 {
            0 => 0.0,
            1 => ELBOW_MAX_RAD,
            _ => elbow(&mut rng),
        };
        let posture = ArmPosture::from_upper_arm(r.quaternion(), t).unwrap();
        let stiffness = arm
            .at(rng.random_range(0.0..4.0), &posture)
            .unwrap()
            .cartesian;
        assert_eq!(stiffness, stiffness.transpose());
        let [low, _, high] = eigenvalues3(&stiffness);
        smallest = smallest.min(low);
        largest = largest.max(high);
    }
    println!("principal stiffness from {smallest:.1} to {largest:.1} N/m");
    assert!(smallest > 1.0);
    assert!(largest < 2500.0);
}

#[test]
fn an_arm_that_falls_is_an_error_and_no_other_is() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    let (mut held, mut fell, mut brink, mut worst) = (0, 0, 0, 0.0_f64);
    for _ in 0..10_000 {
        let segments =
            Segments::new(rng.random_range(20.0..300.0), rng.random_range(0.8..2.5)).unwrap();
        let posture =
            ArmPosture::from_upper_arm(orientation(&mut rng).quaternion(), elbow(&mut rng))
                .unwrap();
        let joint = Vector4::from_fn(|_, _| rng.random_range(1.0..30.0));
        let total = Matrix4::from_diagonal(&joint) + posture.gravity_stiffness(&segments);
        let lowest = total.symmetric_eigenvalues().min();
        match cartesian_stiffness(&segments, &posture, &joint) {
            Ok(stiffness) => {
                held += 1;
                assert!(lowest > 0.0);
                assert!(eigenvalues3(&stiffness)[0] > 0.0);
            }
            Err(StiffnessError::Unstable {
                smallest_joint_stiffness,
            }) => {
                fell += 1;
                assert!(lowest < 0.02, "{lowest}");
                assert_eq!(smallest_joint_stiffness, joint.min());
            }
            // On the brink: what is left of the joints does not show beside the stiffness along the arm.
            Err(StiffnessError::NotPositiveDefinite { .. }) => {
                brink += 1;
                worst = worst.max(lowest);
            }
            Err(other) => panic!("{other}"),
        }
    }
    println!("{held} arms held, {fell} fell, {brink} on the brink");
    assert!(worst < 0.1);
    assert!(held > 3000 && fell > 1000);
}

#[test]
fn blend_agrees_with_the_closed_forms_at_its_ends() {
    let mut rng = ChaCha8Rng::seed_from_u64(6);
    let arm = ArmStiffness::illustrative();
    for _ in 0..2000 {
        // Above 45 degrees: the damped pseudo-inverse, with an explicit inverse here.
        let r = orientation(&mut rng);
        let bent = ArmPosture::from_upper_arm(
            r.quaternion(),
            rng.random_range(std::f64::consts::FRAC_PI_4..ELBOW_MAX_RAD),
        )
        .unwrap();
        let stiffness = arm.at(0.7, &bent).unwrap();
        let held =
            Matrix4::from_diagonal(&stiffness.joint) + bent.gravity_stiffness(arm.segments());
        let j = bent.jacobian(arm.segments());
        let gram = j * j.transpose() + Matrix3::identity() * 0.01_f64.powi(2);
        let inverse = j.transpose() * gram.try_inverse().unwrap();
        let expected = inverse.transpose() * held * inverse;
        assert!((stiffness.cartesian - expected).norm() < 1e-9 * expected.norm());

        // Straight: springs at the shoulder alone resist along the line to the hand up to the bound.
        let straight = ArmPosture::from_upper_arm(r.quaternion(), 0.0).unwrap();
        let stiffness = arm.at(0.7, &straight).unwrap().cartesian;
        let along = straight.hand_position(arm.segments()).normalize();
        assert!((stiffness * along - along * 2000.0).norm() < 1e-6);
    }
}

/// `(J+)^T K J+` against springs in series, `(J K^-1 J^T)^-1`, both here from explicit inverses. Excess in the
/// direction where the two differ most.
#[test]
fn kinematic_form_is_a_few_percent_stiffer_than_springs_in_series() {
    let mut rng = ChaCha8Rng::seed_from_u64(7);
    let arm = ArmStiffness::illustrative();
    let (mut excess, mut softened) = (Vec::new(), Vec::new());
    for _ in 0..4000 {
        let posture = working(&mut rng);
        let stiffness = arm.at(rng.random_range(0.0..2.0), &posture).unwrap();
        let held =
            Matrix4::from_diagonal(&stiffness.joint) + posture.gravity_stiffness(arm.segments());
        let j = posture.jacobian(arm.segments());
        let compliance = j * held.try_inverse().unwrap() * j.transpose();
        let root = compliance.cholesky().unwrap().l();
        let inverse = j.transpose() * (j * j.transpose()).try_inverse().unwrap();
        let kinematic = inverse.transpose() * held * inverse;
        // Both relative to springs in series, whose stiffness in these coordinates is the identity.
        let [least, _, most] = eigenvalues3(&(root.transpose() * kinematic * root));
        assert!(least > 1.0 - 1e-9);
        excess.push(most - 1.0);
        softened.push((kinematic - stiffness.cartesian).norm() / kinematic.norm());
    }
    excess.sort_by(f64::total_cmp);
    softened.sort_by(f64::total_cmp);
    let (median, p95) = (excess[excess.len() / 2], excess[excess.len() * 95 / 100]);
    let damping = softened[softened.len() - 1];
    println!("too stiff: median {median:.3}, p95 {p95:.3}; damping takes off at most {damping:.3}");
    assert!((0.03..0.08).contains(&median));
    assert!((0.06..0.14).contains(&p95));
    assert!(damping < 0.02);
}

#[test]
fn stiffness_grows_with_activation_and_turns_with_the_body() {
    let mut rng = ChaCha8Rng::seed_from_u64(8);
    let arm = ArmStiffness::illustrative();
    for _ in 0..2000 {
        let (r, t) = (orientation(&mut rng), elbow(&mut rng));
        let posture = ArmPosture::from_upper_arm(r.quaternion(), t).unwrap();
        let (low, high) = (rng.random_range(0.0..1.0), rng.random_range(1.2..4.0));
        let soft = arm.at(low, &posture).unwrap();
        let hard = arm.at(high, &posture).unwrap();
        assert!(hard.co_contraction > soft.co_contraction);
        assert!(eigenvalues3(&(hard.cartesian - soft.cartesian))[0] > 0.0);

        let turn = UnitQuaternion::from_scaled_axis(Vector3::z() * rng.random_range(-3.0..3.0));
        let turned = ArmPosture::from_upper_arm((turn * r).quaternion(), t).unwrap();
        let turn = turn.to_rotation_matrix();
        let expected = turn * soft.cartesian * turn.transpose();
        let turned = arm.at(low, &turned).unwrap().cartesian;
        assert!((turned - expected).norm() < 1e-9 * expected.norm());
    }
}

/// Halving the step of a path halves the largest change: a step anywhere on it would not shrink.
#[test]
fn stiffness_never_steps_along_a_path() {
    let arm = ArmStiffness::illustrative();
    let reach = arm.segments().upper_arm_m() + arm.segments().forearm_m();
    type Path<'a> = &'a dyn Fn(f64) -> ArmPosture<f64>;
    let opening: Path = &|s| ArmPosture::from_angles([0.6, 0.2, 0.3, s * ELBOW_MAX_RAD]).unwrap();
    // The hand out through the straight arm and past it, within the tolerance.
    let stretching: Path = &|s| {
        let hand = Vector3::new(0.8, 0.3, -0.52).normalize() * reach * (0.5 + 0.6 * s);
        ArmPosture::from_hand_and_swivel(arm.segments(), &hand, 0.2).unwrap()
    };
    // The upper arm sideways, where Euler angles would lock; the hand circles.
    let sideways: Path = &|s| {
        let (sin, cos) = (std::f64::consts::TAU * s).sin_cos();
        let hand = Vector3::new(0.1 * sin, 0.4, 0.1 * cos);
        ArmPosture::from_hand_and_swivel(arm.segments(), &hand, 0.0).unwrap()
    };
    for (name, path) in [
        ("opening", opening),
        ("stretching", stretching),
        ("sideways", sideways),
    ] {
        let largest = |steps: u32| {
            let at = |k: u32| {
                arm.at(0.5, &path(f64::from(k) / f64::from(steps)))
                    .unwrap()
                    .cartesian
            };
            (0..steps)
                .map(|k| (at(k + 1) - at(k)).norm())
                .fold(0.0, f64::max)
        };
        let (coarse, fine) = (largest(2000), largest(8000));
        println!("{name}: largest change {coarse:.2} N/m at 2000 steps, {fine:.2} at 8000");
        assert!(coarse < 60.0);
        // The elbow angle itself goes as the root of the distance to the straight arm: a factor of 2 there,
        // of 4 elsewhere.
        assert!(fine < 0.55 * coarse);
    }
}

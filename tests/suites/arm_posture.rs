//! The arm triangle: postures from hand and upper arm, single precision, and measurements that are wrong.
#![allow(
    clippy::unwrap_used,
    clippy::panic,
    reason = "test suite: helpers outside the tests fail by panicking too"
)]

use nalgebra::{Quaternion, UnitQuaternion, Vector3, Vector4};
use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::f64::consts::{FRAC_PI_2, PI};
use tonus_shared::stiffness::{
    ArmPosture, ArmStiffness, CoContraction, ELBOW_MAX_RAD, ElbowSource, ParameterError,
    PostureError, REACH_TOLERANCE, Segments, StiffnessError, cartesian_stiffness,
};

fn segments() -> Segments<f64> {
    Segments::new(75.0, 1.75).unwrap()
}

/// An upper arm within the shoulder's usual range, and an elbow angle anywhere.
fn usual(rng: &mut ChaCha8Rng) -> ArmPosture<f64> {
    ArmPosture::from_angles([
        rng.random_range(-0.5..2.5),
        rng.random_range(-2.0..0.7),
        rng.random_range(-1.2..1.2),
        rng.random_range(0.0..ELBOW_MAX_RAD),
    ])
    .unwrap()
}

fn rotation_of(posture: &ArmPosture<f64>) -> UnitQuaternion<f64> {
    UnitQuaternion::from_rotation_matrix(posture.upper_arm())
}

#[test]
fn swivel_zero_puts_the_elbow_below_behind_or_in_front() {
    let arm = segments();
    let (upper, fore) = (arm.upper_arm_m(), arm.forearm_m());
    let right_angle = upper.hypot(fore);
    let at = |hand: Vector3<f64>, swivel: f64| {
        let posture = ArmPosture::from_hand_and_swivel(&arm, &hand, swivel).unwrap();
        assert_eq!(posture.elbow_source(), ElbowSource::Hand);
        assert!((posture.hand_position(&arm) - hand).norm() < 1e-12);
        assert!((posture.elbow_rad() - FRAC_PI_2).abs() < 1e-12);
        posture.elbow_position(&arm)
    };
    // The hanging upper arm with the forearm level is swivel zero.
    let hanging = at(Vector3::new(fore, 0.0, -upper), 0.0);
    assert!((hanging - Vector3::new(0.0, 0.0, -upper)).norm() < 1e-12);
    let forward = Vector3::x() * right_angle;
    assert!(at(forward, 0.0).z < -0.2);
    assert!(at(forward, FRAC_PI_2).y > 0.2);
    assert!(at(forward, PI).z > 0.2);
    assert!(at(Vector3::z() * -right_angle, 0.0).x < -0.2);
    assert!(at(Vector3::z() * right_angle, 0.0).x > 0.2);
    assert!(at(Vector3::y() * right_angle, 0.0).z < -0.2);
    assert_eq!(
        ArmPosture::from_hand_and_swivel(&arm, &-forward, 0.0),
        Err(PostureError::SwivelUndefined)
    );
}

#[test]
fn hand_and_upper_arm_give_back_the_posture() {
    let (mut rng, arm) = (ChaCha8Rng::seed_from_u64(1), segments());
    for _ in 0..5000 {
        let truth = usual(&mut rng);
        let hand = truth.hand_position(&arm);
        let found =
            ArmPosture::from_hand_and_upper_arm(&arm, &hand, rotation_of(&truth).quaternion())
                .unwrap();
        assert!((found.hand_position(&arm) - hand).norm() < 1e-9);
        assert!((found.elbow_position(&arm).norm() - arm.upper_arm_m()).abs() < 1e-12);
        // Near the straight arm the angle goes as the root of the distance's rounding.
        assert!((found.elbow_rad() - truth.elbow_rad()).abs() < 1e-6);
        assert!(rotation_of(&found).angle_to(&rotation_of(&truth)) < 1e-6);
    }
}

#[test]
fn a_drifted_yaw_turns_only_the_swivel() {
    let (mut rng, arm) = (ChaCha8Rng::seed_from_u64(2), segments());
    for _ in 0..200 {
        let truth = usual(&mut rng);
        let hand = truth.hand_position(&arm);
        let drift = UnitQuaternion::from_scaled_axis(Vector3::z() * rng.random_range(-0.5..0.5));
        let measured = drift * rotation_of(&truth);
        let found =
            ArmPosture::from_hand_and_upper_arm(&arm, &hand, measured.quaternion()).unwrap();
        assert!((found.hand_position(&arm) - hand).norm() < 1e-9);
        assert!((found.elbow_rad() - truth.elbow_rad()).abs() < 1e-6);
        // No other swivel is nearer to what was measured.
        let nearest = rotation_of(&found).angle_to(&measured);
        let line = nalgebra::Unit::new_normalize(hand);
        for step in 1..72 {
            let turn = UnitQuaternion::from_axis_angle(&line, f64::from(step) * PI / 36.0);
            assert!((turn * rotation_of(&found)).angle_to(&measured) > nearest);
        }
    }
}

#[test]
fn an_orientation_that_points_elsewhere_is_refused() {
    let arm = segments();
    let hand = Vector3::new(0.0, 0.0, -0.55);
    let up = UnitQuaternion::from_scaled_axis(Vector3::x() * PI);
    let Err(PostureError::OrientationDisagrees { angle_rad }) =
        ArmPosture::from_hand_and_upper_arm(&arm, &hand, up.quaternion())
    else {
        panic!("an upper arm pointing up cannot hold a hand that low");
    };
    assert!((FRAC_PI_2..=PI).contains(&angle_rad));
}

#[test]
fn without_a_hand_the_elbow_is_assumed_and_says_so() {
    let posture = ArmPosture::from_upper_arm(&Quaternion::identity(), FRAC_PI_2).unwrap();
    assert_eq!(posture.elbow_source(), ElbowSource::Assumed);
    let arm = segments();
    let expected = Vector3::new(arm.forearm_m(), 0.0, -arm.upper_arm_m());
    assert!((posture.hand_position(&arm) - expected).norm() < 1e-12);
    for elbow_rad in [-0.01, 2.7, 90.0] {
        assert_eq!(
            ArmPosture::from_upper_arm(&Quaternion::identity(), elbow_rad),
            Err(PostureError::ElbowAngle {
                elbow_rad,
                max_rad: ELBOW_MAX_RAD
            })
        );
    }
    assert_eq!(
        ArmPosture::from_upper_arm(&Quaternion::new(0.0, 0.0, 0.0, 0.0), 1.0),
        Err(PostureError::NotUnit { norm: 0.0 })
    );
}

#[test]
fn a_hand_a_little_out_of_reach_is_brought_back_and_no_further() {
    let arm = segments();
    let reach = arm.upper_arm_m() + arm.forearm_m();
    let direction = Vector3::new(0.8, 0.36, -0.48);
    let with = |distance: f64| ArmPosture::from_hand_and_swivel(&arm, &(direction * distance), 0.3);
    let stretched = with(reach + 0.07).unwrap();
    assert!(stretched.elbow_rad() < 1e-7);
    assert!((stretched.hand_position(&arm) - direction * reach).norm() < 1e-7);
    let bent = with(0.12).unwrap();
    assert!((bent.elbow_rad() - ELBOW_MAX_RAD).abs() < 1e-12);
    for distance in [reach + 0.08, 0.08, 0.0] {
        let Err(PostureError::OutOfReach {
            distance_m,
            nearest_m,
            farthest_m,
        }) = with(distance)
        else {
            panic!("{distance} m is no arm's length");
        };
        assert!((distance_m - distance).abs() < 1e-12);
        assert!((farthest_m - reach * (1.0 + REACH_TOLERANCE)).abs() < 1e-12);
        assert!(nearest_m > 0.08 && nearest_m < 0.12);
    }
}

/// Everything from measurement to stiffness, in f32 against f64.
#[test]
fn single_precision_follows_double() {
    let mut rng = ChaCha8Rng::seed_from_u64(3);
    let (wide, narrow) = (
        ArmStiffness::<f64>::illustrative(),
        ArmStiffness::<f32>::illustrative(),
    );
    let mut worst = 0.0_f64;
    for _ in 0..10_000 {
        let truth = usual(&mut rng);
        let activation: f32 = rng.random_range(0.0..4.0);
        let hand = truth.hand_position(wide.segments()).cast::<f32>();
        let upper_arm = rotation_of(&truth).quaternion().cast::<f32>();
        let single =
            ArmPosture::from_hand_and_upper_arm(narrow.segments(), &hand, &upper_arm).unwrap();
        let double = ArmPosture::from_hand_and_upper_arm(
            wide.segments(),
            &hand.cast::<f64>(),
            &upper_arm.cast::<f64>(),
        )
        .unwrap();
        let single = narrow
            .at(activation, &single)
            .unwrap()
            .cartesian
            .cast::<f64>();
        let double = wide.at(f64::from(activation), &double).unwrap().cartesian;
        worst = worst.max((single - double).norm() / double.norm());
    }
    println!("f32 against f64: at most {worst:.1e} of the stiffness");
    assert!(worst < 5e-4);
}

#[test]
fn parameters_out_of_range_are_named() {
    let curve = CoContraction::new(0.7, 1.5).unwrap();
    for bad in [0.0, -1.0, 1000.1, f64::NAN, f64::INFINITY] {
        let result = ArmStiffness::new(curve, [12.0, 12.0, bad, 12.0], segments());
        assert!(matches!(
            result,
            Err(ParameterError::JointStiffness { joint: 2, .. })
        ));
    }
    let arm = ArmStiffness::new(curve, [12.0; 4], segments()).unwrap();
    let posture = ArmPosture::from_angles([0.2, 0.0, 0.0, 1.2]).unwrap();
    for bad in [f64::NAN, f64::INFINITY] {
        assert_eq!(arm.at(bad, &posture), Err(StiffnessError::NonFinite));
    }
    // Eq. 8 and 7 by hand.
    let stiffness = arm.at(1.0, &posture).unwrap();
    let c = 1.0 + 0.7 * (1.0 - (-1.5_f64).exp()) / (1.0 + (-1.5_f64).exp());
    assert!((stiffness.co_contraction - c).abs() < 1e-14);
    assert!((stiffness.joint - Vector4::repeat(12.0 * c)).norm() < 1e-12);
}

/// Any float: ordinary sizes as often as bit patterns, so that deep code is reached too.
fn float() -> impl Strategy<Value = f64> {
    prop_oneof![-1.0..1.0_f64, -5.0..5.0_f64, proptest::num::f64::ANY]
}

fn positive_definite(arm: &ArmStiffness<f64>, posture: &ArmPosture<f64>, activation: f64) {
    match arm.at(activation, posture) {
        Ok(stiffness) => {
            assert!(stiffness.cartesian.iter().all(|k| k.is_finite()));
            assert!(stiffness.cartesian.symmetric_eigenvalues().min() > 0.0);
        }
        Err(error) => assert_eq!(
            (error, activation.is_finite()),
            (StiffnessError::NonFinite, false)
        ),
    }
}

proptest! {
    #![proptest_config(tonus_tests::seeded(4_000))]

    #[test]
    fn no_measurement_panics_or_gives_a_stiffness_that_is_not_one(
        hand in [float(), float(), float()],
        upper_arm in [float(), float(), float(), float()],
        angles in [float(), float(), float(), float()],
        activation in float(),
    ) {
        let arm = ArmStiffness::illustrative();
        let hand = Vector3::from(hand);
        let raw = Quaternion::from(upper_arm);
        let unit = if raw.norm().is_normal() { raw / raw.norm() } else { raw };
        let postures = [
            ArmPosture::from_hand_and_swivel(arm.segments(), &hand, angles[0]),
            ArmPosture::from_hand_and_upper_arm(arm.segments(), &hand, &raw),
            ArmPosture::from_hand_and_upper_arm(arm.segments(), &hand, &unit),
            ArmPosture::from_upper_arm(&unit, angles[3]),
            ArmPosture::from_angles(angles),
        ];
        for posture in postures.into_iter().flatten() {
            positive_definite(&arm, &posture, activation);
        }
    }

    #[test]
    fn no_joint_stiffness_panics_or_passes_unless_it_holds(
        joint in [float(), float(), float(), float()],
        mass_kg in float(),
        height_m in float(),
    ) {
        let segments = Segments::new(mass_kg.abs() * 100.0, height_m.abs()).unwrap_or(segments());
        let posture = ArmPosture::from_angles([0.4, -0.2, 0.1, 0.9]).unwrap();
        if let Ok(stiffness) = cartesian_stiffness(&segments, &posture, &Vector4::from(joint)) {
            prop_assert!(stiffness.iter().all(|k| k.is_finite()));
            prop_assert!(stiffness.symmetric_eigenvalues().min() > 0.0);
        }
    }
}

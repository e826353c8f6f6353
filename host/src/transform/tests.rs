use nalgebra::{Rotation3, Unit};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

use super::*;

const MARKS_M: [[f64; 3]; 4] = [
    [0.4, -0.2, 0.02],
    [0.6, 0.2, 0.02],
    [0.35, 0.15, 0.25],
    [0.5, 0.0, 0.1],
];

/// Robot to tracker by a rotation and a shift written out, so that the truth is not the code's own.
fn seen(mark: [f64; 3], rotation: &Rotation3<f64>, shift: &Vector3<f64>) -> Touched {
    let tracker = rotation.transpose() * (Vector3::from(mark) - shift);
    Touched {
        tracker_m: tracker.into(),
        robot_m: mark,
    }
}

#[test]
fn a_quarter_turn_by_hand() {
    // A Leap before the robot: its x is the robot's -y, its y the robot's z, its z the robot's -x.
    let touched = [[0.3, 0.1, 0.0], [0.5, 0.1, 0.0], [0.3, 0.4, 0.2]].map(|[x, y, z]| Touched {
        tracker_m: [-y, z + 0.1, 0.6 - x],
        robot_m: [x, y, z],
    });
    let taught = Transform::teach(&touched).unwrap();
    assert!(taught.residual_m < 1e-12);
    let [x, y, z] = taught.transform.point_m([0.2, 0.3, 0.1]);
    assert!((x - 0.5).abs() < 1e-12 && (y + 0.2).abs() < 1e-12 && (z - 0.2).abs() < 1e-12);
    let [x, y, z] = taught.transform.direction([0.0, 0.0, 1.0]);
    assert!((x + 1.0).abs() < 1e-12 && y.abs() < 1e-12 && z.abs() < 1e-12);
    // Quaternion of the turn that takes (x, y, z) to (-z, -x, y): axis (1, -1, -1), 120 degrees.
    let stored = taught.transform.to_stored();
    let expected = [0.5, -0.5, -0.5, 0.5];
    for (got, expected) in stored.rotation_xyzw.iter().zip(expected) {
        assert!((got - expected).abs() < 1e-12, "{stored:?}");
    }
    let back = taught.transform.inverse().point_m([0.5, -0.2, 0.2]);
    assert!((back[1] - 0.3).abs() < 1e-12);
}

#[test]
fn any_rigid_motion_is_found_and_noise_stays_noise() {
    let mut rng = ChaCha8Rng::seed_from_u64(5);
    for trial in 0..200 {
        let mut draw = || -> f64 { StandardNormal.sample(&mut rng) };
        let axis = Unit::new_normalize(Vector3::new(draw(), draw(), draw()));
        let rotation = Rotation3::from_axis_angle(&axis, 3.0 * draw());
        let shift = Vector3::new(draw(), draw(), draw());
        let points = if trial % 2 == 0 { 3 } else { 4 };
        let mut touched: Vec<Touched> = MARKS_M[..points]
            .iter()
            .map(|mark| seen(*mark, &rotation, &shift))
            .collect();
        let exact = Transform::teach(&touched).unwrap();
        assert!(exact.residual_m < 1e-12);
        for point in &mut touched {
            point.tracker_m = point.tracker_m.map(|x| x + 0.002 * draw());
        }
        let noisy = Transform::teach(&touched).unwrap();
        assert!(noisy.residual_m < 0.006);
        let apart = Vector3::from(noisy.transform.point_m(touched[0].tracker_m))
            - Vector3::from(MARKS_M[0]);
        assert!(apart.norm() < 0.012, "{apart}");
        let stored = noisy.transform.to_stored();
        let read = Transform::from_stored(&stored).unwrap();
        let apart = Vector3::from(read.point_m([0.1, 0.2, 0.3]))
            - Vector3::from(noisy.transform.point_m([0.1, 0.2, 0.3]));
        assert!(apart.norm() < 1e-14);
    }
}

#[test]
fn a_mirror_image_is_refused_and_never_taken_for_a_motion() {
    let mut mirrored: Vec<Touched> = MARKS_M
        .iter()
        .map(|[x, y, z]| Touched {
            tracker_m: [*x, -*y, *z],
            robot_m: [*x, *y, *z],
        })
        .collect();
    mirrored.push(Touched {
        tracker_m: [0.3, 0.3, 0.4],
        robot_m: [0.3, -0.3, 0.4],
    });
    assert!(matches!(
        Transform::teach(&mirrored),
        Err(TransformError::Residual { .. })
    ));
}

#[test]
fn points_that_teach_nothing_are_refused_by_name() {
    let identity = Rotation3::identity();
    let at = |mark: [f64; 3]| seen(mark, &identity, &Vector3::zeros());
    let two = Transform::teach(&[at(MARKS_M[0]), at(MARKS_M[1])]);
    assert_eq!(two.unwrap_err(), TransformError::TooFew { got: 2 });
    let line = [[0.3, 0.0, 0.0], [0.4, 0.001, 0.0], [0.5, 0.0, 0.001]].map(at);
    assert!(matches!(
        Transform::teach(&line),
        Err(TransformError::Collinear { .. })
    ));
    let close = [[0.3, 0.0, 0.0], [0.5, 0.0, 0.0], [0.32, 0.03, 0.0]].map(at);
    assert!(matches!(
        Transform::teach(&close),
        Err(TransformError::TooClose {
            first: 1,
            second: 3,
            ..
        })
    ));
    let mut slipped = MARKS_M.map(at);
    slipped[2].tracker_m[0] += 0.08;
    assert!(matches!(
        Transform::teach(&slipped),
        Err(TransformError::Residual { worst: 3, .. })
    ));
    let mut nan = MARKS_M.map(at);
    nan[1].robot_m[2] = f64::NAN;
    assert_eq!(
        Transform::teach(&nan).unwrap_err(),
        TransformError::NotFinite { point: 2 }
    );
    let stored = Stored {
        rotation_xyzw: [0.0, 0.0, 0.0, 0.9],
        translation_m: [0.0; 3],
    };
    assert_eq!(
        Transform::from_stored(&stored).unwrap_err(),
        TransformError::NotUnit { norm: 0.9 }
    );
    let stored = Stored {
        rotation_xyzw: [0.0, 0.0, 0.0, 1.0],
        translation_m: [f64::NAN; 3],
    };
    assert_eq!(
        Transform::from_stored(&stored).unwrap_err(),
        TransformError::Stored
    );
}

#[test]
fn the_shoulder_looks_forward_left_and_up() {
    let shoulder = Shoulder {
        centre_m: [0.2, 0.4, 0.4],
        turned_left_rad: 0.0,
    };
    // 30 cm before the shoulder, 10 cm to its left, 20 cm below it.
    let [x, y, z] = shoulder.point_m([0.1, 0.2, 0.1]);
    assert!((x - 0.3).abs() < 1e-12 && (y - 0.1).abs() < 1e-12 && (z + 0.2).abs() < 1e-12);
    // A person turned to the left by a right angle has the tracker's left (-x) before them.
    let turned = Shoulder {
        turned_left_rad: std::f64::consts::FRAC_PI_2,
        ..shoulder
    };
    let [x, y, z] = turned.point_m([-0.1, 0.4, 0.4]);
    assert!((x - 0.3).abs() < 1e-12 && y.abs() < 1e-12 && z.abs() < 1e-12);
    let by_touch = Shoulder::by_touch(&[[0.19, 0.4, 0.4], [0.21, 0.4, 0.4]]).unwrap();
    assert!((by_touch.centre_m[0] - 0.2).abs() < 1e-12);
    let default = Shoulder::by_height(1.75, false).unwrap();
    assert!(
        default.centre_m[0] > 0.0 && Shoulder::by_height(1.75, true).unwrap().centre_m[0] < 0.0
    );
}

#[test]
fn a_shoulder_that_cannot_be_is_refused_by_name() {
    assert_eq!(Shoulder::by_touch(&[]), Err(ShoulderError::NotSeen));
    let moved = Shoulder::by_touch(&[[0.0, 0.4, 0.4], [0.2, 0.4, 0.4]]);
    assert!(matches!(moved, Err(ShoulderError::Moved { .. })));
    assert!(matches!(
        Shoulder::by_touch(&[[0.0, 2.0, 0.0]]),
        Err(ShoulderError::Far { .. })
    ));
    assert!(matches!(
        Shoulder::by_touch(&[[f64::NAN; 3]; 2]),
        Err(ShoulderError::Far { .. })
    ));
    assert_eq!(
        Shoulder::by_height(175.0, false),
        Err(ShoulderError::Height { height_m: 175.0 })
    );
}

use nalgebra::{UnitQuaternion, Vector3};
use tonus_shared::{
    pipeline::{ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Pipeline, PipelineConfig},
    sample::{AdcScale, Scan},
    semg::chain::ChainConfig,
    stiffness::ArmStiffness,
    wire::Muscle,
};

use super::*;

const IDENTITY: [f32; 4] = [0.0, 0.0, 0.0, 1.0];
const RATE_HZ: f32 = 200.0;
const STEP_US: u64 = 5_000;
const G: f32 = 9.806_65;

/// An arm that moves exactly as it is told, with an ideal sensor on it.
struct Arm {
    attitude: Attitude,
    truth: UnitQuaternion<f32>,
    /// Upper-arm axes to sensor axes.
    to_sensor: UnitQuaternion<f32>,
    bias_rad_s: Vector3<f32>,
    now_us: u64,
    shown: Option<[f32; 4]>,
}

impl Arm {
    fn new(truth: UnitQuaternion<f32>) -> Self {
        Self::mounted(truth, UnitQuaternion::identity())
    }

    fn mounted(truth: UnitQuaternion<f32>, mounting: UnitQuaternion<f32>) -> Self {
        Self {
            attitude: Attitude::new(mounting.coords.into(), RATE_HZ).unwrap(),
            truth,
            to_sensor: mounting.inverse(),
            bias_rad_s: Vector3::zeros(),
            now_us: 1_000_000,
            shown: None,
        }
    }

    /// Turns with a constant rate (upper-arm axes, rad/s) for a while.
    fn turn(&mut self, rate_rad_s: [f32; 3], duration_s: f32) {
        let rate = Vector3::from(rate_rad_s);
        for _ in 0..(duration_s * RATE_HZ).round() as u32 {
            self.now_us += STEP_US;
            self.truth *= UnitQuaternion::from_scaled_axis(rate / RATE_HZ);
            let motion = self.motion(rate);
            self.shown = self.attitude.push(&motion, self.now_us).unwrap();
        }
    }

    fn rest(&mut self, duration_s: f32) {
        self.turn([0.0; 3], duration_s);
    }

    fn motion(&self, rate: Vector3<f32>) -> Motion {
        let up = self.truth.inverse() * Vector3::z() * G;
        Motion {
            acceleration_m_s2: (self.to_sensor * up).into(),
            rate_rad_s: (self.to_sensor * (rate + self.bias_rad_s)).into(),
        }
    }

    fn shown(&self) -> UnitQuaternion<f32> {
        UnitQuaternion::from_quaternion(Quaternion::from(self.shown.unwrap()))
    }

    /// Angle between what is shown and an attitude given as x, y, z, w; degrees.
    fn off_deg(&self, xyzw: [f32; 4]) -> f32 {
        let other = UnitQuaternion::from_quaternion(Quaternion::from(xyzw));
        self.shown().angle_to(&other).to_degrees()
    }
}

fn turned(axis: [f32; 3], degrees: f32) -> UnitQuaternion<f32> {
    UnitQuaternion::from_scaled_axis(Vector3::from(axis) * degrees.to_radians())
}

#[test]
fn gravity_gives_the_inclination_of_arms_at_rest() {
    let half = core::f32::consts::FRAC_1_SQRT_2;
    // Hanging; forward and level (about -y); lifted to the left (about x).
    let arms = [
        ([0.0, 0.0, G], IDENTITY),
        ([G, 0.0, 0.0], [0.0, -half, 0.0, half]),
        ([0.0, G, 0.0], [half, 0.0, 0.0, half]),
    ];
    for (acceleration_m_s2, expected) in arms {
        let mut attitude = Attitude::new(IDENTITY, RATE_HZ).unwrap();
        let motion = Motion {
            acceleration_m_s2,
            rate_rad_s: [0.0; 3],
        };
        let mut shown = None;
        for number in 0..200 {
            shown = attitude.push(&motion, number * STEP_US).unwrap();
        }
        for (got, expected) in shown.unwrap().iter().zip(expected) {
            assert!((got - expected).abs() < 1e-4, "{shown:?}");
        }
    }
}

#[test]
fn known_turns_come_out_as_their_closed_form() {
    // Elbow forward by 60 degrees within a second, about -y.
    let mut arm = Arm::new(UnitQuaternion::identity());
    arm.rest(2.0);
    arm.turn([0.0, -60_f32.to_radians(), 0.0], 1.0);
    assert!(arm.off_deg([0.0, -0.5, 0.0, 0.866_025_4]) < 0.2);
    // The elbow now points forward and down: -z of the arm.
    let elbow = arm.shown() * -Vector3::z();
    assert!(
        (elbow - Vector3::new(0.866_025_4, 0.0, -0.5)).norm() < 5e-3,
        "{elbow}"
    );

    // A quarter turn about the vertical, which only the gyroscope sees.
    let mut arm = Arm::new(UnitQuaternion::identity());
    arm.rest(2.0);
    arm.turn([0.0, 0.0, 90_f32.to_radians()], 1.0);
    let half = core::f32::consts::FRAC_1_SQRT_2;
    assert!(arm.off_deg([0.0, 0.0, half, half]) < 0.2);

    // Forward, sideways, twist, and all the way back.
    for axis in [[0.0, -1.0, 0.0], [1.0, 0.0, 0.0], [0.0, 0.0, 1.0]] {
        arm.turn(axis.map(|part| part * 1.5), 0.7);
        arm.turn(axis.map(|part| part * -1.5), 0.7);
    }
    assert!(arm.off_deg([0.0, 0.0, half, half]) < 0.4);
}

#[test]
fn the_gyroscopes_bias_is_learnt_at_rest() {
    let mut arm = Arm::new(turned([0.0, -1.0, 0.0], 30.0));
    arm.bias_rad_s = Vector3::new(0.010, -0.020, 0.015);
    arm.rest(60.0);
    let bias = Vector3::from(arm.attitude.bias_rad_s());
    assert!((bias - arm.bias_rad_s).norm() < 2e-4, "{bias}");
    // A minute with the bias would be 85 degrees; with what is left of it, less than one.
    let before = arm.shown();
    arm.rest(60.0);
    let drift_deg = arm.shown().angle_to(&before).to_degrees();
    assert!(drift_deg < 1.0, "{drift_deg}");
    let up = arm.shown() * (arm.truth.inverse() * Vector3::z());
    assert!(
        (up - Vector3::z()).norm() < 5e-3,
        "inclination does not drift: {up}"
    );
}

#[test]
fn the_mounting_turns_sensor_axes_into_the_arms() {
    // The sensor's x points to the elbow, its z away from the arm to the right: arm axes of sensor x, y, z are
    // -z, x, -y.
    let mounting = nalgebra::Matrix3::new(0.0, 1.0, 0.0, 0.0, 0.0, -1.0, -1.0, 0.0, 0.0);
    let mounting = UnitQuaternion::from_matrix(&mounting);
    let mut arm = Arm::mounted(UnitQuaternion::identity(), mounting);
    let hanging = arm.motion(Vector3::zeros());
    assert!(
        (hanging.acceleration_m_s2[0] + G).abs() < 1e-4,
        "x is down: {hanging:?}"
    );
    arm.rest(2.0);
    assert!(arm.off_deg(IDENTITY) < 0.1);
    arm.turn([0.0, -60_f32.to_radians(), 0.0], 1.0);
    assert!(arm.off_deg([0.0, -0.5, 0.0, 0.866_025_4]) < 0.2);
}

#[test]
fn what_is_not_finite_or_not_newer_changes_nothing() {
    let mut arm = Arm::new(turned([1.0, 0.0, 0.0], 25.0));
    arm.rest(1.0);
    let good = arm.motion(Vector3::zeros());
    let before = arm.shown.unwrap();
    for value in [f32::NAN, f32::INFINITY, f32::NEG_INFINITY, f32::MAX] {
        for axis in 0..3 {
            let mut motion = good;
            motion.acceleration_m_s2[axis] = value;
            let pushed = arm.attitude.push(&motion, arm.now_us + 1);
            assert_eq!(pushed, Err(AttitudeError::NonFinite));
            let mut motion = good;
            motion.rate_rad_s[axis] = value;
            let pushed = arm.attitude.push(&motion, arm.now_us + 1);
            assert_eq!(pushed, Err(AttitudeError::NonFinite));
        }
    }
    for acquired_us in [0, arm.now_us - 1, arm.now_us] {
        let expected = AttitudeError::TimeNotNewer {
            acquired_us,
            newest_us: arm.now_us,
        };
        assert_eq!(arm.attitude.push(&good, acquired_us), Err(expected));
    }
    arm.rest(0.005);
    for (got, before) in arm.shown.unwrap().iter().zip(before) {
        assert!((got - before).abs() < 1e-5);
    }
}

#[test]
fn whatever_finite_comes_the_attitude_stays_a_rotation() {
    let mut attitude = Attitude::new(IDENTITY, RATE_HZ).unwrap();
    let mut bits = 1_u64;
    let mut draw = || {
        bits = bits
            .wrapping_mul(6_364_136_223_846_793_005)
            .wrapping_add(1_442_695_040_888_963_407);
        f32::from_bits((bits >> 32) as u32)
    };
    let mut shown = 0;
    for number in 0..200_000 {
        let motion = Motion {
            acceleration_m_s2: [draw(), draw(), draw()],
            rate_rad_s: [draw(), draw(), draw()],
        };
        if let Ok(Some(xyzw)) = attitude.push(&motion, number * 2_000) {
            shown += 1;
            let norm = Quaternion::from(xyzw).norm();
            assert!((norm - 1.0).abs() < 1e-3, "{xyzw:?} after {motion:?}");
        }
    }
    assert!(shown > 10_000, "{shown}");
}

#[test]
fn a_gap_is_not_integrated_over() {
    let mut arm = Arm::new(UnitQuaternion::identity());
    arm.bias_rad_s = Vector3::new(0.01, 0.0, -0.01);
    arm.rest(30.0);
    let bias = arm.attitude.bias_rad_s();
    // 50 ms is bridged, more is not.
    arm.now_us += 45_000;
    arm.rest(0.005);
    assert!(arm.shown.is_some());
    // During the gap the arm was lifted.
    arm.now_us += 200_000;
    arm.truth = turned([0.0, -1.0, 0.0], 40.0);
    arm.rest(0.4);
    assert_eq!(arm.shown, None, "settling");
    arm.rest(0.6);
    let up = arm.shown() * (arm.truth.inverse() * Vector3::z());
    assert!(
        (up - Vector3::z()).norm() < 2e-2,
        "the new inclination: {up}"
    );
    for (got, before) in arm.attitude.bias_rad_s().iter().zip(bias) {
        assert!((got - before).abs() < 2e-3, "the bias is remembered");
    }
}

#[test]
fn what_is_no_mounting_or_rate_is_refused() {
    let not_unit = Attitude::new([0.0, 0.0, 0.0, 0.9], RATE_HZ).err();
    assert_eq!(not_unit, Some(AttitudeError::NotUnit { norm: 0.9 }));
    let nan = Attitude::new([f32::NAN, 0.0, 0.0, 1.0], RATE_HZ).err();
    assert_eq!(nan, Some(AttitudeError::NonFinite));
    for rate_hz in [0.0, -1.0, 49.0, 1001.0, f32::INFINITY] {
        let rate = Attitude::new(IDENTITY, rate_hz).err();
        assert_eq!(rate, Some(AttitudeError::Rate { rate_hz }));
    }
    assert!(Attitude::new(IDENTITY, f32::NAN).is_err());
}

#[test]
fn the_pipeline_takes_it() {
    let mut pipeline = Pipeline::<1>::new(&PipelineConfig {
        boot_id: 1,
        firmware_hash: [0; 8],
        adc: AdcScale::new(1e-6, 0, -1000, 1000).unwrap(),
        chain: ChainConfig::at_rate(1_000.0),
        channels: [ChannelConfig {
            muscle: Muscle::BicepsLong,
            rest_v: 10e-6,
            mvc_v: 500e-6,
        }],
        activation_window_s: DEFAULT_ACTIVATION_WINDOW_S,
        arm: ArmStiffness::illustrative(),
        raw: false,
    })
    .unwrap();
    let mut arm = Arm::new(turned([0.0, -1.0, 0.0], 50.0));
    arm.rest(1.0);
    let scan = Scan {
        index: 0,
        acquired_us: arm.now_us,
        counts: [0],
    };
    pipeline.push_scan(&scan).unwrap();
    for _ in 0..2_000 {
        arm.turn([0.7, -0.9, 1.1], 0.005);
        let scan = Scan {
            index: scan.index + (arm.now_us - scan.acquired_us) as u32 / 1_000,
            acquired_us: arm.now_us,
            counts: [0],
        };
        pipeline.push_scan(&scan).unwrap();
        pipeline
            .set_orientation(arm.shown.unwrap(), arm.now_us)
            .unwrap();
    }
}

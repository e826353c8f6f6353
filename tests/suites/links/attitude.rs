//! The armband's attitude as the upper arm's: arms of known posture, armbands that sit in known ways.

use nalgebra::{Quaternion, Rotation3, Unit, UnitQuaternion, Vector3};
use tonus::link::myo::{Armband, IMU, SEMG};
use tonus_shared::stiffness::{ArmPosture, ArmStiffness};
use tonus_shared::wire::{HandPosition, Header, Packet, Stream, StreamFlags, decode};
use tonus_tests::frames::{HEADER, bytes_of};

/// A packet of sEMG, and every other of them one of attitude.
const PACKET_US: u64 = 10_000;
const SECOND_US: u64 = 1_000_000;
/// Counts of the armband's quaternion are 1/16384: two of them are multiplied, and axes turn by twice as much.
const ROUNDING_RAD: f64 = 5e-4;

/// How an armband sits: its axes in the upper arm's, and the heading of its level frame in the shoulder's.
#[derive(Clone, Copy)]
struct Worn {
    mounting: UnitQuaternion<f64>,
    heading: UnitQuaternion<f64>,
}

impl Worn {
    /// Logo (z) forward over the biceps, x up the arm or down it, all of it tilted on the tapering arm, and by `aside_rad` off the biceps.
    fn new(x_up: bool, tilted_rad: f64, aside_rad: f64, heading_rad: f64) -> Self {
        let x = if x_up { Vector3::z() } else { -Vector3::z() };
        let z = Vector3::x();
        let axes = Rotation3::from_basis_unchecked(&[x, z.cross(&x), z]);
        let tilt = Rotation3::from_axis_angle(&Vector3::y_axis(), tilted_rad);
        let aside = Rotation3::from_axis_angle(&Vector3::z_axis(), aside_rad);
        Self {
            mounting: UnitQuaternion::from_rotation_matrix(&(aside * tilt * axes)),
            heading: UnitQuaternion::from_axis_angle(&Vector3::z_axis(), heading_rad),
        }
    }

    /// What the armband tells of an upper arm at rest in this attitude (upper-arm frame to shoulder frame).
    fn tells(&self, upper_arm: &UnitQuaternion<f64>) -> Vec<u8> {
        let told = self.heading.inverse() * upper_arm * self.mounting;
        let up_g = told.inverse() * Vector3::z();
        let q = told.quaternion();
        let scaled = [q.w, q.i, q.j, q.k].map(|part| 16_384.0 * part);
        let acceleration = [up_g.x, up_g.y, up_g.z].map(|part| 2_048.0 * part);
        let counts = scaled.into_iter().chain(acceleration).chain([0.0; 3]);
        counts
            .flat_map(|count| (count.round() as i16).to_le_bytes())
            .collect()
    }
}

/// An arm with an armband, and what has left it.
struct Arm {
    armband: Armband,
    worn: Worn,
    packets: u64,
    attitudes: Vec<UnitQuaternion<f64>>,
    streams: Vec<Stream>,
}

impl Arm {
    fn wearing(worn: Worn) -> Self {
        let mut armband = Armband::new(7).unwrap();
        armband.connected();
        Self {
            armband,
            worn,
            packets: 0,
            attitudes: Vec::new(),
            streams: Vec::new(),
        }
    }

    fn now_us(&self) -> u64 {
        SECOND_US + self.packets * PACKET_US
    }

    /// Stays so for a while, relaxed; what left before is forgotten.
    fn stays(&mut self, upper_arm: &UnitQuaternion<f64>, hand: Option<Vector3<f64>>, seconds: f64) {
        self.attitudes.clear();
        self.streams.clear();
        let until_us = self.now_us() + (1e6 * seconds) as u64;
        while self.now_us() < until_us {
            self.packets += 1;
            let at_us = self.now_us();
            let mut notified = vec![(SEMG[self.packets as usize % 4], vec![0; 16])];
            if self.packets.is_multiple_of(2) {
                notified.push((IMU, self.worn.tells(upper_arm)));
            }
            for (characteristic, bytes) in notified {
                let (attitudes, streams) = (&mut self.attitudes, &mut self.streams);
                let send = |frame: &[u8]| match decode(frame).unwrap().packet {
                    Packet::Orientation(told) => {
                        let [x, y, z, w] = told.xyzw.map(f64::from);
                        attitudes
                            .push(UnitQuaternion::from_quaternion(Quaternion::new(w, x, y, z)));
                    }
                    Packet::Stream(stream) => streams.push(stream),
                    _ => {}
                };
                self.armband
                    .take(characteristic, &bytes, at_us, send)
                    .unwrap();
            }
            if let Some(hand) = hand {
                let position_m = Some(hand.map(|metres| metres as f32).into());
                let header = Header {
                    device_us: at_us,
                    ..HEADER
                };
                let frame =
                    bytes_of(&header, &Packet::HandPosition(HandPosition { position_m })).unwrap();
                self.armband.request(&frame, at_us, |_| {});
            }
        }
    }

    /// The step of the calibration in which the elbow is bent against a weight.
    fn bends_the_elbow(&mut self) {
        let at_us = self.now_us();
        self.armband.hangs(at_us);
        self.stays(&UnitQuaternion::identity(), None, 4.0);
    }
}

fn about(axis: Unit<Vector3<f64>>, degrees: f64) -> UnitQuaternion<f64> {
    UnitQuaternion::from_axis_angle(&axis, degrees.to_radians())
}

/// Ways of wearing it: either way round, on an arm that tapers, with any heading.
fn ways() -> impl Iterator<Item = Worn> {
    let headings = [-2.9, -0.4, 0.0, 1.7];
    [true, false].into_iter().flat_map(move |x_up| {
        headings
            .into_iter()
            .zip([0.0, 0.1, -0.15, 0.2])
            .map(move |(heading, tilt)| Worn::new(x_up, tilt, 0.0, heading))
    })
}

#[test]
fn a_known_attitude_comes_out_however_the_armband_sits() {
    let raised = about(-Vector3::y_axis(), 70.0);
    let aside = about(Vector3::x_axis(), -40.0);
    for worn in ways() {
        let mut arm = Arm::wearing(worn);
        arm.bends_the_elbow();
        for upper_arm in [
            raised,
            aside,
            raised * aside,
            about(Vector3::z_axis(), 50.0),
        ] {
            arm.stays(&upper_arm, None, 0.5);
            assert!(arm.attitudes.len() >= 24, "{}", arm.attitudes.len());
            // An attitude leaves with the next scan: the first is of before.
            for told in &arm.attitudes[1..] {
                assert!(told.angle_to(&upper_arm) < ROUNDING_RAD, "{told}");
            }
        }
        // 70 degrees of flexion lift the elbow from straight below to cos 70 degrees below the shoulder, ahead.
        arm.stays(&raised, None, 0.5);
        let elbow = arm.attitudes[10] * -Vector3::z();
        let expected = Vector3::new(70_f64.to_radians().sin(), 0.0, -70_f64.to_radians().cos());
        assert!((elbow - expected).norm() < ROUNDING_RAD, "{elbow}");
    }
}

#[test]
fn a_logo_beside_the_biceps_turns_directions_but_no_elevation() {
    let aside = 0.3;
    let mut arm = Arm::wearing(Worn::new(true, 0.1, aside, 0.9));
    arm.bends_the_elbow();
    arm.stays(&about(-Vector3::y_axis(), 60.0), None, 0.5);
    let elbow = arm.attitudes[10] * -Vector3::z();
    assert!(
        (elbow.z + 60_f64.to_radians().cos()).abs() < ROUNDING_RAD,
        "{elbow}"
    );
    assert!(
        (elbow.y.atan2(elbow.x) + aside).abs() < 2.0 * ROUNDING_RAD,
        "{elbow}"
    );
}

/// A stream's stiffness against the closed form's in a posture.
fn agrees(stream: &Stream, posture: &ArmPosture<f64>) {
    let arm = ArmStiffness::<f64>::illustrative();
    let expected = arm
        .at(f64::from(stream.activation), posture)
        .unwrap()
        .cartesian
        .diagonal();
    for (got, expected) in stream.stiffness_n_per_m.iter().zip(expected.iter()) {
        assert!(
            (f64::from(*got) / expected - 1.0).abs() < 5e-3,
            "{stream:?}: {expected}"
        );
    }
}

#[test]
fn the_posture_rests_on_it_with_and_without_a_hand() {
    let arm_stiffness = ArmStiffness::<f64>::illustrative();
    let [flexion, left, axial, elbow] = [0.7, -0.3, 0.6, 1.2];
    let posture = |elbow| ArmPosture::from_angles([flexion, left, axial, elbow]).unwrap();
    let upper_arm = UnitQuaternion::from_rotation_matrix(posture(elbow).upper_arm());
    let hand = posture(elbow).hand_position(arm_stiffness.segments());
    let mut arm = Arm::wearing(Worn::new(false, 0.1, 0.0, 2.0));
    // Nobody knows yet how it sits: the arm is assumed to hang, or the hand alone counts.
    arm.stays(&upper_arm, None, 1.0);
    assert_eq!(arm.attitudes, []);
    let last = *arm.streams.last().unwrap();
    assert!(!last.flags.contains(StreamFlags::ORIENTATION_SEEN));
    let right_angle = std::f64::consts::FRAC_PI_2;
    agrees(
        &last,
        &ArmPosture::from_angles([0.0, 0.0, 0.0, right_angle]).unwrap(),
    );

    arm.bends_the_elbow();
    arm.stays(&upper_arm, None, 1.0);
    let last = *arm.streams.last().unwrap();
    assert!(last.flags.contains(StreamFlags::ORIENTATION_SEEN));
    agrees(&last, &posture(right_angle));

    arm.stays(&upper_arm, Some(hand), 1.0);
    let last = *arm.streams.last().unwrap();
    assert!(
        last.flags
            .contains(StreamFlags::ORIENTATION_SEEN.with(StreamFlags::HAND_SEEN, true))
    );
    agrees(&last, &posture(elbow));

    // On a new link it may have been put on anew.
    arm.armband.connected();
    arm.stays(&upper_arm, Some(hand), 1.0);
    assert!(arm.attitudes.len() <= 1, "one was on its way");
    let last = *arm.streams.last().unwrap();
    assert!(!last.flags.contains(StreamFlags::ORIENTATION_SEEN));
    agrees(
        &last,
        &ArmPosture::from_hand_and_swivel(arm_stiffness.segments(), &hand, 0.0).unwrap(),
    );
}

#[test]
fn nothing_is_learnt_from_an_arm_that_is_not_asked_does_not_hang_or_moves() {
    let hanging = UnitQuaternion::identity();
    let worn = Worn::new(true, 0.0, 0.0, 1.0);
    // Not asked, or asked for something else meanwhile.
    let mut arm = Arm::wearing(worn);
    arm.stays(&hanging, None, 5.0);
    let at_us = arm.now_us();
    arm.armband.hangs(at_us);
    arm.stays(&hanging, None, 1.5);
    arm.armband.moves();
    arm.stays(&hanging, None, 3.0);
    assert_eq!(arm.attitudes, []);
    // The elbow rests on a table.
    let at_us = arm.now_us();
    arm.armband.hangs(at_us);
    arm.stays(&about(-Vector3::y_axis(), 45.0), None, 4.0);
    assert_eq!(arm.attitudes, []);
    // It swings: never a second in one place.
    let at_us = arm.now_us();
    arm.armband.hangs(at_us);
    for swing in 0..8 {
        let degrees = if swing % 2 == 0 { 0.0 } else { 40.0 };
        arm.stays(&about(-Vector3::y_axis(), degrees), None, 0.5);
        assert_eq!(arm.attitudes, []);
    }
    // Too late; and then in time.
    arm.stays(&hanging, None, 3.0);
    assert_eq!(arm.attitudes, []);
    arm.bends_the_elbow();
    assert!(!arm.attitudes.is_empty());
}

#[test]
fn an_attitude_that_contradicts_gravity_is_never_used() {
    // Told the other way about: from the level frame to the armband.
    let mut arm = Arm::wearing(Worn::new(true, 0.0, 0.0, 1.0));
    let at_us = SECOND_US;
    arm.armband.hangs(at_us);
    let tells = arm.worn.tells(&UnitQuaternion::identity());
    for packet in 0..400 {
        let mut bytes = tells.clone();
        for part in 1..4 {
            let count = i16::from_le_bytes([bytes[2 * part], bytes[2 * part + 1]]);
            bytes[2 * part..2 * part + 2].copy_from_slice(&(-count).to_le_bytes());
        }
        let at_us = at_us + packet * PACKET_US;
        let send = |frame: &[u8]| {
            let packet = decode(frame).unwrap().packet;
            assert!(!matches!(packet, Packet::Orientation(_)));
        };
        arm.armband
            .take(SEMG[packet as usize % 4], &[0; 16], at_us, send)
            .unwrap();
        arm.armband.take(IMU, &bytes, at_us, send).unwrap();
    }
}

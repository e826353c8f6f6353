use std::time::Duration;

use super::super::gate::Cause;
use super::*;

const SETPOINT: Setpoint = Setpoint {
    position_m: [0.4, -0.1, 0.3],
    velocity_m_per_s: [0.1, 0.0, -0.2],
    stiffness_n_per_m: [300.0, 400.0, 500.0],
    damping_ratio: 0.9,
};

fn command(acquired_us: u64, valid_until_us: u64) -> Command {
    Command {
        position_m: [0.4, -0.1, 0.3],
        velocity_m_per_s: [0.0; 3],
        stiffness_n_per_m: [300.0; 3],
        damping_ratio: 0.9,
        acquired_us,
        valid_until_us,
        sequence: 7,
        boot_id: 0xdead_beef,
        quality: Quality::Good,
    }
}

fn pair(rate_hz: f64) -> (UdpSocket, UdpRobot) {
    let controller = UdpSocket::bind("127.0.0.1:0").unwrap();
    controller
        .set_read_timeout(Some(Duration::from_secs(5)))
        .unwrap();
    let robot = UdpRobot::open(controller.local_addr().unwrap(), rate_hz).unwrap();
    (controller, robot)
}

#[test]
fn the_datagram_is_written_as_documented() {
    let text = serde_json::to_string(&datagram(
        &SETPOINT,
        State::Following,
        Some(&command(1_000_000, 1_060_000)),
        3,
        1_020_000,
    ));
    assert_eq!(
        text.unwrap(),
        r#"{"version":1,"sequence":3,"boot_id":3735928559,"acquired_us":1000000,"valid_until_us":1060000,"sent_us":1020000,"age_us":20000,"valid_for_us":40000,"position_m":[0.4,-0.1,0.3],"velocity_m_per_s":[0.1,0.0,-0.2],"stiffness_n_per_m":[300.0,400.0,500.0],"damping_ratio":0.9,"state":"following","quality":"good"}"#
    );
}

#[test]
fn no_setpoint_is_valid_for_longer_than_its_life_or_its_command() {
    let valid = |state, command: Option<Command>, now_us| {
        datagram(&SETPOINT, state, command.as_ref(), 0, now_us).valid_for_us
    };
    assert_eq!(
        valid(State::Following, Some(command(0, 50_000)), 20_000),
        30_000
    );
    assert_eq!(
        valid(State::Following, Some(command(0, u64::MAX)), 20_000),
        100_000
    );
    assert_eq!(valid(State::Following, Some(command(0, 10_000)), 20_000), 0);
    assert_eq!(
        valid(State::Holding, Some(command(0, 10_000)), 20_000),
        100_000
    );
    assert_eq!(valid(State::Disarmed(Cause::Person), None, 20_000), 100_000);
    // Nobody armed it yet: not to be followed at all.
    assert_eq!(valid(State::Disarmed(Cause::Start), None, 20_000), 0);
    assert_eq!(
        valid(State::Holding, None, u64::MAX),
        0,
        "at the end of time"
    );
}

#[test]
fn setpoints_come_at_the_set_rate_and_after_a_stall_in_no_burst() {
    let (controller, mut robot) = pair(100.0);
    for ms in 0..1000_u64 {
        robot.send(&SETPOINT, State::Holding, None, ms * 1000);
    }
    assert_eq!(robot.counts().sent, 100);
    robot.send(&SETPOINT, State::Holding, None, 10_000_000);
    for us in 0..5_000 {
        robot.send(&SETPOINT, State::Holding, None, 10_000_000 + us);
    }
    assert_eq!(robot.counts().sent, 101);
    let mut bytes = [0; 2048];
    for sequence in 0..101 {
        let (length, _) = controller.recv_from(&mut bytes).unwrap();
        let got: SetpointDatagram = serde_json::from_slice(&bytes[..length]).unwrap();
        assert_eq!((got.version, got.sequence), (1, sequence));
        assert_eq!((got.boot_id, got.age_us, got.quality), (None, None, None));
    }
}

fn wait_for(robot: &mut UdpRobot, counted: u64) -> Option<Feedback> {
    let mut newest = None;
    for _ in 0..2000 {
        newest = robot.heard(5_000_000).or(newest);
        if robot.counts().heard + robot.counts().refused >= counted {
            break;
        }
        std::thread::sleep(Duration::from_millis(1));
    }
    newest
}

#[test]
fn feedback_is_taken_from_the_named_controller_alone() {
    let (controller, mut robot) = pair(100.0);
    robot.send(&SETPOINT, State::Holding, None, 0);
    let mut bytes = [0; 2048];
    let (_, back) = controller.recv_from(&mut bytes).unwrap();
    let good = br#"{"version":1,"position_m":[0.1,0.2,0.3],"stiffness_n_per_m":[10,20,30],"age_us":4000,"more":"x"}"#;
    controller.send_to(good, back).unwrap();
    let told = wait_for(&mut robot, 1).unwrap();
    assert_eq!(
        told,
        Feedback {
            measured_us: 4_996_000,
            position_m: [0.1, 0.2, 0.3],
            stiffness_n_per_m: [10.0, 20.0, 30.0],
        }
    );
    let stranger = UdpSocket::bind("127.0.0.1:0").unwrap();
    stranger.send_to(good, back).unwrap();
    let long = vec![b' '; 4000];
    let bad: [&[u8]; 8] = [
        b"",
        b"\xff\x00",
        br#"{"version":2,"position_m":[0.1,0.2,0.3],"stiffness_n_per_m":[10,20,30]}"#,
        br#"{"version":1,"position_m":[0.1,0.2],"stiffness_n_per_m":[10,20,30]}"#,
        br#"{"version":1,"position_m":[1e999,0.2,0.3],"stiffness_n_per_m":[10,20,30]}"#,
        br#"{"version":1,"position_m":[0.1,0.2,0.3],"stiffness_n_per_m":[10,0,30]}"#,
        br#"{"version":1,"position_m":[0.1,0.2,0.3],"stiffness_n_per_m":[10,20,30],"age_us":99000000}"#,
        &long,
    ];
    for bytes in bad {
        controller.send_to(bytes, back).unwrap();
    }
    assert_eq!(wait_for(&mut robot, 10), None);
    assert_eq!((robot.counts().heard, robot.counts().refused), (1, 9));
}

#[test]
fn nothing_is_sent_to_whom_nobody_named() {
    assert_eq!(address("5005").unwrap(), "127.0.0.1:5005".parse().unwrap());
    assert_eq!(
        address("10.0.0.2:81").unwrap(),
        "10.0.0.2:81".parse().unwrap()
    );
    for text in ["", "robot:5005", "70000", "10.0.0.2", "-1"] {
        assert!(
            matches!(address(text), Err(UdpError::Address { .. })),
            "{text}"
        );
    }
    for text in [
        "127.0.0.1:0",
        "0.0.0.0:5",
        "255.255.255.255:5",
        "224.0.0.1:5",
        "[::]:5",
        "[ff02::1]:5",
    ] {
        let opened = UdpRobot::open(text.parse().unwrap(), 100.0);
        assert!(matches!(opened, Err(UdpError::NotOne { .. })), "{text}");
    }
    for rate_hz in [0.0, 0.5, 1001.0, f64::NAN] {
        let opened = UdpRobot::open("127.0.0.1:5".parse().unwrap(), rate_hz);
        assert!(matches!(opened, Err(UdpError::Rate { .. })));
    }
}

use std::net::UdpSocket;

use super::*;
use crate::live::SessionClock;

fn real(robot: Option<UdpRobot>) -> (Real, crate::live::Port) {
    let inputs = Inputs::new(SessionClock::start());
    let (port, wearable) = inputs.port();
    let parts = Parts {
        inputs,
        wearable,
        tracker: None,
        page: None,
        recorder: None,
        speaker: None,
        robot,
        passkeys: Passkeys::new(false),
        hands: None,
        keeper: Keeper::default(),
        disarm: Arc::default(),
        stop: Arc::default(),
        end_us: None,
        ends_with_hands: false,
        watch: Box::new(|_| {}),
    };
    (Real::new(parts), port)
}

fn robot_seen() -> Input {
    Input::Robot(RobotSeen {
        measured_us: 0,
        position_m: [0.5, 0.0, 0.4],
        stiffness_n_per_m: [200.0; 3],
    })
}

#[test]
fn learning_that_fails_inside_tells_so() {
    assert_eq!(surviving(|| Ok(vec![1])), Ok(vec![1]));
    assert_eq!(surviving(|| Err("no".to_owned())), Err("no".to_owned()));
    let told = surviving(|| panic!("the matrix {}", 7));
    assert!(told.is_err_and(|text| text.contains("the matrix 7")));
    let told = surviving(|| std::panic::panic_any(3_u8));
    assert!(told.is_err_and(|text| text.contains("no cause told")));
}

#[test]
fn what_waited_is_taken_at_the_time_it_is_taken() {
    let (mut real, port) = real(None);
    port.input_at(0, Input::Hand(None));
    std::thread::sleep(Duration::from_millis(30));
    let (at_us, input) = real.next().unwrap();
    assert_eq!(input, Some(Input::Hand(None)));
    assert!(at_us >= 30_000, "{at_us}");
}

#[test]
fn disarming_passes_all_that_waits() {
    let (mut real, port) = real(None);
    port.input(Input::Hand(None));
    real.disarm.store(true, Ordering::Relaxed);
    let next = |real: &mut Real| real.next().unwrap().1;
    assert_eq!(next(&mut real), Some(Input::Act(Act::Disarm)));
    assert_eq!(next(&mut real), Some(Input::Hand(None)));
}

#[test]
fn a_robot_elsewhere_is_spared_what_a_stall_left_out() {
    let stall = || std::thread::sleep(Duration::from_millis(30));
    let controller = UdpSocket::bind("127.0.0.1:0").unwrap();
    let robot = UdpRobot::open(controller.local_addr().unwrap(), 200.0).unwrap();
    let (mut elsewhere, port) = real(Some(robot));
    let stalled = |real: &mut Real| {
        let (at_us, input) = real.next().unwrap();
        let Some(Input::Stalled { since_us }) = input else {
            panic!("{input:?}");
        };
        assert!(since_us + 30_000 <= at_us);
        at_us
    };
    port.input(Input::Hand(None));
    stall();
    let at_us = stalled(&mut elsewhere);
    // Disarming passes what waits also where the program stalls once more.
    elsewhere.disarm.store(true, Ordering::Relaxed);
    stall();
    assert!(stalled(&mut elsewhere) >= at_us + 30_000);
    let next = |real: &mut Real| real.next().unwrap().1;
    assert_eq!(next(&mut elsewhere), Some(Input::Act(Act::Disarm)));
    assert_eq!(next(&mut elsewhere), Some(Input::Hand(None)));
    // The simulated arm's time goes on.
    let (mut simulated, _port) = real(None);
    stall();
    assert_eq!(next(&mut simulated), None);
}

#[test]
fn what_the_wearable_is_told_last_goes_out_before_its_source_ends() {
    let (mut real, port) = real(None);
    real.stop.store(true, Ordering::Relaxed);
    assert!(real.next().is_none());
    // The levels of before, as the engine sends them when it leaves.
    real.ask(0, Request::Frame(vec![7]));
    let source = std::thread::spawn(move || {
        let mut got = None;
        while !port.stopping() {
            std::thread::sleep(Duration::from_millis(20));
            got = got.or_else(|| port.request(Duration::ZERO));
        }
        got
    });
    let _left = real.finish();
    assert_eq!(source.join().unwrap(), Some(Request::Frame(vec![7])));
}

#[test]
fn a_recorded_robot_does_not_stand_for_the_one_that_is_commanded() {
    let (mut simulated, port) = real(None);
    port.input(robot_seen());
    assert_eq!(simulated.next().unwrap().1, Some(robot_seen()));
    let controller = UdpSocket::bind("127.0.0.1:0").unwrap();
    let robot = UdpRobot::open(controller.local_addr().unwrap(), 200.0).unwrap();
    let (mut elsewhere, port) = real(Some(robot));
    port.input(robot_seen());
    assert_eq!(elsewhere.next().unwrap().1, None);
}

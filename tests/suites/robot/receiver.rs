//! `docs/receiver.py` follows, holds and stops by its own clock, and drops what is old or broken.

use std::io::{BufRead, BufReader};
use std::net::UdpSocket;
use std::path::PathBuf;
use std::process::{Child, Command as Program, Stdio};
use std::sync::mpsc::{Receiver, channel};
use std::time::{Duration, Instant};

use tonus::robot::command::{Command, Quality};
use tonus::robot::gate::{Cause, State};
use tonus::robot::limits::Setpoint;
use tonus::robot::udp::{Feedback, UdpRobot};

const PATIENCE: Duration = Duration::from_secs(20);

struct Running {
    child: Child,
    /// Lines that it prints, and when.
    lines: Receiver<(Instant, String)>,
    port: u16,
}

impl Drop for Running {
    fn drop(&mut self) {
        // It may have ended by itself.
        let _ended = self.child.kill();
        let _status = self.child.wait();
    }
}

fn start() -> Running {
    let port = UdpSocket::bind("127.0.0.1:0")
        .unwrap()
        .local_addr()
        .unwrap()
        .port();
    let script = PathBuf::from(env!("CARGO_MANIFEST_DIR")).join("../docs/receiver.py");
    let mut child = Program::new("python3")
        .arg(script)
        .arg(port.to_string())
        .stdout(Stdio::piped())
        .spawn()
        .expect("python3 runs");
    let output = BufReader::new(child.stdout.take().unwrap());
    let (sender, lines) = channel();
    std::thread::spawn(move || {
        for line in output.lines().map_while(Result::ok) {
            if sender.send((Instant::now(), line)).is_err() {
                break;
            }
        }
    });
    Running { child, lines, port }
}

fn setpoint(x: f64) -> Setpoint {
    Setpoint {
        position_m: [x, 0.0, 0.3],
        velocity_m_per_s: [0.0; 3],
        stiffness_n_per_m: [300.0, 300.0, 400.0],
        damping_ratio: 1.0,
    }
}

fn command(now_us: u64) -> Command {
    Command {
        position_m: [0.4, 0.0, 0.3],
        velocity_m_per_s: [0.0; 3],
        stiffness_n_per_m: [300.0; 3],
        damping_ratio: 1.0,
        acquired_us: now_us,
        valid_until_us: now_us + 100_000,
        sequence: 1,
        boot_id: 1,
        quality: Quality::Good,
    }
}

/// The next line that begins with `word`, and when it came.
fn line(running: &Running, word: &str) -> (Instant, String) {
    loop {
        let (at, line) = running
            .lines
            .recv_timeout(PATIENCE)
            .unwrap_or_else(|_| panic!("no {word}"));
        if line.starts_with(word) {
            return (at, line);
        }
    }
}

#[test]
fn the_receiver_follows_holds_and_stops_by_its_own_clock() {
    let mut running = start();
    let mut robot = UdpRobot::open(
        format!("127.0.0.1:{}", running.port).parse().unwrap(),
        100.0,
    )
    .unwrap();
    let began = Instant::now();
    let now_us = || u64::try_from(began.elapsed().as_micros()).unwrap();
    // Whoever starts in the midst of it says nothing and does nothing.
    while began.elapsed() < Duration::from_secs(2) {
        let at_us = now_us();
        robot.send(
            &setpoint(0.5),
            State::Following,
            Some(&command(at_us)),
            at_us,
        );
        assert_eq!(robot.heard(at_us), None);
        std::thread::sleep(Duration::from_millis(2));
    }
    // Nobody armed it: it says where it is, and does nothing.
    while robot.heard(now_us()).is_none() {
        assert!(began.elapsed() < PATIENCE, "the receiver answers");
        robot.send(
            &setpoint(0.4),
            State::Disarmed(Cause::Start),
            None,
            now_us(),
        );
        std::thread::sleep(Duration::from_millis(2));
    }
    std::thread::sleep(Duration::from_millis(50));
    assert!(running.lines.try_recv().is_err(), "it does nothing");
    let mut told: Option<Feedback> = None;
    let mut last = began;
    while told.is_none_or(|told| told.position_m[0] < 0.45) && began.elapsed() < PATIENCE {
        let now_us = now_us();
        let x = 0.4 + 0.01 * began.elapsed().as_secs_f64().min(10.0);
        robot.send(
            &setpoint(x),
            State::Following,
            Some(&command(now_us)),
            now_us,
        );
        told = robot.heard(now_us).or(told);
        last = Instant::now();
        if told.is_some() && robot.counts().heard >= 20 {
            break;
        }
        std::thread::sleep(Duration::from_millis(2));
    }
    let told = told.expect("the receiver answers");
    assert!(told.position_m[0] >= 0.4 && told.stiffness_n_per_m == [300.0, 300.0, 400.0]);
    assert!(line(&running, "follow").1.contains("[300.0, 300.0, 400.0]"));
    // Silence: valid for 100 ms, then it holds; stops after half a second.
    let (held, _) = line(&running, "hold");
    let (stopped, _) = line(&running, "stop");
    let [held_s, stopped_s] = [held, stopped].map(|at| at.duration_since(last).as_secs_f64());
    println!("holds after {held_s:.3} s of silence, stops after {stopped_s:.3} s");
    assert!((0.08..0.4).contains(&held_s), "{held_s}");
    assert!((0.48..1.0).contains(&stopped_s), "{stopped_s}");
    assert!(
        running.child.wait().unwrap().success(),
        "it has ended and does not start again by itself"
    );
}

#[test]
fn what_is_old_broken_or_of_another_version_is_not_followed() {
    let running = start();
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let to = format!("127.0.0.1:{}", running.port);
    let datagram = |sequence: u64, version: u32, x: f64| {
        format!(
            r#"{{"version":{version},"sequence":{sequence},"valid_for_us":100000,"position_m":[{x},0,0],"velocity_m_per_s":[0,0,0],"stiffness_n_per_m":[100,100,100],"damping_ratio":1,"state":"following","quality":"good"}}"#
        )
    };
    let began = Instant::now();
    let mut sequence = 1000;
    socket
        .set_read_timeout(Some(Duration::from_millis(20)))
        .unwrap();
    let disarmed = datagram(1000, 1, 0.0)
        .replace("following", "disarmed")
        .replace("\"valid_for_us\":100000", "\"valid_for_us\":0");
    while socket.recv(&mut [0; 512]).is_err() {
        assert!(began.elapsed() < PATIENCE, "the receiver answers");
        socket.send_to(disarmed.as_bytes(), &to).unwrap();
    }
    let first = loop {
        assert!(began.elapsed() < PATIENCE, "the receiver follows");
        sequence += 1;
        socket
            .send_to(datagram(sequence, 1, 0.5).as_bytes(), &to)
            .unwrap();
        if let Ok((_, line)) = running.lines.recv_timeout(Duration::from_millis(20)) {
            break line;
        }
    };
    assert_eq!(first, "follow [[0.5, 0, 0], [100, 100, 100]]");
    for bad in [
        datagram(3, 1, 0.9),
        datagram(sequence, 1, 0.9),
        datagram(sequence + 10, 2, 0.9),
        "{".into(),
        "[]".into(),
        "null".into(),
        r#"{"version":1}"#.into(),
    ] {
        socket.send_to(bad.as_bytes(), &to).unwrap();
    }
    socket.send_to(&[0xff, 0xfe, 0x00], &to).unwrap();
    socket
        .send_to(datagram(sequence + 1, 1, 0.6).as_bytes(), &to)
        .unwrap();
    let (_, line) = line_with(&running, "0.6");
    assert_eq!(line, "follow [[0.6, 0, 0], [100, 100, 100]]");
}

/// The next line with this text; none before it may tell of what was not to be followed.
fn line_with(running: &Running, text: &str) -> (Instant, String) {
    loop {
        let (at, line) = running
            .lines
            .recv_timeout(PATIENCE)
            .unwrap_or_else(|_| panic!("no {text}"));
        assert!(!line.contains("0.9"), "{line}");
        if line.contains(text) {
            return (at, line);
        }
    }
}

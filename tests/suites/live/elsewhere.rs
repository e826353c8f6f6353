//! A robot elsewhere, in real time: nobody commands it before a person armed it, it is not lost from sight, and the last word
//! is that it is disarmed.

use std::cell::RefCell;
use std::net::UdpSocket;
use std::rc::Rc;
use std::sync::atomic::{AtomicBool, Ordering};
use std::sync::mpsc::{Receiver, Sender, channel};
use std::sync::{Arc, Mutex};
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tonus::config::Config;
use tonus::demo::{self, DemoConfig};
use tonus::live::{Act, View};
use tonus::source::LinkChoice;
use tonus::studio::hands::Hands;
use tonus::studio::keep::Keeper;
use tonus::studio::run::{Plan, run};

/// Where the robot stands before it is commanded: not where the program would have it.
const STANDS_M: [f64; 3] = [0.55, 0.15, 0.3];

/// What a controller heard, and when.
pub(crate) type Heard = Arc<Mutex<Vec<(Instant, Value)>>>;

/// A controller that follows what may be followed and says where it is while `talks`.
pub(crate) fn controller(heard: Heard, talks: Arc<AtomicBool>, over: Receiver<()>) -> u16 {
    let socket = UdpSocket::bind("127.0.0.1:0").unwrap();
    let port = socket.local_addr().unwrap().port();
    socket
        .set_read_timeout(Some(Duration::from_millis(20)))
        .unwrap();
    std::thread::spawn(move || {
        let (mut at_m, mut bytes) = (json!(STANDS_M), [0; 4096]);
        while over.try_recv().is_err() {
            let Ok((length, from)) = socket.recv_from(&mut bytes) else {
                continue;
            };
            let told: Value = serde_json::from_slice(&bytes[..length]).unwrap();
            if told["valid_for_us"].as_u64().unwrap() > 0 {
                at_m = told["position_m"].clone();
            }
            if talks.load(Ordering::Relaxed) {
                let answer = json!({ "version": 1, "position_m": at_m, "stiffness_n_per_m": [200, 200, 400] });
                socket.send_to(answer.to_string().as_bytes(), from).unwrap();
            }
            heard.lock().unwrap().push((Instant::now(), told));
        }
    });
    port
}

/// Arms, makes the robot fall silent, waits, arms again, and ends.
struct Person {
    talks: Arc<AtomicBool>,
    stop: Arc<AtomicBool>,
    /// What was done, and when.
    done: Rc<RefCell<Vec<(&'static str, Instant)>>>,
}

impl Hands for Person {
    fn look(&mut self, view: &View) -> Vec<Act> {
        let mut done = self.done.borrow_mut();
        let since = done.last().map_or(Duration::ZERO, |(_, at)| at.elapsed());
        let state = view.robot.state.as_str();
        let next = match done.len() {
            // Whoever presses Disarm, or records, has not armed: the robot stays its controller's.
            0 if view.at_us > 1_500_000 => Some(("disarm", Some(Act::Disarm))),
            1 if view.robot.can_arm && view.at_us > 3_000_000 => Some(("arm", Some(Act::Arm))),
            2 if since > Duration::from_millis(1_500) && state != "disarmed" => {
                self.talks.store(false, Ordering::Relaxed);
                Some(("silence", None))
            }
            3 if since > Duration::from_millis(1_500) => {
                self.talks.store(true, Ordering::Relaxed);
                Some(("speech", None))
            }
            4 if since > Duration::from_millis(1_000) && view.robot.can_arm => {
                Some(("arm again", Some(Act::Arm)))
            }
            5 if since > Duration::from_millis(800) && state != "disarmed" => {
                self.stop.store(true, Ordering::Relaxed);
                Some(("end", None))
            }
            _ => None,
        };
        let Some((what, act)) = next else {
            return Vec::new();
        };
        done.push((what, Instant::now()));
        act.into_iter().collect()
    }

    fn over(&self) -> bool {
        false
    }
}

pub(crate) fn plan(config: Config, person: impl Hands + 'static, stop: Arc<AtomicBool>) -> Plan {
    Plan {
        config,
        link: LinkChoice::Simulated,
        hands: Some(Box::new(person)),
        ends_with_hands: false,
        seconds: Some(40.0),
        record: None,
        page: false,
        lsl: false,
        library: Some(Arc::new(
            demo::learn_skills(&DemoConfig::default()).unwrap(),
        )),
        keeper: Keeper::default(),
        person: None,
        seed: 1,
        pace: 1.0,
        ask_passkey: Arc::new(|_| None),
        stop,
    }
}

#[test]
fn a_robot_elsewhere_is_commanded_from_arming_to_disarming_alone() {
    let heard = Heard::default();
    let talks = Arc::new(AtomicBool::new(true));
    let (over, ended): (Sender<()>, _) = channel();
    let port = controller(Arc::clone(&heard), Arc::clone(&talks), ended);
    let mut config = Config::default();
    config.robot.to = format!("udp:127.0.0.1:{port}");
    let stop = Arc::new(AtomicBool::new(false));
    let done = Rc::default();
    let person = Person {
        talks,
        stop: Arc::clone(&stop),
        done: Rc::clone(&done),
    };
    let plan = plan(config, person, stop);
    run(plan, |_| {}, |_| {}).unwrap();
    std::thread::sleep(Duration::from_millis(100));
    over.send(()).unwrap();
    let heard = heard.lock().unwrap();
    let done = done.borrow();
    let names: Vec<_> = done.iter().map(|(name, _)| *name).collect();
    assert_eq!(
        names,
        ["disarm", "arm", "silence", "speech", "arm again", "end"]
    );
    let at = |name| done.iter().find(|(done, _)| *done == name).unwrap().1;
    let between = |from: Instant, to: Instant| {
        let within = move |(when, _): &&(Instant, Value)| from <= *when && *when < to;
        heard.iter().filter(within).map(|(_, told)| told)
    };
    let begin = heard[0].0;

    // Before: nothing may be followed, and the place is the robot's own once it has told it.
    let before: Vec<_> = between(begin, at("arm")).collect();
    assert!(before.len() > 300, "{} datagrams", before.len());
    for told in &before {
        assert_eq!(
            (&told["state"], &told["valid_for_us"]),
            (&json!("disarmed"), &json!(0))
        );
    }
    assert!(
        before[100..]
            .iter()
            .all(|told| told["position_m"] == json!(STANDS_M))
    );

    // The first step after arming starts there.
    let armed = between(at("arm"), at("silence")).find(|told| told["state"] != "disarmed");
    let first = armed.expect("it is armed")["position_m"]
        .as_array()
        .unwrap();
    for (axis, stands) in STANDS_M.iter().enumerate() {
        let off = (first[axis].as_f64().unwrap() - stands).abs();
        assert!(off < 0.02, "axis {axis} is {off} m from where it stands");
    }

    // A robot that fell silent is disarmed within its half second, and not armed by speaking again.
    let late = at("silence") + Duration::from_millis(700);
    assert!(between(late, at("arm again")).count() > 100);
    assert!(between(late, at("arm again")).all(|told| told["state"] == "disarmed"));
    assert!(between(at("arm again"), at("end")).any(|told| told["state"] != "disarmed"));

    // The last word, said more than once.
    let last: Vec<_> = heard
        .iter()
        .rev()
        .take(4)
        .map(|(_, told)| &told["state"])
        .collect();
    assert_eq!(last, ["disarmed"; 4]);
}

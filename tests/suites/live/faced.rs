//! The wearable's attitude: of any heading at first, and of the shoulder's once the elbow was bent.

use nalgebra::{Quaternion, UnitQuaternion};
use tonus::live::{Act, Input, Prompt, Request, View};
use tonus::simulate::person::Arm;
use tonus::source::simulated::{SimulatedConfig, SimulatedDevices};
use tonus::studio::hands::Hands;
use tonus::studio::terminal::{Calibrates, Enter};
use tonus::studio::virtually::Someone;
use tonus_shared::wire::{Packet, StreamFlags, decode};

use crate::world::{run, somebody};

/// Where the upper arm is raised to about the horizontal, shoulder frame, metres.
const RAISED_M: [f64; 3] = [0.45, 0.1, 0.1];

struct Bends {
    hands: Calibrates,
    /// Holds the arm up when it should hang.
    raises: bool,
    /// The step with the bent elbow is over.
    bent: bool,
    bending: bool,
    measuring: bool,
    arm: Arm,
    newest: Option<UnitQuaternion<f64>>,
    /// Angle between what the wearable says of the upper arm and what is true, degrees, once it was bent.
    off_deg: Vec<f64>,
    /// Whether stiffness rested on it.
    counted: bool,
    warned: bool,
    messages: Vec<String>,
}

impl Bends {
    fn new(raises: bool) -> Self {
        Self {
            hands: Calibrates::new(somebody(), Enter::at_once(), Box::new(|_| {})),
            raises,
            bent: false,
            bending: false,
            measuring: false,
            arm: Arm::new().unwrap(),
            newest: None,
            off_deg: Vec::new(),
            counted: false,
            warned: false,
            messages: Vec::new(),
        }
    }
}

impl Someone for Bends {
    fn look(&mut self, view: &View) -> Vec<Act> {
        let step = view.calibration.step.as_ref();
        self.bending = step.is_some_and(|step| step.name == "fit_flex");
        self.measuring = self.bending && step.is_some_and(|step| step.measuring);
        self.bent |= self.bending && step.is_some_and(|step| step.done);
        let text = "which way is forward";
        self.warned = view.link.warnings.iter().any(|told| told.contains(text));
        for message in &view.messages {
            if !self.messages.contains(&message.text) {
                self.messages.push(message.text.clone());
            }
        }
        self.hands.look(view)
    }

    fn over(&self) -> bool {
        self.off_deg.len() > 200
    }

    fn meddle(&mut self, devices: &mut SimulatedDevices, now_us: u64) {
        if self.raises && self.measuring {
            // Once: a wish begins a movement.
            self.raises = false;
            let prompt = Prompt::Hold {
                hand_m: RAISED_M,
                force_n: [0.0; 3],
                effort: 0.2,
            };
            devices.ask(Request::Prompt(prompt), now_us);
        }
        if let Some(told) = self.newest.take()
            && let Some(xyzw) = self.arm.upper_arm_xyzw(devices.hand_m(now_us))
        {
            let truth = UnitQuaternion::from_quaternion(Quaternion::from(xyzw));
            self.off_deg.push(told.angle_to(&truth).to_degrees());
        }
    }

    fn input(&mut self, _at_us: u64, input: &Input) {
        let Input::Frame(bytes) = input else { return };
        let Ok(frame) = decode(bytes) else { return };
        match frame.packet {
            Packet::Orientation(told) if self.bent => {
                let told = UnitQuaternion::from_quaternion(Quaternion::from(told.xyzw));
                self.newest = Some(told.cast());
            }
            Packet::Stream(stream) => {
                let counts = stream.flags.contains(StreamFlags::ORIENTATION_SEEN);
                assert!(!counts || self.bending || self.bent, "before anybody knows");
                self.counted |= counts;
            }
            _ => {}
        }
    }
}

#[test]
fn a_bent_elbow_tells_the_wearable_where_forward_is() {
    for seed in 1..=4 {
        let devices = SimulatedConfig {
            seed,
            ..SimulatedConfig::default()
        };
        let seen = run(devices, Bends::new(false), 60);
        assert!(seen.counted && !seen.warned, "{:?}", seen.messages);
        // Packets are some milliseconds old, and the arm moves a little.
        let most = seen.off_deg.iter().copied().fold(0.0, f64::max);
        assert!(most < 3.0, "seed {seed}: {most} degrees");
        let knows = |text: &String| text.contains("knows where forward is");
        assert!(seen.messages.iter().any(knows), "{:?}", seen.messages);
    }
}

#[test]
fn a_raised_arm_tells_nothing_and_the_person_is_told_so() {
    let seen = run(SimulatedConfig::default(), Bends::new(true), 60);
    assert!(!seen.counted && seen.warned, "{:?}", seen.messages);
    let told = |text: &String| text.contains("did not hang");
    assert!(seen.messages.iter().any(told), "{:?}", seen.messages);
}

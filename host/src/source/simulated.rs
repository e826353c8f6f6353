//! A simulated person with a wearable, a hand tracker and a robot that shows its part: devices in session time.
//!
//! Every byte goes the way it goes with real devices: scans through the wearable's own signal path, frames over a lossy link
//! both ways. The wearable's clock runs by itself, off by [`SimulatedConfig::drift_ppm`], and the person does what the
//! engine's prompts ask.

use std::collections::VecDeque;
use std::f64::consts::PI;
use std::time::Duration;

use nalgebra::{Quaternion, UnitQuaternion, Vector3};
use rand::SeedableRng;
use rand_chacha::ChaCha8Rng;
use tonus_shared::pipeline::{Board, CalibrationError, illustrative};
use tonus_shared::sample::Scan;
use tonus_shared::stiffness::ParameterError;
use tonus_shared::wire::Muscle;

use crate::link::bridge::Bridge;
use crate::link::simulated::{LinkConditions, NotAProbability, SimulatedLink};
use crate::live::{
    HandSeen, Input, LinkEvent, Port, Prompt, Request, RobotSeen, Timed, TrackerEvent,
};
use crate::simulate::emg::{Electrodes, ElectrodesError, SCAN_US};
use crate::simulate::muscle::CHANNELS;
use crate::simulate::person::Arm;
use crate::simulate::puppet::{Puppet, Wish};
use crate::simulate::scripted;
use crate::simulate::tracker::{TrackedHand, Tracker, TrackerNoise};
use crate::transform::Shoulder;

/// Places of the electrodes.
const MUSCLES: [Muscle; CHANNELS] = [
    Muscle::BicepsShort,
    Muscle::BicepsLong,
    Muscle::TricepsLateral,
    Muscle::TricepsLong,
];
/// The link is up so long after the start, microseconds.
const UP_US: u64 = 200_000;
/// The robot that shows its part tells where it is so often, microseconds.
const ROBOT_EVERY_US: u64 = 10_000;
/// Where the hand is held, shoulder frame, metres: the upper arm hangs and the elbow is bent to about a right angle, forward.
const HELD_M: [f64; 3] = [0.32, 0.0, -0.27];
/// The attitude sensor tells every so many scans.
const ATTITUDE_EVERY: u64 = 10;
/// Muscles against a weight: those that work, and their antagonists.
const WORKING: f64 = 0.45;
const YIELDING: f64 = 0.06;
/// While a link is cut or the devices stand still, time is caught up with at most this, microseconds.
const LONGEST_STALL_US: u64 = 1_000_000;
/// The simulated tracker: a millimetre and a half of jitter, and a bias that wanders by three in a minute, as a tracker's
/// that is not moved.
pub const TRACKER: TrackerNoise = TrackerNoise {
    jitter_sd_m: 0.0015,
    bias_sd_m: 0.003,
    bias_time_s: 60.0,
};
/// Where the shoulder is in the simulated tracker's frame, which lies on the table as a real one: as
/// [`Shoulder::by_height`] has it for the right arm of a person of 1.75 m.
pub const SHOULDER: Shoulder = Shoulder {
    centre_m: [0.129 * 1.75, 0.22 * 1.75, 0.24 * 1.75],
    turned_left_rad: 0.0,
};

/// What is simulated.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct SimulatedConfig {
    /// Everything random follows from it.
    pub seed: u64,
    /// The links between wearable and host, both ways.
    pub link: LinkConditions,
    /// How much slower the wearable's clock runs than the host's, parts per million.
    pub drift_ppm: f64,
    /// Errors of the tracker.
    pub noise: TrackerNoise,
}

impl Default for SimulatedConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            link: LinkConditions {
                loss: 0.02,
                ..LinkConditions::default()
            },
            drift_ppm: 40.0,
            noise: TRACKER,
        }
    }
}

/// Why nothing can be simulated.
#[derive(Debug, thiserror::Error)]
pub enum SimulatedError {
    /// The electrodes.
    #[error(transparent)]
    Electrodes(#[from] ElectrodesError),
    /// The link.
    #[error(transparent)]
    Link(#[from] NotAProbability),
    /// The wearable.
    #[error(transparent)]
    Wearable(#[from] CalibrationError),
    /// The person's arm.
    #[error(transparent)]
    Person(#[from] ParameterError),
}

/// The devices.
#[derive(Debug)]
pub struct SimulatedDevices {
    config: SimulatedConfig,
    puppet: Puppet,
    person: Arm,
    electrodes: Electrodes,
    /// Of the attitude sensor's level frame against the shoulder frame: nobody knows it.
    heading_rad: f64,
    bridge: Bridge<CHANNELS>,
    up: SimulatedLink,
    down: SimulatedLink,
    tracker: Tracker,
    arriving: VecDeque<TrackedHand>,
    scans: u64,
    /// Scans before this one were not taken: the devices stood still.
    skipped_us: u64,
    robot_us: u64,
    began: bool,
    /// The link is cut.
    cut: bool,
    /// Everything from the wearable comes so much later.
    late_us: u64,
    /// The tracker is covered.
    covered: bool,
}

impl SimulatedDevices {
    /// Devices that start with session time.
    ///
    /// # Errors
    /// [`SimulatedError`]; none in practice but for a link that is none.
    pub fn new(config: SimulatedConfig) -> Result<Self, SimulatedError> {
        const RATES_HZ: &[u32] = &[1_000];
        let electrodes = Electrodes::new(config.seed)?;
        let mut rng = ChaCha8Rng::seed_from_u64(config.seed ^ 0x626f_6f74);
        let board = Board {
            boot_id: rand::RngExt::random(&mut rng),
            firmware_hash: [0; 8],
            adc: electrodes.scale(),
            rates_hz: RATES_HZ,
        };
        Ok(Self {
            puppet: Puppet::new(config.seed),
            person: Arm::new()?,
            electrodes,
            heading_rad: rand::RngExt::random_range(&mut rng, -PI..PI),
            bridge: Bridge::new(board, &illustrative(MUSCLES, 1_000))?,
            up: SimulatedLink::new(config.link, config.seed)?,
            down: SimulatedLink::new(config.link, !config.seed)?,
            tracker: Tracker::new(config.noise, config.seed),
            arriving: VecDeque::new(),
            scans: 0,
            skipped_us: 0,
            robot_us: 0,
            began: false,
            cut: false,
            late_us: 0,
            covered: false,
            config,
        })
    }

    /// Does what the engine asks for.
    pub fn ask(&mut self, request: Request, now_us: u64) {
        match request {
            Request::Frame(bytes) if self.cut => drop(bytes),
            Request::Frame(bytes) => self.down.push(&bytes, now_us),
            Request::Prompt(prompt) => {
                if let Some(wish) = self.wish(&prompt) {
                    self.puppet.wish(wish, now_us);
                }
            }
        }
    }

    fn wish(&mut self, prompt: &Prompt) -> Option<Wish> {
        let [all, flexing, stretching] = [
            [1.0; CHANNELS],
            [WORKING, WORKING, YIELDING, YIELDING],
            [YIELDING, YIELDING, WORKING, WORKING],
        ];
        let hold = |hand_m, activation| Some(Wish::Hold { hand_m, activation });
        match prompt {
            Prompt::Rest => Some(Wish::Rest),
            Prompt::Contract => Some(Wish::Contract),
            Prompt::Hold {
                hand_m,
                force_n,
                effort,
            } => {
                let activation = all.map(|full| full * effort);
                hold(
                    self.person.gives_way(*hand_m, *force_n, *effort),
                    activation,
                )
            }
            Prompt::Flex => hold(HELD_M, flexing),
            Prompt::Extend => hold(HELD_M, stretching),
            // The tracker sees the other hand there; this one has nothing to do with it.
            Prompt::TouchShoulder => hold([0.0; 3], [0.0; CHANNELS]),
            Prompt::TouchPoint { robot_m } => {
                hold(scripted::in_shoulder_frame(*robot_m), [0.0; CHANNELS])
            }
            Prompt::Perform { label } => Some(Wish::Perform(self.puppet.draw(label)?)),
            // They finish what they do.
            Prompt::Free => None,
        }
    }

    /// Cuts the link, as out of reach, or mends it.
    pub fn cut(&mut self, cut: bool) {
        self.cut = cut;
    }

    /// Holds back everything from the wearable for so long, as a queue on its way does.
    pub fn hold_back(&mut self, late_us: u64) {
        self.late_us = late_us;
    }

    /// Covers the tracker, which then sees no hand, or uncovers it.
    pub fn cover(&mut self, covered: bool) {
        self.covered = covered;
    }

    /// Session time of a scan, microseconds.
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "microseconds of days"
    )]
    fn scanned_us(&self, scan: u64) -> u64 {
        let us = (scan * SCAN_US) as f64 * (1.0 + self.config.drift_ppm * 1e-6);
        us as u64 + self.skipped_us
    }

    /// When, in session time, the scan with this device time was truly taken: for measuring, no part of the system looks.
    #[must_use]
    pub fn truly_us(&self, device_us: u64) -> u64 {
        self.scanned_us(device_us / SCAN_US)
    }

    /// Everything that reaches the host by `now_us`, in order of time.
    pub fn step(&mut self, now_us: u64) -> Vec<Timed> {
        let mut out = Vec::new();
        if !self.began && now_us >= UP_US {
            self.began = true;
            let mut event = |input| {
                out.push(Timed {
                    at_us: UP_US,
                    input,
                })
            };
            event(Input::Link(LinkEvent::Up {
                name: "simulated wearable".to_owned(),
                mtu: Some(247),
                interval_us: Some(7_500),
            }));
            event(Input::Tracker(TrackerEvent::Up {
                name: "simulated tracker".to_owned(),
            }));
        }
        let late_us = now_us.saturating_sub(self.scanned_us(self.scans));
        if late_us > LONGEST_STALL_US {
            self.skipped_us += late_us;
        }
        self.scan(now_us);
        self.track(now_us, &mut out);
        self.show(now_us, &mut out);
        while let Some(delivery) = self.up.poll(now_us.saturating_sub(self.late_us)) {
            if self.began && !self.cut {
                out.push(Timed {
                    at_us: delivery.at_us + self.late_us,
                    input: Input::Frame(delivery.bytes),
                });
            }
        }
        out.sort_by_key(|timed| timed.at_us);
        out
    }

    fn scan(&mut self, now_us: u64) {
        loop {
            let at_us = self.scanned_us(self.scans);
            if at_us > now_us {
                return;
            }
            self.requests(at_us);
            let scan = self.acquire(at_us);
            let up = &mut self.up;
            // Scans are numbered without repeats, so none is refused.
            let _never_refused = self.bridge.push_scan(&scan, |bytes| up.push(bytes, at_us));
            if self.scans.is_multiple_of(ATTITUDE_EVERY) {
                self.attitude(at_us);
            }
            self.scans += 1;
        }
    }

    fn requests(&mut self, at_us: u64) {
        let device_us = self.scans * SCAN_US;
        while let Some(delivery) = self.down.poll(at_us) {
            let up = &mut self.up;
            self.bridge
                .request(&delivery.bytes, device_us, |bytes| up.push(bytes, at_us));
        }
    }

    fn attitude(&mut self, at_us: u64) {
        let hand_m = self.puppet.truth(at_us).hand_m;
        let Some(upper_arm) = self.person.upper_arm_xyzw(hand_m) else {
            return;
        };
        let upper_arm = UnitQuaternion::from_quaternion(Quaternion::from(upper_arm));
        let told =
            UnitQuaternion::from_axis_angle(&Vector3::z_axis(), self.heading_rad) * upper_arm;
        #[allow(clippy::cast_possible_truncation, reason = "the packet carries f32")]
        let xyzw = <[f64; 4]>::from(told.coords).map(|part| part as f32);
        // Times rise with the scans, so none is refused.
        let _never_refused = self.bridge.set_attitude(xyzw, self.scans * SCAN_US);
    }

    fn acquire(&mut self, at_us: u64) -> Scan<CHANNELS> {
        const STEP_US: u64 = 2_000;
        const STEP_S: f64 = 2e-3;
        let truth = self.puppet.truth(at_us);
        let before_us = at_us.saturating_sub(STEP_US);
        let [a, b, c] =
            [before_us, at_us, at_us + STEP_US].map(|at_us| self.puppet.truth(at_us).hand_m);
        let acceleration =
            std::array::from_fn(|axis| (a[axis] - 2.0 * b[axis] + c[axis]) / (STEP_S * STEP_S));
        self.electrodes.scan(truth.activation, acceleration)
    }

    fn track(&mut self, now_us: u64, out: &mut Vec<Timed>) {
        while self.tracker.next_us() <= now_us {
            let exposed_us = self.tracker.next_us();
            let hand_m = self.puppet.truth(exposed_us).hand_m;
            match self.tracker.expose(hand_m).filter(|_| !self.covered) {
                Some(hand) => self.arriving.push_back(hand),
                None => out.push(Timed {
                    at_us: now_us,
                    input: Input::Hand(None),
                }),
            }
        }
        while self
            .arriving
            .front()
            .is_some_and(|hand| hand.arrived_us <= now_us)
        {
            let Some(hand) = self.arriving.pop_front() else {
                return;
            };
            out.push(Timed {
                at_us: hand.arrived_us,
                input: Input::Hand(Some(HandSeen {
                    exposed_us: hand.exposed_us,
                    position_m: SHOULDER.in_tracker_m(hand.position_m),
                })),
            });
        }
    }

    /// The robot's part of a movement that is shown.
    fn show(&mut self, now_us: u64, out: &mut Vec<Timed>) {
        while self.robot_us + ROBOT_EVERY_US <= now_us {
            self.robot_us += ROBOT_EVERY_US;
            let Some((action, s)) = self.puppet.showing(self.robot_us) else {
                continue;
            };
            let robot = scripted::robot(&action, s);
            out.push(Timed {
                at_us: self.robot_us,
                input: Input::Robot(RobotSeen {
                    measured_us: self.robot_us,
                    position_m: robot.position_m,
                    stiffness_n_per_m: robot.stiffness_n_per_m,
                }),
            });
        }
    }

    /// Where the hand truly is, shoulder frame, metres: for scoring alone.
    #[must_use]
    pub fn hand_m(&self, at_us: u64) -> [f64; 3] {
        self.puppet.truth(at_us).hand_m
    }

    /// What the person truly performs, for scoring alone.
    #[must_use]
    pub fn performing(&self, at_us: u64) -> Option<(&'static str, f64)> {
        let (action, s) = self.puppet.performing(at_us)?;
        Some((action.skill.label(), s))
    }
}

/// Runs the devices in real time until the program ends.
pub fn run(mut devices: SimulatedDevices, port: &Port) {
    /// Shorter than a scan.
    const NAP: Duration = Duration::from_micros(500);
    while !port.stopping() {
        while let Some(request) = port.request(Duration::ZERO) {
            devices.ask(request, port.now_us());
        }
        for timed in devices.step(port.now_us()) {
            port.input_at(timed.at_us, timed.input);
        }
        std::thread::sleep(NAP);
    }
}

//! What the gate must never do, worked out from what was told to it: none of its own constants, none of its own state but
//! whether it says that it is armed.

use tonus::robot::command::{Command, Quality};
use tonus::robot::gate::State;
use tonus::robot::limits::Setpoint;

const WORKSPACE_M: [[f64; 2]; 3] = [[0.1, 0.9], [-0.8, 0.8], [0.0, 1.0]];
const STIFFNESS_N_PER_M: [f64; 2] = [10.0, 3000.0];
const STIFFNESS_RATE: f64 = 3000.0;
const DAMPING: [f64; 2] = [0.5, 1.5];
const SPEED_M_PER_S: f64 = 1.0;
const FALLBACK_N_PER_M: [f64; 3] = [200.0, 200.0, 400.0];
const LONGEST_PERIOD_US: u64 = 10_000;
/// Rounding of sums and norms.
const ROUNDING: f64 = 1e-9;

/// Time as the gate must see it, and the newest command that it took.
#[derive(Default)]
pub(crate) struct Oracle {
    pub(crate) now_us: u64,
    ticked_us: u64,
    pub(crate) newest: Option<Command>,
    pub(crate) armed: bool,
    pub(crate) following: u64,
    pub(crate) holding: u64,
    pub(crate) falling_back: u64,
    pub(crate) disarmed: u64,
}

impl Oracle {
    pub(crate) fn tell_time(&mut self, now_us: u64) {
        self.now_us = self.now_us.max(now_us);
    }

    /// A person armed: the period starts anew.
    pub(crate) fn arm(&mut self) {
        let command = self.newest.expect("armed without a command");
        assert!(
            self.fresh(&command),
            "armed on {command:?} at {}",
            self.now_us
        );
        self.armed = true;
        self.ticked_us = self.now_us;
    }

    /// A command was taken: it must have been one to take.
    pub(crate) fn took(&mut self, command: &Command) {
        let numbers = command.position_m.iter().chain(&command.velocity_m_per_s);
        assert!(
            numbers
                .chain([&command.damping_ratio])
                .all(|x| x.is_finite()),
            "took {command:?}"
        );
        let positive = command
            .stiffness_n_per_m
            .iter()
            .chain([&command.damping_ratio]);
        assert!(
            positive.into_iter().all(|k| *k > 0.0 && k.is_finite()),
            "took {command:?}"
        );
        assert!(
            command.acquired_us <= self.now_us.saturating_add(5_000),
            "from the future: {command:?}"
        );
        if let Some(newest) = self.newest {
            let same_boot = newest.boot_id == command.boot_id;
            assert!(same_boot || !self.armed, "another boot while armed");
            if same_boot {
                let ahead = command.sequence.wrapping_sub(newest.sequence);
                assert!((1..1 << 31).contains(&ahead), "took {ahead} ahead");
                assert!(command.acquired_us >= newest.acquired_us, "older evidence");
            }
        }
        self.newest = Some(*command);
    }

    fn age_us(&self, command: &Command) -> u64 {
        self.now_us.saturating_sub(command.acquired_us)
    }

    fn fresh(&self, command: &Command) -> bool {
        self.age_us(command) <= 60_000
            && self.now_us < command.valid_until_us
            && command.quality == Quality::Good
    }

    /// One tick from `before` to `after`.
    pub(crate) fn ticked(&mut self, before: &Setpoint, after: &Setpoint, state: State) {
        let period_us = (self.now_us - self.ticked_us).min(LONGEST_PERIOD_US);
        self.ticked_us = self.now_us;
        let period_s = period_us as f64 * 1e-6;
        within(after);
        rates(before, after, period_s);
        let follows = state == State::Following;
        let fresh = self.newest.is_some_and(|command| self.fresh(&command));
        if follows {
            self.following += 1;
            assert!(
                self.armed && fresh,
                "follows {:?} at {}",
                self.newest,
                self.now_us
            );
            self.towards(before, after);
        } else {
            assert_eq!(after.position_m, before.position_m, "moves in {state:?}");
            assert_eq!(after.velocity_m_per_s, [0.0; 3], "keeps going in {state:?}");
        }
        match state {
            State::Following => {}
            State::Holding => {
                self.holding += 1;
                let age_us = self
                    .newest
                    .map_or(u64::MAX, |command| self.age_us(&command));
                assert!(
                    self.armed && age_us <= 100_000,
                    "holds on evidence {age_us} us old"
                );
                assert_eq!(
                    after.stiffness_n_per_m, before.stiffness_n_per_m,
                    "a hold changes no stiffness"
                );
            }
            State::FallingBack => {
                self.falling_back += 1;
                let age_us = self
                    .newest
                    .map_or(u64::MAX, |command| self.age_us(&command));
                assert!(
                    self.armed && age_us <= 500_000,
                    "armed on evidence {age_us} us old"
                );
                falls_back(before, after);
            }
            State::Disarmed(_) => {
                self.disarmed += 1;
                self.armed = false;
                falls_back(before, after);
            }
        }
        assert!(
            self.armed || matches!(state, State::Disarmed(_)),
            "armed by nobody"
        );
    }

    fn towards(&self, before: &Setpoint, after: &Setpoint) {
        let Some(command) = self.newest else { return };
        for (axis, [low, high]) in WORKSPACE_M.into_iter().enumerate() {
            let goal = command.position_m[axis].max(low).min(high);
            let (from, to) = (before.position_m[axis], after.position_m[axis]);
            assert!(
                (to - goal).abs() <= (from - goal).abs() + ROUNDING,
                "away from the command"
            );
            let [soft, firm] = STIFFNESS_N_PER_M;
            let goal = command.stiffness_n_per_m[axis].max(soft).min(firm);
            let (from, to) = (
                before.stiffness_n_per_m[axis],
                after.stiffness_n_per_m[axis],
            );
            assert!(
                (to - goal).abs() <= (from - goal).abs() + ROUNDING,
                "away from its stiffness"
            );
        }
    }
}

fn within(setpoint: &Setpoint) {
    let inside = |value: f64, [low, high]: [f64; 2]| value >= low && value <= high;
    for (axis, range) in WORKSPACE_M.into_iter().enumerate() {
        assert!(inside(setpoint.position_m[axis], range), "{setpoint:?}");
        assert!(
            inside(setpoint.stiffness_n_per_m[axis], STIFFNESS_N_PER_M),
            "{setpoint:?}"
        );
    }
    assert!(setpoint.damping_ratio >= DAMPING[0] && setpoint.damping_ratio <= DAMPING[1]);
    // NaN is below nothing.
    assert!(
        length(&setpoint.velocity_m_per_s) <= SPEED_M_PER_S + ROUNDING,
        "{setpoint:?}"
    );
}

fn rates(before: &Setpoint, after: &Setpoint, period_s: f64) {
    let way: [f64; 3] =
        std::array::from_fn(|axis| after.position_m[axis] - before.position_m[axis]);
    assert!(
        length(&way) <= SPEED_M_PER_S * period_s + ROUNDING,
        "{way:?} in {period_s} s"
    );
    for axis in 0..3 {
        let change = (after.stiffness_n_per_m[axis] - before.stiffness_n_per_m[axis]).abs();
        assert!(
            change <= STIFFNESS_RATE * period_s + ROUNDING,
            "{change} N/m in {period_s} s"
        );
    }
}

fn falls_back(before: &Setpoint, after: &Setpoint) {
    for (axis, goal) in FALLBACK_N_PER_M.into_iter().enumerate() {
        let (from, to) = (
            before.stiffness_n_per_m[axis],
            after.stiffness_n_per_m[axis],
        );
        assert!(
            (to - goal).abs() <= (from - goal).abs(),
            "not to the fallback"
        );
    }
}

fn length(vector: &[f64; 3]) -> f64 {
    vector.iter().map(|x| x * x).sum::<f64>().sqrt()
}

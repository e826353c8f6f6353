//! Ten million control periods with loss, bursts, duplicates, reordering, clock steps, numbers that are none, restarts,
//! stalls, disconnections and forged futures, while a person arms and disarms at random.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus::robot::gate::{Gate, State};
use tonus::robot::limits::{Fallback, Limits};

use super::link::Link;
use super::oracle::Oracle;

const STEPS: u32 = 10_000_000;

struct World {
    gate: Gate,
    oracle: Oracle,
    link: Link,
    rng: ChaCha8Rng,
    /// Real time, and what the host's clock is off by.
    time_us: u64,
    clock_off_us: i64,
    arms: u32,
    refused_arms: u32,
    taken: u64,
    refused: u64,
}

impl World {
    fn new(seed: u64) -> Self {
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        Self {
            gate: Gate::new(Limits::default(), Fallback::default(), [0.4, 0.0, 0.3]).unwrap(),
            oracle: Oracle::default(),
            link: Link::new(ChaCha8Rng::seed_from_u64(rng.random())),
            rng,
            time_us: 10_000_000,
            clock_off_us: 0,
            arms: 0,
            refused_arms: 0,
            taken: 0,
            refused: 0,
        }
    }

    /// What the host's clock says.
    fn now_us(&self) -> u64 {
        self.time_us.saturating_add_signed(self.clock_off_us)
    }

    fn step(&mut self) {
        self.pass_time();
        let now_us = self.now_us();
        self.oracle.tell_time(now_us);
        for command in self.link.arrivals(self.time_us) {
            let before = self.gate.setpoint();
            let armed = !matches!(self.gate.state(), State::Disarmed(_));
            if self.gate.offer(&command, now_us).is_ok() {
                self.taken += 1;
                self.oracle.took(&command);
            } else {
                self.refused += 1;
                if armed && matches!(self.gate.state(), State::Disarmed(_)) {
                    // Another boot: its commands count from now on.
                    self.oracle.armed = false;
                    self.oracle.newest = None;
                }
            }
            let after = self.gate.setpoint();
            assert_eq!(
                after.position_m, before.position_m,
                "an offer alone moves nothing"
            );
            assert_eq!(after.stiffness_n_per_m, before.stiffness_n_per_m);
        }
        self.act(now_us);
        let before = self.gate.setpoint();
        let after = self.gate.tick(now_us);
        self.oracle.ticked(&before, &after, self.gate.state());
    }

    fn pass_time(&mut self) {
        self.time_us += match self.rng.random_range(0..100_000_u32) {
            0 => self.rng.random_range(100_000..3_000_000),
            1..20 => self.rng.random_range(5_000..150_000),
            20..40 => 0,
            _ => self.rng.random_range(800..1_200),
        };
        match self.rng.random_range(0..1_000_000_u32) {
            0 => self.clock_off_us += self.rng.random_range(-2_000_000..2_000_000_i64),
            1..4 => self.clock_off_us += self.rng.random_range(-50_000..50_000_i64),
            // The clock is set right again.
            4..40 => self.clock_off_us = 0,
            _ => {}
        }
        if self.rng.random_bool(2e-6) {
            // A monotonic clock never goes back, so what ran ahead stays ahead: the host starts the session anew.
            self.restart_session();
        }
    }

    /// A new session: the clock from the beginning, a new gate, disarmed.
    fn restart_session(&mut self) {
        let place = self.gate.setpoint().position_m;
        self.gate = Gate::new(Limits::default(), Fallback::default(), place).unwrap();
        let counts = std::mem::take(&mut self.oracle);
        self.oracle.following = counts.following;
        self.oracle.holding = counts.holding;
        self.oracle.falling_back = counts.falling_back;
        self.oracle.disarmed = counts.disarmed;
        self.clock_off_us = 0;
        self.oracle.tell_time(self.time_us);
        let before = self.gate.setpoint();
        let after = self.gate.tick(self.time_us);
        assert_eq!(before.position_m, after.position_m);
        self.oracle.ticked(&before, &after, self.gate.state());
    }

    /// What a person and the link's ends do.
    fn act(&mut self, now_us: u64) {
        match self.rng.random_range(0..20_000_u32) {
            0..40 => {
                let disarmed = matches!(self.gate.state(), State::Disarmed(_));
                let place = self.place();
                match self.gate.arm(place, now_us) {
                    Ok(()) if disarmed => {
                        self.arms += 1;
                        assert!(place.iter().all(|x| x.is_finite()));
                        self.oracle.arm();
                    }
                    Ok(()) => {}
                    Err(_) => self.refused_arms += 1,
                }
            }
            40..42 => {
                self.gate.disarm();
                self.oracle.armed = false;
            }
            42..44 => {
                self.gate.disconnect();
                self.oracle.armed = false;
                self.oracle.newest = None;
            }
            44 => self.link.restart(),
            _ => {}
        }
    }

    /// Where the robot says that it is: mostly where it was told to be.
    fn place(&mut self) -> [f64; 3] {
        match self.rng.random_range(0..10_u32) {
            0 => [f64::NAN, 0.0, 0.3],
            1 => [2.0, 0.0, 0.3],
            _ => self.gate.setpoint().position_m,
        }
    }
}

#[test]
fn ten_million_steps_break_no_limit_and_nobody_but_a_person_arms() {
    let started = std::time::Instant::now();
    let mut world = World::new(20_261_126);
    for _ in 0..STEPS {
        world.step();
    }
    let oracle = &world.oracle;
    println!(
        "{STEPS} steps in {:.1} s: following {}, holding {}, falling back {}, disarmed {}; {} commands taken, {} refused; armed \
         {} times, refused {} times",
        started.elapsed().as_secs_f64(),
        oracle.following,
        oracle.holding,
        oracle.falling_back,
        oracle.disarmed,
        world.taken,
        world.refused,
        world.arms,
        world.refused_arms
    );
    // A test in which a state never comes says nothing of it.
    let steps = u64::from(STEPS);
    for (count, least) in [
        (oracle.following, steps / 10),
        (oracle.holding, steps / 1_000),
        (oracle.falling_back, steps / 1_000),
        (oracle.disarmed, steps / 100),
    ] {
        assert!(count > least, "{count}");
    }
    assert!(world.arms > 1_000 && world.refused_arms > 1_000);
    assert!(world.refused > 10_000 && world.taken > 100_000);
}

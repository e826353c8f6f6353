//! A source of commands on a link that does everything wrong: seeded, in the caller's time.

use rand::RngExt;
use rand_chacha::ChaCha8Rng;
use tonus::robot::command::{Command, Quality};

/// A command is made every so often, as stream packets come.
const INTERVAL_US: u64 = 10_000;

/// What is wrong at present; drawn anew now and then.
#[derive(Debug, Clone, Copy)]
struct Weather {
    lost: f64,
    doubled: f64,
    delay_us: u64,
    jitter_us: u64,
    spoiled: f64,
    forged: f64,
    bad_quality: f64,
}

const FAIR: Weather = Weather {
    lost: 0.0,
    doubled: 0.0,
    delay_us: 8_000,
    jitter_us: 4_000,
    spoiled: 0.0,
    forged: 0.0,
    bad_quality: 0.0,
};

pub(crate) struct Link {
    rng: ChaCha8Rng,
    weather: Weather,
    weather_until_us: u64,
    made_us: u64,
    sequence: u32,
    boot_id: u32,
    target_m: [f64; 3],
    /// Commands on their way, with the time that they arrive.
    under_way: Vec<(u64, Command)>,
    silent_until_us: u64,
}

impl Link {
    pub(crate) fn new(rng: ChaCha8Rng) -> Self {
        Self {
            rng,
            weather: FAIR,
            weather_until_us: 0,
            made_us: 0,
            // Wraps soon.
            sequence: u32::MAX - 1_000,
            boot_id: 1,
            target_m: [0.4, 0.0, 0.3],
            under_way: Vec::new(),
            silent_until_us: 0,
        }
    }

    /// The wearable restarts: another boot, numbers from the beginning.
    pub(crate) fn restart(&mut self) {
        self.boot_id = self.boot_id.wrapping_add(1);
        self.sequence = 0;
    }

    /// Commands that arrive up to `now_us`, in the order that the link likes.
    pub(crate) fn arrivals(&mut self, now_us: u64) -> Vec<Command> {
        if now_us >= self.weather_until_us {
            self.weather = self.drawn();
            self.weather_until_us = now_us + self.rng.random_range(200_000..5_000_000);
        }
        while self.made_us + INTERVAL_US <= now_us {
            self.made_us += INTERVAL_US;
            // After a long stall only the newest second is made.
            self.made_us = self.made_us.max(now_us.saturating_sub(1_000_000));
            self.make();
        }
        let (arrived, under_way) = self
            .under_way
            .iter()
            .partition(|(at_us, _)| *at_us <= now_us);
        self.under_way = under_way;
        let arrived: Vec<(u64, Command)> = arrived;
        arrived.into_iter().map(|(_, command)| command).collect()
    }

    fn drawn(&mut self) -> Weather {
        match self.rng.random_range(0..8) {
            0..4 => FAIR,
            4 => Weather {
                lost: 0.3,
                jitter_us: 60_000,
                ..FAIR
            },
            5 => Weather {
                doubled: 0.3,
                jitter_us: 200_000,
                delay_us: 40_000,
                ..FAIR
            },
            6 => Weather {
                spoiled: 0.3,
                forged: 0.1,
                bad_quality: 0.2,
                ..FAIR
            },
            _ => Weather {
                lost: 0.95,
                delay_us: 300_000,
                jitter_us: 400_000,
                ..FAIR
            },
        }
    }

    fn make(&mut self) {
        self.sequence = self.sequence.wrapping_add(1);
        if self.rng.random_bool(0.001) {
            self.silent_until_us = self.made_us + self.rng.random_range(50_000..2_000_000);
        }
        if self.made_us < self.silent_until_us || self.rng.random_bool(self.weather.lost) {
            return;
        }
        if self.rng.random_bool(0.02) {
            self.target_m = std::array::from_fn(|_| self.rng.random_range(-1.5..1.5));
        }
        let mut command = Command {
            position_m: self.target_m,
            velocity_m_per_s: std::array::from_fn(|_| self.rng.random_range(-2.0..2.0)),
            stiffness_n_per_m: std::array::from_fn(|_| self.rng.random_range(1.0..5_000.0)),
            damping_ratio: self.rng.random_range(0.1..3.0),
            acquired_us: self.made_us,
            valid_until_us: self.made_us + self.rng.random_range(20_000..200_000),
            sequence: self.sequence,
            boot_id: self.boot_id,
            quality: Quality::Good,
        };
        if self.rng.random_bool(self.weather.bad_quality) {
            command.quality = [Quality::Undecided, Quality::Novel, Quality::SignalFault]
                [self.rng.random_range(0..3)];
        }
        if self.rng.random_bool(self.weather.forged) {
            self.forge(&mut command);
        }
        if self.rng.random_bool(self.weather.spoiled) {
            self.spoil(&mut command);
        }
        let copies = if self.rng.random_bool(self.weather.doubled) {
            2
        } else {
            1
        };
        for _ in 0..copies {
            let late_us = self.weather.delay_us + self.rng.random_range(0..=self.weather.jitter_us);
            self.under_way.push((self.made_us + late_us, command));
        }
    }

    /// Times and numbers that no honest source sends.
    fn forge(&mut self, command: &mut Command) {
        match self.rng.random_range(0..5) {
            0 => command.acquired_us += self.rng.random_range(50_000..10_000_000),
            1 => command.acquired_us = u64::MAX,
            2 => {
                command.acquired_us = command
                    .acquired_us
                    .saturating_sub(self.rng.random_range(0..5_000_000))
            }
            3 => command.sequence = command.sequence.wrapping_add(self.rng.random()),
            _ => {
                command.valid_until_us = if self.rng.random_bool(0.5) {
                    0
                } else {
                    u64::MAX
                }
            }
        }
    }

    /// One number that is none, or absurd.
    fn spoil(&mut self, command: &mut Command) {
        const ABSURD: [f64; 8] = [
            f64::NAN,
            f64::INFINITY,
            f64::NEG_INFINITY,
            f64::MAX,
            f64::MIN,
            -1.0,
            0.0,
            f64::MIN_POSITIVE,
        ];
        let value = ABSURD[self.rng.random_range(0..ABSURD.len())];
        let axis = self.rng.random_range(0..3);
        match self.rng.random_range(0..4) {
            0 => command.position_m[axis] = value,
            1 => command.velocity_m_per_s[axis] = value,
            2 => command.stiffness_n_per_m[axis] = value,
            _ => command.damping_ratio = value,
        }
    }
}

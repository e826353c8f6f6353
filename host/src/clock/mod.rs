//! One device's clock in the host's time: the one room that compares time bases.
//!
//! *Device time* is what the sender wrote into a packet, in microseconds of its own clock; *host time* counts
//! microseconds of the host's monotonic clock. Nothing here reads a clock: arrivals carry their times.
//!
//! An arrival says `host = offset + (1 + skew) device + delay`, and a delay is never less than the shortest one that the
//! transport can do. So the line through device and host time is the highest that no arrival lies below (Moon, Skelly
//! and Towsley, *Estimation and removal of clock skew from network delay measurements*, INFOCOM 1999); packets that
//! were late, lost, repeated or overtaken do not move it.
//!
//! **What cannot be seen.** A delay that every packet has shifts the line and nothing shows it: it is subtracted as
//! configured, [`ClockConfig::transport_us`]. Round trips bound it: it is between 0 and [`Health::round_trip_us`], and
//! only an assumption (both ways alike: half of it) says where. The same holds for a shortest delay that creeps, as
//! when packets of one rate wait for connection events of another: over tens of seconds it looks like skew. Packets every
//! 10 ms at events every 15 ms cost up to the 5 ms by which the two can miss each other.
//!
//! A step of the device's clock and a step of the shortest delay are the same to a host that hears only arrivals. Either
//! starts the comparison anew ([`Notice::Stepped`]); steps of less than about 3 ms are followed without a notice within a
//! minute. A device that answers pings ([`ClockConfig::answers_pings`]) is not taken to have set its clock back only because
//! all arrivals are late ([`Notice::Late`]): what came late stays old as far as round trips became longer as well.

mod counter;
mod floor;
mod health;
mod lag;
mod round_trip;

use counter::Counter;
use floor::{Floor, MAX_JITTER_US, NOTICED_US};
use lag::Lag;
use round_trip::RoundTrips;

pub use health::{ClockError, Counts, Health, Mapped, Notice};
pub use round_trip::RoundTrip;

/// So many arrivals in a row under another boot id are a restart; fewer are garbage or stragglers.
const BOOT_CONFIRMATIONS: u32 = 3;
/// So many arrivals before their time, alike and close together, are a step.
const STEP_CONFIRMATIONS: u32 = 8;
/// How close together, microseconds.
const STEP_WITHIN_US: u64 = 1_000_000;
/// An arrival before its time by this much and twice the uncertainty is no better minimum but a step, microseconds;
/// before a rate is known it takes the longest jitter.
const EARLY_US: f64 = 2_000.0;
/// After a silence of this length the old line says nothing, microseconds.
const SILENCE_US: u64 = 60_000_000;

/// How one device's clock is read.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub struct ClockConfig {
    /// The shortest delay between the device time of a packet and its arrival, microseconds: what every packet takes at
    /// least. It cannot be observed; 0 maps every instant late by it.
    pub transport_us: u32,
    /// Bits of the device's counter of microseconds, 8 to 64: where it wraps to 0.
    pub counter_bits: u32,
    /// Whether the device answers pings over the same way as it sends. Then arrivals that are late, all of them and for
    /// good, are of a longer way until round trips refute it; otherwise they are of a clock that was set back.
    pub answers_pings: bool,
}

impl Default for ClockConfig {
    /// The wearable's counter of 64 bits, no delay, no pings.
    fn default() -> Self {
        Self {
            transport_us: 0,
            counter_bits: 64,
            answers_pings: false,
        }
    }
}

/// Compares one device's clock with the host's, arrival by arrival, in bounded memory.
#[derive(Debug, Clone)]
pub struct DeviceClock {
    config: ClockConfig,
    fit: Option<Fit>,
    stranger: Option<Stranger>,
    newest_arrival_us: u64,
    counts: Counts,
}

/// The comparison since the last new start.
#[derive(Debug, Clone)]
struct Fit {
    boot_id: u32,
    counter: Counter,
    /// Host time that host times are relative to.
    origin_us: u64,
    floor: Floor,
    round_trips: RoundTrips,
    early: Option<Early>,
    lag: Option<Lag>,
}

/// Arrivals before their time, so far.
#[derive(Debug, Clone, Copy)]
struct Early {
    count: u32,
    since_us: u64,
    lowest_us: f64,
    highest_us: f64,
}

/// A boot id that is not the one followed.
#[derive(Debug, Clone, Copy)]
struct Stranger {
    boot_id: u32,
    count: u32,
}

impl DeviceClock {
    /// Knows nothing yet.
    ///
    /// # Errors
    /// [`ClockError::CounterBits`].
    pub fn new(config: ClockConfig) -> Result<Self, ClockError> {
        if !(8..=64).contains(&config.counter_bits) {
            return Err(ClockError::CounterBits {
                got: config.counter_bits,
            });
        }
        Ok(Self {
            config,
            fit: None,
            stranger: None,
            newest_arrival_us: 0,
            counts: Counts::default(),
        })
    }

    /// A packet with this device time came at this host time. The device time may be any instant before the packet
    /// left: what lies between is delay.
    ///
    /// An arrival before one that was told already is refused and counted: arrivals are told as they come.
    pub fn arrived(&mut self, boot_id: u32, device_us: u64, arrived_us: u64) -> Option<Notice> {
        if arrived_us < self.newest_arrival_us {
            self.counts.refused += 1;
            return None;
        }
        let silence_us = arrived_us - self.newest_arrival_us;
        self.newest_arrival_us = arrived_us;
        let Some(fit) = &mut self.fit else {
            self.start(boot_id, device_us, arrived_us, 0.0);
            return Some(Notice::Started { boot_id });
        };
        if fit.boot_id != boot_id {
            return self.strange(boot_id, device_us, arrived_us);
        }
        self.stranger = None;
        if silence_us > SILENCE_US {
            let skew = fit.floor.skew();
            self.start(boot_id, device_us, arrived_us, skew);
            return Some(Notice::Resumed { silence_us });
        }
        let skew = fit.floor.skew();
        match fit.place(device_us, arrived_us, self.config.answers_pings) {
            Placed::Taken(notice) => {
                self.counts.taken += 1;
                notice
            }
            Placed::Refused => {
                self.counts.refused += 1;
                None
            }
            Placed::Stepped { by_us } => {
                self.start(boot_id, device_us, arrived_us, skew);
                Some(Notice::Stepped { by_us })
            }
            Placed::Late { lag, by_us } => {
                self.start(boot_id, device_us, arrived_us, skew);
                if let Some(fit) = &mut self.fit {
                    fit.lag = Some(lag);
                }
                by_us.map(|by_us| Notice::Late { by_us })
            }
        }
    }

    /// A ping came back: its reply is an arrival, and the whole bounds the transport's delay.
    ///
    /// # Errors
    /// [`ClockError::Impossible`] for times that contradict each other; nothing is taken from them.
    pub fn answered(
        &mut self,
        boot_id: u32,
        trip: &RoundTrip,
    ) -> Result<Option<Notice>, ClockError> {
        if let Err(error) = trip.check(self.config.counter_bits) {
            self.counts.refused += 1;
            return Err(error);
        }
        let taken = self.counts.taken;
        let notice = self.arrived(boot_id, trip.replied_us, trip.arrived_us);
        if self.counts.taken > taken
            && let Some(fit) = &mut self.fit
        {
            let received = fit.counter.since_origin(trip.received_us);
            let sent = trip.requested_us as f64 - fit.origin_us as f64;
            fit.round_trips.push(received, sent);
        }
        Ok(notice)
    }

    /// When, in host time, the device's clock stood at `device_us`.
    ///
    /// # Errors
    /// [`ClockError::UnknownBoot`] when that clock is not followed, [`ClockError::OutOfRange`] for an instant that host
    /// time does not have.
    pub fn host_us(&self, boot_id: u32, device_us: u64) -> Result<Mapped, ClockError> {
        let fit = self.followed(boot_id)?;
        let x = fit.counter.since_origin(device_us);
        let line = fit.floor.line();
        let way_us = f64::from(self.config.transport_us) + fit.lag_us();
        let at = fit.origin_us as f64 + line.host_us(x) - way_us;
        Ok(Mapped {
            at_us: in_range(at, device_us)?,
            uncertainty_us: fit.floor.uncertainty_us(x),
        })
    }

    /// What the device's clock shows at a host time: the inverse of [`DeviceClock::host_us`].
    ///
    /// # Errors
    /// As there.
    pub fn device_us(&self, boot_id: u32, host_us: u64) -> Result<Mapped, ClockError> {
        let fit = self.followed(boot_id)?;
        let way_us = f64::from(self.config.transport_us) + fit.lag_us();
        let h = host_us as f64 - fit.origin_us as f64 + way_us;
        let x = fit.floor.line().device_us(h);
        if !x.is_finite() || x.abs() > 1e18 {
            return Err(ClockError::OutOfRange { got_us: host_us });
        }
        Ok(Mapped {
            at_us: fit.counter.at(x.round() as i64),
            uncertainty_us: fit.floor.uncertainty_us(x),
        })
    }

    /// How the comparison stands; none before the first arrival.
    #[must_use]
    pub fn health(&self) -> Option<Health> {
        let fit = self.fit.as_ref()?;
        let x = fit.floor.newest_x();
        let line = fit.floor.line();
        Some(Health {
            boot_id: fit.boot_id,
            offset_us: fit.origin_us as f64 + line.host_us(x)
                - f64::from(self.config.transport_us)
                - fit.lag_us()
                - fit.counter.at(x as i64) as f64,
            rate_ppm: 1e6 * line.skew,
            residual_us: fit.floor.residual_us(),
            uncertainty_us: fit.floor.uncertainty_us(x),
            span_us: fit.floor.span_us(),
            round_trip_us: fit.round_trips.shortest_us(&line),
            late_us: fit.lag_us(),
            settled: fit.floor.settled(),
        })
    }

    /// What became of the arrivals so far.
    #[must_use]
    pub fn counts(&self) -> Counts {
        self.counts
    }

    fn followed(&self, boot_id: u32) -> Result<&Fit, ClockError> {
        self.fit
            .as_ref()
            .filter(|fit| fit.boot_id == boot_id)
            .ok_or(ClockError::UnknownBoot { got: boot_id })
    }

    /// An arrival under another boot id than the one followed.
    fn strange(&mut self, boot_id: u32, device_us: u64, arrived_us: u64) -> Option<Notice> {
        let known = self.stranger.filter(|known| known.boot_id == boot_id);
        let count = known.map_or(1, |known| known.count + 1);
        if count < BOOT_CONFIRMATIONS {
            self.stranger = Some(Stranger { boot_id, count });
            self.counts.refused += 1;
            return None;
        }
        // Another boot of the same crystal.
        let skew = self.fit.as_ref().map_or(0.0, |fit| fit.floor.skew());
        self.start(boot_id, device_us, arrived_us, skew);
        Some(Notice::Rebooted { boot_id })
    }

    fn start(&mut self, boot_id: u32, device_us: u64, arrived_us: u64, skew: f64) {
        self.counts.taken += 1;
        self.counts.starts += 1;
        self.stranger = None;
        self.fit = Some(Fit {
            boot_id,
            counter: Counter::starting_at(device_us, self.config.counter_bits),
            origin_us: arrived_us,
            floor: Floor::starting(skew),
            round_trips: RoundTrips::default(),
            early: None,
            lag: None,
        });
    }
}

/// What became of an arrival.
enum Placed {
    Taken(Option<Notice>),
    Refused,
    Stepped {
        by_us: f64,
    },
    /// A new start that keeps the line of before; by how much arrivals are late, if that is news.
    Late {
        lag: Lag,
        by_us: Option<f64>,
    },
}

impl Fit {
    fn place(&mut self, device_us: u64, arrived_us: u64, answers_pings: bool) -> Placed {
        let x = self.counter.since_origin(device_us);
        let h = (arrived_us - self.origin_us) as f64;
        let line = self.floor.line();
        let delay_us = h - line.host_us(x);
        let least_us = if self.floor.settled() {
            EARLY_US
        } else {
            MAX_JITTER_US
        } + 2.0 * self.floor.uncertainty_us(x);
        if delay_us < -least_us {
            return self.before_its_time((x, h), arrived_us, least_us);
        }
        self.counter.advance(device_us);
        match self.floor.push(x, h) {
            Some(by_us) if answers_pings => {
                let lag = match &self.lag {
                    Some(lag) => lag.moved(x, h),
                    None => {
                        // Those since it began to be late are of another clock, if it was set.
                        let until = h - NOTICED_US;
                        let usual_us = self.round_trips.shortest_until_us(&line, until);
                        Lag::starting(delay_us, line.skew, usual_us.unwrap_or(0.0).max(0.0))
                    }
                };
                Placed::Late {
                    lag,
                    by_us: Some(self.lag_us() - by_us),
                }
            }
            Some(by_us) => Placed::Stepped { by_us },
            None => Placed::Taken(self.weigh_lag()),
        }
    }

    /// How much older than by the line alone everything is, microseconds.
    fn lag_us(&self) -> f64 {
        let at = self.floor.newest_x();
        self.lag.map_or(0.0, |lag| lag.us(&self.floor.line(), at))
    }

    /// What round trips leave of a lag, and whether it is over.
    fn weigh_lag(&mut self) -> Option<Notice> {
        let (line, at) = (self.floor.line(), self.floor.newest_x());
        let lag = self.lag.as_mut()?;
        let shortest_us = self.round_trips.shortest_us(&line);
        let stepped = shortest_us.and_then(|shortest_us| lag.bound(&line, at, shortest_us));
        let told = lag.told();
        if lag.us(&line, at) <= EARLY_US {
            self.lag = None;
            if !told {
                return Some(Notice::Late { by_us: 0.0 });
            }
        }
        stepped.map(|by_us| Notice::Stepped { by_us })
    }

    /// An arrival that lies below the line: garbage when alone, a step when others like it follow. After a lag it may be the
    /// end of that, and no step.
    fn before_its_time(&mut self, (x, h): (f64, f64), arrived_us: u64, least_us: f64) -> Placed {
        let delay_us = h - self.floor.line().host_us(x);
        let fresh = Early {
            count: 1,
            since_us: arrived_us,
            lowest_us: delay_us,
            highest_us: delay_us,
        };
        let joined = self
            .early
            .filter(|early| arrived_us - early.since_us <= STEP_WITHIN_US)
            .map(|early| Early {
                count: early.count + 1,
                since_us: early.since_us,
                lowest_us: early.lowest_us.min(delay_us),
                highest_us: early.highest_us.max(delay_us),
            })
            .filter(|early| early.highest_us - early.lowest_us <= MAX_JITTER_US);
        let early = joined.unwrap_or(fresh);
        self.early = Some(early);
        if early.count < STEP_CONFIRMATIONS {
            return Placed::Refused;
        }
        let by_us = -early.lowest_us - self.lag_us();
        match self.lag {
            Some(lag) if by_us <= least_us => Placed::Late {
                lag: lag.moved(x, h),
                by_us: None,
            },
            _ => Placed::Stepped { by_us },
        }
    }
}

/// A host time as a whole number, if there is such a time.
fn in_range(at: f64, asked_us: u64) -> Result<u64, ClockError> {
    if (0.0..9e18).contains(&at) {
        Ok(at.round() as u64)
    } else {
        Err(ClockError::OutOfRange { got_us: asked_us })
    }
}

#[cfg(test)]
mod tests;

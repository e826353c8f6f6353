//! A radio link in virtual time: loss, delay, jitter, duplicates, overtaking and flipped bytes, seeded.
//!
//! Bluetooth Low Energy itself neither reorders nor corrupts what it delivers; other transports do, and a
//! receiver must stand both. The defaults are a fair Bluetooth link: one connection interval of delay,
//! up to one more of jitter, in order.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use std::collections::BTreeMap;
use thiserror::Error;

/// Packets that may be under way at once; beyond, the oldest is dropped and counted.
pub const CAPACITY: usize = 1024;

/// How bad the link is. Probabilities are per packet and independent.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct LinkConditions {
    /// Probability that a packet never arrives.
    pub loss: f64,
    /// Probability that a packet arrives twice.
    pub duplicate: f64,
    /// Probability that a packet may be overtaken: it comes two to four jitters late, out of order.
    pub reorder: f64,
    /// Probability that one to three bytes of a packet are changed.
    pub corrupt: f64,
    /// Delay of every packet, microseconds.
    pub delay_us: u64,
    /// Largest further delay, uniform, microseconds. Alone it never changes the order.
    pub jitter_us: u64,
}

impl Default for LinkConditions {
    fn default() -> Self {
        Self {
            loss: 0.0,
            duplicate: 0.0,
            reorder: 0.0,
            corrupt: 0.0,
            delay_us: 7_500,
            jitter_us: 7_500,
        }
    }
}

/// What became of the packets so far.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq)]
pub struct LinkCounters {
    /// Pushed in.
    pub sent: u64,
    /// Came out, duplicates counted.
    pub delivered: u64,
    /// Never to arrive.
    pub lost: u64,
    /// Scheduled a second time.
    pub duplicated: u64,
    /// Let be overtaken.
    pub reordered: u64,
    /// Changed under way (of those not lost).
    pub corrupted: u64,
    /// Dropped because [`CAPACITY`] packets were under way.
    pub overflowed: u64,
}

/// A probability that is none.
#[derive(Debug, Clone, Copy, PartialEq, Error)]
#[error("link condition `{name}` is {value}, it must be a probability from 0 to 1")]
pub struct NotAProbability {
    /// Field of [`LinkConditions`].
    pub name: &'static str,
    /// Its value.
    pub value: f64,
}

/// Bytes and when they came out of the link.
#[derive(Debug, Clone, PartialEq, Eq)]
pub struct Delivery {
    /// When, microseconds of virtual time: at most the `now_us` polled with.
    pub at_us: u64,
    /// The packet as delivered.
    pub bytes: Vec<u8>,
}

/// One direction of a link.
#[derive(Debug, Clone)]
pub struct SimulatedLink {
    conditions: LinkConditions,
    rng: ChaCha8Rng,
    /// Keyed by (time of delivery, order of scheduling): ties come out in the order they went in.
    under_way: BTreeMap<(u64, u64), Vec<u8>>,
    scheduled: u64,
    last_in_order_us: u64,
    counters: LinkCounters,
}

impl SimulatedLink {
    /// An empty link; equal seeds and equal pushes give equal deliveries.
    ///
    /// # Errors
    /// [`NotAProbability`] names the condition.
    pub fn new(conditions: LinkConditions, seed: u64) -> Result<Self, NotAProbability> {
        let LinkConditions {
            loss,
            duplicate,
            reorder,
            corrupt,
            ..
        } = conditions;
        for (name, value) in [
            ("loss", loss),
            ("duplicate", duplicate),
            ("reorder", reorder),
            ("corrupt", corrupt),
        ] {
            if !(0.0..=1.0).contains(&value) {
                return Err(NotAProbability { name, value });
            }
        }
        Ok(Self {
            conditions,
            rng: ChaCha8Rng::seed_from_u64(seed),
            under_way: BTreeMap::new(),
            scheduled: 0,
            last_in_order_us: 0,
            counters: LinkCounters::default(),
        })
    }

    /// What became of the packets so far.
    #[must_use]
    pub fn counters(&self) -> LinkCounters {
        self.counters
    }

    /// A packet enters at `now_us`.
    pub fn push(&mut self, bytes: &[u8], now_us: u64) {
        self.counters.sent += 1;
        // Every packet draws the same dice, whatever its fate: changing one condition changes no other fate.
        let [lost, twice, late, changed]: [f64; 4] = std::array::from_fn(|_| self.rng.random());
        let jitter_us = self.rng.random_range(0..=self.conditions.jitter_us);
        let extra_us = self
            .conditions
            .jitter_us
            .saturating_mul(2)
            .saturating_add(2 * jitter_us + 1);
        let mut damage: [(u64, u8); 3] =
            std::array::from_fn(|_| (self.rng.random(), self.rng.random_range(1..=255)));
        let flips = self.rng.random_range(1..=damage.len());

        let LinkConditions {
            loss,
            duplicate,
            reorder,
            corrupt,
            delay_us,
            ..
        } = self.conditions;
        if lost < loss {
            self.counters.lost += 1;
            return;
        }
        let mut bytes = bytes.to_vec();
        if changed < corrupt && !bytes.is_empty() {
            self.counters.corrupted += 1;
            flip(&mut bytes, &mut damage[..flips]);
        }
        let mut at_us = now_us.saturating_add(delay_us).saturating_add(jitter_us);
        if late < reorder {
            self.counters.reordered += 1;
            at_us = at_us.saturating_add(extra_us);
        } else {
            at_us = at_us.max(self.last_in_order_us);
            self.last_in_order_us = at_us;
        }
        if twice < duplicate {
            self.counters.duplicated += 1;
            self.schedule(at_us.saturating_add(extra_us), bytes.clone());
        }
        self.schedule(at_us, bytes);
    }

    /// The next packet due by `now_us`, earliest first; call until `None`.
    pub fn poll(&mut self, now_us: u64) -> Option<Delivery> {
        let first = self.under_way.first_entry()?;
        let at_us = first.key().0;
        if at_us > now_us {
            return None;
        }
        self.counters.delivered += 1;
        Some(Delivery {
            at_us,
            bytes: first.remove(),
        })
    }

    fn schedule(&mut self, at_us: u64, bytes: Vec<u8>) {
        if self.under_way.len() >= CAPACITY {
            self.under_way.pop_first();
            self.counters.overflowed += 1;
        }
        self.under_way.insert((at_us, self.scheduled), bytes);
        self.scheduled += 1;
    }
}

/// Changes bytes so that the packet surely differs: an exclusive or with a non-zero byte, at distinct places.
fn flip(bytes: &mut [u8], damage: &mut [(u64, u8)]) {
    let length = bytes.len() as u64;
    damage.iter_mut().for_each(|(place, _)| *place %= length);
    damage.sort_unstable();
    let mut last = None;
    for &mut (place, mask) in damage {
        if last == Some(place) {
            continue;
        }
        last = Some(place);
        if let Some(byte) = usize::try_from(place)
            .ok()
            .and_then(|place| bytes.get_mut(place))
        {
            *byte ^= mask;
        }
    }
}

#[cfg(test)]
mod tests;

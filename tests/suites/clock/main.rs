//! One device's clock in the host's time, against clocks whose relation is known: the figures of the safety
//! requirements, and properties over drift, steps, wraps, losses, repetitions, overtaking and garbage.
#![allow(clippy::unwrap_used, clippy::panic, reason = "test suite")]

use proptest::prelude::*;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus::clock::{ClockConfig, DeviceClock, Mapped, Notice, RoundTrip};
use tonus::link::simulated::{LinkConditions, SimulatedLink};
use tonus_tests::seeded;

mod late;

const BOOT: u32 = 0xB007;
/// A stream's packets leave so far apart, microseconds.
const PERIOD_US: u64 = 10_000;
const TRANSPORT_US: u32 = 7_500;
/// The host had been running for so long when the stream began, microseconds.
const HOST_BEGAN_US: u64 = 3_000_000;

/// A device whose clock is known: `phase + (1 + ppm / 1e6) host`, modulo its counter.
#[derive(Debug, Clone, Copy)]
struct Device {
    phase_us: u64,
    ppm: f64,
    bits: u32,
}

impl Device {
    fn shows(&self, host_us: u64) -> u64 {
        let gained = (self.ppm * 1e-6 * host_us as f64).round() as i64;
        let shown = self
            .phase_us
            .wrapping_add(host_us)
            .wrapping_add_signed(gained);
        shown & (u64::MAX >> (64 - self.bits))
    }

    fn clock(&self) -> DeviceClock {
        DeviceClock::new(ClockConfig {
            transport_us: TRANSPORT_US,
            counter_bits: self.bits,
            ..ClockConfig::default()
        })
        .unwrap()
    }
}

/// 5 % loss, and a jitter of two connection intervals of 15 ms.
fn two_intervals() -> LinkConditions {
    LinkConditions {
        loss: 0.05,
        delay_us: u64::from(TRANSPORT_US),
        jitter_us: 30_000,
        ..LinkConditions::default()
    }
}

/// A stream over a link: calls `arrived` with the host times of leaving and arriving.
fn stream(conditions: LinkConditions, seed: u64, seconds: u64, mut arrived: impl FnMut(u64, u64)) {
    let mut link = SimulatedLink::new(conditions, seed).unwrap();
    for k in 0..seconds * 1_000_000 / PERIOD_US {
        let now = HOST_BEGAN_US + k * PERIOD_US;
        link.push(&now.to_le_bytes(), now);
        while let Some(came) = link.poll(now) {
            arrived(
                u64::from_le_bytes(came.bytes.try_into().unwrap()),
                came.at_us,
            );
        }
    }
}

fn error_us(mapped: &Mapped, truth_us: u64) -> f64 {
    mapped.at_us as f64 - truth_us as f64
}

fn percentile(values: &mut [f64], share: f64) -> f64 {
    values.sort_by(f64::total_cmp);
    values[((values.len() - 1) as f64 * share).round() as usize]
}

/// Errors of the newest packet's time from 30 s on, absolute, microseconds, and how many were within the uncertainty
/// stated.
fn errors_after_30_s(
    device: Device,
    conditions: LinkConditions,
    seed: u64,
    seconds: u64,
) -> (Vec<f64>, usize, DeviceClock) {
    let mut clock = device.clock();
    let (mut errors, mut within) = (Vec::new(), 0);
    stream(conditions, seed, seconds, |left, came| {
        let shown = device.shows(left);
        clock.arrived(BOOT, shown, came);
        if came > HOST_BEGAN_US + 30_000_000 {
            let mapped = clock.host_us(BOOT, shown).unwrap();
            let error = error_us(&mapped, left).abs();
            within += usize::from(error <= mapped.uncertainty_us + 1.0);
            errors.push(error);
        }
    });
    (errors, within, clock)
}

#[test]
fn a_hundred_ppm_is_followed_to_a_millisecond() {
    let (mut all, mut within, mut worst_rate, mut residuals) = (Vec::new(), 0, 0.0_f64, Vec::new());
    for seed in 0..20 {
        for ppm in [-100.0, 100.0] {
            let device = Device {
                phase_us: 77_000_000 + seed,
                ppm,
                bits: 64,
            };
            let (errors, inside, clock) = errors_after_30_s(device, two_intervals(), seed, 60);
            all.extend(errors);
            within += inside;
            let health = clock.health().unwrap();
            // The host gains what the device loses.
            worst_rate = worst_rate.max((health.rate_ppm + ppm / (1.0 + 1e-6 * ppm)).abs());
            residuals.push(health.residual_us);
        }
    }
    let covered = within as f64 / all.len() as f64;
    let p95 = percentile(&mut all, 0.95);
    let largest = *all.last().unwrap();
    let residual = percentile(&mut residuals, 0.95);
    println!(
        "after 30 s: error p95 {p95:.0} us, largest {largest:.0} us; rate within {worst_rate:.1} ppm; \
         residual shown p95 {residual:.0} us; {:.1} % within the uncertainty shown",
        100.0 * covered
    );
    assert!(p95 <= 1_000.0 && residual <= 1_000.0);
    assert!(covered >= 0.95);
}

#[test]
fn both_directions_agree() {
    let device = Device {
        phase_us: 5,
        ppm: 80.0,
        bits: 64,
    };
    let (_, _, clock) = errors_after_30_s(device, two_intervals(), 3, 40);
    for host_us in (HOST_BEGAN_US..HOST_BEGAN_US + 40_000_000).step_by(1_234_567) {
        let shown = clock.device_us(BOOT, host_us).unwrap().at_us;
        let back = clock.host_us(BOOT, shown).unwrap().at_us;
        assert!(back.abs_diff(host_us) <= 1, "{host_us} came back as {back}");
        assert!(shown.abs_diff(device.shows(host_us)) <= 1_000);
    }
}

/// Packets that leave only at events of the link, every 15 ms of the host's time, a fifth of them one event later: the
/// shortest delay itself creeps over 5 ms as the two rates slide along each other, which no host can tell from skew.
#[test]
fn connection_events_cost_no_more_than_their_beat() {
    const BEAT_US: f64 = 5_000.0;
    let mut all = Vec::new();
    for (seed, ppm) in [(1, 100.0), (2, -100.0), (3, 20.0), (4, -20.0)] {
        let device = Device {
            phase_us: 9,
            ppm,
            bits: 64,
        };
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut clock = device.clock();
        for k in 0..18_000_u64 {
            // A whole number of the device's periods after it began.
            let left = (HOST_BEGAN_US as f64 + (k * PERIOD_US) as f64 / (1.0 + 1e-6 * ppm)) as u64;
            let events = 1 + u64::from(rng.random_bool(0.2));
            let came = (left / 15_000 + events) * 15_000 + u64::from(TRANSPORT_US);
            if rng.random_bool(0.05) {
                continue;
            }
            clock.arrived(BOOT, device.shows(left), came);
            if k > 3_000 {
                let mapped = clock.host_us(BOOT, device.shows(left)).unwrap();
                all.push(error_us(&mapped, left));
            }
        }
    }
    let (low, high) = (percentile(&mut all, 0.025), percentile(&mut all, 0.975));
    println!("at connection events of 15 ms: errors from {low:.0} to {high:.0} us");
    assert!(low >= -BEAT_US && high <= BEAT_US + 1_000.0);
}

#[test]
fn pings_find_the_shortest_round_trip() {
    let device = Device {
        phase_us: 1 << 40,
        ppm: -50.0,
        bits: 64,
    };
    let mut rng = ChaCha8Rng::seed_from_u64(11);
    let mut clock = device.clock();
    let (mut requests, mut next_ping) = (0, HOST_BEGAN_US);
    stream(two_intervals(), 11, 60, |left, came| {
        clock.arrived(BOOT, device.shows(left), came);
        if came > next_ping {
            // 2 ms and more there, 7.5 ms and more back; the answer is the newest arrival.
            let sent = came - 60_000;
            let received = sent + 2_000 + rng.random_range(0..15_000);
            let trip = RoundTrip {
                requested_us: sent,
                received_us: device.shows(received),
                replied_us: device.shows(received + 300),
                arrived_us: came,
            };
            clock.answered(BOOT, &trip).unwrap();
            requests += 1;
            next_ping = came + 500_000;
        }
    });
    let round_trip_us = clock.health().unwrap().round_trip_us.unwrap();
    let shortest = 2_000.0 + f64::from(TRANSPORT_US);
    assert!(requests > 100);
    // The earliest of 32 requests is late by half a millisecond on average.
    assert!(
        (shortest - 500.0..shortest + 2_500.0).contains(&round_trip_us),
        "{round_trip_us}"
    );
}

#[test]
fn a_restart_is_noticed_at_its_third_packet_and_learnt_anew() {
    let before = Device {
        phase_us: 1 << 33,
        ppm: 60.0,
        bits: 64,
    };
    let after = Device {
        phase_us: 0_u64.wrapping_sub(43_000_000),
        ..before
    };
    let mut clock = before.clock();
    let (mut notices, mut of_new, mut errors) = (Vec::new(), 0, Vec::new());
    stream(two_intervals(), 5, 80, |left, came| {
        let restarted = left >= HOST_BEGAN_US + 40_000_000;
        let (device, boot) = if restarted {
            (after, 99)
        } else {
            (before, BOOT)
        };
        of_new += u32::from(restarted);
        if let Some(notice) = clock.arrived(boot, device.shows(left), came) {
            notices.push((notice, of_new));
        }
        if left >= HOST_BEGAN_US + 70_000_000 {
            let mapped = clock.host_us(99, device.shows(left)).unwrap();
            errors.push(error_us(&mapped, left).abs());
        }
    });
    assert_eq!(
        notices,
        [
            (Notice::Started { boot_id: BOOT }, 0),
            (Notice::Rebooted { boot_id: 99 }, 3)
        ]
    );
    assert!(percentile(&mut errors, 0.95) <= 1_000.0);
}

/// What 95 % of the errors of one run stay below, microseconds. Errors of one run are alike, and one in hundreds lies
/// between 1 and 2 ms; over all runs it is 1 ms, above.
const OF_ONE_RUN_US: f64 = 2_000.0;

fn drifts() -> impl Strategy<Value = f64> {
    prop_oneof![20.0..500.0, -500.0..-20.0]
}

proptest! {
    #![proptest_config(seeded(24))]

    #[test]
    fn any_crystal_over_any_fair_link(
        ppm in drifts(), phase_us: u64, seed: u64,
        loss in 0.0..0.3, duplicate in 0.0..0.2, reorder in 0.0..0.2, jitter_us in 0_u64..30_000,
    ) {
        let device = Device { phase_us, ppm, bits: 64 };
        let conditions = LinkConditions { loss, duplicate, reorder, jitter_us, ..two_intervals() };
        let (mut errors, _, clock) = errors_after_30_s(device, conditions, seed, 45);
        let health = clock.health().unwrap();
        let p95 = percentile(&mut errors, 0.95);
        prop_assert!(p95 <= OF_ONE_RUN_US, "p95 {p95} us, {health:?}");
        prop_assert!((health.rate_ppm + ppm / (1.0 + 1e-6 * ppm)).abs() < 40.0, "{health:?}");
        prop_assert_eq!(clock.counts().starts, 1);
    }

    #[test]
    fn a_counter_of_32_bits_maps_as_one_of_64(
        ppm in drifts(), seed: u64, until_wrap_us in 0_u64..40_000_000,
    ) {
        let phase_us = (1_u64 << 32) - HOST_BEGAN_US - until_wrap_us;
        let wide = Device { phase_us: phase_us + (5 << 32), ppm, bits: 64 };
        let narrow = Device { phase_us, ppm, bits: 32 };
        let (of_wide, _, _) = errors_after_30_s(wide, two_intervals(), seed, 40);
        let (of_narrow, _, clock) = errors_after_30_s(narrow, two_intervals(), seed, 40);
        prop_assert_eq!(of_wide, of_narrow);
        prop_assert_eq!(clock.counts().starts, 1);
    }

    #[test]
    fn a_step_is_told_and_survived(
        ppm in drifts(), seed: u64, size_us in 40_000_i64..1_000_000_000, ahead: bool,
    ) {
        let by_us = if ahead { size_us } else { -size_us };
        let device = Device { phase_us: 1 << 42, ppm, bits: 64 };
        let stepped = Device { phase_us: device.phase_us.wrapping_add_signed(by_us), ..device };
        let at = HOST_BEGAN_US + 33_000_000;
        let mut clock = device.clock();
        let (mut told, mut errors) = (Vec::new(), Vec::new());
        stream(two_intervals(), seed, 75, |left, came| {
            let device = if left < at { device } else { stepped };
            if let Some(Notice::Stepped { by_us }) = clock.arrived(BOOT, device.shows(left), came) {
                told.push((by_us, came - at));
            }
            if left > at + 36_000_000 {
                let mapped = clock.host_us(BOOT, device.shows(left)).unwrap();
                errors.push(error_us(&mapped, left).abs());
            }
        });
        prop_assert_eq!(told.len(), 1, "{:?}", told);
        let (told_us, after_us) = told[0];
        // At once when packets come before their time; two whole buckets of two seconds when they are late.
        prop_assert!(after_us < if ahead { 300_000 } else { 6_500_000 }, "after {after_us} us");
        // Told in the host's microseconds, which differ from the device's by the drift.
        let tolerance = 15_000.0 + 600e-6 * size_us as f64;
        prop_assert!((told_us - by_us as f64).abs() < tolerance, "{told_us} for {by_us}");
        prop_assert!(percentile(&mut errors, 0.95) <= OF_ONE_RUN_US);
    }

    #[test]
    fn garbage_among_packets_moves_nothing(
        ppm in drifts(), seed: u64, share in 0.0..0.05,
    ) {
        let device = Device { phase_us: 1 << 41, ppm, bits: 64 };
        let mut rng = ChaCha8Rng::seed_from_u64(seed);
        let mut clock = device.clock();
        let mut errors = Vec::new();
        stream(two_intervals(), seed, 45, |left, came| {
            if rng.random_bool(share) {
                let bits = rng.random_range(0..64);
                clock.arrived(BOOT, rng.random::<u64>() >> bits, came);
            }
            if rng.random_bool(share) {
                clock.arrived(rng.random(), rng.random(), came);
            }
            clock.arrived(BOOT, device.shows(left), came);
            if left > HOST_BEGAN_US + 30_000_000 {
                let mapped = clock.host_us(BOOT, device.shows(left)).unwrap();
                errors.push(error_us(&mapped, left).abs());
            }
        });
        let p95 = percentile(&mut errors, 0.95);
        prop_assert!(p95 <= OF_ONE_RUN_US, "p95 {p95} us, {:?} {:?}", clock.health(), clock.counts());
    }

    #[test]
    fn nothing_that_is_told_breaks_it(
        bits in 8_u32..=64, answers_pings: bool,
        told in prop::collection::vec((0_u32..3, any::<u64>(), any::<u64>(), 0_u64..5_000_000, any::<bool>()), 1..400),
    ) {
        let config = ClockConfig { transport_us: TRANSPORT_US, counter_bits: bits, answers_pings };
        let mut clock = DeviceClock::new(config).unwrap();
        let mut now = 0_u64;
        for (boot, device_us, other, passed, wild) in told {
            now = if wild { other } else { now.saturating_add(passed) };
            clock.arrived(boot, device_us, now);
            let trip = RoundTrip {
                requested_us: now.saturating_sub(passed),
                received_us: device_us,
                replied_us: device_us.wrapping_add(other >> 40),
                arrived_us: now,
            };
            let _ = clock.answered(boot, &trip);
            if let Some(health) = clock.health() {
                let shown = [health.offset_us, health.rate_ppm, health.residual_us, health.uncertainty_us];
                prop_assert!(shown.iter().all(|value| value.is_finite()), "{health:?}");
                prop_assert!(health.rate_ppm.abs() <= 600.0 + 1e-9);
                let _ = (clock.host_us(health.boot_id, other), clock.device_us(health.boot_id, other));
            }
        }
    }
}

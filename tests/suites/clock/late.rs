//! Everything comes later than it did: a longer way, or a clock that was set back. Only round trips tell them apart.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus::clock::{ClockConfig, DeviceClock, Notice, RoundTrip};

use super::{
    BOOT, Device, HOST_BEGAN_US, OF_ONE_RUN_US, TRANSPORT_US, error_us, percentile, stream,
    two_intervals,
};

/// How a device that answers a ping each second is followed: `late_us` tells by how much everything that left at an instant is
/// late, `device` whose clock then shows what. Calls `each` with the clock, the instant of leaving, what was told, and the
/// error of the newest packet's time, microseconds.
fn with_pings(
    seed: u64,
    seconds: u64,
    device: impl Fn(u64) -> Device,
    late_us: impl Fn(u64) -> u64,
    mut each: impl FnMut(u64, Option<Notice>, f64),
) {
    let config = ClockConfig {
        transport_us: TRANSPORT_US,
        answers_pings: true,
        ..ClockConfig::default()
    };
    let mut clock = DeviceClock::new(config).unwrap();
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let (mut newest, mut next_ping) = (0, HOST_BEGAN_US);
    stream(two_intervals(), seed, seconds, |left, came| {
        let came = came + late_us(left);
        if came < newest {
            return; // overtaken by one that was not late
        }
        newest = came;
        let shown = device(left).shows(left);
        let notice = if left >= next_ping {
            next_ping = left + 1_000_000;
            // Its way there is as the way back without what is late.
            let there_us = u64::from(TRANSPORT_US) + rng.random_range(0..30_000);
            let trip = RoundTrip {
                requested_us: left - there_us,
                received_us: shown,
                replied_us: shown,
                arrived_us: came,
            };
            clock.answered(BOOT, &trip).unwrap()
        } else {
            clock.arrived(BOOT, shown, came)
        };
        // Before the host began is no time of the host's.
        let mapped = clock.host_us(BOOT, shown);
        let error = mapped.map_or(f64::NEG_INFINITY, |mapped| error_us(&mapped, left));
        each(left - HOST_BEGAN_US, notice, error);
    });
}

/// A radio, or a program before it, that holds everything back by 300 ms for two minutes: what comes is that old, all the
/// time, and no clock stepped.
#[test]
fn a_lag_that_round_trips_show_never_becomes_fresh() {
    for (seed, ppm) in [(1, 100.0), (2, -100.0), (3, 20.0), (4, 0.0)] {
        let device = Device {
            phase_us: 1 << 40,
            ppm,
            bits: 64,
        };
        let lags = HOST_BEGAN_US + 40_000_000..HOST_BEGAN_US + 160_000_000;
        let late_us = |left: u64| if lags.contains(&left) { 300_000 } else { 0 };
        let (mut told, mut after) = (Vec::new(), Vec::new());
        with_pings(
            seed,
            220,
            |_| device,
            late_us,
            |at_us, notice, error| {
                if let Some(notice) = notice {
                    told.push((at_us, notice));
                }
                if at_us > 40_000_000 {
                    // As old as the truth says; nothing ever seems younger by more than the clock's figures allow.
                    assert!(
                        error < 5_000.0,
                        "{ppm} ppm, {at_us} us: {error} us too young"
                    );
                }
                if at_us > 200_000_000 {
                    after.push(error.abs());
                }
            },
        );
        println!(
            "{ppm} ppm: {told:?}, at last p95 {:.0} us",
            percentile(&mut after, 0.95)
        );
        assert!(
            !told
                .iter()
                .any(|(_, notice)| matches!(notice, Notice::Stepped { .. })),
            "{told:?}"
        );
        let late: Vec<f64> = (told.iter())
            .filter_map(|(_, notice)| match notice {
                Notice::Late { by_us } => Some(*by_us),
                _ => None,
            })
            .collect();
        assert!((late[0] - 300_000.0).abs() < 30_000.0, "{told:?}");
        assert_eq!(late.last(), Some(&0.0), "{told:?}");
        assert!(percentile(&mut after, 0.95) <= OF_ONE_RUN_US);
    }
}

/// A clock that was set back makes packets late as well, and no round trip longer.
#[test]
fn a_clock_that_was_set_back_is_followed_once_round_trips_say_so() {
    for (seed, size_us) in [
        (1, 60_000_u64),
        (2, 300_000),
        (3, 5_000_000),
        (4, 1_000_000_000),
    ] {
        let device = Device {
            phase_us: 1 << 40,
            ppm: 60.0,
            bits: 64,
        };
        let set = Device {
            phase_us: device.phase_us - size_us,
            ..device
        };
        let of = |left: u64| {
            if left < HOST_BEGAN_US + 40_000_000 {
                device
            } else {
                set
            }
        };
        let (mut told, mut after) = (Vec::new(), Vec::new());
        with_pings(
            seed,
            140,
            of,
            |_| 0,
            |at_us, notice, error| {
                if let Some(Notice::Stepped { by_us }) = notice {
                    told.push((at_us - 40_000_000, by_us));
                }
                if at_us > 110_000_000 {
                    after.push(error);
                }
            },
        );
        let p95 = percentile(&mut after.iter().map(|e| e.abs()).collect::<Vec<_>>(), 0.95);
        println!("set back by {size_us} us: told {told:?}, p95 at last {p95:.0} us");
        assert_eq!(told.len(), 1, "{told:?}");
        // Two whole buckets of two seconds, and a ping or two.
        assert!(told[0].0 < 9_000_000, "{told:?}");
        // What is left of doubt makes packets older, and is at most what the shortest of some round trips wander.
        assert!(after.iter().all(|error| *error < OF_ONE_RUN_US));
        assert!(p95 <= 5_000.0, "{p95}");
    }
}

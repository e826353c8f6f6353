//! Closed forms: clocks without jitter, and lines that can be drawn by hand.

use super::counter::{Counter, signed_difference};
use super::floor::Floor;
use super::{ClockConfig, ClockError, DeviceClock, Notice, RoundTrip};

const BOOT: u32 = 7;

fn clock(config: ClockConfig) -> DeviceClock {
    DeviceClock::new(config).unwrap()
}

/// A clock that was told a stream without jitter: device time `offset + k * 10 ms`, each arriving 4 ms after it left, on
/// a host whose clock gains 100 parts per million.
fn steady(config: ClockConfig) -> DeviceClock {
    let mut clock = clock(config);
    for k in 0..1_000_u64 {
        clock.arrived(BOOT, 5_000_000 + 10_000 * k, 1_004_000 + 10_001 * k);
    }
    clock
}

#[test]
fn without_jitter_the_line_is_exact() {
    let clock = steady(ClockConfig::default());
    let health = clock.health().unwrap();
    assert!((health.rate_ppm - 100.0).abs() < 1e-3, "{health:?}");
    assert!(health.residual_us < 1e-3 && health.settled, "{health:?}");
    // The line holds the shortest delay: nothing on this side tells 4 ms of transport from 4 ms of offset.
    let mapped = clock.host_us(BOOT, 5_000_000 + 10_000 * 500).unwrap();
    assert_eq!(mapped.at_us, 1_004_000 + 10_001 * 500);
    let newest_device = 5_000_000.0 + 10_000.0 * 999.0;
    let newest_host = 1_004_000.0 + 10_001.0 * 999.0;
    assert!((health.offset_us - (newest_host - newest_device)).abs() < 1e-3);
}

#[test]
fn the_configured_transport_is_taken_off() {
    let clock = steady(ClockConfig {
        transport_us: 4_000,
        ..ClockConfig::default()
    });
    let mapped = clock.host_us(BOOT, 5_000_000).unwrap();
    assert_eq!(mapped.at_us, 1_000_000);
    assert_eq!(clock.device_us(BOOT, 1_000_000).unwrap().at_us, 5_000_000);
    let later = clock.device_us(BOOT, 1_000_000 + 10_001 * 700).unwrap();
    assert_eq!(later.at_us, 5_000_000 + 10_000 * 700);
}

#[test]
fn a_round_trip_bounds_the_transport() {
    let mut clock = steady(ClockConfig::default());
    // 3 ms there, held for 2 ms, 4 ms back; device and host both 10 s and 10.001 s on.
    let received_us = 5_000_000 + 10_000_000;
    let trip = RoundTrip {
        requested_us: 1_000_000 + 10_001_000 - 3_000,
        received_us,
        replied_us: received_us + 2_000,
        arrived_us: 1_000_000 + 10_001_000 + 2_000 + 4_000,
    };
    assert_eq!(clock.answered(BOOT, &trip), Ok(None));
    let round_trip_us = clock.health().unwrap().round_trip_us.unwrap();
    assert!((round_trip_us - 7_000.0).abs() < 1.0, "{round_trip_us}");
}

#[test]
fn pings_that_contradict_themselves_are_refused() {
    let mut clock = steady(ClockConfig::default());
    let before = clock.health();
    let good = RoundTrip {
        requested_us: 12_000_000,
        received_us: 16_000_000,
        replied_us: 16_001_000,
        arrived_us: 12_008_000,
    };
    let bad = [
        RoundTrip {
            arrived_us: 11_999_999,
            ..good
        },
        RoundTrip {
            replied_us: 15_999_999,
            ..good
        },
        RoundTrip {
            replied_us: 16_009_000,
            ..good
        },
    ];
    for trip in bad {
        let refused = clock.answered(BOOT, &trip);
        assert!(
            matches!(refused, Err(ClockError::Impossible { trip: named, .. }) if named == trip)
        );
    }
    assert_eq!(clock.counts().refused, 3);
    assert_eq!(clock.health(), before);
}

#[test]
fn the_line_goes_below_all_points_and_nearest_to_them() {
    let mut floor = Floor::starting(0.0);
    // One arrival in each bucket, at 0, 3, 6, 9 and 12 s, with delays of 9, 1, 5, 2 and 8 ms; the first is the origin.
    // Below the mean device time lies the edge from the second to the fourth: 1 ms in 6 s.
    for (seconds, delay_ms) in [(3.0, 1.0), (6.0, 5.0), (9.0, 2.0), (12.0, 8.0)] {
        let x = 1e6 * seconds;
        assert_eq!(floor.push(x, x + 1e3 * (delay_ms - 9.0)), None);
    }
    let line = floor.line();
    assert!((line.skew - 1e3 / 6e6).abs() < 1e-12, "{line:?}");
    assert!((line.host_us(3e6) - (3e6 - 8e3)).abs() < 1e-6, "{line:?}");
    assert!((line.host_us(9e6) - (9e6 - 7e3)).abs() < 1e-6, "{line:?}");
    assert!((line.device_us(line.host_us(3e6)) - 3e6).abs() < 1e-6);
}

#[test]
fn counters_wrap() {
    assert_eq!(signed_difference(5, 0xFFFF_FFFE, 32), 7);
    assert_eq!(signed_difference(0xFFFF_FFFE, 5, 32), -7);
    assert_eq!(signed_difference(1, u64::MAX, 64), 2);
    let mut counter = Counter::starting_at(0xFFFF_FF00, 32);
    counter.advance(0x100);
    assert_eq!(counter.since_origin(0x100), 512.0);
    assert_eq!(counter.since_origin(0xFFFF_FF80), 128.0);
    assert_eq!((counter.at(0), counter.at(512)), (0xFFFF_FF00, 0x100));
}

#[test]
fn a_counter_of_no_such_width_is_refused() {
    for counter_bits in [0, 7, 65] {
        let config = ClockConfig {
            counter_bits,
            ..ClockConfig::default()
        };
        let refused = DeviceClock::new(config).map(|_| ());
        assert_eq!(refused, Err(ClockError::CounterBits { got: counter_bits }));
    }
}

#[test]
fn a_boot_must_be_followed_to_be_mapped() {
    let mut clock = clock(ClockConfig::default());
    let unknown = |boot_id| Err(ClockError::UnknownBoot { got: boot_id });
    assert_eq!(clock.host_us(BOOT, 0), unknown(BOOT));
    let started = Some(Notice::Started { boot_id: BOOT });
    assert_eq!(clock.arrived(BOOT, 1_000, 50_000), started);
    assert_eq!(clock.host_us(8, 0), unknown(8));
    // A device time from before the host's beginning.
    assert!(matches!(
        clock.host_us(BOOT, 1_000_u64.wrapping_sub(60_000)),
        Err(ClockError::OutOfRange { .. })
    ));
    // Two arrivals of another boot are not yet a restart, and one of the old takes them back.
    for _ in 0..2 {
        assert_eq!(clock.arrived(8, 0, 60_000), None);
        assert_eq!(clock.arrived(8, 0, 60_000), None);
        assert_eq!(clock.arrived(BOOT, 11_000, 60_000), None);
    }
    assert_eq!(clock.arrived(8, 0, 70_000), None);
    assert_eq!(clock.arrived(8, 10_000, 80_000), None);
    let rebooted = Some(Notice::Rebooted { boot_id: 8 });
    assert_eq!(clock.arrived(8, 20_000, 90_000), rebooted);
    assert_eq!(clock.host_us(8, 20_000).unwrap().at_us, 90_000);
    assert_eq!(clock.host_us(BOOT, 11_000), unknown(BOOT));
}

#[test]
fn a_long_silence_starts_anew_and_times_that_go_back_are_refused() {
    let mut clock = steady(ClockConfig::default());
    assert_eq!(clock.arrived(BOOT, 15_000_000, 1_000), None);
    assert_eq!(clock.counts().refused, 1);
    let newest = 1_004_000 + 10_001 * 999;
    let silence_us = 60_000_001;
    let resumed = Some(Notice::Resumed { silence_us });
    assert_eq!(
        clock.arrived(BOOT, 80_000_000, newest + silence_us),
        resumed
    );
    assert_eq!(clock.counts().starts, 2);
}

use super::*;

const BUFFER_US: u64 = 5_000;

fn clock() -> ScanClock {
    ScanClock::new(1_000, 5)
}

#[test]
fn regular_buffers_are_evenly_spaced_from_the_first_end() {
    let mut clock = clock();
    for number in 0..1_000_u32 {
        let end_us = 20_000 + BUFFER_US * u64::from(number);
        let expected = Block {
            first_index: 5 * number,
            first_acquired_us: end_us - 4_000,
            lost: 0,
        };
        assert_eq!(clock.buffer_full(end_us), expected);
    }
}

#[test]
fn whole_buffers_that_were_overwritten_are_counted_and_skipped() {
    let mut clock = clock();
    clock.buffer_full(20_000);
    let block = clock.buffer_full(20_000 + 4 * BUFFER_US);
    let expected = Block {
        first_index: 5 + 15,
        first_acquired_us: 36_000,
        lost: 15,
    };
    assert_eq!(block, expected);
    assert_eq!(clock.buffer_full(20_000 + 5 * BUFFER_US).lost, 0);
}

#[test]
fn a_buffer_seen_two_milliseconds_late_is_not_a_lost_one() {
    let mut clock = clock();
    clock.buffer_full(20_000);
    let late = clock.buffer_full(27_000);
    assert_eq!((late.first_index, late.lost), (5, 0));
    assert_eq!(late.first_acquired_us, 21_000 + 2_000 / 16);
}

#[test]
fn follows_100_ppm_of_drift_to_a_sixteenth_of_jitter() {
    // Ends at the scan timer's pace, which is 100 ppm slow; seen 0 to 99 us late.
    for ppm in [-100_i64, 100] {
        let mut clock = clock();
        let mut last_us = 0;
        for number in 0..12_000_i64 {
            let end_us = 1_000_000 + number * 5_000 + number * 5_000 * ppm / 1_000_000;
            let seen_us = end_us + number * 37 % 100;
            let block = clock.buffer_full(u64::try_from(seen_us).unwrap());
            assert_eq!(i64::from(block.first_index), number * 5);
            assert_eq!(block.lost, 0);
            assert!(block.first_acquired_us > last_us, "device time goes on");
            last_us = block.first_acquired_us + 4_000;
            let error_us = i64::try_from(last_us).unwrap() - end_us;
            // Mean lateness 50 us, drift 0.5 us per buffer followed 16 buffers behind.
            assert!((0..=110).contains(&error_us), "{error_us} us at {number}");
        }
    }
}

#[test]
fn the_index_wraps() {
    let mut clock = ScanClock {
        next_index: u32::MAX - 1,
        ..clock()
    };
    assert_eq!(clock.buffer_full(10_000).first_index, u32::MAX - 1);
    assert_eq!(clock.buffer_full(15_000).first_index, 3);
}

#[test]
fn times_at_the_ends_of_their_range_do_not_overflow() {
    let mut early = clock();
    assert_eq!(early.buffer_full(0).first_acquired_us, 0);
    let mut late = clock();
    late.buffer_full(0);
    late.buffer_full(u64::MAX / 2);
}

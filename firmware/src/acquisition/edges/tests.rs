use super::*;

/// Seeded, so that a failure repeats (SplitMix64).
struct Draw(u64);

impl Draw {
    fn next(&mut self) -> u64 {
        self.0 = self.0.wrapping_add(0x9e37_79b9_7f4a_7c15);
        let mut z = self.0;
        z = (z ^ (z >> 30)).wrapping_mul(0xbf58_476d_1ce4_e5b9);
        z = (z ^ (z >> 27)).wrapping_mul(0x94d0_49bb_1331_11eb);
        z ^ (z >> 31)
    }

    fn below(&mut self, bound: u64) -> u64 {
        self.next() % bound
    }

    fn within(&mut self, bound: f64) -> f64 {
        (self.next() as f64 / u64::MAX as f64 * 2.0 - 1.0) * bound
    }
}

/// What two crystals show of a moment of true time: the timer's count and the device clock.
#[derive(Clone, Copy)]
struct Clocks {
    timer_start: u32,
    timer_ppm: f64,
    device_ppm: f64,
}

impl Clocks {
    fn ticks(&self, true_us: f64) -> u32 {
        let ticks = true_us * 16.0 * (1.0 + self.timer_ppm * 1e-6);
        (ticks as u64 as u32).wrapping_add(self.timer_start)
    }

    fn device_us(&self, true_us: f64) -> f64 {
        true_us * (1.0 + self.device_ppm * 1e-6)
    }

    /// The device clock counts in steps of 1/32768 s.
    fn shown_us(&self, true_us: f64) -> u64 {
        let steps = (self.device_us(true_us) * 32_768e-6).floor();
        (steps / 32_768e-6) as u64
    }

    fn edge(&self, edge_us: f64, latency_us: f64) -> Edge {
        let seen_us = edge_us + latency_us;
        Edge {
            captured: self.ticks(edge_us),
            seen: self.ticks(seen_us),
            seen_us: self.shown_us(seen_us),
        }
    }
}

#[test]
fn every_scan_keeps_its_number_through_jitter_gaps_drift_and_wrap() {
    for seed in 0..40 {
        let mut draw = Draw(seed);
        let clocks = Clocks {
            // Wraps within the first 10 s, and again every 268 s.
            timer_start: u32::MAX - draw.below(160_000_000) as u32,
            timer_ppm: draw.within(50.0),
            device_ppm: draw.within(50.0),
        };
        let nominal_us = if seed % 2 == 0 { 1_000.0 } else { 500.0 };
        let mut period_us = nominal_us * (1.0 + draw.within(0.025));
        let mut clock = EdgeClock::new(nominal_us as u32, 16);
        let mut edge_us = 1e6 + draw.below(1_000) as f64;
        let mut number = 0_u32;
        let mut last: Option<(u32, u64)> = None;
        for _ in 0..30_000 {
            let stamp = clock
                .edge(&clocks.edge(edge_us, draw.below(700) as f64))
                .unwrap();
            assert_eq!(stamp.index, number, "seed {seed}");
            if let Some((last_index, last_us)) = last {
                assert_eq!(stamp.lost, number - last_index - 1, "seed {seed}");
                assert!(
                    stamp.acquired_us > last_us,
                    "seed {seed}: device time goes on"
                );
            }
            let error_us = stamp.acquired_us as f64 - clocks.device_us(edge_us);
            // One step of the device clock, the drift of 16 scans, a fraction of a microsecond twice.
            assert!(
                (-34.0..=4.0).contains(&error_us),
                "seed {seed}: {error_us} us at {number}"
            );
            last = Some((number, stamp.acquired_us));
            // Its temperature drifts the oscillator; the edge itself jitters by a tick.
            period_us *= 1.0 + draw.within(1e-6);
            let gap = match draw.below(200) {
                0 if number > 500 => draw.below(2_000) as u32,
                1 => draw.below(3) as u32,
                _ => 0,
            };
            number += 1 + gap;
            edge_us += period_us * f64::from(1 + gap) + draw.within(0.06);
        }
    }
}

#[test]
fn literal_edges() {
    let mut clock = EdgeClock::new(1_000, 16);
    let edge = |captured, seen_us| Edge {
        captured,
        seen: captured + 160,
        seen_us,
    };
    let stamp = |index, acquired_us, lost| Stamp {
        index,
        acquired_us,
        lost,
    };
    // Seen 10 us after each edge.
    assert_eq!(clock.edge(&edge(500, 5_010)), Some(stamp(0, 5_000, 0)));
    assert_eq!(clock.edge(&edge(16_500, 6_010)), Some(stamp(1, 6_000, 0)));
    assert_eq!(clock.edge(&edge(48_500, 8_010)), Some(stamp(3, 8_000, 1)));
    assert_eq!(
        clock.edge(&edge(50_500, 8_135)),
        None,
        "an eighth of a period"
    );
    assert_eq!(clock.edge(&edge(64_500, 9_010)), Some(stamp(4, 9_000, 0)));
    // 20 periods later, and 250 us late: the converter was restarted.
    assert_eq!(
        clock.edge(&edge(388_500, 29_260)),
        Some(stamp(24, 29_250, 19))
    );
    assert_eq!(
        clock.edge(&edge(404_500, 30_260)),
        Some(stamp(25, 30_250, 0))
    );
}

#[test]
fn a_gap_longer_than_the_timer_is_told_by_the_device_clock() {
    // 600 s: a 16 MHz timer of 32 bits wraps after 268 s.
    let clocks = Clocks {
        timer_start: 0,
        timer_ppm: 0.0,
        device_ppm: 0.0,
    };
    let mut clock = EdgeClock::new(1_000, 16);
    assert_eq!(clock.edge(&clocks.edge(1e6, 0.0)).unwrap().index, 0);
    let stamp = clock.edge(&clocks.edge(601e6, 0.0)).unwrap();
    assert_eq!((stamp.index, stamp.lost), (600_000, 599_999));
    assert!((600_999_960..=601_000_000).contains(&stamp.acquired_us));
}

#[test]
fn impossible_clocks_do_not_overflow_or_run_back() {
    let ends = [0, 1, u32::MAX / 2, u32::MAX];
    let times = [0, 1, 1 << 40, (1 << 55) - 1];
    for captured in ends {
        for seen in ends {
            for seen_us in times {
                let mut clock = EdgeClock::new(500, 16);
                let first = clock
                    .edge(&Edge {
                        captured: 0,
                        seen: 0,
                        seen_us: 1_000,
                    })
                    .unwrap();
                let edge = Edge {
                    captured,
                    seen,
                    seen_us,
                };
                if let Some(stamp) = clock.edge(&edge) {
                    assert!(stamp.acquired_us > first.acquired_us, "{edge:?}");
                }
            }
        }
    }
}

#[test]
fn the_index_wraps() {
    let mut clock = EdgeClock::new(1_000, 1);
    clock.last = Some(Last {
        captured: 0,
        index: u32::MAX,
        acquired: 7_000 << FRACTION,
    });
    let edge = Edge {
        captured: 2_000,
        seen: 2_000,
        seen_us: 9_000,
    };
    let stamp = clock.edge(&edge).unwrap();
    assert_eq!((stamp.index, stamp.lost), (1, 1));
}

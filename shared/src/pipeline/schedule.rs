//! When packets are due, counted in scans.

/// Stream packets per second.
pub const STREAM_HZ: u32 = 100;

/// Ticks between two configuration packets, and between two status packets.
const SLOW_TICKS: u64 = STREAM_HZ as u64;
/// Status comes half a second after configuration, so that the two never meet.
const STATUS_OFFSET_TICKS: u64 = SLOW_TICKS / 2;

/// What a scan makes due.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub(super) struct Due {
    pub(super) stream: bool,
    pub(super) configuration: bool,
    pub(super) status: bool,
}

/// Phase of the stream, in whole numbers: scan n makes tick `floor(100 n / rate)` due, so that packet k comes with
/// scan `ceil(k rate / 100)` for ever, whatever the rate. The rate is taken to a thousandth of a hertz.
#[derive(Clone, Copy, Debug)]
pub(super) struct Schedule {
    rate_mhz: u64,
    /// Thousandths of a tick-hertz since the last tick; below `rate_mhz` between scans.
    phase: u64,
    ticks: u64,
}

/// What one scan adds to the phase.
const STEP: u64 = STREAM_HZ as u64 * 1_000;

impl Schedule {
    /// `rate_hz` has passed the filter design: 200 to 2000.
    pub(super) fn new(rate_hz: f64) -> Self {
        let rate_mhz = libm::round(rate_hz * 1e3) as u64;
        Self {
            rate_mhz,
            phase: rate_mhz.saturating_sub(STEP),
            ticks: 0,
        }
    }

    /// Goes on at another rate from where the phase stands.
    pub(super) fn set_rate(&mut self, rate_hz: f64) {
        let rate_mhz = libm::round(rate_hz * 1e3) as u64;
        self.phase = self.phase * rate_mhz / self.rate_mhz.max(1);
        self.rate_mhz = rate_mhz;
    }

    /// Advances by one scan and the `missed` ones before it: the grid stays, several ticks at once are one packet.
    pub(super) fn advance(&mut self, missed: u32) -> Due {
        self.phase += (u64::from(missed) + 1) * STEP;
        if self.phase < self.rate_mhz {
            return Due::default();
        }
        let passed = self.phase / self.rate_mhz.max(1);
        self.phase %= self.rate_mhz.max(1);
        let before = self.ticks;
        self.ticks += passed;
        // Tick 0 is the first: before it no multiple has been passed.
        let crossed = |offset: u64| {
            (self.ticks + SLOW_TICKS - 1 - offset) / SLOW_TICKS
                > (before + SLOW_TICKS - 1 - offset) / SLOW_TICKS
        };
        Due {
            stream: passed > 0,
            configuration: crossed(0),
            status: crossed(STATUS_OFFSET_TICKS),
        }
    }
}

#[cfg(test)]
mod tests {
    use super::Schedule;

    #[test]
    fn slow_packets_come_once_a_second_and_never_together() {
        let mut schedule = Schedule::new(200.0);
        for scan in 0..1_000 {
            let due = schedule.advance(0);
            assert_eq!(due.stream, scan % 2 == 0);
            assert_eq!(due.configuration, scan % 200 == 0);
            assert_eq!(due.status, scan % 200 == 100);
        }
    }

    #[test]
    fn another_rate_keeps_the_grid_of_time() {
        let mut schedule = Schedule::new(1_000.0);
        let before = (0..15).filter(|_| schedule.advance(0).stream).count();
        assert_eq!(before, 2, "at 0 and 10 ms");
        // 14 ms have passed; at 500 scans a second the next tick, 20 ms, is the third scan away, then every fifth.
        schedule.set_rate(500.0);
        let ticks: [bool; 13] = core::array::from_fn(|_| schedule.advance(0).stream);
        let expected: [bool; 13] = core::array::from_fn(|scan| scan % 5 == 2);
        assert_eq!(ticks, expected);
        let mut same = Schedule::new(1_234.5);
        same.advance(0);
        let unchanged = same;
        same.set_rate(1_234.5);
        assert_eq!(same.phase, unchanged.phase);
    }

    #[test]
    fn a_gap_keeps_the_grid() {
        let mut schedule = Schedule::new(1_000.0);
        assert!(schedule.advance(0).stream);
        let due = schedule.advance(1_234);
        assert!(due.stream && due.configuration && due.status);
        // Scan 1235 came last; the grid's next packet is scan 1240.
        for scan in 1_236..1_250 {
            assert_eq!(schedule.advance(0).stream, scan % 10 == 0, "scan {scan}");
        }
    }
}

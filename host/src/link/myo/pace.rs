//! When the armband's samples were taken: it numbers and times nothing.
//!
//! Samples are counted, 5 ms each. What is missing shows in two ways: packets go round four characteristics, so that
//! up to three lost in a row are known at once; and of whole rounds (40 ms) that are lost, the packets since are late by so much, for
//! good. A stalled radio delays packets too, but not for good.
//!
//! A queue that grows on the way delays packets for good as well, and nothing that the armband sends tells it from rounds that
//! are lost. So what is taken for lost is summed up: beyond [`Pace::doubtful_us`] of some length, only a new link is sure to
//! have no queue.

use super::packet::SAMPLES;
use super::{SEMG, armband::SAMPLE_US};

const PACKET_US: u64 = SAMPLES as u64 * SAMPLE_US;
const ROUND_US: u64 = SEMG.len() as u64 * PACKET_US;
/// The lateness of a second is that of its most punctual packet.
const WINDOW_US: u64 = 1_000_000;
/// So much later than in the second before, and a round is missing; the rest is the radio's.
const MISSING_US: u64 = ROUND_US - PACKET_US;
/// The armband's clock may be slower than the host's by so much each second, microseconds: 200 parts per million.
const SLOWER_US: i64 = 200;

/// Where packets stand on the armband's own clock, which starts near session time.
#[derive(Clone, Copy, Debug, Default)]
pub(super) struct Pace {
    /// Index of the next packet's first sample if none is missing.
    next: u64,
    /// Which characteristic sent the last packet of this link.
    turn: Option<usize>,
    window: Window,
    /// Lateness of the second before.
    before_us: Option<i64>,
    /// Lateness of the most punctual packet of this link.
    least_us: Option<i64>,
    /// Taken for lost since the link came up.
    doubtful_us: u64,
}

#[derive(Clone, Copy, Debug, Default)]
struct Window {
    since_us: u64,
    late_us: Option<i64>,
}

impl Pace {
    /// A link has come up: nobody knows how many samples are missing, but time tells.
    pub(super) fn link(&mut self) {
        self.turn = None;
        self.before_us = None;
        self.least_us = None;
        self.doubtful_us = 0;
        self.window = Window::default();
    }

    /// Of how many microseconds in this link nobody knows whether samples are lost or late.
    pub(super) fn doubtful_us(&self) -> u64 {
        self.doubtful_us
    }

    /// The armband's time at session time `at_us` by its most punctual packet: packets that are late now are behind it.
    pub(super) fn device_us(&self, at_us: u64) -> u64 {
        at_us.saturating_add_signed(-self.least_us.unwrap_or_default())
    }

    /// Index of the first sample of a packet from characteristic `turn` that came at `at_us`.
    pub(super) fn place(&mut self, turn: usize, at_us: u64) -> u64 {
        let skipped = match self.turn {
            // Whatever was before, the present is not earlier.
            None => {
                self.next = self.next.max(at_us / SAMPLE_US);
                self.window.since_us = at_us;
                0
            }
            Some(last) => (turn + 2 * SEMG.len() - last - 1) % SEMG.len(),
        };
        self.turn = Some(turn);
        let first = self.next + (skipped * SAMPLES) as u64 + self.rounds_missing(at_us);
        self.next = first + SAMPLES as u64;
        // Negative where the armband's clock is the faster one.
        let late_us = at_us.cast_signed() - (first * SAMPLE_US).cast_signed();
        let late_us = self
            .window
            .late_us
            .map_or(late_us, |least| least.min(late_us));
        self.window.late_us = Some(late_us);
        self.least_us = Some(self.least_us.map_or(late_us, |least| least.min(late_us)));
        first
    }

    /// Samples of whole rounds found missing at the end of a second.
    fn rounds_missing(&mut self, at_us: u64) -> u64 {
        if at_us.saturating_sub(self.window.since_us) < WINDOW_US {
            return 0;
        }
        let late_us = self.window.late_us.unwrap_or_default();
        let more_us = late_us - self.before_us.unwrap_or(late_us);
        let more_us = u64::try_from(more_us).unwrap_or_default();
        let rounds = if more_us < MISSING_US {
            0
        } else {
            (more_us + ROUND_US / 2) / ROUND_US
        };
        self.before_us = Some(late_us - (rounds * ROUND_US).cast_signed());
        self.window = Window {
            since_us: at_us,
            late_us: None,
        };
        self.doubtful_us += rounds * ROUND_US;
        self.least_us = self.least_us.map(|least| least.saturating_add(SLOWER_US));
        rounds * ROUND_US / SAMPLE_US
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    /// Indices of the packets `numbers` of a link, each `delay_us` late.
    fn placed(numbers: impl Iterator<Item = u64>, delay_us: impl Fn(u64) -> u64) -> Vec<u64> {
        let mut pace = Pace::default();
        let place = |number: u64| {
            pace.place(
                number as usize % 4,
                1_000_000 + number * PACKET_US + delay_us(number),
            )
        };
        numbers.map(place).collect()
    }

    fn stamped(numbers: impl Iterator<Item = u64>, late_samples: u64) -> Vec<u64> {
        numbers
            .map(|number| 200 + late_samples + 2 * number)
            .collect()
    }

    #[test]
    fn samples_are_counted_whatever_the_radio_delays() {
        // Between 0 and 15 ms; then a stall of 300 ms whose packets come at once.
        let delay = |number: u64| match number {
            350..380 => (380 - number) * PACKET_US,
            _ => (number * 7_919) % 15_000,
        };
        assert_eq!(placed(0..1_000, delay), stamped(0..1_000, 0));
    }

    #[test]
    fn up_to_three_lost_in_a_row_are_known_at_once() {
        let lost = [5, 40, 41, 77, 78, 79];
        let came = || (0..100).filter(|number| !lost.contains(number));
        assert_eq!(placed(came(), |_| 0), stamped(came(), 0));
    }

    #[test]
    fn rounds_that_are_lost_are_found_within_two_seconds() {
        // Packets 500 to 511: three rounds.
        let came = || (0..500).chain(512..1_200);
        let placed = placed(came(), |number| (number * 7_919) % 15_000);
        let right = stamped(came(), 0);
        assert_eq!(placed[..500], right[..500]);
        assert_eq!(placed[700..], right[700..]);
    }

    #[test]
    fn what_may_be_a_queue_is_doubted_until_there_is_a_new_link() {
        let mut pace = Pace::default();
        // From the 500th packet on everything comes 300 ms late: seven or eight rounds, by the look of it.
        for number in 0..1_000_u64 {
            let late_us = if number < 500 { 0 } else { 300_000 };
            let at_us = 1_000_000 + number * PACKET_US + late_us;
            pace.place(number as usize % 4, at_us);
            assert!(number >= 500 || pace.doubtful_us() == 0, "{number}");
        }
        assert!((280_000..=320_000).contains(&pace.doubtful_us()));
        pace.link();
        assert_eq!(pace.doubtful_us(), 0);
    }

    #[test]
    fn the_armbands_time_is_that_of_its_most_punctual_packet() {
        let mut pace = Pace::default();
        for number in 0..300_u64 {
            let late_us = if number < 200 { 0 } else { 25_000 };
            pace.place(
                number as usize % 4,
                1_000_000 + number * PACKET_US + late_us,
            );
        }
        // Packet 0 is taken for punctual; one that is 25 ms late does not move it, but for 200 ppm of six seconds.
        let at_us = 20_000_000;
        assert!(at_us - pace.device_us(at_us) <= 6 * 200);
    }

    #[test]
    fn a_new_link_goes_on_where_time_is_and_never_back() {
        let mut pace = Pace::default();
        assert_eq!(pace.place(2, 1_000_000), 200);
        pace.link();
        assert_eq!(pace.place(0, 9_000_000), 1_800);
        pace.link();
        assert_eq!(pace.place(3, 9_000_000), 1_802);
    }
}

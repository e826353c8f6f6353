//! How old the newest scan was when its command was made.

use std::collections::VecDeque;

use crate::live::LatencyView;

/// Ages that are kept: half a minute of commands.
const KEPT: usize = 3_000;

/// The newest ages.
#[derive(Debug, Default)]
pub(super) struct Latencies {
    newest_us: VecDeque<u64>,
    count: u64,
}

impl Latencies {
    /// Another one, microseconds.
    pub(super) fn add(&mut self, age_us: u64) {
        if self.newest_us.len() >= KEPT {
            self.newest_us.pop_front();
        }
        self.newest_us.push_back(age_us);
        self.count += 1;
    }

    /// Their quantiles; none before the first.
    pub(super) fn view(&self) -> Option<LatencyView> {
        let mut sorted: Vec<u64> = self.newest_us.iter().copied().collect();
        sorted.sort_unstable();
        let at = |percent: usize| {
            let index = (sorted.len() * percent / 100).min(sorted.len().checked_sub(1)?);
            #[allow(clippy::cast_precision_loss, reason = "milliseconds")]
            sorted.get(index).map(|us| *us as f64 * 1e-3)
        };
        Some(LatencyView {
            p50_ms: at(50)?,
            p99_ms: at(99)?,
            commands: self.count,
        })
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn quantiles_of_the_newest() {
        let mut latencies = Latencies::default();
        assert_eq!(latencies.view(), None);
        for _ in 0..5_000 {
            latencies.add(1_000_000);
        }
        for ms in 1..=3_000 {
            latencies.add(ms * 1_000);
        }
        let view = latencies.view().unwrap();
        assert_eq!((view.p50_ms, view.p99_ms), (1_501.0, 2_971.0));
        assert_eq!(view.commands, 8_000);
    }
}

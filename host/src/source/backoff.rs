//! How long to wait before the next attempt.

use std::time::Duration;

/// The first wait.
const FIRST: Duration = Duration::from_millis(250);
/// The longest.
const LONGEST: Duration = Duration::from_secs(2);

/// Waits that double from a quarter of a second up to two seconds.
#[derive(Clone, Copy, Debug)]
pub struct Backoff(Duration);

impl Backoff {
    /// Nothing has failed yet.
    #[must_use]
    pub fn new() -> Self {
        Self(FIRST)
    }

    /// How long to wait now.
    pub fn failed(&mut self) -> Duration {
        let wait = self.0;
        self.0 = (wait * 2).min(LONGEST);
        wait
    }

    /// It worked: the next failure is a first one.
    pub fn worked(&mut self) {
        self.0 = FIRST;
    }
}

impl Default for Backoff {
    fn default() -> Self {
        Self::new()
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn waits_double_up_to_two_seconds_and_begin_anew_after_a_success() {
        let mut backoff = Backoff::new();
        let mut waits = || backoff.failed().as_millis();
        assert_eq!(
            [waits(), waits(), waits(), waits(), waits()],
            [250, 500, 1000, 2000, 2000]
        );
        backoff.worked();
        assert_eq!(backoff.failed().as_millis(), 250);
    }
}

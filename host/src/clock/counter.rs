//! A counter of few bits as one that does not wrap.

/// Follows a counter of microseconds through its wraps.
#[derive(Debug, Clone, Copy)]
pub(super) struct Counter {
    bits: u32,
    newest: u64,
    /// Microseconds of `newest` since the origin.
    newest_x: i64,
}

impl Counter {
    /// The origin is where it stands now.
    pub(super) fn starting_at(now: u64, bits: u32) -> Self {
        Self {
            bits,
            newest: now,
            newest_x: 0,
        }
    }

    /// Microseconds since the origin: of the two or more instants at which the counter shows this, the one nearest to the
    /// newest.
    pub(super) fn since_origin(&self, shown: u64) -> f64 {
        self.unwrapped(shown) as f64
    }

    /// Remembers a reading that is newer than all before it.
    pub(super) fn advance(&mut self, shown: u64) {
        let x = self.unwrapped(shown);
        if x > self.newest_x {
            (self.newest, self.newest_x) = (shown, x);
        }
    }

    /// What the counter shows `x` microseconds after the origin.
    pub(super) fn at(&self, x: i64) -> u64 {
        let shown = self
            .newest
            .wrapping_add_signed(x.wrapping_sub(self.newest_x));
        shown & (u64::MAX >> (64 - self.bits))
    }

    fn unwrapped(&self, shown: u64) -> i64 {
        self.newest_x
            .saturating_add(signed_difference(shown, self.newest, self.bits))
    }
}

/// `later - earlier` of a counter of `bits` bits, between minus and plus half its range.
pub(super) fn signed_difference(later: u64, earlier: u64, bits: u32) -> i64 {
    let spare = 64 - bits;
    (later.wrapping_sub(earlier) << spare).cast_signed() >> spare
}

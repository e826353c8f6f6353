//! Stiffness without steps when its source changes.

use super::schedule::STREAM_HZ;

/// How long a change of source takes, ticks: half a second.
const BLEND_TICKS: u32 = STREAM_HZ / 2;

/// Follows the computed stiffness. Whenever the source changes (or an end comes to holding), the difference of
/// logarithms between the last value and the new source's is taken down to zero along a straight line:
///
/// ```text
/// K = K_source exp(offset * remaining / BLEND_TICKS),   offset = ln(K_last / K_source) at the change
/// ```
///
/// so that no tick changes K by more than 1/50 of the difference, plus what the new source itself does, and K stays
/// positive.
#[derive(Clone, Copy, Debug)]
pub(super) struct Blend<S> {
    last: [f32; 3],
    offset: [f32; 3],
    remaining: u32,
    following: Following<S>,
}

#[derive(Clone, Copy, Debug, PartialEq)]
enum Following<S> {
    Nothing,
    Source(S),
    Held,
}

impl<S: Copy + PartialEq> Blend<S> {
    /// `resting`: what is held if the first tick has no stiffness, N/m.
    pub(super) fn new(resting: [f32; 3]) -> Self {
        Self {
            last: resting,
            offset: [0.0; 3],
            remaining: 0,
            following: Following::Nothing,
        }
    }

    /// One tick: the stiffness diagonal that the source gives (positive, N/m), none if it gives none.
    pub(super) fn step(&mut self, computed: Option<[f32; 3]>, source: S) -> [f32; 3] {
        let Some(target) = computed else {
            self.following = Following::Held;
            return self.last;
        };
        if self.following == Following::Nothing {
            self.last = target;
        } else if self.following != Following::Source(source) {
            for ((offset, last), target) in self.offset.iter_mut().zip(self.last).zip(target) {
                *offset = libm::logf(last / target);
            }
            self.remaining = BLEND_TICKS;
        }
        self.following = Following::Source(source);
        self.remaining = self.remaining.saturating_sub(1);
        let share = self.remaining as f32 / BLEND_TICKS as f32;
        for ((last, target), offset) in self.last.iter_mut().zip(target).zip(self.offset) {
            *last = if self.remaining == 0 {
                target
            } else {
                target * libm::expf(offset * share)
            };
        }
        self.last
    }

    /// What was followed is no longer what it was: the next tick comes from another source.
    pub(super) fn leave_source(&mut self) {
        if self.following != Following::Nothing {
            self.following = Following::Held;
        }
    }

    /// Whether the stiffness is still on its way.
    pub(super) fn under_way(&self) -> bool {
        self.remaining > 0
    }
}

#[cfg(test)]
mod tests {
    use super::{BLEND_TICKS, Blend};

    #[test]
    fn a_change_of_source_is_a_straight_line_of_logarithms() {
        let mut blend = Blend::new([1.0; 3]);
        assert_eq!(
            blend.step(Some([100.0, 200.0, 300.0]), 'a'),
            [100.0, 200.0, 300.0]
        );
        assert!(!blend.under_way());
        let ratio = 4.0_f32.powf(1.0 / BLEND_TICKS as f32);
        let mut expected = 100.0;
        for tick in 0..BLEND_TICKS {
            let [x, y, z] = blend.step(Some([400.0, 200.0, 75.0]), 'b');
            expected *= ratio;
            assert!((x / expected - 1.0).abs() < 1e-5, "tick {tick}: {x}");
            assert!((x * z / 30_000.0 - 1.0).abs() < 1e-5 && (y - 200.0).abs() < 1e-3);
            assert_eq!(blend.under_way(), tick + 1 < BLEND_TICKS);
        }
        assert_eq!(
            blend.step(Some([400.0, 200.0, 75.0]), 'b'),
            [400.0, 200.0, 75.0]
        );
    }

    #[test]
    fn holding_repeats_the_last_and_ends_without_a_step() {
        let mut blend = Blend::new([50.0; 3]);
        assert_eq!(
            blend.step(None, 'a'),
            [50.0; 3],
            "held from the start: the resting value"
        );
        blend.step(Some([100.0; 3]), 'a');
        for _ in 0..2 * BLEND_TICKS {
            blend.step(Some([100.0; 3]), 'a');
        }
        assert_eq!(blend.step(None, 'a'), [100.0; 3]);
        let [after, ..] = blend.step(Some([200.0; 3]), 'a');
        assert!(after > 100.0 && after < 102.0, "{after}");
    }
}

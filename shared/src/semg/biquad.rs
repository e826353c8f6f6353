//! Second-order sections, coefficients apart from state.
//!
//! A section is held as what moves slowly in a filter whose cutoff is far below the sample rate: a level
//! `w` and its change per sample `v`, with `w` at the input's level when settled:
//!
//! ```text
//! v' = a2 v + c (x - w)        c = 1 + a1 + a2
//! y  = g0 w + g1 v' - g2 v     g0 = (b0 + b1 + b2) / c,  g1 = b0 / c,  g2 = b2 / c
//! w' = w + v'
//!
//! Y/X = (b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2)
//! ```
//!
//! Why this form in `f32`: the usual ones store `a1`, near -2, and subtract numbers that almost cancel; for
//! an envelope filter at 2 kHz `1 + a1 + a2` is 2e-4, so that a rounding in the last place comes out 4000
//! times larger (2e-3 of the level at order 8). Here the small number `c` is itself the coefficient, the
//! gain at zero frequency is `g0` whatever the rounding, and a rounding is amplified by `rate / cutoff`, not
//! by its square. The price is nothing: two words of state, five multiplications and five additions, each
//! line a chain of `acc +/- c * v` that a Cortex-M4F runs as one-cycle `VMLA.F32` on its single-precision
//! registers; no branch, no `f64`, no intermediate much larger than the signal.

use crate::Real;

/// Sections a cascade holds: order 8.
pub const MAX_SECTIONS: usize = 4;

/// Coefficients of one section, as in the equations above. A first-order one has `a2 = g2 = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section<T> {
    a2: T,
    c: T,
    g0: T,
    g1: T,
    g2: T,
}

/// State of one section: level and change per sample.
#[derive(Clone, Copy, Debug, PartialEq)]
struct SectionState<T> {
    w: T,
    v: T,
}

impl<T: Real> Section<T> {
    /// One sample through the section.
    #[inline(always)]
    fn step(&self, state: &mut SectionState<T>, x: T) -> T {
        let v = self.a2 * state.v + self.c * (x - state.w);
        let y = self.g0 * state.w + self.g1 * v - self.g2 * state.v;
        state.w += v;
        state.v = v;
        y
    }

    /// Sets the state that a constant input `x` has settled to; returns the settled output.
    fn settle(&self, state: &mut SectionState<T>, x: T) -> T {
        state.w = x;
        state.v = T::zero();
        self.g0 * x
    }
}

impl Section<f64> {
    /// From the denominator's `a2` and `c = 1 + a1 + a2`, and the numerator over c: its sum `g0`, its first
    /// coefficient `g1` and its last `g2`. The design gives c in closed form, without cancellation.
    pub(crate) fn new(a2: f64, c: f64, [g0, g1, g2]: [f64; 3]) -> Self {
        Self { a2, c, g0, g1, g2 }
    }

    /// The transfer function's numerator `[b0, b1, b2]` and denominator `[1, a1, a2]`.
    #[must_use]
    pub fn transfer(&self) -> ([f64; 3], [f64; 3]) {
        let Self { a2, c, g0, g1, g2 } = *self;
        (
            [g1 * c, (g0 - g1 - g2) * c, g2 * c],
            [1.0, c - 1.0 - a2, a2],
        )
    }

    fn convert<T: Real>(&self) -> Section<T> {
        Section {
            a2: T::of(self.a2),
            c: T::of(self.c),
            g0: T::of(self.g0),
            g1: T::of(self.g1),
            g2: T::of(self.g2),
        }
    }
}

/// Up to [`MAX_SECTIONS`] sections in a row: one filter, as designed from a sample rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cascade<T> {
    sections: [Section<T>; MAX_SECTIONS],
    used: usize,
    order: usize,
}

/// State of one [`Cascade`] for one channel.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct CascadeState<T> {
    sections: [SectionState<T>; MAX_SECTIONS],
}

impl<T: Real> CascadeState<T> {
    /// At rest: as if every earlier sample had been zero.
    #[must_use]
    pub fn zero() -> Self {
        Self {
            sections: [SectionState {
                w: T::zero(),
                v: T::zero(),
            }; MAX_SECTIONS],
        }
    }
}

impl<T: Real> Cascade<T> {
    /// The sections in use, in the order they run.
    #[must_use]
    pub fn sections(&self) -> &[Section<T>] {
        &self.sections[..self.used]
    }

    /// Order of the whole transfer function.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// One sample through every section: five multiplications and five additions each.
    #[inline(always)]
    pub fn step(&self, state: &mut CascadeState<T>, x: T) -> T {
        let mut y = x;
        let sections = self.sections.iter().zip(&mut state.sections);
        for (section, state) in sections.take(self.used) {
            y = section.step(state, y);
        }
        y
    }

    /// As [`Cascade::step`] for several channels: every coefficient is loaded once for all of them, which on a
    /// Cortex-M4F is a quarter of the work.
    #[inline(always)]
    pub fn step_all<const C: usize>(
        &self,
        mut states: [&mut CascadeState<T>; C],
        x: [T; C],
    ) -> [T; C] {
        let mut y = x;
        for (index, section) in self.sections.iter().enumerate().take(self.used) {
            let section = *section;
            for (y, state) in y.iter_mut().zip(&mut states) {
                *y = section.step(&mut state.sections[index], *y);
            }
        }
        y
    }

    /// Starts in the steady state of a constant input `x`, so that the first sample gives no
    /// transient. Returns the steady output.
    pub fn settle(&self, state: &mut CascadeState<T>, x: T) -> T {
        let mut y = x;
        for (section, state) in self.sections().iter().zip(&mut state.sections) {
            y = section.settle(state, y);
        }
        y
    }
}

impl Cascade<f64> {
    /// A filter of `order`, its sections from `section(k)`, k = 0 first. `order` is at most 8.
    pub(crate) fn build(order: usize, section: impl Fn(usize) -> Section<f64>) -> Self {
        debug_assert!(order.div_ceil(2) <= MAX_SECTIONS);
        Self {
            sections: core::array::from_fn(section),
            used: order.div_ceil(2).min(MAX_SECTIONS),
            order,
        }
    }

    /// The filter in the scalar it will run in.
    #[must_use]
    pub fn convert<T: Real>(&self) -> Cascade<T> {
        Cascade {
            sections: self.sections.each_ref().map(Section::convert),
            used: self.used,
            order: self.order,
        }
    }

    /// Group delay at zero frequency, in samples: `-d arg H / d omega`, the delay of slow changes.
    ///
    /// Meaningless for a filter that stops zero frequency.
    #[must_use]
    pub fn slow_delay_samples(&self) -> f64 {
        (self.sections().iter())
            .map(|s| (1.0 - s.a2) / s.c - (s.g1 - s.g2) / s.g0)
            .sum()
    }
}

/// The delay that `first` and then `second` give to the *power* of amplitude-modulated noise, in samples.
///
/// This is what a high-pass or a notch adds to an envelope; the phase of the carrier, which the plain group
/// delay speaks of, is lost in the rectifier. It is the group delay averaged over the carrier's band with
/// the power that passes, `int tau |H|^2 S / int |H|^2 S`. With h the impulse response of both filters and g
/// that of `carrier`, the filter that makes the carrier of spectrum S from white noise, Parseval turns it
/// into `sum q p / sum p^2`, `p = g * h`, `q = g * (n h)`.
pub(crate) fn power_delay_samples(
    first: &Cascade<f64>,
    second: Option<&Cascade<f64>>,
    carrier: &Cascade<f64>,
) -> f64 {
    // The response is over when the states hold 1e-14 of its energy; the slowest design (2.5e-4 of the rate)
    // needs about 10 000 samples.
    const LONGEST: u32 = 20_000;
    const NEGLIGIBLE: f64 = 1e-14;
    let zero = CascadeState::zero();
    let (mut in_first, mut in_second, mut in_p, mut in_q) = (zero, zero, zero, zero);
    let (mut power, mut moment) = (0.0, 0.0);
    for n in 0..LONGEST {
        let mut h = first.step(&mut in_first, if n == 0 { 1.0 } else { 0.0 });
        if let Some(second) = second {
            h = second.step(&mut in_second, h);
        }
        let p = carrier.step(&mut in_p, h);
        let q = carrier.step(&mut in_q, f64::from(n) * h);
        power += p * p;
        moment += q * p;
        let left = in_first.energy() + in_second.energy() + in_p.energy();
        if left < NEGLIGIBLE * power {
            break;
        }
    }
    if power > 0.0 { moment / power } else { 0.0 }
}

impl CascadeState<f64> {
    fn energy(&self) -> f64 {
        (self.sections.iter()).map(|s| s.w * s.w + s.v * s.v).sum()
    }
}

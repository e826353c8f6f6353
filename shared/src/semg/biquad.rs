//! Second-order sections in transposed direct form II, coefficients apart from state.
//!
//! ```text
//! H(z) = (b0 + b1 z^-1 + b2 z^-2) / (1 + a1 z^-1 + a2 z^-2)
//! y = b0 x + s1;   s1' = b1 x - a1 y + s2;   s2' = b2 x - a2 y
//! ```
//!
//! Why this form in `f32`: two words of state, five multiply-accumulates, no intermediate larger than
//! the signal, and every line is `acc +/- c * v`, which a Cortex-M4F runs as one-cycle `VMLA.F32` /
//! `VMLS.F32` on values held in its 32 single registers; nothing branches, nothing is `f64`. Sections keep
//! each pole pair's rounding to itself (a direct form of order 3 at 5 Hz and 200 Hz is ten times worse).
//! What is left grows as `(rate / cutoff)^2`: the rounding of the state, seen through `1 / (1 + a1 + a2)`.

use crate::Real;

/// Sections a cascade holds: order 8.
pub const MAX_SECTIONS: usize = 4;

/// Coefficients of one second-order section, `a0 = 1`. A first-order one has `b2 = a2 = 0`.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Section<T> {
    /// Feed-forward `[b0, b1, b2]`.
    pub b: [T; 3],
    /// Feedback `[a1, a2]`, with the sign of the denominator.
    pub a: [T; 2],
}

/// State of one section.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct SectionState<T> {
    s1: T,
    s2: T,
}

impl<T: Real> SectionState<T> {
    fn zero() -> Self {
        Self {
            s1: T::zero(),
            s2: T::zero(),
        }
    }
}

impl<T: Real> Section<T> {
    /// One sample through the section.
    #[inline]
    pub fn step(&self, state: &mut SectionState<T>, x: T) -> T {
        let y = self.b[0] * x + state.s1;
        state.s1 = self.b[1] * x - self.a[0] * y + state.s2;
        state.s2 = self.b[2] * x - self.a[1] * y;
        y
    }

    /// Gain at zero frequency.
    fn gain(&self) -> T {
        (self.b[0] + self.b[1] + self.b[2]) / (T::one() + self.a[0] + self.a[1])
    }

    /// Sets the state that a constant input `x` has settled to; returns the settled output.
    fn settle(&self, state: &mut SectionState<T>, x: T) -> T {
        let y = self.gain() * x;
        state.s2 = self.b[2] * x - self.a[1] * y;
        state.s1 = self.b[1] * x - self.a[0] * y + state.s2;
        y
    }
}

impl Section<f64> {
    /// The section in another scalar, its zero-frequency gain kept.
    ///
    /// Rounding `a` moves `1 + a1 + a2`, which is near 4e-5 to 2e-2 for an envelope filter, by up to
    /// 1e-7: a gain error of up to 1e-3. The numerator is scaled by what the rounded denominator became.
    fn convert<T: Real>(&self) -> Section<T> {
        let a = self.a.map(T::of);
        let rounded = 1.0 + a[0].widen() + a[1].widen();
        let scale = rounded / (1.0 + self.a[0] + self.a[1]);
        Section {
            b: self.b.map(|b| T::of(b * scale)),
            a,
        }
    }
}

/// Up to [`MAX_SECTIONS`] sections in a row: one filter, as designed from a sample rate.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Cascade<T> {
    sections: [Section<T>; MAX_SECTIONS],
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
            sections: [SectionState::zero(); MAX_SECTIONS],
        }
    }
}

impl<T: Real> Cascade<T> {
    /// The sections in use, in the order they run.
    #[must_use]
    pub fn sections(&self) -> &[Section<T>] {
        let used = self.order.div_ceil(2).min(MAX_SECTIONS);
        &self.sections[..used]
    }

    /// Order of the whole transfer function.
    #[must_use]
    pub fn order(&self) -> usize {
        self.order
    }

    /// One sample through every section. Five multiply-accumulates and four state words a section.
    #[inline]
    pub fn step(&self, state: &mut CascadeState<T>, x: T) -> T {
        let mut y = x;
        for (section, state) in self.sections().iter().zip(&mut state.sections) {
            y = section.step(state, y);
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
            order,
        }
    }

    /// The filter in the scalar it will run in.
    #[must_use]
    pub fn convert<T: Real>(&self) -> Cascade<T> {
        Cascade {
            sections: self.sections.each_ref().map(Section::convert),
            order: self.order,
        }
    }

    /// Group delay at zero frequency, in samples: `-d arg H / d omega`, the delay of slow changes.
    ///
    /// Meaningless for a filter that stops zero frequency.
    #[must_use]
    pub fn slow_delay_samples(&self) -> f64 {
        self.sections()
            .iter()
            .map(|Section { b, a }| {
                (b[1] + 2.0 * b[2]) / (b[0] + b[1] + b[2])
                    - (a[0] + 2.0 * a[1]) / (1.0 + a[0] + a[1])
            })
            .sum()
    }

    /// Centroid of the energy of the impulse response, `sum n h[n]^2 / sum h[n]^2`, in samples.
    ///
    /// This is the delay that the filter gives to the *power* of modulated white noise (Parseval: the
    /// group delay weighted with `|H|^2`), so it is what a high-pass or a notch adds to an envelope. The
    /// phase of the carrier, which the plain group delay speaks of, is lost in the rectifier.
    #[must_use]
    pub fn energy_delay_samples(&self) -> f64 {
        // The response is over once the state holds 1e-14 of its energy; the slowest design (2.5e-4 of the
        // rate) needs about 10 000 samples.
        const LONGEST: u32 = 20_000;
        const NEGLIGIBLE: f64 = 1e-14;
        let mut state = CascadeState::zero();
        let (mut energy, mut moment) = (0.0, 0.0);
        for n in 0..LONGEST {
            let h = self.step(&mut state, if n == 0 { 1.0 } else { 0.0 });
            energy += h * h;
            moment += f64::from(n) * h * h;
            let left: f64 = (state.sections.iter())
                .map(|s| s.s1 * s.s1 + s.s2 * s.s2)
                .sum();
            if left < NEGLIGIBLE * energy {
                break;
            }
        }
        if energy > 0.0 { moment / energy } else { 0.0 }
    }
}

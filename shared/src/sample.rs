//! Device time, one multichannel scan, and the scale from converter counts to volts.
//!
//! Device time is a `u64` of microseconds since the wearable started; it never wraps in practice and is
//! never compared with the host's clock without the clock model.

use crate::Real;

/// One sampling instant of all `C` sEMG channels, as the converter gave it.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Scan<const C: usize> {
    /// Number of the sampling period; goes up by one each period (wrapping), so a jump is a gap.
    pub index: u32,
    /// Device time of the conversion, us.
    pub acquired_us: u64,
    /// Converter counts, one per channel, sign-extended.
    pub counts: [i32; C],
}

/// From converter counts to volts at the electrodes (front-end gain included), and the converter's rails.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct AdcScale {
    volts_per_count: f64,
    offset_counts: i32,
    min_count: i32,
    max_count: i32,
}

/// Why an [`AdcScale`] was refused.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum AdcScaleError {
    /// The step is zero, negative or not finite.
    #[error("volts per count must be positive and finite, not {volts_per_count}")]
    VoltsPerCount {
        /// The refused step, V.
        volts_per_count: f64,
    },
    /// The rails do not enclose the count that stands for 0 V.
    #[error(
        "the count of zero volts ({offset_counts}) must lie within the rails {min_count} to {max_count}, and these must differ"
    )]
    Rails {
        /// Count of 0 V.
        offset_counts: i32,
        /// Lowest count.
        min_count: i32,
        /// Highest count.
        max_count: i32,
    },
}

impl AdcScale {
    /// A scale with `volts_per_count` V per count at the electrode, 0 V at `offset_counts`, and rails
    /// `min_count..=max_count`.
    ///
    /// # Errors
    /// [`AdcScaleError`] when the step is not positive or the rails do not enclose the offset.
    pub fn new(
        volts_per_count: f64,
        offset_counts: i32,
        min_count: i32,
        max_count: i32,
    ) -> Result<Self, AdcScaleError> {
        if !(volts_per_count.is_finite() && volts_per_count > 0.0) {
            return Err(AdcScaleError::VoltsPerCount { volts_per_count });
        }
        if min_count >= max_count || !(min_count..=max_count).contains(&offset_counts) {
            return Err(AdcScaleError::Rails {
                offset_counts,
                min_count,
                max_count,
            });
        }
        Ok(Self {
            volts_per_count,
            offset_counts,
            min_count,
            max_count,
        })
    }

    /// Volts at the electrode.
    ///
    /// The difference from the count of 0 V is exact (but for `f32` beyond 24 bits), and the product rounded.
    #[must_use]
    pub fn volts<T: Real>(&self, count: i32) -> T {
        difference::<T>(count, self.offset_counts) * T::of(self.volts_per_count)
    }

    /// Whether the converter is at a rail, so that the true voltage is unknown.
    #[must_use]
    pub fn at_rail(&self, count: i32) -> bool {
        // One comparison: what lies outside wraps round to above what lies inside.
        let above = count
            .wrapping_sub(self.min_count)
            .wrapping_sub(1)
            .cast_unsigned();
        let inside = self.max_count.wrapping_sub(self.min_count).wrapping_sub(1);
        above >= inside.cast_unsigned()
    }

    /// V per count.
    #[must_use]
    pub fn volts_per_count(&self) -> f64 {
        self.volts_per_count
    }

    /// Count of 0 V.
    #[must_use]
    pub fn offset_counts(&self) -> i32 {
        self.offset_counts
    }

    /// Lowest and highest count.
    #[must_use]
    pub fn rails(&self) -> (i32, i32) {
        (self.min_count, self.max_count)
    }
}

/// `count - reference` without overflow, rounded once.
#[inline]
pub(crate) fn difference<T: Real>(count: i32, reference: i32) -> T {
    match count.checked_sub(reference) {
        Some(difference) => T::whole(difference),
        None => T::of(f64::from(count) - f64::from(reference)),
    }
}

#[cfg(test)]
mod tests {
    use super::{AdcScale, AdcScaleError};

    #[test]
    fn literal_codes_of_a_24_bit_converter() {
        // ADS129x: 2.4 V reference, gain 6: full scale 0.4 V over 2^23 - 1 counts.
        let scale = AdcScale::new(0.4 / 8_388_607.0, 0, -8_388_608, 8_388_607).unwrap();
        assert_eq!(scale.volts::<f64>(0x7F_FFFF), 0.4);
        assert_eq!(scale.volts::<f32>(0), 0.0);
        assert!((scale.volts::<f64>(1) - 47.683_721e-9).abs() < 1e-15);
        assert!(scale.at_rail(8_388_607) && scale.at_rail(-8_388_608));
        assert!(!scale.at_rail(8_388_606));
    }

    #[test]
    fn extreme_counts_do_not_overflow() {
        let scale = AdcScale::new(1.0, i32::MAX, i32::MIN, i32::MAX).unwrap();
        assert_eq!(scale.volts::<f64>(i32::MIN), -4_294_967_295.0);
    }

    #[test]
    fn refuses_what_is_no_scale() {
        for step in [0.0, -1.0, f64::NAN, f64::INFINITY] {
            assert!(matches!(
                AdcScale::new(step, 0, -1, 1),
                Err(AdcScaleError::VoltsPerCount { .. })
            ));
        }
        for (offset, low, high) in [(0, 1, 1), (0, 5, -5), (9, -8, 8)] {
            assert!(matches!(
                AdcScale::new(1.0, offset, low, high),
                Err(AdcScaleError::Rails { .. })
            ));
        }
    }
}

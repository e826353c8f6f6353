//! From a battery's voltage to how full it is.

/// Voltages of one kind of battery, by falling charge.
///
/// Discharge curves differ by load, age and cold: what they tell is good to some ten per cent.
#[derive(Clone, Copy, Debug)]
pub struct Battery {
    /// Millivolts and per cent, both falling, joined by straight lines.
    curve: &'static [(u16, u8)],
}

impl Battery {
    /// A lithium polymer cell of 3.7 V: typical discharge at a fifth of its capacity an hour.
    pub const LITHIUM_POLYMER: Self = Self::new(&[
        (4_150, 100),
        (3_950, 75),
        (3_800, 50),
        (3_700, 25),
        (3_600, 10),
        (3_300, 0),
    ]);
    /// A coin cell CR2032, or another supply of 3 V.
    pub const COIN_CELL: Self = Self::new(&[(3_000, 100), (2_900, 60), (2_700, 20), (2_000, 0)]);

    /// Below this it should be charged, per cent.
    pub const LOW_PERCENT: u8 = 10;

    const fn new(curve: &'static [(u16, u8)]) -> Self {
        let mut point = 1;
        while point < curve.len() {
            assert!(curve[point - 1].0 > curve[point].0 && curve[point - 1].1 > curve[point].1);
            point += 1;
        }
        Self { curve }
    }

    /// How full it is at `battery_mv`, per cent.
    #[must_use]
    pub fn percent(&self, battery_mv: u16) -> u8 {
        let above = self.curve.iter().rposition(|(mv, _)| *mv >= battery_mv);
        let (Some(above), below) = (above, above.map_or(0, |above| above + 1)) else {
            return self.curve.first().map_or(0, |(_, percent)| *percent);
        };
        let Some((low_mv, low_percent)) = self.curve.get(below) else {
            return self.curve[above].1;
        };
        let (high_mv, high_percent) = self.curve[above];
        let share = u32::from(battery_mv - low_mv) * u32::from(high_percent - low_percent)
            / u32::from(high_mv - low_mv);
        low_percent + share as u8
    }
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn the_curve_is_met_at_its_points_and_halfway_between_them() {
        let cell = Battery::LITHIUM_POLYMER;
        for (battery_mv, percent) in [
            (u16::MAX, 100),
            (4_150, 100),
            (3_950, 75),
            (3_875, 62),
            (3_750, 37),
            (3_300, 0),
            (3_299, 0),
            (0, 0),
        ] {
            assert_eq!(cell.percent(battery_mv), percent, "{battery_mv} mV");
        }
    }

    #[test]
    fn less_voltage_is_never_more_charge() {
        for battery in [Battery::LITHIUM_POLYMER, Battery::COIN_CELL] {
            let falling = (1_500..4_500).map(|mv| battery.percent(mv));
            assert!(falling.is_sorted());
        }
    }
}

//! Credible intervals of what a grid stands for.

/// Mean and a central interval of a posterior.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Interval {
    /// Mean.
    pub mean: f64,
    /// Lower end.
    pub low: f64,
    /// Upper end.
    pub high: f64,
}

/// Probability spread evenly from `low` to `high`.
#[derive(Clone, Copy, Debug)]
pub(super) struct Cell {
    pub(super) low: f64,
    pub(super) high: f64,
    pub(super) weight: f64,
}

impl Cell {
    /// What of its weight lies below `value`.
    fn below(&self, value: f64) -> f64 {
        let width = self.high - self.low;
        if width > 0.0 {
            self.weight * ((value - self.low) / width).clamp(0.0, 1.0)
        } else if value >= self.low {
            self.weight
        } else {
            0.0
        }
    }
}

/// The central interval that holds `probability` of `cells`, whose weights sum to one; `None` without cells.
pub(super) fn credible(cells: &[Cell], probability: f64) -> Option<Interval> {
    let low = cells.iter().map(|cell| cell.low).reduce(f64::min)?;
    let high = cells.iter().map(|cell| cell.high).reduce(f64::max)?;
    let tail = 0.5 * (1.0 - probability);
    let middle = |cell: &Cell| 0.5 * cell.weight * (cell.low + cell.high);
    Some(Interval {
        mean: cells.iter().map(middle).sum(),
        low: quantile(cells, (low, high), tail),
        high: quantile(cells, (low, high), 1.0 - tail),
    })
}

/// Halvings of the range: below a nanosecond of ten seconds.
const HALVINGS: usize = 40;

fn quantile(cells: &[Cell], (mut low, mut high): (f64, f64), probability: f64) -> f64 {
    for _ in 0..HALVINGS {
        let middle = 0.5 * (low + high);
        let below: f64 = cells.iter().map(|cell| cell.below(middle)).sum();
        if below < probability {
            low = middle;
        } else {
            high = middle;
        }
    }
    0.5 * (low + high)
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn two_cells_by_hand() {
        let cell = |low, high, weight| Cell { low, high, weight };
        // A quarter on [0, 1], three quarters on [1, 3]: the 10 % quantile is 0.4, the 90 % quantile 1 + 2 * 0.65 / 0.75.
        let cells = [cell(0.0, 1.0, 0.25), cell(1.0, 3.0, 0.75)];
        let interval = credible(&cells, 0.8).unwrap();
        assert!((interval.low - 0.4).abs() < 1e-9);
        assert!((interval.high - (1.0 + 2.0 * 0.65 / 0.75)).abs() < 1e-9);
        assert!((interval.mean - (0.125 + 1.5)).abs() < 1e-12);
        let point = credible(&[cell(2.0, 2.0, 1.0)], 0.9).unwrap();
        assert_eq!((point.low, point.high), (2.0, 2.0));
        assert!(credible(&[], 0.9).is_none());
    }
}

//! What the others find surprising about each demonstration that is left out.

use nalgebra::DMatrix;

use super::kernel::{Kernel, Kernels};
use super::{GateError, GateSettings, Seen};

/// Only rates of false alarms up to this matter when settings are compared.
const GREATEST_RATE: f64 = 0.1;

/// One demonstration left out.
struct Judged {
    class: usize,
    /// Per class that was there, the squared innovations against each of its references, `J x n`.
    squares: Vec<(usize, DMatrix<f64>)>,
}

/// All demonstrations, each left out with its group.
pub(super) struct LeftOut {
    judged: Vec<Judged>,
    rows: usize,
}

impl LeftOut {
    pub(super) fn of(seen: &Seen, settings: &GateSettings) -> Result<Self, GateError> {
        let mut judged = Vec::with_capacity(seen.class.len());
        let last = seen.group.iter().max().copied().unwrap_or(0);
        for group in 0..=last {
            let (out, others): (Vec<usize>, Vec<usize>) =
                (0..seen.class.len()).partition(|&i| seen.group[i] == group);
            if out.is_empty() {
                continue;
            }
            let kernels = Kernels::of(seen, &others, settings)?;
            for i in out {
                let row = seen.rows.row(i).transpose();
                let there = kernels.classes.iter().enumerate();
                let there = there.filter_map(|(q, kernel)| Some((q, kernel.as_ref()?)));
                let squares = there.filter_map(|(q, kernel)| Some((q, squared(kernel, &row)?)));
                judged.push(Judged {
                    class: seen.class[i],
                    squares: squares.collect(),
                });
            }
        }
        let rows = seen.rows.ncols();
        Ok(Self { judged, rows })
    }

    pub(super) fn count(&self) -> usize {
        self.judged.len()
    }

    /// How well the known and the same movements with their own class taken away are told apart: the area under the
    /// detection curve over false alarm rates up to [`GREATEST_RATE`], from 0 to 1, and its standard error.
    pub(super) fn told_apart(&self, tail: f64) -> (f64, f64) {
        let least = |judged: &Judged, own: bool| {
            let classes = judged.squares.iter();
            let classes = classes.filter(|(q, _)| own || *q != judged.class);
            classes
                .map(|(_, squares)| least_surprise(squares, tail, self.rows))
                .fold(f64::INFINITY, f64::min)
        };
        let mut known: Vec<f64> = self.judged.iter().map(|j| least(j, true)).collect();
        known.sort_by(f64::total_cmp);
        let novel = self.judged.iter().map(|j| least(j, false));
        // A lone class has no others: nothing to choose by.
        let novel: Vec<f64> = novel.filter(|score| score.is_finite()).collect();
        let areas = novel.iter().map(|score| {
            let below = known.partition_point(|k| k < score);
            let rate = (known.len() - below) as f64 / known.len() as f64;
            (1.0 - rate / GREATEST_RATE).max(0.0)
        });
        let areas: Vec<f64> = areas.collect();
        let count = areas.len().max(1) as f64;
        let mean = areas.iter().sum::<f64>() / count;
        let squares = areas.iter().map(|area| (area - mean) * (area - mean));
        (mean, libm::sqrt(squares.sum::<f64>()) / count)
    }

    /// After each number of rows, the score that a share `rate` of the left out exceeds.
    pub(super) fn thresholds(&self, tail: f64, rate: f64) -> Vec<f64> {
        let after = |rows: usize| {
            let least = self.judged.iter().map(|judged| {
                let classes = judged.squares.iter();
                classes
                    .map(|(_, squares)| least_surprise(squares, tail, rows))
                    .fold(f64::INFINITY, f64::min)
            });
            let mut known: Vec<f64> = least.collect();
            known.sort_by(f64::total_cmp);
            upper_quantile(&known, rate)
        };
        (1..=self.rows).map(after).collect()
    }
}

fn squared(kernel: &Kernel, row: &nalgebra::DVector<f64>) -> Option<DMatrix<f64>> {
    let mut whitened = kernel.whitened.clone();
    let row = kernel.factor.solve_lower_triangular(row)?;
    for mut column in whitened.column_iter_mut() {
        column -= &row;
        column.apply(|d| *d *= *d);
    }
    Some(whitened)
}

/// Least mean surprise over the references (columns) after `rows` rows.
fn least_surprise(squares: &DMatrix<f64>, tail: f64, rows: usize) -> f64 {
    let columns = squares.column_iter();
    let surprises = columns.map(|column| {
        let first = column.rows(0, rows);
        first
            .iter()
            .map(|square| libm::log1p(square / tail))
            .sum::<f64>()
    });
    surprises.fold(f64::INFINITY, f64::min) / rows as f64
}

/// The value that a new one exceeds with probability `rate`: the order statistic number `(n + 1) (1 - rate)`, between two
/// of them in proportion. (Of `n` exchangeable values and a new one, that one is the largest with probability
/// `1 / (n + 1)`.) `sorted` is not empty.
fn upper_quantile(sorted: &[f64], rate: f64) -> f64 {
    let last = sorted.len() - 1;
    let place = ((sorted.len() + 1) as f64 * (1.0 - rate) - 1.0).clamp(0.0, last as f64);
    let below = libm::floor(place) as usize;
    let above = (below + 1).min(last);
    sorted[below] + (place - below as f64) * (sorted[above] - sorted[below])
}

//! What the others find surprising about each demonstration that is left out.

use nalgebra::DMatrix;

use super::kernel::{Kernel, Kernels};
use super::{GateError, GateSettings, Seen};

/// Only rates of false alarms up to this matter when settings are compared.
const GREATEST_RATE: f64 = 0.1;

/// Share of the left out whose greatest scores show how rare greater ones are.
const TAIL: f64 = 0.25;

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

    /// The least rate of false alarms that so many can show.
    pub(super) fn least_rate(&self) -> f64 {
        1.0 / (self.judged.len() + 1) as f64
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
        let courses = self.courses(tail);
        let after = |row: usize| {
            let mut known: Vec<f64> = courses.iter().map(|course| course[row]).collect();
            known.sort_by(f64::total_cmp);
            upper_quantile(&known, rate)
        };
        (0..self.rows).map(after).collect()
    }

    /// After each number of rows, scores such that a share `rate` of the left out exceeds any of them: all as many
    /// standard deviations above the mean of the left out's log scores (the greatest of standardised
    /// statistics, Westfall and Young 1993). Early scores scatter the most and are allowed to. A rate below
    /// [`LeftOut::least_rate`] is extrapolated.
    pub(super) fn thresholds_throughout(&self, tail: f64, rate: f64) -> Vec<f64> {
        let mut logs = self.courses(tail);
        // Seen exactly before, a score is zero.
        for score in logs.iter_mut().flatten() {
            *score = libm::log(score.max(f64::MIN_POSITIVE));
        }
        let count = logs.len() as f64;
        let after = |row: usize| {
            let scores = || logs.iter().map(|course| course[row]);
            let mean = scores().sum::<f64>() / count;
            let squares = scores().map(|log| (log - mean) * (log - mean));
            let std = libm::sqrt(squares.sum::<f64>() / (count - 1.0).max(1.0));
            (mean, std.max(f64::EPSILON))
        };
        let moments: Vec<(f64, f64)> = (0..self.rows).map(after).collect();
        let greatest = logs.iter().map(|course| {
            let rows = course.iter().zip(&moments);
            rows.map(|(log, (mean, std))| (log - mean) / std)
                .fold(f64::NEG_INFINITY, f64::max)
        });
        let mut greatest: Vec<f64> = greatest.collect();
        greatest.sort_by(f64::total_cmp);
        let above = if rate < self.least_rate() {
            exponential_tail(&greatest, rate)
        } else {
            upper_quantile(&greatest, rate)
        };
        let score = |(mean, std): &(f64, f64)| libm::exp(mean + above * std);
        moments.iter().map(score).collect()
    }

    /// Of each of the left out, its score after each number of rows.
    fn courses(&self, tail: f64) -> Vec<Vec<f64>> {
        let after = |judged: &Judged, rows: usize| {
            let classes = judged.squares.iter();
            classes
                .map(|(_, squares)| least_surprise(squares, tail, rows))
                .fold(f64::INFINITY, f64::min)
        };
        let course = |judged| (1..=self.rows).map(|rows| after(judged, rows)).collect();
        self.judged.iter().map(course).collect()
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

/// The value that a new one exceeds with probability `rate`, at most [`TAIL`], if what exceeds the upper quartile does so by
/// an exponentially distributed excess, the tail of the normal and the logistic distribution in the limit (Pickands
/// 1975). `sorted` is not empty.
fn exponential_tail(sorted: &[f64], rate: f64) -> f64 {
    let threshold = upper_quantile(sorted, TAIL);
    let excesses = sorted.iter().filter(|value| **value > threshold);
    let excesses: Vec<f64> = excesses.map(|value| value - threshold).collect();
    let mean = excesses.iter().sum::<f64>() / excesses.len().max(1) as f64;
    threshold + mean * libm::log(TAIL / rate)
}

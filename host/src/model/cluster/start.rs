//! Where EM starts: k-means++ and a few steps of k-means.
//!
//! Source: Arthur and Vassilvitskii, k-means++: the advantages of careful seeding, SODA 2007.

use nalgebra::{DMatrix, DVector};
use rand::RngExt;
use rand_chacha::ChaCha8Rng;

/// Steps of k-means, at most.
const STEPS: usize = 20;

/// What a distance is measured in.
#[derive(Clone, Copy, Debug)]
pub(super) enum Metric {
    /// As the points are: large differences of the movements count most.
    Movement,
    /// Each coordinate by its own spread: small ones may be what tells kinds apart.
    Whitened,
}

/// A component for each point. Labelled points keep their class, the first `classes` components; a component may be
/// left without points.
pub(super) fn start(
    points: &DMatrix<f64>,
    labels: &[Option<usize>],
    (classes, components): (usize, usize),
    metric: Metric,
    rng: &mut ChaCha8Rng,
) -> Vec<usize> {
    let points = in_metric(points, metric);
    let mut centres: Vec<DVector<f64>> = (0..classes)
        .filter_map(|class| centre(&points, |i| labels[i] == Some(class)))
        .collect();
    while centres.len() < components {
        let next = far_point(&points, &centres, rng);
        centres.push(points.column(next).into_owned());
    }
    let mut of = nearest(&points, labels, &centres);
    for _ in 0..STEPS {
        for (q, mine) in centres.iter_mut().enumerate() {
            if let Some(moved) = centre(&points, |i| of[i] == q) {
                *mine = moved;
            }
        }
        let next = nearest(&points, labels, &centres);
        if next == of {
            break;
        }
        of = next;
    }
    of
}

fn in_metric(points: &DMatrix<f64>, metric: Metric) -> DMatrix<f64> {
    let mut points = points.clone();
    if let Metric::Whitened = metric {
        for mut row in points.row_iter_mut() {
            let norm = row.norm();
            if norm > 0.0 {
                row /= norm;
            }
        }
    }
    points
}

/// Mean of the points that belong; `None` if none does.
fn centre(points: &DMatrix<f64>, belongs: impl Fn(usize) -> bool) -> Option<DVector<f64>> {
    let members: Vec<usize> = (0..points.ncols()).filter(|&i| belongs(i)).collect();
    (!members.is_empty()).then(|| points.select_columns(&members).column_mean())
}

/// A point with probability proportional to its squared distance from the nearest centre; any, if there is no centre
/// or every point is one.
fn far_point(points: &DMatrix<f64>, centres: &[DVector<f64>], rng: &mut ChaCha8Rng) -> usize {
    let square = |i: usize| {
        let to = |centre: &DVector<f64>| (points.column(i) - centre).norm_squared();
        centres.iter().map(to).fold(f64::INFINITY, f64::min)
    };
    let any = rng.random_range(0..points.ncols());
    let share: f64 = rng.random();
    let squares: Vec<f64> = (0..points.ncols()).map(square).collect();
    let total: f64 = squares.iter().sum();
    if !(total.is_finite() && total > 0.0) {
        return any;
    }
    let mut left = share * total;
    let drawn = squares.iter().position(|square| {
        left -= square;
        left < 0.0
    });
    drawn.unwrap_or(any)
}

fn nearest(
    points: &DMatrix<f64>,
    labels: &[Option<usize>],
    centres: &[DVector<f64>],
) -> Vec<usize> {
    let of = |i: usize| {
        let squares: Vec<f64> = centres
            .iter()
            .map(|centre| -(points.column(i) - centre).norm_squared())
            .collect();
        super::greatest(&squares)
    };
    (0..points.ncols())
        .map(|i| labels[i].unwrap_or_else(|| of(i)))
        .collect()
}

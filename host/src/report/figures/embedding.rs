//! t-SNE (van der Maaten and Hinton 2008) of the demonstrations' weights.
//!
//! bhtsne starts from given places, here the first two principal components, so that nothing is random; it runs on
//! one thread, because the order of its sums is the scheduler's otherwise.

use bhtsne::tSNE;
use nalgebra::DMatrix;

use super::{absent, key};
use crate::demonstration::Demonstration;
use crate::experiment::pick_and_place::PickAndPlace;
use crate::model::{Fitted, Model};
use crate::report::chart::{Mark, Panel, Series, class};
use crate::report::html::Figure;

/// Neighbours that a point looks at, where there are enough.
const PERPLEXITY: f64 = 20.0;
/// Standard deviation of the start along the first axis: small, as its authors advise.
const START: f64 = 1e-4;

pub(super) fn figure(found: &PickAndPlace, (id, title): (&'static str, &str), seed: u64) -> Figure {
    let figures = &found.figures;
    let places = figures.model.as_ref().and_then(map);
    let Some(places) = places else {
        return absent(id, title);
    };
    let mut labels: Vec<&str> = figures
        .demonstrations
        .iter()
        .map(Demonstration::label)
        .collect();
    labels.sort_unstable();
    labels.dedup();
    let mark = |i: usize| {
        let (ink, _, shape) = class(i);
        Mark::Dots(ink, shape, 4.5)
    };
    let series = labels.iter().enumerate().map(|(i, label)| {
        let of = figures.demonstrations.iter().zip(&places);
        let of = of.filter(|(demonstration, _)| demonstration.label() == *label);
        Series::new(mark(i), of.map(|(_, place)| *place))
    });
    let axes = ["first coordinate, no unit", "second coordinate, no unit"];
    let mut panel = Panel::new("t-SNE of weights", axes[0], axes[1], series.collect());
    panel.size = (620.0, 460.0);
    let clusters = format!(
        " Without labels the program finds {} clusters, adjusted Rand index {:.3}.",
        found.unlabelled.components, found.unlabelled.adjusted_rand_index
    );
    Figure {
        id,
        title: title.to_owned(),
        caption: format!(
            "The weights of {} demonstrations, all DoFs, brought to two dimensions that keep neighbours together (seed \
             {seed}; paper, figure 6). Distances between groups mean nothing.{clusters}",
            places.len()
        ),
        keys: labels
            .iter()
            .enumerate()
            .map(|(i, label)| key(mark(i), label))
            .collect(),
        panels: vec![panel],
        columns: 1,
        ..Figure::default()
    }
}

/// A place for each demonstration that the model was learnt from, in their order.
fn map(model: &Model) -> Option<Vec<(f64, f64)>> {
    let fits = model.parts().demonstrations.iter();
    let weights: Vec<Vec<f64>> = fits.map(|fitted| scaled(model, fitted)).collect();
    // bhtsne refuses fewer than three times the perplexity.
    let perplexity = PERPLEXITY.min((weights.len() as f64 - 1.0) / 3.0 - 0.1);
    if perplexity < 2.0 {
        return None;
    }
    let start = principal(&weights)?;
    let pool = rayon::ThreadPoolBuilder::new()
        .num_threads(1)
        .build()
        .ok()?;
    let places = pool.install(|| {
        let mut map: tSNE<'_, f64, Vec<f64>> = tSNE::new(&weights);
        map.perplexity(perplexity)
            .initial_embedding(start)
            .exact(distance);
        map.embedding()
    });
    Some(
        places
            .chunks_exact(2)
            .map(|place| (place[0], place[1]))
            .collect(),
    )
}

#[allow(clippy::ptr_arg, reason = "the type that bhtsne is given")]
fn distance(a: &Vec<f64>, b: &Vec<f64>) -> f64 {
    libm::sqrt(a.iter().zip(b).map(|(x, y)| (x - y) * (x - y)).sum())
}

/// Weights that a demonstration became, each DoF over its scale.
fn scaled(model: &Model, fitted: &Fitted) -> Vec<f64> {
    let parts = model.parts();
    let of_dof = fitted.weights.chunks_exact(parts.basis.count());
    let pairs = of_dof.zip(&parts.scale);
    pairs
        .flat_map(|(weights, scale)| weights.iter().map(move |weight| weight / scale))
        .collect()
}

/// Scores along the first two principal components, small.
fn principal(weights: &[Vec<f64>]) -> Option<Vec<f64>> {
    let (rows, columns) = (weights.len(), weights.first()?.len());
    let mut data = DMatrix::from_fn(rows, columns, |i, j| weights[i][j]);
    let mean = data.row_mean();
    for mut row in data.row_iter_mut() {
        row -= &mean;
    }
    // The Gram matrix is the small one.
    let gram = (&data * data.transpose()).symmetric_eigen();
    let mut order: Vec<usize> = (0..rows).collect();
    order.sort_by(|&a, &b| gram.eigenvalues[b].total_cmp(&gram.eigenvalues[a]));
    let axis = |place: usize| {
        let score = gram.eigenvectors.column(*order.get(place)?);
        // Unit vectors of `rows` entries; the sign of the largest makes them unique.
        let sign = if score[score.iamax()] < 0.0 {
            -1.0
        } else {
            1.0
        };
        Some(score * (sign * START * libm::sqrt(rows as f64)))
    };
    let (first, second) = (axis(0)?, axis(1)?);
    Some((0..rows).flat_map(|i| [first[i], second[i]]).collect())
}

//! Bases, weights and covariance, conditioning: what a skill is.

use super::{PHASE, curve, dof_axis, dof_name, key};
use crate::demonstration::Demonstration;
use crate::experiment::Results;
use crate::model::Model;
use crate::model::recognise::Recogniser;
use crate::report::chart::{Board, Ink, Key, Mark, Panel, Series, Shape, Stroke};
use crate::report::html::Figure;

/// Half a 95 % interval in standard deviations.
const WIDTH: f64 = 1.96;
/// The two DoFs whose coupling is shown: hand and robot along y, in [`DOFS`](crate::session::DOFS).
const COUPLED: [usize; 2] = [1, 7];
/// The same of their stiffnesses.
const COUPLED_STIFFNESS: [usize; 2] = [4, 10];
const DEMONSTRATION: Mark = Mark::Line(Ink::Grey, Stroke::Solid, 0.8);
const PRIOR: Mark = Mark::Line(Ink::Text, Stroke::Dashed, 1.6);
const PRIOR_BAND: Mark = Mark::Band(Ink::Grey, 0.3);
const POSTERIOR: Mark = Mark::Line(Ink::Blue, Stroke::Solid, 2.0);
const POSTERIOR_BAND: Mark = Mark::Band(Ink::Blue, 0.25);
const VIA: Mark = Mark::Dots(Ink::Vermillion, Shape::Diamond, 5.0);
const FUNCTION: Mark = Mark::Line(Ink::Blue, Stroke::Solid, 1.2);
const ONE_FUNCTION: Mark = Mark::Line(Ink::Vermillion, Stroke::Solid, 2.6);

/// A model of the run with demonstrations of it.
struct Shown<'r> {
    model: &'r Model,
    demonstrations: &'r [Demonstration],
}

fn shown(results: &Results) -> Option<Shown<'_>> {
    let hand_over = results.hand_over.as_ref().and_then(|found| {
        let demonstrations = &found.figures.demonstrations;
        Some((found.figures.model.as_ref()?, demonstrations))
    });
    let objects = results.object_matching.as_ref().and_then(|found| {
        let demonstrations = &found.figures.demonstrations;
        Some((found.figures.model.as_ref()?, demonstrations))
    });
    let picks = results.pick_and_place.as_ref().and_then(|found| {
        let demonstrations = &found.figures.demonstrations;
        Some((found.figures.model.as_ref()?, demonstrations))
    });
    let (model, demonstrations) = hand_over.or(objects).or(picks)?;
    Some(Shown {
        model,
        demonstrations,
    })
}

pub(super) fn figures(results: &Results) -> [Figure; 3] {
    let titles = [
        ("fig-bases", "Basis functions"),
        ("fig-weights", "Weights and covariance of a skill"),
        ("fig-conditioning", "Conditioning one of two coupled DoFs"),
    ];
    let Some(shown) = shown(results) else {
        return titles.map(|(id, title)| super::absent(id, title));
    };
    let seed = results.seed;
    [
        bases(shown.model),
        weights(&shown, seed),
        conditioning(shown.model, seed),
    ]
}

fn bases(model: &Model) -> Figure {
    let basis = model.parts().basis;
    let count = basis.count();
    let samples = 241;
    let mut functions = vec![Vec::with_capacity(samples); count];
    let mut psi = vec![0.0; count];
    for sample in 0..samples {
        let phase = sample as f64 / (samples - 1) as f64;
        // Of the right length, at a finite phase.
        if basis.values(phase, &mut psi).is_ok() {
            for (function, value) in functions.iter_mut().zip(&psi) {
                function.push((phase, *value));
            }
        }
    }
    let middle = count / 2;
    let series = functions.into_iter().enumerate().map(|(k, points)| {
        let mark = if k == middle { ONE_FUNCTION } else { FUNCTION };
        Series::new(mark, points)
    });
    let mut panel = Panel::new("psi(s)", PHASE, "value, no unit", series.collect());
    panel.size = (780.0, 280.0);
    Figure {
        id: "fig-bases",
        title: "Basis functions".to_owned(),
        caption: format!(
            "The {count} functions that every DoF is a weighted sum of (paper, figure 2); the one in the middle is drawn \
             bold. Normalised Gaussians sum to one at every phase."
        ),
        keys: vec![
            key(FUNCTION, "a basis function"),
            key(ONE_FUNCTION, "the one in the middle"),
        ],
        panels: vec![panel],
        columns: 1,
        ..Figure::default()
    }
}

fn weights(shown: &Shown<'_>, seed: u64) -> Figure {
    let model = shown.model;
    let label = model
        .labels()
        .first()
        .map(String::as_str)
        .unwrap_or_default();
    let demonstrations: Vec<_> = shown
        .demonstrations
        .iter()
        .filter(|d| d.label() == label)
        .collect();
    let panels = COUPLED
        .into_iter()
        .chain(COUPLED_STIFFNESS)
        .filter_map(|dof| {
            let (phases, mean, std) = expected(model, &[], dof)?;
            let low: Vec<_> = mean.iter().zip(&std).map(|(m, s)| m - WIDTH * s).collect();
            let high: Vec<_> = mean.iter().zip(&std).map(|(m, s)| m + WIDTH * s).collect();
            let each = demonstrations
                .iter()
                .map(|d| Series::new(DEMONSTRATION, curve(d, dof)));
            let mut series = vec![Series::band(POSTERIOR_BAND, &phases, &low, &high)];
            series.extend(each);
            series.push(Series::over(POSTERIOR, &phases, &mean));
            Some(Panel::new(&dof_name(dof), PHASE, dof_axis(dof), series))
        });
    Figure {
        id: "fig-weights",
        title: format!("Weights and covariance of `{label}`"),
        caption: format!(
            "{} demonstrations of `{label}` (seed {seed}) become weights, the weights a Gaussian, and the Gaussian a \
             movement with its spread (paper, figure 3). Left: mean weights of each DoF, black the least and white the \
             greatest of that DoF. Right: correlation of the weights of two coupled DoFs, black -1, white 1; the blocks \
             off the diagonal are what lets one be inferred from the other.",
            demonstrations.len()
        ),
        keys: vec![
            key(DEMONSTRATION, "a demonstration"),
            key(POSTERIOR, "mean of the skill"),
            key(POSTERIOR_BAND, "mean ± 1.96 standard deviations"),
        ],
        boards: vec![mean_board(model), correlation_board(model)],
        panels: panels.collect(),
        columns: 2,
    }
}

/// Mean weights of the first skill, each DoF between its least and greatest.
fn mean_board(model: &Model) -> Board {
    let parts = model.parts();
    let count = parts.basis.count();
    let rows = parts
        .weight_means
        .chunks_exact(count)
        .take(parts.dofs.len());
    let cells = rows.map(|row| {
        let (low, high) = row
            .iter()
            .fold((f64::INFINITY, f64::NEG_INFINITY), |(a, b), &v| {
                (a.min(v), b.max(v))
            });
        let span = (high - low).max(f64::MIN_POSITIVE);
        row.iter().map(|v| (v - low) / span).collect()
    });
    Board {
        title: "mean weights".to_owned(),
        x: "basis function".to_owned(),
        y: "DoF".to_owned(),
        scale: "share of the DoF's range".to_owned(),
        range: (0.0, 1.0),
        cells: cells.collect(),
        rows: parts
            .dofs
            .iter()
            .map(|dof| dof.name.replace('_', " "))
            .collect(),
        size: (620.0, 360.0),
    }
}

/// Correlations of the weights of the coupled positions.
fn correlation_board(model: &Model) -> Board {
    let parts = model.parts();
    let (count, rank) = (parts.basis.count(), parts.rank);
    // Rows of loading times root: their inner products are the covariance.
    let root: Vec<&[f64]> = parts.roots.chunks_exact(rank).take(rank).collect();
    let rows = COUPLED
        .into_iter()
        .flat_map(|dof| dof * count..(dof + 1) * count);
    let factors = rows.filter_map(|row| {
        let line = parts.loading.get(row * rank..(row + 1) * rank)?;
        let mut factor = vec![0.0; rank];
        for (weight, line) in line.iter().zip(&root) {
            for (sum, entry) in factor.iter_mut().zip(*line) {
                *sum += weight * entry;
            }
        }
        Some(factor)
    });
    let factors: Vec<Vec<f64>> = factors.collect();
    let dot = |a: &[f64], b: &[f64]| -> f64 { a.iter().zip(b).map(|(x, y)| x * y).sum() };
    let cells = factors.iter().map(|a| {
        let each = factors.iter().map(|b| {
            let scale = libm::sqrt(dot(a, a) * dot(b, b));
            if scale > 0.0 { dot(a, b) / scale } else { 0.0 }
        });
        each.collect()
    });
    Board {
        title: format!("{} and {}", dof_name(COUPLED[0]), dof_name(COUPLED[1])),
        x: "weight, first DoF then second".to_owned(),
        y: "weight".to_owned(),
        scale: "correlation".to_owned(),
        range: (-1.0, 1.0),
        cells: cells.collect(),
        rows: Vec::new(),
        size: (480.0, 420.0),
    }
}

fn conditioning(model: &Model, seed: u64) -> Figure {
    let id = "fig-conditioning";
    let title = "Conditioning one of two coupled DoFs";
    let Some((phases, mean, std)) = expected(model, &[], COUPLED[0]) else {
        return super::absent(id, title);
    };
    let last = phases.len() - 1;
    let seen = (
        COUPLED[0],
        phases[last],
        mean[last] + 1.5 * std[last],
        0.1 * std[last],
    );
    let panels = COUPLED.into_iter().filter_map(|dof| {
        let mut series = Vec::new();
        for (observed, band, line) in [
            (&[][..], PRIOR_BAND, PRIOR),
            (&[seen][..], POSTERIOR_BAND, POSTERIOR),
        ] {
            let (phases, mean, std) = expected(model, observed, dof)?;
            let low: Vec<_> = mean.iter().zip(&std).map(|(m, s)| m - WIDTH * s).collect();
            let high: Vec<_> = mean.iter().zip(&std).map(|(m, s)| m + WIDTH * s).collect();
            series.push(Series::band(band, &phases, &low, &high));
            series.push(Series::over(line, &phases, &mean));
        }
        if dof == seen.0 {
            series.push(Series::new(VIA, [(seen.1, seen.2)]));
        }
        let mut panel = Panel::new(&dof_name(dof), PHASE, dof_axis(dof), series);
        panel.size = (430.0, 280.0);
        Some(panel)
    });
    let keys: Vec<Key> = vec![
        key(PRIOR, "mean before"),
        key(PRIOR_BAND, "± 1.96 standard deviations before"),
        key(POSTERIOR, "mean after"),
        key(POSTERIOR_BAND, "± 1.96 standard deviations after"),
        key(VIA, "observed"),
    ];
    Figure {
        id,
        title: title.to_owned(),
        caption: format!(
            "One value of {} is observed at the end, 1.5 standard deviations above its mean; {} is not observed and \
             moves with it (paper, figure 5; the model of seed {seed}).",
            dof_name(COUPLED[0]),
            dof_name(COUPLED[1])
        ),
        keys,
        panels: panels.collect(),
        columns: 2,
        ..Figure::default()
    }
}

/// Phases, mean and standard deviation of a DoF of the first skill after observations of DoF, phase, value, std.
fn expected(
    model: &Model,
    observed: &[(usize, f64, f64, f64)],
    dof: usize,
) -> Option<(Vec<f64>, Vec<f64>, Vec<f64>)> {
    predicted(model, observed, 0, dof)
}

/// As [`expected`], of any skill.
pub(super) fn predicted(
    model: &Model,
    observed: &[(usize, f64, f64, f64)],
    skill: usize,
    dof: usize,
) -> Option<(Vec<f64>, Vec<f64>, Vec<f64>)> {
    let view = model.view().ok()?;
    let mut recogniser = Recogniser::new(model, &view).ok()?;
    for &(dof, phase, value, std) in observed {
        recogniser.observe(dof, phase, value, std).ok()?;
    }
    let (mut phases, mut means, mut stds) = (Vec::new(), Vec::new(), Vec::new());
    for point in 0..super::POINTS {
        let phase = point as f64 / (super::POINTS - 1) as f64;
        let prediction = recogniser.predict(skill, dof, phase).ok()?;
        phases.push(phase);
        means.push(prediction.mean);
        stds.push(prediction.std);
    }
    Some((phases, means, stds))
}

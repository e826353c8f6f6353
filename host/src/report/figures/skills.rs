//! Bases, weights and covariance, conditioning: what a skill is.

use super::{PHASE, curve, dof_axis, dof_name, key};
use crate::demonstration::Demonstration;
use crate::experiment::Results;
use crate::model::Model;
use crate::model::recognise::Recogniser;
use crate::report::chart::{Board, Ink, Key, Mark, Panel, Series, Shape, Stroke};
use crate::report::html::Figure;

/// Probability of the intervals shown.
const INTERVAL: f64 = 0.95;
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
            let expected = predicted(model, &[], 0, dof)?;
            let each = demonstrations
                .iter()
                .map(|d| Series::new(DEMONSTRATION, curve(d, dof)));
            let mut series = vec![expected.band(POSTERIOR_BAND)];
            series.extend(each);
            series.push(expected.line(POSTERIOR));
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
            key(POSTERIOR_BAND, "95 % interval of a recorded value"),
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
        x: "basis function, number".to_owned(),
        y: "DoF".to_owned(),
        scale: "weight, share of the DoF's range".to_owned(),
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
        x: "weight of the first DoF, then of the second, number".to_owned(),
        y: "weight, number".to_owned(),
        scale: "correlation, -1 to 1".to_owned(),
        range: (-1.0, 1.0),
        cells: cells.collect(),
        rows: Vec::new(),
        size: (480.0, 420.0),
    }
}

fn conditioning(model: &Model, seed: u64) -> Figure {
    let id = "fig-conditioning";
    let title = "Conditioning one of two coupled DoFs";
    let before = predicted(model, &[], 0, COUPLED[0]);
    let ends = before
        .as_ref()
        .and_then(|b| Some((b.mean.last()?, b.high.last()?)));
    let Some((&mean, &high)) = ends else {
        return super::absent(id, title);
    };
    // Three quarters of the way to the interval's end.
    let seen = (
        COUPLED[0],
        1.0,
        mean + 0.75 * (high - mean),
        0.05 * (high - mean),
    );
    let panels = COUPLED.into_iter().filter_map(|dof| {
        let mut series = Vec::new();
        for (observed, band, line) in [
            (&[][..], PRIOR_BAND, PRIOR),
            (&[seen][..], POSTERIOR_BAND, POSTERIOR),
        ] {
            let expected = predicted(model, observed, 0, dof)?;
            series.push(expected.band(band));
            series.push(expected.line(line));
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
        key(PRIOR_BAND, "95 % interval before"),
        key(POSTERIOR, "mean after"),
        key(POSTERIOR_BAND, "95 % interval after"),
        key(VIA, "observed"),
    ];
    Figure {
        id,
        title: title.to_owned(),
        caption: format!(
            "One value of {} is observed at the end, three quarters of the way to the upper end of its interval; {} is not observed and \
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

/// What a skill expects of a DoF.
pub(super) struct Expected {
    phases: Vec<f64>,
    pub(super) mean: Vec<f64>,
    low: Vec<f64>,
    pub(super) high: Vec<f64>,
}

impl Expected {
    /// Its pointwise interval.
    pub(super) fn band(&self, mark: Mark) -> Series {
        Series::band(mark, &self.phases, &self.low, &self.high)
    }

    /// Its mean.
    pub(super) fn line(&self, mark: Mark) -> Series {
        Series::over(mark, &self.phases, &self.mean)
    }
}

/// What a skill expects of a DoF after observations of DoF, phase, value, std.
pub(super) fn predicted(
    model: &Model,
    observed: &[(usize, f64, f64, f64)],
    skill: usize,
    dof: usize,
) -> Option<Expected> {
    let view = model.view().ok()?;
    let mut recogniser = Recogniser::new(model, &view).ok()?;
    for &(dof, phase, value, std) in observed {
        recogniser.observe(dof, phase, value, std).ok()?;
    }
    let mut expected = Expected {
        phases: Vec::new(),
        mean: Vec::new(),
        low: Vec::new(),
        high: Vec::new(),
    };
    for point in 0..super::POINTS {
        let phase = point as f64 / (super::POINTS - 1) as f64;
        let spread = recogniser.spread(skill, dof, phase).ok()?;
        let (low, high) = spread.interval(INTERVAL).ok()?;
        expected.phases.push(phase);
        expected
            .mean
            .push(recogniser.predict(skill, dof, phase).ok()?.mean);
        expected.low.push(low);
        expected.high.push(high);
    }
    Some(expected)
}

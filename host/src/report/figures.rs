//! The figures, in the paper's order; numbers in captions are those of the run that is shown.

mod calibration;
mod embedding;
mod hand_over;
mod objects;
mod picks;
mod skills;
mod sweeps;

use serde_json::Value;

use super::chart::{Ink, Key, Mark, Panel, Series, Shape, Stroke};
use super::html::{Figure, Page};
use crate::demonstration::Demonstration;
use crate::experiment::Results;
use crate::experiment::figures::Inference;
use crate::session::DOFS;
use skills::predicted;

/// Label of a phase axis.
const PHASE: &str = "phase, 0 start to 1 end";
/// What is inferred, its interval, what was recorded, what was observed.
const MEAN: Mark = Mark::Line(Ink::Blue, Stroke::Solid, 2.0);
const INTERVAL: Mark = Mark::Band(Ink::Blue, 0.22);
const TRUTH: Mark = Mark::Line(Ink::Vermillion, Stroke::Dashed, 2.0);
const OBSERVED: Mark = Mark::Dots(Ink::Text, Shape::Diamond, 4.5);
/// Points of a curve on the page: more than a panel has pixels to tell apart by twos.
const POINTS: usize = 101;

/// Writes all figures.
pub(super) fn write(page: &mut Page, results: &Results, document: &Value) {
    let seed = results.seed;
    page.section(
        "model",
        "What a skill is",
        "Bases, weights and what conditioning does to them: the counterparts of the paper's figures 2, 3 and 5.",
    );
    for figure in skills::figures(results) {
        page.figure(&figure);
    }
    page.section(
        "hand-over",
        "Hand-over",
        "One skill ties reach, stiffness and the robot together; new motions are inferred from few observations: the \
         counterparts of figures 8, 10 and 11.",
    );
    for figure in hand_over::figures(results.hand_over.as_ref(), seed) {
        page.figure(&figure);
    }
    page.section(
        "object-matching",
        "Object matching",
        "Three objects lifted along nearly the same path, told apart by the muscles: the counterparts of figures 4, 12 \
         and 13.",
    );
    for figure in objects::figures(results.object_matching.as_ref(), seed) {
        page.figure(&figure);
    }
    page.section(
        "pick-and-place",
        "Pick and place",
        "Reach, pick and place, recognised while they happen: the counterparts of figures 6, 14 and 15.",
    );
    for figure in picks::figures(results.pick_and_place.as_ref(), seed) {
        page.figure(&figure);
    }
    page.section(
        "sweeps",
        "How much is enough",
        "Recognition and inference over how much of a movement is seen, how often, and in how much noise; and whether \
         probabilities mean what they say.",
    );
    for figure in sweeps::figures(results) {
        page.figure(&figure);
    }
    page.figure(&calibration::figure(document));
}

fn key(mark: Mark, label: &str) -> Key {
    Key {
        mark,
        label: label.to_owned(),
    }
}

/// `human x`, `robot stiffness y`.
fn dof_name(dof: usize) -> String {
    let name = DOFS.get(dof).copied().unwrap_or_default();
    name.replace("_k", " stiffness ").replace('_', " ")
}

/// Axis label of a DoF.
fn dof_axis(dof: usize) -> &'static str {
    let stiffness = DOFS.get(dof).is_some_and(|name| name.contains("_k"));
    if stiffness {
        "stiffness, N/m"
    } else {
        "position, m"
    }
}

/// No more points than a panel can show.
fn thinned(points: impl IntoIterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let all: Vec<_> = points.into_iter().collect();
    if all.len() <= POINTS {
        return all;
    }
    let last = all.len() - 1;
    (0..POINTS).map(|i| all[i * last / (POINTS - 1)]).collect()
}

/// One DoF of a demonstration over its phase.
fn curve(demonstration: &Demonstration, dof: usize) -> Vec<(f64, f64)> {
    let values = demonstration.values().get(dof);
    let values = values.map(Vec::as_slice).unwrap_or_default();
    thinned(demonstration.phases().zip(values.iter().copied()))
}

/// One DoF of an inference: interval, mean, what was recorded, what was observed of it.
fn inferred(inference: &Inference, dof: usize, title: &str) -> Option<Panel> {
    let band = inference.bands.get(dof)?;
    let phases = &inference.phases;
    let seen = inference.observed.iter().filter(|seen| seen.dof == dof);
    let series = vec![
        Series::band(INTERVAL, phases, &band.low, &band.high),
        Series::over(MEAN, phases, &band.mean),
        Series::over(TRUTH, phases, &band.truth),
        Series::new(OBSERVED, seen.map(|seen| (seen.phase, seen.value))),
    ];
    Some(Panel::new(title, PHASE, dof_axis(dof), series))
}

fn inferred_keys() -> Vec<Key> {
    vec![
        key(MEAN, "inferred mean"),
        key(INTERVAL, "95 % interval, pointwise"),
        key(TRUTH, "recorded"),
        key(OBSERVED, "observed"),
    ]
}

/// A figure of something that was not run.
fn absent(id: &'static str, title: &str) -> Figure {
    Figure {
        id,
        title: title.to_owned(),
        ..Figure::default()
    }
}

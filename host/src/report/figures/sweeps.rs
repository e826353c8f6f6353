//! Accuracy and error over what is observed.

use super::key;
use crate::experiment::hand_over::Accuracy;
use crate::experiment::recordings::{At, Recording};
use crate::experiment::{Point, Results, Sweeps};
use crate::report::chart::{Ink, Key, Mark, Panel, Series, Shape, Stroke};
use crate::report::html::Figure;

const WITH: Mark = Mark::Line(Ink::Blue, Stroke::Solid, 2.0);
const WITH_DOTS: Mark = Mark::Dots(Ink::Blue, Shape::Circle, 4.0);
const WITHOUT: Mark = Mark::Line(Ink::Vermillion, Stroke::Dashed, 2.0);
const WITHOUT_DOTS: Mark = Mark::Dots(Ink::Vermillion, Shape::Square, 4.0);
const CHANCE: Mark = Mark::Line(Ink::Grey, Stroke::Dotted, 1.6);

const FRACTION: &str = "part of the movement seen, %";
const OBSERVATIONS: &str = "observations, count";
const NOISE: &str = "noise of each position, mm";

pub(super) fn figures(results: &Results) -> Vec<Figure> {
    let objects = results.object_matching.as_ref().map(|found| &found.sweeps);
    let picks = results.pick_and_place.as_ref().map(|found| &found.sweeps);
    let hand_over = results.hand_over.as_ref();
    let seed = results.seed;
    let two = |id,
               title: &str,
               (x, scale): (&str, f64),
               of: fn(&Sweeps) -> &[Point],
               error: Option<&[Accuracy]>| {
        let mut panels = Vec::new();
        for (name, sweeps) in [("object matching", objects), ("pick and place", picks)] {
            panels.extend(sweeps.map(|sweeps| recognition(name, (x, scale), of(sweeps))));
        }
        if let Some(points) = error.filter(|points| !points.is_empty()) {
            panels.push(end_point((x, scale), points));
        }
        Figure {
            id,
            title: title.to_owned(),
            caption: format!(
                "Held-out accuracy of recognition with the hand's position and stiffness and with its position alone; \
                 for the hand-over the median distance between inferred and true end of the robot's path (seed {seed})."
            ),
            keys: keys(),
            panels,
            columns: 3,
            ..Figure::default()
        }
    };
    vec![
        two(
            "fig-fraction",
            "Seeing the first part of the movement",
            (FRACTION, 100.0),
            |sweeps| &sweeps.by_fraction,
            hand_over.map(|found| found.by_fraction.as_slice()),
        ),
        two(
            "fig-observations",
            "Accuracy against number of observations",
            (OBSERVATIONS, 1.0),
            |sweeps| &sweeps.by_observations,
            hand_over.map(|found| found.by_observations.as_slice()),
        ),
        two(
            "fig-noise",
            "Accuracy in noise",
            (NOISE, 1000.0),
            |sweeps| &sweeps.by_noise_m,
            hand_over.map(|found| found.by_noise_m.as_slice()),
        ),
        recordings(results),
    ]
}

fn keys() -> Vec<Key> {
    vec![
        key(WITH, "position and stiffness (sEMG)"),
        key(WITHOUT, "position alone"),
        key(CHANCE, "chance"),
    ]
}

fn recognition(name: &str, (x, scale): (&str, f64), points: &[Point]) -> Panel {
    let of = |value: fn(&Point) -> f64| -> Vec<(f64, f64)> {
        points.iter().map(|p| (scale * p.at, value(p))).collect()
    };
    let (with, without) = (
        of(|p| p.with_semg.accuracy),
        of(|p| p.without_semg.accuracy),
    );
    let ends = [with.first(), with.last()].into_iter().flatten();
    // Three classes in both experiments.
    let chance: Vec<_> = ends.map(|(at, _)| (*at, 1.0 / 3.0)).collect();
    let series = vec![
        Series::new(CHANCE, chance),
        Series::new(WITHOUT, without.clone()),
        Series::new(WITHOUT_DOTS, without),
        Series::new(WITH, with.clone()),
        Series::new(WITH_DOTS, with),
    ];
    let mut panel = Panel::new(name, x, "accuracy, share right", series);
    panel.y_range = Some((0.0, 1.0));
    panel
}

fn end_point((x, scale): (&str, f64), points: &[Accuracy]) -> Panel {
    let of = |value: fn(&Accuracy) -> f64| -> Vec<(f64, f64)> {
        let each = points.iter();
        each.map(|p| (scale * p.at, 1000.0 * value(p))).collect()
    };
    let with = of(|p| p.end_point_error_m);
    let without = of(|p| p.end_point_error_without_semg_m);
    let series = vec![
        Series::new(WITHOUT, without.clone()),
        Series::new(WITHOUT_DOTS, without),
        Series::new(WITH, with.clone()),
        Series::new(WITH_DOTS, with),
    ];
    Panel::new("hand-over", x, "end-point error, mm", series)
}

/// Accuracy on the recordings over the part seen and over noise.
fn recordings(results: &Results) -> Figure {
    let id = "fig-recordings";
    let title = "Recordings of real people";
    let Some(all) = results.recordings.as_ref().map(|found| &found.sets) else {
        return super::absent(id, title);
    };
    let mark = |i: usize| {
        let (ink, stroke, shape) = crate::report::chart::class(i);
        (Mark::Line(ink, stroke, 2.0), Mark::Dots(ink, shape, 4.0))
    };
    let panel = |title: &str, x: &str, of: &dyn Fn(usize) -> Vec<(f64, f64)>| {
        let series = (0..all.len()).flat_map(|i| {
            let (line, dots) = mark(i);
            [Series::new(line, of(i)), Series::new(dots, of(i))]
        });
        let mut panel = Panel::new(title, x, "accuracy, share right", series.collect());
        panel.y_range = Some((0.0, 1.0));
        panel.size = (520.0, 300.0);
        panel
    };
    let points = |scale: f64, of: fn(&Recording) -> &[At]| {
        move |i: usize| -> Vec<(f64, f64)> {
            let points = of(&all[i]).iter();
            points.map(|p| (scale * p.at, p.score.accuracy)).collect()
        }
    };
    let fraction = points(100.0, |r| &r.by_fraction);
    let unknown = points(100.0, |r| &r.unknown_tempo.by_fraction);
    let observations = points(1.0, |r| &r.by_observations);
    let noise = points(1000.0, |r| &r.by_noise_m);
    let names = all.iter().enumerate();
    Figure {
        id,
        title: title.to_owned(),
        caption: "Held-out accuracy on recordings by others, ten observations (digits: fifteen) in the part of the \
                  movement that is seen, its duration known unless a panel says otherwise; how each was held out \
                  stands beside its name."
            .to_owned(),
        keys: names
            .map(|(i, r)| key(mark(i).0, &format!("{}, {}", r.name, r.held_out)))
            .collect(),
        panels: vec![
            panel("by part seen", FRACTION, &fraction),
            panel("by part seen, tempo unknown", FRACTION, &unknown),
            panel("by observations", OBSERVATIONS, &observations),
            panel("by noise", NOISE, &noise),
        ],
        columns: 2,
        ..Figure::default()
    }
}

//! Object matching: sEMG and envelopes, demonstrations, inference with and without sEMG, recognition over time.

use super::hand_over::grouped;
use super::picks::traces;
use super::{absent, inferred, inferred_keys, key, thinned};
use crate::experiment::figures::{Envelopes, Inference};
use crate::experiment::object_matching::ObjectMatching;
use crate::report::chart::{Ink, Mark, Panel, Series, Stroke};
use crate::report::html::Figure;

const RAW: Mark = Mark::Line(Ink::Grey, Stroke::Solid, 0.6);
const ENVELOPE: Mark = Mark::Line(Ink::Vermillion, Stroke::Solid, 2.0);
/// Hand height and stiffness, and the robot's, in [`DOFS`](crate::session::DOFS).
const SHOWN: [usize; 4] = [2, 5, 8, 11];
/// Raw samples that a panel shows: extremes of as many intervals.
const BUCKETS: usize = 240;

pub(super) fn figures(found: Option<&ObjectMatching>, seed: u64) -> Vec<Figure> {
    let titles = [
        ("fig-envelopes", "Raw sEMG and envelopes of a lift"),
        ("fig-lifts", "Object matching: demonstrations"),
        (
            "fig-matching",
            "Object matching: inferred with sEMG and without",
        ),
        (
            "fig-matching-recognition",
            "Object matching: recognition over time",
        ),
    ];
    let Some(found) = found else {
        return titles.map(|(id, title)| absent(id, title)).into();
    };
    let figures = &found.figures;
    let [envelopes, lifts, matching, recognition] = titles;
    let (panels, keys) = grouped(&figures.demonstrations, |d| d.label().to_owned(), &SHOWN);
    let demonstrations = Figure {
        id: lifts.0,
        title: lifts.1.to_owned(),
        caption: format!(
            "{} lifts (seed {seed}; paper, figure 12): hands take nearly the same path, stiffness differs.",
            figures.demonstrations.len()
        ),
        keys: keys
            .into_iter()
            .map(|(mark, name)| key(mark, &name))
            .collect(),
        panels,
        columns: 2,
        ..Figure::default()
    };
    vec![
        raw(&figures.envelopes, envelopes, seed),
        demonstrations,
        with_and_without(&figures.with_semg, &figures.without_semg, matching, seed),
        traces(
            &figures.traces,
            recognition,
            &format!(
                "New lifts with sEMG, one of each object (seed {seed}): posterior probability of each object after each \
                 observation, and log-likelihood less that of the likeliest."
            ),
        ),
    ]
}

/// Raw signal above, envelope below, a column for each channel of the first lift; envelopes of the others after.
fn raw(all: &[Envelopes], (id, title): (&'static str, &str), seed: u64) -> Figure {
    let Some(first) = all.first() else {
        return absent(id, title);
    };
    let name = |channel: usize| first.channels.get(channel).map_or("", String::as_str);
    let mut panels = Vec::new();
    for (channel, samples) in first.raw_v.iter().enumerate() {
        let microvolts = samples.iter().map(|v| v * 1e6);
        let points = extremes(first.raw_t_s.iter().copied().zip(microvolts));
        let title = format!("{}, {}", first.performed, name(channel));
        let series = vec![Series::new(RAW, points)];
        panels.push(Panel::new(&title, "time, s", "raw sEMG, µV", series));
    }
    for lift in all {
        for (channel, envelope) in lift.envelope.iter().enumerate() {
            let percent = envelope.iter().map(|share| 100.0 * share);
            let points = thinned(lift.t_s.iter().copied().zip(percent));
            let title = format!("{}, {}", lift.performed, name(channel));
            let series = vec![Series::new(ENVELOPE, points)];
            panels.push(Panel::new(
                &title,
                "time, s",
                "envelope, % of maximum",
                series,
            ));
        }
    }
    for panel in &mut panels {
        panel.size = (300.0, 200.0);
    }
    Figure {
        id,
        title: title.to_owned(),
        caption: format!(
            "Four channels (seed {seed}; paper, figure 4): raw sEMG of `{}` as sampled, drawn as the extremes of each \
             pixel, and the envelopes that the wearable sent for one lift of each object, as shares of maximum voluntary \
             contraction at the times they describe.",
            first.performed
        ),
        keys: vec![key(RAW, "raw sEMG"), key(ENVELOPE, "envelope")],
        panels,
        columns: 4,
        ..Figure::default()
    }
}

/// Least and greatest of each interval: what a dense signal looks like from afar.
fn extremes(points: impl Iterator<Item = (f64, f64)>) -> Vec<(f64, f64)> {
    let all: Vec<_> = points.collect();
    let each = all.len().div_ceil(BUCKETS).max(1);
    let bucket = |points: &[(f64, f64)]| -> Vec<(f64, f64)> {
        let by_value = |a: &&(f64, f64), b: &&(f64, f64)| a.1.total_cmp(&b.1);
        let ends = [
            points.iter().min_by(by_value),
            points.iter().max_by(by_value),
        ];
        let mut ends: Vec<_> = ends.into_iter().flatten().copied().collect();
        ends.sort_by(|a, b| a.0.total_cmp(&b.0));
        ends
    };
    all.chunks(each).flat_map(bucket).collect()
}

fn with_and_without(
    with: &[Inference],
    without: &[Inference],
    (id, title): (&'static str, &str),
    seed: u64,
) -> Figure {
    let mut panels = Vec::new();
    for (dof, what) in [(SHOWN[2], "height"), (SHOWN[3], "stiffness")] {
        for (inferences, how) in [(with, "with sEMG"), (without, "without")] {
            for inference in inferences {
                let title = format!(
                    "{how}: {} taken for {}",
                    inference.performed, inference.recognised
                );
                let short = title.replace("lift_", "");
                panels.extend(inferred(inference, dof, &format!("robot {what}, {short}")));
            }
        }
    }
    Figure {
        id,
        title: title.to_owned(),
        caption: format!(
            "One new trial of each object (seed {seed}; paper, figure 13): the robot's height and stiffness in z as \
             inferred from the hand's position and stiffness, and from its position alone. The title says what was \
             lifted and what it was taken for."
        ),
        keys: inferred_keys(),
        panels,
        columns: 3,
        ..Figure::default()
    }
}

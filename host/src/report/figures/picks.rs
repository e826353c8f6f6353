//! Pick and place: weights on a map, priors, recognition and inference over observations.

use super::embedding;
use super::{PHASE, absent, dof_axis, dof_name, inferred, inferred_keys, key, predicted};
use crate::experiment::figures::{Inference, Trace};
use crate::experiment::pick_and_place::PickAndPlace;
use crate::model::Model;
use crate::report::chart::{Ink, Key, Mark, Panel, Series, class};
use crate::report::html::Figure;

/// Positions of the hand and of the robot, in [`DOFS`](crate::session::DOFS).
const SHOWN: [usize; 6] = [0, 1, 2, 6, 7, 8];
const SINGLE: Mark = Mark::Band(Ink::Grey, 0.3);
/// Log-likelihoods further below the likeliest are all the same: hopeless.
const HOPELESS: f64 = -50.0;

pub(super) fn figures(found: Option<&PickAndPlace>, seed: u64) -> Vec<Figure> {
    let titles = [
        ("fig-embedding", "Weights of all demonstrations on a map"),
        (
            "fig-priors",
            "Pick and place: skills, and one Gaussian over all",
        ),
        (
            "fig-recognition",
            "Pick and place: recognition over observations",
        ),
        (
            "fig-pick-inference",
            "Pick and place: inference over observations",
        ),
    ];
    let Some(found) = found else {
        return titles.map(|(id, title)| absent(id, title)).into();
    };
    let figures = &found.figures;
    let [map, priors_of, recognition, inference] = titles;
    vec![
        embedding::figure(found, map, seed),
        priors(
            figures.model.as_ref(),
            figures.single.as_ref(),
            priors_of,
            seed,
        ),
        traces(
            &figures.traces,
            recognition,
            &format!(
                "A movement that was held out (seed {seed}; paper, figure 15): posterior probability of each skill after \
                 each observation, and joint log-likelihood less that of the likeliest."
            ),
        ),
        over_observations(&figures.inferences, inference, seed),
    ]
}

fn priors(
    model: Option<&Model>,
    single: Option<&Model>,
    (id, title): (&'static str, &str),
    seed: u64,
) -> Figure {
    let Some(model) = model else {
        return absent(id, title);
    };
    let marks = |skill: usize| {
        let (ink, stroke, _) = class(skill);
        (Mark::Band(ink, 0.22), Mark::Line(ink, stroke, 2.0))
    };
    let panels = SHOWN.into_iter().map(|dof| {
        let mut series = Vec::new();
        let mut add = |model: &Model, skill: usize, band: Mark, line: Option<Mark>| {
            let Some(expected) = predicted(model, &[], skill, dof) else {
                return;
            };
            series.push(expected.band(band));
            series.extend(line.map(|line| expected.line(line)));
        };
        if let Some(single) = single {
            add(single, 0, SINGLE, None);
        }
        for skill in 0..model.labels().len() {
            let (band, line) = marks(skill);
            add(model, skill, band, Some(line));
        }
        Panel::new(&dof_name(dof), PHASE, dof_axis(dof), series)
    });
    let skills = model.labels().iter().enumerate();
    let mut keys: Vec<Key> = skills.map(|(i, label)| key(marks(i).1, label)).collect();
    keys.push(key(SINGLE, "one Gaussian over all, 95 % interval"));
    Figure {
        id,
        title: title.to_owned(),
        caption: format!(
            "Mean and pointwise 95 % interval of each skill before anything is observed (seed {seed}; paper, figure \
             14). The grey band is one Gaussian learnt from all demonstrations together: wide, and about none of them."
        ),
        keys,
        panels: panels.collect(),
        columns: 3,
        ..Figure::default()
    }
}

/// Posterior and log-likelihood over the observations of each trace.
pub(super) fn traces(all: &[Trace], (id, title): (&'static str, &str), caption: &str) -> Figure {
    let Some(first) = all.first() else {
        return absent(id, title);
    };
    let marks = |skill: usize| {
        let (ink, stroke, shape) = class(skill);
        (Mark::Line(ink, stroke, 2.0), Mark::Dots(ink, shape, 3.5))
    };
    let panel = |trace: &Trace, of: &[Vec<f64>], what: &str| {
        let series = (0..trace.labels.len()).flat_map(|skill| {
            let value = |step: &Vec<f64>| step.get(skill).map_or(f64::NAN, |v| v.max(HOPELESS));
            let points = trace.phases.iter().copied().zip(of.iter().map(value));
            let points: Vec<_> = points.collect();
            let (line, dots) = marks(skill);
            [Series::new(line, points.clone()), Series::new(dots, points)]
        });
        let title = format!("{} is performed", trace.performed);
        Panel::new(&title, PHASE, what, series.collect())
    };
    let posteriors = all.iter().map(|trace| {
        let mut panel = panel(trace, &trace.posterior, "posterior probability, 0 to 1");
        panel.y_range = Some((0.0, 1.0));
        panel
    });
    let likelihoods = all.iter();
    let likelihoods =
        likelihoods.map(|trace| panel(trace, &trace.log_likelihood, "log-likelihood, nats"));
    let labels = first.labels.iter().enumerate();
    Figure {
        id,
        title: title.to_owned(),
        caption: format!("{caption} Log-likelihoods are cut off at {HOPELESS} nats."),
        keys: labels.map(|(i, label)| key(marks(i).0, label)).collect(),
        panels: posteriors.chain(likelihoods).collect(),
        columns: 3,
        ..Figure::default()
    }
}

fn over_observations(
    inferences: &[Inference],
    (id, title): (&'static str, &str),
    seed: u64,
) -> Figure {
    let panels = SHOWN[..3].iter().flat_map(|&dof| {
        inferences.iter().filter_map(move |inference| {
            let mut panel = inferred(inference, dof, &inference.name)?;
            panel.title = format!("{}, {}", dof_name(dof), inference.name);
            panel.size = (330.0, 225.0);
            Some(panel)
        })
    });
    Figure {
        id,
        title: title.to_owned(),
        caption: format!(
            "The held-out movement (seed {seed}; paper, figure 15) as inferred after more and more observations: the \
             interval closes around what was recorded."
        ),
        keys: inferred_keys(),
        panels: panels.collect(),
        columns: 4,
        ..Figure::default()
    }
}

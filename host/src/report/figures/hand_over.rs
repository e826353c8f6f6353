//! Hand-over: demonstrations, inferred paths and stiffness against what was recorded.

use super::{PHASE, absent, curve, dof_axis, dof_name, inferred, inferred_keys, key};
use crate::demonstration::Demonstration;
use crate::experiment::figures::Inference;
use crate::experiment::hand_over::HandOver;
use crate::report::chart::{Mark, Panel, Series, class};
use crate::report::html::Figure;

/// Hand and robot along y, and their stiffnesses, in [`DOFS`](crate::session::DOFS).
const SHOWN: [usize; 4] = [1, 7, 4, 10];
const SCHEMES: [&str; 3] = ["(a)", "(b)", "(c)"];

pub(super) fn figures(found: Option<&HandOver>, seed: u64) -> Vec<Figure> {
    let titles = [
        ("fig-hand-over-demonstrations", "Hand-over: demonstrations"),
        (
            "fig-hand-over-paths",
            "Hand-over: inferred paths of the robot",
        ),
        (
            "fig-hand-over-stiffness",
            "Hand-over: inferred stiffness of the robot",
        ),
        ("fig-hand-over-human", "Hand-over: the hand itself"),
    ];
    let Some(found) = found else {
        return titles.map(|(id, title)| absent(id, title)).into();
    };
    let figures = &found.figures;
    let [first, paths, stiffness, human] = titles;
    let schemes = |(id, title): (&'static str, &str), dof: usize, paper: &str| {
        by_scheme(&figures.inferences, (id, title), dof, (paper, seed))
    };
    vec![
        demonstrations(&figures.demonstrations, first, seed),
        schemes(paths, SHOWN[1], "paper, figure 10"),
        schemes(stiffness, SHOWN[3], "paper, figure 11"),
        schemes(human, SHOWN[0], "paper, figure 10, red"),
    ]
}

/// Lines of demonstrations, one look for each group.
pub(super) fn grouped(
    demonstrations: &[Demonstration],
    group: impl Fn(&Demonstration) -> String,
    dofs: &[usize],
) -> (Vec<Panel>, Vec<(Mark, String)>) {
    let mut groups: Vec<String> = Vec::new();
    for demonstration in demonstrations {
        let name = group(demonstration);
        if !groups.contains(&name) {
            groups.push(name);
        }
    }
    let mark = |index: usize| {
        let (ink, stroke, _) = class(index);
        Mark::Line(ink, stroke, 1.0)
    };
    let panels = dofs.iter().map(|&dof| {
        let series = demonstrations.iter().map(|demonstration| {
            let name = group(demonstration);
            let index = groups.iter().position(|known| *known == name).unwrap_or(0);
            Series::new(mark(index), curve(demonstration, dof))
        });
        Panel::new(&dof_name(dof), PHASE, dof_axis(dof), series.collect())
    });
    let panels = panels.collect();
    let keys = groups
        .into_iter()
        .enumerate()
        .map(|(i, name)| (mark(i), name));
    (panels, keys.collect())
}

fn demonstrations(all: &[Demonstration], (id, title): (&'static str, &str), seed: u64) -> Figure {
    // Trials are named `case 1, 1` to `case 3, 10`.
    let case = |d: &Demonstration| d.trial().split(',').next().unwrap_or_default().to_owned();
    let (panels, keys) = grouped(all, case, &SHOWN);
    Figure {
        id,
        title: title.to_owned(),
        caption: format!(
            "{} demonstrations in {} cases (seed {seed}; paper, figure 8): the farther the hand reaches in y, the more \
             the elastic band stiffens the arm, and the robot's part follows.",
            all.len(),
            keys.len()
        ),
        keys: keys
            .into_iter()
            .map(|(mark, name)| key(mark, &name))
            .collect(),
        panels,
        columns: 2,
        ..Figure::default()
    }
}

/// One DoF of all motions under each scheme.
fn by_scheme(
    inferences: &[Vec<Inference>],
    (id, title): (&'static str, &str),
    dof: usize,
    (paper, seed): (&str, u64),
) -> Figure {
    let panels = inferences
        .iter()
        .zip(SCHEMES)
        .flat_map(|(motions, scheme)| {
            motions.iter().enumerate().filter_map(move |(i, motion)| {
                let place = if i % 2 == 1 { ", between" } else { "" };
                let mut panel =
                    inferred(motion, dof, &format!("{scheme} motion {}{place}", i + 1))?;
                panel.size = (300.0, 215.0);
                Some(panel)
            })
        });
    Figure {
        id,
        title: format!("{title}, {}", dof_name(dof)),
        caption: format!(
            "Six new motions (seed {seed}; {paper}), numbers 2, 4 and 6 between the demonstrated cases, under the three \
             schemes: (a) x-y of the hand at 2 s, (b) and its stiffness, (c) both at 1.4, 1.6, 1.8 and 2 s. Diamonds, \
             where there are any, are what was observed of this DoF."
        ),
        keys: inferred_keys(),
        panels: panels.collect(),
        columns: 6,
        ..Figure::default()
    }
}

//! The recordings as demonstrations, fitted once.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use rayon::prelude::*;

use super::grids::Plan;
use super::setting::{Phase, Setting, Ways};
use crate::demonstration::{Choice, Demonstration, read};
use crate::experiment::ExperimentError;
use crate::model::cluster::both_ways;
use crate::model::{Fitted, Model, fit, learn_fitted};
use crate::table::Table;

/// The arm in one file, as it was recorded.
#[derive(Debug)]
pub(super) struct Run {
    file: PathBuf,
    pub(super) t_s: Vec<f64>,
    /// The hand, and the elbow as the shoulder has it: what a sensor of the upper arm's attitude tells.
    pub(super) rows_m: Vec<[f64; 6]>,
}

/// One recording.
#[derive(Debug)]
pub(super) struct Set {
    pub(super) plan: &'static Plan,
    by_time: Vec<Demonstration>,
    by_path: Vec<Demonstration>,
    runs: Vec<Run>,
    fits: Vec<Fits>,
}

/// Fits of every demonstration, and of the same backwards.
#[derive(Debug)]
struct Fits {
    key: (Phase, usize, f64),
    forward: Vec<Fitted>,
    backward: Vec<Fitted>,
}

impl Set {
    /// All demonstrations of one recording.
    pub(super) fn read(folder: &Path, plan: &'static Plan) -> Result<Self, ExperimentError> {
        let tables = folder.join(plan.name).join("csv");
        let missing = |source| ExperimentError::Folder {
            folder: tables.clone(),
            source,
        };
        let entries = std::fs::read_dir(&tables).map_err(missing)?;
        let files = entries.map(|entry| entry.map(|file| file.path()));
        let mut files = files.collect::<Result<Vec<_>, _>>().map_err(missing)?;
        files.sort();
        let columns: Vec<String> = plan
            .dofs
            .iter()
            .chain(&plan.occluded)
            .map(|c| (*c).to_owned())
            .collect();
        let exclude = ["none", "idle"].map(str::to_owned);
        let choice = Choice {
            dofs: &columns,
            exclude: &exclude,
        };
        let mut by_time = Vec::new();
        let mut runs = Vec::new();
        for file in files {
            let table = Table::open(&file)?;
            for demonstration in read(&table, &choice)? {
                by_time.push(seen(demonstration, plan)?);
            }
            if plan.runs {
                runs.push(Run::of(&table, file)?);
            }
        }
        // A missing file, or one cut at a line's end, would pass for a smaller recording.
        if by_time.len() != plan.movements {
            return Err(ExperimentError::Movements {
                folder: tables,
                found: by_time.len(),
                expected: plan.movements,
            });
        }
        let by_path = by_time.iter().map(|d| d.at_constant_speed(&[0, 1, 2]));
        let mut set = Self {
            plan,
            by_path: by_path.collect(),
            by_time,
            runs,
            fits: Vec::new(),
        };
        set.fits = set.fit()?;
        Ok(set)
    }

    fn fit(&self) -> Result<Vec<Fits>, ExperimentError> {
        let grid = &self.plan.grid;
        let keys = grid.phases.iter().flat_map(|&phase| {
            let pairs = grid.functions.iter();
            pairs.flat_map(move |&functions| {
                grid.ridges
                    .iter()
                    .map(move |&ridge| (phase, functions, ridge))
            })
        });
        let keys: Vec<_> = keys.collect();
        let one = |key: (Phase, usize, f64)| -> Result<Fits, ExperimentError> {
            let (phase, functions, ridge) = key;
            let setting = Setting {
                phase,
                functions,
                ridge,
                ..grid.setting(&super::setting::Choice::default())
            };
            let valid = setting.valid(self.plan.dofs)?;
            let forward = self.at(phase);
            let backward: Vec<_> = forward.iter().map(Demonstration::backwards).collect();
            Ok(Fits {
                key,
                forward: fit(forward, &valid)?,
                backward: fit(&backward, &valid)?,
            })
        };
        keys.into_par_iter().map(one).collect()
    }

    /// The movements as they were timed.
    pub(super) fn demonstrations(&self) -> &[Demonstration] {
        &self.by_time
    }

    /// The movements by this phase.
    pub(super) fn at(&self, phase: Phase) -> &[Demonstration] {
        match phase {
            Phase::Time => &self.by_time,
            Phase::Path => &self.by_path,
        }
    }

    pub(super) fn classes(&self) -> BTreeSet<&str> {
        self.by_time.iter().map(Demonstration::class).collect()
    }

    /// The run that a movement was cut from, where the recording goes on.
    pub(super) fn run(&self, movement: usize) -> Option<&Run> {
        let file = self.by_time.get(movement)?.file();
        self.runs.iter().find(|run| run.file == file)
    }

    /// When a movement is so far, seconds from its start.
    pub(super) fn time_s(&self, movement: usize, phase: Phase, share: f64) -> f64 {
        let timed = &self.by_time[movement];
        match phase {
            Phase::Time => share * timed.duration_s(),
            Phase::Path => {
                let mut along = self.by_path[movement].phases();
                let sample = along.position(|p| p >= share - 1e-9);
                let sample = sample.unwrap_or(timed.t_s().len() - 1);
                timed.t_s()[sample] - timed.t_s()[0]
            }
        }
    }

    /// A model of some of the demonstrations.
    pub(super) fn learn(
        &self,
        setting: &Setting,
        training: &[usize],
    ) -> Result<Model, ExperimentError> {
        let valid = setting.valid(self.plan.dofs)?;
        let key = (setting.phase, setting.functions, setting.ridge);
        let of = |all: &[Fitted]| training.iter().map(|&i| all[i].clone()).collect::<Vec<_>>();
        let Some(fits) = self.fits.iter().find(|fits| fits.key == key) else {
            let some: Vec<_> = training
                .iter()
                .map(|&i| self.at(setting.phase)[i].clone())
                .collect();
            return Ok(crate::model::learn(&some, &valid)?);
        };
        let taught = match setting.ways {
            Ways::One => of(&fits.forward),
            Ways::BothDirections => both_ways(&of(&fits.forward), &of(&fits.backward), &valid)?,
        };
        Ok(learn_fitted(taught, &valid)?)
    }
}

impl Run {
    fn of(table: &Table, file: PathBuf) -> Result<Self, ExperimentError> {
        let columns = |names: [&str; 3]| -> Result<Vec<[f64; 3]>, ExperimentError> {
            let [x, y, z] = names.map(|name| table.numbers_in(name, 0..table.rows()));
            let rows = x?.into_iter().zip(y?).zip(z?);
            Ok(rows.map(|((x, y), z)| [x, y, z]).collect())
        };
        let hand = columns(["x", "y", "z"])?;
        let elbow = columns(["elbow_x", "elbow_y", "elbow_z"])?;
        let shoulder = columns(["shoulder_x", "shoulder_y", "shoulder_z"])?;
        let rows = hand.iter().zip(elbow.iter().zip(&shoulder));
        let row = |(hand, (elbow, shoulder)): (&[f64; 3], (&[f64; 3], &[f64; 3]))| {
            std::array::from_fn(|i| match i {
                0..3 => hand[i],
                _ => elbow[i - 3] - shoulder[i - 3],
            })
        };
        Ok(Self {
            file,
            t_s: table.numbers_in("t_s", 0..table.rows())?,
            rows_m: rows.map(row).collect(),
        })
    }
}

/// Without the rows in which the hand is hidden.
fn seen(demonstration: Demonstration, plan: &Plan) -> Result<Demonstration, ExperimentError> {
    if plan.occluded.is_none() {
        return Ok(demonstration);
    }
    let (dofs, hidden) = demonstration.values().split_at(plan.dofs.len());
    let kept = |series: &[f64]| -> Vec<f64> {
        let rows = series.iter().zip(hidden.iter().flatten());
        rows.filter(|(_, hidden)| **hidden == 0.0)
            .map(|(v, _)| *v)
            .collect()
    };
    let values = dofs.iter().map(|series| kept(series)).collect();
    let (label, trial) = (demonstration.label(), demonstration.trial());
    let times = kept(demonstration.t_s());
    Demonstration::new(label, trial, demonstration.file(), times, values).map_err(|source| {
        ExperimentError::Recording {
            file: demonstration.file().to_owned(),
            trial: trial.to_owned(),
            source,
        }
    })
}

//! The same questions to recordings of real people by others.

use std::collections::BTreeSet;
use std::path::Path;

use serde::Serialize;
use tonus_shared::promp::Basis;

use super::{Config, ExperimentError, Progress, Score};
use crate::demonstration::{Choice, Demonstration, read};
use crate::model::evaluate::{Outcome, Protocol, evaluate};
use crate::model::{Dof, Hyperparameters, Valid, learn};
use crate::table::Table;

/// What was found on one recording.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Recording {
    /// Its folder.
    pub name: String,
    /// How what is tested was held out: `leave one out`, `subject1 -> subject2`.
    pub held_out: String,
    /// Classes.
    pub classes: usize,
    /// Demonstrations tested.
    pub demonstrations: usize,
    /// Ten observations in the first 20, 30, 50, 100 % of the movement, duration known.
    pub by_fraction: Vec<At>,
    /// White noise of 0 to 0.05 m added to each observed position; whole movement.
    pub by_noise_m: Vec<At>,
}

/// One point of a sweep.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct At {
    /// What is swept.
    pub at: f64,
    /// What came of it.
    #[serde(flatten)]
    pub score: Score,
}

/// Parts of the movement that are looked at.
const FRACTIONS: [f64; 4] = [0.2, 0.3, 0.5, 1.0];
/// Basis functions of each DoF.
const FUNCTIONS: usize = 20;
/// Noise that the recogniser assumes of positions: what is chosen from, metres.
const SIGMAS_M: [f64; 5] = [0.005, 0.01, 0.02, 0.05, 0.1];
/// Where a new person may stand: what is chosen from, metres.
const PLACEMENTS_M: [f64; 4] = [0.0, 0.05, 0.1, 0.2];
/// Parts that a recording is dealt into where one person is tested on themselves, and for choosing.
const FOLDS: usize = 10;
const INNER_FOLDS: usize = 5;

/// Evaluates the recordings below `folder`: from one person to the other where there are two, else in ten folds.
///
/// The noise that is assumed, and the placement where the person is new, are chosen on the training part alone, by
/// log-loss in five folds of it over the whole, half and 30 % of the movement. Start and duration are known.
///
/// # Errors
/// A recording that is missing or cannot be read; what learning or inference refuses.
pub fn run(
    folder: &Path,
    config: &Config,
    progress: &mut dyn FnMut(Progress),
) -> Result<Vec<Recording>, ExperimentError> {
    let mut step = 0;
    let mut next = |what| {
        progress(Progress {
            what,
            done: step,
            total: 3,
        });
        step += 1;
    };
    next("recordings: six actions of two people");
    let people = read_all(folder, "vmci_pick_place_mocap")?;
    let (one, two): (Vec<_>, Vec<_>) =
        (people.iter().cloned()).partition(|d| d.trial().starts_with("subject1"));
    let name = "vmci_pick_place_mocap";
    let mut found = vec![
        across(name, "subject 1 -> subject 2", (&one, &two), config)?,
        across(name, "subject 2 -> subject 1", (&two, &one), config)?,
    ];
    next("recordings: ten digits");
    found.push(in_folds(folder, "leap_digits_mit", config)?);
    next("recordings: three reaches to grasp");
    found.push(in_folds(folder, "kinesis_reach_to_grasp_mit", config)?);
    Ok(found)
}

/// All demonstrations of one recording, hand position alone.
fn read_all(folder: &Path, name: &str) -> Result<Vec<Demonstration>, ExperimentError> {
    let tables = folder.join(name).join("csv");
    let missing = |source| ExperimentError::Folder {
        folder: tables.clone(),
        source,
    };
    let entries = std::fs::read_dir(&tables).map_err(missing)?;
    let files = entries.map(|entry| entry.map(|file| file.path()));
    let mut files = files.collect::<Result<Vec<_>, _>>().map_err(missing)?;
    files.sort();
    let dofs = ["x", "y", "z"].map(str::to_owned);
    let exclude = ["none", "idle"].map(str::to_owned);
    let choice = Choice {
        dofs: &dofs,
        exclude: &exclude,
    };
    let mut all = Vec::new();
    for file in files {
        all.extend(read(&Table::open(&file)?, &choice)?);
    }
    Ok(all)
}

/// From one person to another.
fn across(
    name: &str,
    held_out: &str,
    (learned, tested): (&[Demonstration], &[Demonstration]),
    config: &Config,
) -> Result<Recording, ExperimentError> {
    let mut answers = Answers::new();
    let chosen = choose(learned, &PLACEMENTS_M, config)?;
    answers.add(chosen, learned, tested, config)?;
    Ok(answers.recording(name, held_out, tested))
}

/// Each of ten folds, by what is learnt from the others.
fn in_folds(folder: &Path, name: &str, config: &Config) -> Result<Recording, ExperimentError> {
    let all = read_all(folder, name)?;
    let mut answers = Answers::new();
    for fold in 0..FOLDS {
        let (tested, learned) = dealt(&all, fold, FOLDS);
        let chosen = choose(&learned, &[0.0], config)?;
        answers.add(chosen, &learned, &tested, config)?;
    }
    Ok(answers.recording(name, "ten folds", &all))
}

/// Every so many demonstrations from the `fold`th, and the others.
fn dealt(
    all: &[Demonstration],
    fold: usize,
    folds: usize,
) -> (Vec<Demonstration>, Vec<Demonstration>) {
    let (out, others): (Vec<_>, Vec<_>) = all
        .iter()
        .enumerate()
        .partition(|(index, _)| index % folds == fold);
    let own =
        |some: Vec<(usize, &Demonstration)>| some.into_iter().map(|(_, d)| d.clone()).collect();
    (own(out), own(others))
}

/// Placement and noise assumed.
#[derive(Clone, Copy)]
struct Setting {
    placement_m: f64,
    sigma_m: f64,
}

impl Setting {
    fn valid(self) -> Result<Valid, ExperimentError> {
        let dofs = ["x", "y", "z"].map(Dof::position).to_vec();
        let given = Hyperparameters {
            placement_m: self.placement_m,
            ..Hyperparameters::new(dofs, Basis::gaussian(FUNCTIONS)?)
        };
        Ok(given.check()?)
    }

    fn protocol(self, fraction: f64, noise_m: f64, seed: u64) -> Protocol {
        Protocol {
            fraction,
            noise_m,
            sigma_m: self.sigma_m,
            seed,
            ..Protocol::default()
        }
    }
}

/// The setting of least log-loss in five folds of what is learnt from.
fn choose(
    learned: &[Demonstration],
    placements_m: &[f64],
    config: &Config,
) -> Result<Setting, ExperimentError> {
    let mut best: Option<(f64, Setting)> = None;
    for &placement_m in placements_m {
        let mut losses = [0.0; SIGMAS_M.len()];
        for fold in 0..INNER_FOLDS {
            let (out, others) = dealt(learned, fold, INNER_FOLDS);
            let setting = |sigma_m| Setting {
                placement_m,
                sigma_m,
            };
            let model = learn(&others, &setting(SIGMAS_M[0]).valid()?)?;
            for (loss, sigma_m) in losses.iter_mut().zip(SIGMAS_M) {
                for fraction in [0.3, 0.5, 1.0] {
                    let protocol = setting(sigma_m).protocol(fraction, 0.0, config.seed);
                    *loss += evaluate(&model, &out, &protocol)?.log_loss();
                }
            }
        }
        for (loss, sigma_m) in losses.into_iter().zip(SIGMAS_M) {
            let setting = Setting {
                placement_m,
                sigma_m,
            };
            if best.is_none_or(|(least, _)| loss < least) {
                best = Some((loss, setting));
            }
        }
    }
    Ok(best.map_or(
        Setting {
            placement_m: 0.0,
            sigma_m: Protocol::default().sigma_m,
        },
        |(_, setting)| setting,
    ))
}

/// Answers at every point of both sweeps: log probability of the right one, and whether it was given.
struct Answers {
    fractions: Vec<(f64, Vec<(f64, bool)>)>,
    noises: Vec<(f64, Vec<(f64, bool)>)>,
}

impl Answers {
    fn new() -> Self {
        let none = |at| (at, Vec::new());
        Self {
            fractions: FRACTIONS.map(none).to_vec(),
            noises: (0..=5).map(|cm| none(f64::from(cm) * 0.01)).collect(),
        }
    }

    fn add(
        &mut self,
        setting: Setting,
        learned: &[Demonstration],
        tested: &[Demonstration],
        config: &Config,
    ) -> Result<(), ExperimentError> {
        let model = learn(learned, &setting.valid()?)?;
        let outcomes = |protocol: Protocol| -> Result<Vec<(f64, bool)>, ExperimentError> {
            let outcomes = evaluate(&model, tested, &protocol)?.outcomes;
            let one = |o: &Outcome| (o.log_probability, o.recognised == o.label);
            Ok(outcomes.iter().map(one).collect())
        };
        for (fraction, answers) in &mut self.fractions {
            answers.extend(outcomes(setting.protocol(*fraction, 0.0, config.seed))?);
        }
        for (noise_m, answers) in &mut self.noises {
            answers.extend(outcomes(setting.protocol(1.0, *noise_m, config.seed))?);
        }
        Ok(())
    }

    fn recording(self, name: &str, held_out: &str, tested: &[Demonstration]) -> Recording {
        let labels: BTreeSet<&str> = tested.iter().map(Demonstration::label).collect();
        let scored = |points: Vec<(f64, Vec<(f64, bool)>)>| {
            let point = |(at, answers)| At {
                at,
                score: Score::of(answers),
            };
            points.into_iter().map(point).collect()
        };
        Recording {
            name: name.to_owned(),
            held_out: held_out.to_owned(),
            classes: labels.len(),
            demonstrations: tested.len(),
            by_fraction: scored(self.fractions),
            by_noise_m: scored(self.noises),
        }
    }
}

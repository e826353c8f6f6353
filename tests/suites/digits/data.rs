//! The recordings, what is observed of them, and what a model makes of that.

use std::collections::{BTreeMap, HashMap};
use std::sync::{Arc, Mutex};

use tonus::demonstration::{Choice as Columns, Demonstration, read};
use tonus::model::cluster::both_ways;
use tonus::model::recognise::Recogniser;
use tonus::model::tempo::{TempoConfig, TempoRecogniser};
use tonus::model::{
    Dof, Fitted, Hyperparameters, Model, Predictive, Shrinkage, Transform, Valid, fit, learn_fitted,
};
use tonus::table::Table;
use tonus_shared::promp::Basis;

use crate::grid::{Beside, Phase, Setting, Ways};

/// Observations of each movement.
const OBSERVATIONS: usize = 15;
/// Blocks of the selection.
pub(crate) const BLOCKS: usize = 6;
/// Between observations when the tempo is not known, seconds.
const PERIOD_S: f64 = 0.15;
/// Standard deviation of the noise assumed on the other phase.
const PACE_SIGMA: f64 = 0.05;
/// The same on the logarithms of duration and length.
const SIZE_SIGMA: f64 = 0.1;

/// The recordings.
pub(crate) struct Data {
    recorded: Vec<Demonstration>,
    /// Of each recording: three of each digit in each.
    pub(crate) block: Vec<usize>,
    views: Mutex<HashMap<(Phase, Beside), Arc<Both>>>,
    fits: Mutex<HashMap<(Phase, Beside, usize), Arc<Fits>>>,
}

/// Every recording as a setting sees it, and the same backwards.
struct Both {
    forward: Vec<Demonstration>,
    backward: Vec<Demonstration>,
}

/// Fits of them.
struct Fits {
    forward: Vec<Fitted>,
    backward: Vec<Fitted>,
}

/// Log posterior over the ten digits.
pub(crate) type LogPosterior = Vec<f64>;

impl Data {
    pub(crate) fn read() -> Self {
        let folder = tonus_tests::recordings().join("leap_digits_mit/csv");
        let entries = std::fs::read_dir(&folder).expect("the folder of the recording");
        let mut files: Vec<_> = entries.map(|entry| entry.expect("a file").path()).collect();
        files.sort();
        let dofs = ["x", "y", "z"].map(str::to_owned);
        let columns = Columns {
            dofs: &dofs,
            exclude: &[],
        };
        let of_file = |file| read(&Table::open(file).expect("a table"), &columns);
        let recorded: Vec<_> = files
            .iter()
            .flat_map(|file| of_file(file).expect("demonstrations"))
            .collect();
        let mut seen: BTreeMap<String, usize> = BTreeMap::new();
        let mut deal = |d: &Demonstration| {
            let number = seen.entry(d.label().to_owned()).or_default();
            *number += 1;
            (*number - 1) % BLOCKS
        };
        Self {
            block: recorded.iter().map(&mut deal).collect(),
            recorded,
            views: Mutex::default(),
            fits: Mutex::default(),
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.recorded.len()
    }

    fn views(&self, setting: &Setting) -> Arc<Both> {
        let mut known = self.views.lock().expect("no thread panicked");
        let key = (setting.phase, setting.beside);
        let both = known.entry(key).or_insert_with(|| {
            let seen = |d: &Demonstration| seen(d, setting);
            let backwards = self.recorded.iter().map(Demonstration::backwards);
            Arc::new(Both {
                forward: self.recorded.iter().map(seen).collect(),
                backward: backwards.map(|d| seen(&d)).collect(),
            })
        });
        Arc::clone(both)
    }

    fn fits(&self, setting: &Setting) -> Arc<Fits> {
        let mut known = self.fits.lock().expect("no thread panicked");
        let key = (setting.phase, setting.beside, setting.functions);
        let fits = known.entry(key).or_insert_with(|| {
            let views = self.views(setting);
            let fitted = |all: &[Demonstration]| fit(all, &valid(setting)).expect("fits");
            Arc::new(Fits {
                forward: fitted(&views.forward),
                backward: fitted(&views.backward),
            })
        });
        Arc::clone(fits)
    }

    pub(crate) fn learn(&self, setting: &Setting, training: &[usize]) -> Model {
        let fits = self.fits(setting);
        let of = |all: &[Fitted]| training.iter().map(|&i| all[i].clone()).collect::<Vec<_>>();
        let valid = valid(setting);
        let forward = of(&fits.forward);
        let taught = match setting.ways {
            Ways::One => forward,
            Ways::BothDirections => {
                both_ways(&forward, &of(&fits.backward), &valid).expect("both directions")
            }
        };
        learn_fitted(taught, &valid).expect("a model")
    }

    /// What the model, learnt with this setting, makes of some recordings.
    pub(crate) fn answers(
        &self,
        setting: &Setting,
        model: &Model,
        tested: &[usize],
    ) -> Vec<LogPosterior> {
        let view = model.view().expect("a view");
        let mut recogniser = Recogniser::new(model, &view).expect("a recogniser");
        let views = self.views(setting);
        let answer = |&index: &usize| {
            let demonstration = &views.forward[index];
            recogniser.reset();
            let mut observe = |dof: usize, phase: f64| {
                let value = demonstration.value_at(dof, phase).expect("a DoF");
                let sigma = match dof {
                    0..3 => setting.sigma_m,
                    3 => PACE_SIGMA,
                    _ => SIZE_SIGMA * value,
                };
                let observed = recogniser.observe(dof, phase, value, sigma);
                observed.expect("an observation");
            };
            for step in 0..OBSERVATIONS {
                let phase = step as f64 / (OBSERVATIONS - 1) as f64;
                (0..demonstration.values().len().min(4)).for_each(|dof| observe(dof, phase));
            }
            // What does not change is seen once.
            (4..demonstration.values().len()).for_each(|dof| observe(dof, 0.5));
            model.class_log_posterior(&recogniser.log_posterior())
        };
        tested.iter().map(answer).collect()
    }

    /// What the model makes of the first part of some recordings, when somebody says that a movement begins but not how
    /// long it takes. For settings with phase by time and nothing beside.
    pub(crate) fn answers_without_tempo(
        &self,
        setting: &Setting,
        model: &Model,
        (tested, part): (&[usize], f64),
    ) -> Vec<LogPosterior> {
        let view = model.view().expect("a view");
        let config = TempoConfig {
            onsets: 1,
            onset_std_s: 0.0,
            ..TempoConfig::default()
        };
        let mut recogniser = TempoRecogniser::new(model, &view, config).expect("a recogniser");
        let answer = |&index: &usize| {
            let demonstration = &self.recorded[index];
            let duration_s = demonstration.duration_s();
            recogniser.end();
            recogniser.begin(0.0).expect("a beginning");
            let times = (0..).map(|step| f64::from(step) * PERIOD_S);
            for time_s in times.take_while(|time_s| *time_s <= part * duration_s) {
                for dof in 0..3 {
                    let value = demonstration.value_at(dof, time_s / duration_s);
                    let value = value.expect("a DoF");
                    let observed = recogniser.observe(dof, time_s, value, setting.sigma_m);
                    observed.expect("an observation");
                }
            }
            model.class_log_posterior(&recogniser.log_posterior())
        };
        tested.iter().map(answer).collect()
    }

    /// Number of a recording's class in the order of posteriors, which is that of the names.
    pub(crate) fn class(&self, index: usize) -> usize {
        let name = self.recorded[index].label();
        let number = name
            .strip_prefix('d')
            .and_then(|number| number.parse().ok());
        number.expect("a digit")
    }

    pub(crate) fn outside(&self, blocks: &[usize]) -> Vec<usize> {
        let kept = |i: &usize| !blocks.contains(&self.block[*i]);
        (0..self.count()).filter(kept).collect()
    }

    pub(crate) fn inside(&self, block: usize) -> Vec<usize> {
        (0..self.count())
            .filter(|&i| self.block[i] == block)
            .collect()
    }
}

/// The movement with its phase, and beside the position what the setting wants.
fn seen(movement: &Demonstration, setting: &Setting) -> Demonstration {
    let even = movement.at_constant_speed(&[0, 1, 2]);
    let (one, other) = match setting.phase {
        Phase::Time => (movement, &even),
        Phase::Path => (&even, movement),
    };
    let steps = movement.t_s().len() - 1;
    let length_m: f64 = (0..steps)
        .map(|i| {
            let step = movement.values().iter().map(|v| (v[i + 1] - v[i]).powi(2));
            step.sum::<f64>().sqrt()
        })
        .sum();
    let constant = |value: f64| vec![value; steps + 1];
    let mut values = movement.values().to_vec();
    if setting.beside == Beside::PaceAndSize {
        values.push(other.phases().collect());
        values.push(constant(movement.duration_s()));
        values.push(constant(length_m));
    }
    let (label, trial, file) = (movement.label(), movement.trial(), movement.file());
    Demonstration::new(label, trial, file, one.t_s().to_vec(), values).expect("a movement")
}

fn valid(setting: &Setting) -> Valid {
    let mut dofs = ["x", "y", "z"].map(Dof::position).to_vec();
    let more = [
        ("pace", "1", Transform::Identity),
        ("duration", "s", Transform::Log),
        ("length", "m", Transform::Log),
    ];
    let count = match setting.beside {
        Beside::Nothing => 0,
        Beside::PaceAndSize => 3,
    };
    dofs.extend(more.into_iter().take(count).map(|(name, unit, transform)| {
        let (name, unit) = (name.to_owned(), unit.to_owned());
        Dof {
            name,
            unit,
            transform,
        }
    }));
    let hyperparameters = Hyperparameters {
        placement_m: setting.placement_m,
        shrinkage: Shrinkage::Fixed {
            pooled: setting.pooled,
            diagonal: setting.diagonal,
        },
        predictive: Predictive::Fixed {
            freedom: setting.freedom,
        },
        ..Hyperparameters::new(dofs, Basis::gaussian(setting.functions).expect("a basis"))
    };
    hyperparameters.check().expect("in range")
}

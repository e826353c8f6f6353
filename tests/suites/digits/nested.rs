//! Choosing on the training folds alone, and classifying what was left out.

use std::collections::{BTreeMap, HashMap};
use std::sync::atomic::{AtomicUsize, Ordering};
use std::sync::{Arc, Mutex};

use tonus::demonstration::{Choice as Columns, Demonstration, read};
use tonus::model::cluster::{ClusterConfig, both_ways, variants};
use tonus::model::recognise::Recogniser;
use tonus::model::{
    Dof, Fitted, Hyperparameters, Model, Predictive, Shrinkage, Valid, fit, learn_fitted,
};
use tonus::table::Table;
use tonus_shared::promp::Basis;

use crate::grid::{Choice, Phase, Setting, Ways, setting};

/// Observations of each movement.
const OBSERVATIONS: usize = 15;
/// Blocks of the selection.
const BLOCKS: usize = 6;
/// Rounds over all decisions.
const ROUNDS: usize = 2;
const THREADS: usize = 2;

/// The recordings, by [`Phase`].
pub(crate) struct Data {
    by_time: Vec<Demonstration>,
    by_path: Vec<Demonstration>,
    /// Of each recording: three of each digit in each.
    block: Vec<usize>,
    fits: Mutex<HashMap<(Phase, usize), Arc<Fits>>>,
}

/// Log-loss of a choice, learnt without two blocks, summed over the second of them.
pub(crate) type Losses = HashMap<(Choice, usize, usize), f64>;

/// Fits of every recording, and of the same backwards.
struct Fits {
    forward: Vec<Fitted>,
    backward: Vec<Fitted>,
}

/// What became of one recording.
#[derive(Clone, Debug)]
pub(crate) struct Answer {
    pub(crate) class: String,
    pub(crate) recognised: String,
    /// Of its own class.
    pub(crate) log_probability: f64,
}

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
        let by_time: Vec<_> = files
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
            by_path: by_time
                .iter()
                .map(|d| d.at_constant_speed(&[0, 1, 2]))
                .collect(),
            block: by_time.iter().map(&mut deal).collect(),
            by_time,
            fits: Mutex::default(),
        }
    }

    pub(crate) fn count(&self) -> usize {
        self.by_time.len()
    }

    fn demonstrations(&self, phase: Phase) -> &[Demonstration] {
        match phase {
            Phase::Time => &self.by_time,
            Phase::Path => &self.by_path,
        }
    }

    fn fits(&self, setting: &Setting) -> Arc<Fits> {
        let mut known = self.fits.lock().expect("no thread panicked");
        let key = (setting.phase, setting.functions);
        let fits = known.entry(key).or_insert_with(|| {
            let forward = self.demonstrations(setting.phase);
            let backward: Vec<_> = forward.iter().map(Demonstration::backwards).collect();
            let fitted = |all: &[Demonstration]| fit(all, &valid(setting)).expect("fits");
            Arc::new(Fits {
                forward: fitted(forward),
                backward: fitted(&backward),
            })
        });
        Arc::clone(fits)
    }

    fn learn(&self, setting: &Setting, training: &[usize]) -> Model {
        let fits = self.fits(setting);
        let of = |all: &[Fitted]| training.iter().map(|&i| all[i].clone()).collect::<Vec<_>>();
        let valid = valid(setting);
        let forward = of(&fits.forward);
        let taught = match setting.ways {
            Ways::One => forward,
            Ways::BothDirections => {
                both_ways(&forward, &of(&fits.backward), &valid).expect("both directions")
            }
            Ways::Variants => {
                let all = self.demonstrations(setting.phase);
                let all: Vec<_> = training.iter().map(|&i| all[i].clone()).collect();
                let config = ClusterConfig {
                    most_components: 3,
                    restarts: 3,
                    ..ClusterConfig::default()
                };
                let split = variants(&all, &valid, &config).expect("variants");
                let labelled = forward.into_iter().zip(&split.demonstrations);
                let relabel = |(fit, d): (Fitted, &Demonstration)| Fitted {
                    label: d.label().to_owned(),
                    ..fit
                };
                labelled.map(relabel).collect()
            }
        };
        learn_fitted(taught, &valid).expect("a model")
    }

    /// What the model, learnt with this setting, makes of some recordings.
    fn answers(&self, setting: &Setting, model: &Model, tested: &[usize]) -> Vec<Answer> {
        let view = model.view().expect("a view");
        let mut recogniser = Recogniser::new(model, &view).expect("a recogniser");
        let classes = model.classes();
        let answer = |&index: &usize| {
            let demonstration = &self.demonstrations(setting.phase)[index];
            recogniser.reset();
            for step in 0..OBSERVATIONS {
                let phase = step as f64 / (OBSERVATIONS - 1) as f64;
                for dof in 0..3 {
                    let value = demonstration.value_at(dof, phase).expect("a DoF");
                    recogniser
                        .observe(dof, phase, value, setting.sigma_m)
                        .expect("an observation");
                }
            }
            let posterior = model.class_log_posterior(&recogniser.log_posterior());
            let own = classes
                .iter()
                .position(|name| *name == demonstration.label());
            let best = (0..posterior.len()).max_by(|&i, &j| posterior[i].total_cmp(&posterior[j]));
            Answer {
                class: demonstration.label().to_owned(),
                recognised: classes[best.expect("a class")].to_owned(),
                log_probability: posterior[own.expect("its class")],
            }
        };
        tested.iter().map(answer).collect()
    }

    fn outside(&self, blocks: &[usize]) -> Vec<usize> {
        let kept = |i: &usize| !blocks.contains(&self.block[*i]);
        (0..self.count()).filter(kept).collect()
    }

    fn inside(&self, block: usize) -> Vec<usize> {
        (0..self.count())
            .filter(|&i| self.block[i] == block)
            .collect()
    }
}

fn valid(setting: &Setting) -> Valid {
    let dofs = ["x", "y", "z"].map(Dof::position).to_vec();
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

/// Does `work` for every item, in a few threads.
fn parallel<I: Sync, O: Send>(items: &[I], work: impl Fn(&I) -> O + Sync) -> Vec<O> {
    let next = AtomicUsize::new(0);
    let done = Mutex::new(Vec::new());
    std::thread::scope(|scope| {
        for _ in 0..THREADS {
            scope.spawn(|| {
                while let Some((index, item)) = {
                    let index = next.fetch_add(1, Ordering::Relaxed);
                    items.get(index).map(|item| (index, item))
                } {
                    let out = work(item);
                    done.lock().expect("no thread panicked").push((index, out));
                }
            });
        }
    });
    let mut done = done.into_inner().expect("no thread panicked");
    done.sort_by_key(|(index, _)| *index);
    done.into_iter().map(|(_, out)| out).collect()
}

/// For each block what has the least log-loss on the others: one decision after the other, each at its best given the
/// rest, in two rounds. `sizes` says how many values each decision has; what is known already is not done again.
pub(crate) fn choose(data: &Data, sizes: &Choice, known: &mut Losses) -> Vec<Choice> {
    let mut chosen = vec![Choice::default(); BLOCKS];
    for decision in (0..ROUNDS).flat_map(|_| 0..sizes.len()) {
        let values = sizes[decision];
        if values == 1 {
            continue;
        }
        let with = |mut choice: Choice, value: usize| {
            choice[decision] = value;
            choice
        };
        let mut wanted = Vec::new();
        for (block, choice) in chosen.iter().enumerate() {
            for value in 0..values {
                for other in (0..BLOCKS).filter(|&other| other != block) {
                    wanted.push((with(*choice, value), block.min(other), block.max(other)));
                }
            }
        }
        wanted.sort_unstable();
        wanted.dedup();
        wanted.retain(|&(choice, one, two)| !known.contains_key(&(choice, one, two)));
        let losses = parallel(&wanted, |&(choice, one, two)| {
            let setting = setting(&choice);
            let model = data.learn(&setting, &data.outside(&[one, two]));
            [one, two].map(|block| {
                let answers = data.answers(&setting, &model, &data.inside(block));
                answers.iter().map(|a| -a.log_probability).sum::<f64>()
            })
        });
        for ((choice, one, two), [on_one, on_two]) in wanted.into_iter().zip(losses) {
            known.insert((choice, two, one), on_one);
            known.insert((choice, one, two), on_two);
        }
        for (block, choice) in chosen.iter_mut().enumerate() {
            let loss = |value: &usize| {
                let others = (0..BLOCKS).filter(|&other| other != block);
                let losses = others.map(|other| known[&(with(*choice, *value), block, other)]);
                losses.sum::<f64>()
            };
            let best = (0..values).min_by(|one, other| loss(one).total_cmp(&loss(other)));
            *choice = with(*choice, best.expect("a value"));
        }
    }
    chosen
}

/// Each recording by the model of all others, with what was chosen without its block.
pub(crate) fn leave_one_out(data: &Data, chosen: &[Choice]) -> Vec<Answer> {
    let all: Vec<usize> = (0..data.count()).collect();
    parallel(&all, |&left_out| {
        let setting = setting(&chosen[data.block[left_out]]);
        let others: Vec<_> = all.iter().copied().filter(|&i| i != left_out).collect();
        let model = data.learn(&setting, &others);
        let mut answers = data.answers(&setting, &model, &[left_out]);
        answers.remove(0)
    })
}

//! Choosing on the training folds alone, and classifying what was left out.

use std::collections::HashMap;
use std::sync::Mutex;
use std::sync::atomic::{AtomicUsize, Ordering};

use tonus::model::{Model, stacking};

use crate::data::{BLOCKS, Data, LogPosterior};
use crate::grid::{Choice, Setting, setting};

/// Rounds over all decisions.
const ROUNDS: usize = 2;
const THREADS: usize = 2;

/// What a choice, learnt without two blocks, makes of each recording of the second of them, in their order.
pub(crate) type Known = HashMap<(Choice, usize, usize), Vec<LogPosterior>>;

/// Settings and their shares in a mixture.
pub(crate) type Shares = Vec<(Choice, f64)>;

/// Does `work` for every item, in a few threads.
pub(crate) fn parallel<I: Sync, O: Send>(items: &[I], work: impl Fn(&I) -> O + Sync) -> Vec<O> {
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

/// What a block's search has come to.
#[derive(Clone, Debug, Default)]
pub(crate) struct Search {
    /// Of least log-loss on the other blocks.
    pub(crate) chosen: Choice,
    /// All that was looked at.
    pub(crate) seen: Vec<Choice>,
}

/// Log probability of the true class of every recording outside `block`, learnt without it and without the recording's
/// own block.
fn forecasts(data: &Data, known: &Known, choice: &Choice, block: usize) -> Vec<f64> {
    let others = (0..BLOCKS).filter(|&other| other != block);
    let of = |other: usize| {
        let answers = &known[&(*choice, block, other)];
        let recordings = data.inside(other).into_iter().zip(answers);
        recordings.map(|(index, posterior)| posterior[data.class(index)].min(0.0))
    };
    others.flat_map(of).collect()
}

/// For each block what has the least log-loss on the others: one decision after the other, each at its best given the
/// rest, in two rounds. `sizes` says how many values each decision has; what is known already is not done again.
pub(crate) fn choose(data: &Data, sizes: &Choice, known: &mut Known) -> Vec<Search> {
    let mut searches = vec![Search::default(); BLOCKS];
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
        for (block, search) in searches.iter().enumerate() {
            for value in 0..values {
                for other in (0..BLOCKS).filter(|&other| other != block) {
                    let choice = with(search.chosen, value);
                    wanted.push((choice, block.min(other), block.max(other)));
                }
            }
        }
        wanted.sort_unstable();
        wanted.dedup();
        wanted.retain(|key| !known.contains_key(key));
        let found = parallel(&wanted, |&(choice, one, two)| {
            let setting = setting(&choice);
            let model = data.learn(&setting, &data.outside(&[one, two]));
            [one, two].map(|block| data.answers(&setting, &model, &data.inside(block)))
        });
        for ((choice, one, two), [of_one, of_two]) in wanted.into_iter().zip(found) {
            known.insert((choice, two, one), of_one);
            known.insert((choice, one, two), of_two);
        }
        for (block, search) in searches.iter_mut().enumerate() {
            let gain = |value: &usize| -> f64 {
                let logs = forecasts(data, known, &with(search.chosen, *value), block);
                logs.iter().sum()
            };
            let best = (0..values).max_by(|one, other| gain(one).total_cmp(&gain(other)));
            let looked_at = (0..values).map(|value| with(search.chosen, value));
            search.seen.extend(looked_at);
            search.chosen = with(search.chosen, best.expect("a value"));
        }
    }
    searches
}

/// Shares of least log-loss of all that a block's searches have looked at, and the mean log-loss that each block comes to
/// with them on the others.
pub(crate) fn stack(data: &Data, searches: &[Vec<Search>], known: &Known) -> Vec<(Shares, f64)> {
    let of_block = |block: usize| {
        let mut seen: Vec<Choice> = searches
            .iter()
            .flat_map(|s| s[block].seen.clone())
            .collect();
        seen.sort_unstable();
        seen.dedup();
        let logs = seen
            .iter()
            .map(|choice| forecasts(data, known, choice, block));
        let logs: Vec<Vec<f64>> = logs.collect();
        let shares = stacking::shares(&logs, 0.0).expect("shares");
        let mixed = (0..logs[0].len()).map(|i| {
            let terms = shares.iter().zip(&logs).map(|(w, of)| w * of[i].exp());
            terms.sum::<f64>().ln()
        });
        let loss = -mixed.sum::<f64>() / logs[0].len() as f64;
        let kept = seen
            .into_iter()
            .zip(shares)
            .filter(|(_, share)| *share > 0.0);
        (kept.collect(), loss)
    };
    (0..BLOCKS).map(of_block).collect()
}

/// What `answer` makes of each recording with the model of all others, mixed with the shares found without its block.
pub(crate) fn leave_one_out(
    data: &Data,
    shares: &[Shares],
    answer: impl Fn(&Setting, &Model, usize) -> LogPosterior + Sync,
) -> Vec<LogPosterior> {
    let all: Vec<usize> = (0..data.count()).collect();
    parallel(&all, |&left_out| {
        let others: Vec<_> = all.iter().copied().filter(|&i| i != left_out).collect();
        let of = |(choice, share): &(Choice, f64)| {
            let setting = setting(choice);
            let model = data.learn(&setting, &others);
            (*share, answer(&setting, &model, left_out))
        };
        let parts = shares[data.block[left_out]].iter().map(of);
        let (shares, posteriors): (Vec<f64>, Vec<LogPosterior>) = parts.unzip();
        stacking::mixed(&shares, &posteriors).expect("a mixture")
    })
}

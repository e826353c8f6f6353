//! What is tested, and what it is chosen and learnt from.

use std::collections::BTreeSet;

use super::data::Set;

/// Indices of demonstrations.
pub(super) type Indices = Vec<usize>;

/// One model's worth of holding out.
#[derive(Debug, Clone)]
pub(super) struct Fold {
    pub(super) learned: Indices,
    pub(super) tested: Indices,
}

/// What is tested with what was chosen without it.
#[derive(Debug, Clone)]
pub(super) struct Part {
    pub(super) name: String,
    /// Chosen on these alone.
    pub(super) training: Indices,
    pub(super) tested: Indices,
    /// Parts of `training` left out in turn, for choosing.
    pub(super) folds: Vec<Fold>,
    /// Models and what each is tested on.
    pub(super) tests: Vec<Fold>,
}

/// Both directions between two people.
pub(super) fn from_person_to_person(set: &Set) -> Vec<(&'static str, Part)> {
    let [one, two] = people(set);
    let part = |name: &str, training: &Indices, tested: &Indices| {
        let group = |i: usize| set.demonstrations()[i].trial();
        whole(
            name,
            training,
            tested,
            inner(training, group, set.plan.inner),
        )
    };
    vec![
        ("subject 1 -> subject 2", part("subject 1", &one, &two)),
        ("subject 2 -> subject 1", part("subject 2", &two, &one)),
    ]
}

/// Thirds of each person's runs, by the others of the same person.
pub(super) fn own_runs(set: &Set) -> Vec<Part> {
    let mut parts = Vec::new();
    for (person, own) in (1..).zip(people(set)) {
        let trial = |i: usize| set.demonstrations()[i].trial();
        for (third, fold) in (1..).zip(inner(&own, trial, 3)) {
            let folds = inner(&fold.learned, trial, set.plan.inner);
            let name = format!("subject {person}, without third {third}");
            parts.push(whole(&name, &fold.learned, &fold.tested, folds));
        }
    }
    parts
}

/// Each movement by itself, by a model of all others, with what was chosen without its block.
pub(super) fn leave_one_out(set: &Set) -> Vec<Part> {
    let all: Indices = (0..set.demonstrations().len()).collect();
    let blocks = dealt(set, &all, set.plan.blocks);
    let part = |(number, block): (usize, Fold)| {
        let folds = dealt(set, &block.learned, set.plan.inner);
        let alone = |&i: &usize| Fold {
            learned: all.iter().copied().filter(|&j| j != i).collect(),
            tested: vec![i],
        };
        Part {
            name: format!("without block {number}"),
            tests: block.tested.iter().map(alone).collect(),
            training: block.learned,
            tested: block.tested,
            folds,
        }
    };
    (1..).zip(blocks).map(part).collect()
}

fn whole(name: &str, training: &Indices, tested: &Indices, folds: Vec<Fold>) -> Part {
    Part {
        name: name.to_owned(),
        training: training.clone(),
        tested: tested.clone(),
        folds,
        tests: vec![Fold {
            learned: training.clone(),
            tested: tested.clone(),
        }],
    }
}

fn people(set: &Set) -> [Indices; 2] {
    let first = |i: &usize| set.demonstrations()[*i].trial().starts_with("subject1");
    let (one, two) = (0..set.demonstrations().len()).partition(first);
    [one, two]
}

/// Groups (whole, dealt in their order) left out in turn, at most `folds` times.
fn inner<'g>(members: &[usize], group: impl Fn(usize) -> &'g str, folds: usize) -> Vec<Fold> {
    let groups: BTreeSet<&str> = members.iter().map(|&i| group(i)).collect();
    let groups: Vec<&str> = groups.into_iter().collect();
    let folds = folds.min(groups.len());
    let fold_of = |i: &usize| groups.iter().position(|g| *g == group(*i)).unwrap_or(0) % folds;
    left_out(members, fold_of, folds)
}

/// Every so many of each class left out in turn.
fn dealt(set: &Set, members: &[usize], folds: usize) -> Vec<Fold> {
    let class = |i: usize| set.demonstrations()[i].class();
    let place = |i: &usize| {
        let before = members.iter().take_while(|j| *j != i);
        before.filter(|j| class(**j) == class(*i)).count() % folds
    };
    left_out(members, place, folds)
}

fn left_out(members: &[usize], fold_of: impl Fn(&usize) -> usize, folds: usize) -> Vec<Fold> {
    let one = |fold: usize| {
        let (tested, learned) = members.iter().copied().partition(|i| fold_of(i) == fold);
        Fold { learned, tested }
    };
    (0..folds).map(one).collect()
}

//! Real motion: six actions of two people who pick and place, recognised from the hand's position alone.
//!
//! Ten observations equally spaced over the first part of each movement. **The duration is an oracle**: phases
//! are time over the recorded duration, which nobody knows while the movement is going on.
//!
//! Across people, every hyperparameter is chosen on one person (leave one run out, least mean log-loss over whole,
//! half and 30 %) and then tested once on the other. What was not chosen that way: the form of the shrinkage and
//! that there is a placement term at all were settled while both directions were looked at.
#![allow(missing_docs, reason = "test suite")]

use std::collections::BTreeSet;
use tonus::demonstration::{Choice, Demonstration, read};
use tonus::model::evaluate::{Evaluation, Protocol, evaluate, leave_one_out};
use tonus::model::{Dof, Hyperparameters, Valid, learn};
use tonus::table::Table;
use tonus_shared::promp::Basis;

const FRACTIONS: [f64; 3] = [1.0, 0.5, 0.3];
const FUNCTIONS: [usize; 4] = [8, 12, 20, 30];
const RIDGES: [f64; 2] = [1e-3, 1e-1];
const PLACEMENTS_M: [f64; 4] = [0.0, 0.05, 0.1, 0.2];
const SIGMAS_M: [f64; 5] = [0.01, 0.02, 0.03, 0.05, 0.1];

fn demonstrations() -> Vec<Demonstration> {
    let folder = tonus_tests::recordings().join("vmci_pick_place_mocap/csv");
    let entries = std::fs::read_dir(&folder).expect("the folder of the recording");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    let dofs = ["x", "y", "z"].map(str::to_owned);
    let exclude = ["none", "idle"].map(str::to_owned);
    let choice = Choice {
        dofs: &dofs,
        exclude: &exclude,
    };
    let of_file = |file| read(&Table::open(file).expect("a table"), &choice);
    let all = files
        .iter()
        .flat_map(|file| of_file(file).expect("demonstrations"));
    all.collect()
}

/// What is decided before learning, and the noise that the recogniser assumes.
#[derive(Clone, Copy, Debug)]
struct Setting {
    functions: usize,
    ridge: f64,
    placement_m: f64,
    sigma_m: f64,
}

impl Setting {
    fn valid(&self) -> Valid {
        let basis = Basis::gaussian(self.functions).expect("a basis");
        let dofs = ["x", "y", "z"].map(Dof::position).to_vec();
        let hyperparameters = Hyperparameters {
            ridge: self.ridge,
            placement_m: self.placement_m,
            ..Hyperparameters::new(dofs, basis)
        };
        hyperparameters.check().expect("in range")
    }

    fn protocol(&self, fraction: f64) -> Protocol {
        Protocol {
            fraction,
            sigma_m: self.sigma_m,
            ..Protocol::default()
        }
    }
}

/// Right answers and summed log-loss for each of the fractions.
#[derive(Clone, Copy, Debug, Default)]
struct Score {
    correct: [usize; 3],
    loss: [f64; 3],
    total: usize,
}

impl Score {
    fn add(&mut self, evaluations: [Evaluation; 3]) {
        for (index, evaluation) in evaluations.iter().enumerate() {
            self.correct[index] += evaluation.correct();
            self.loss[index] += evaluation.log_loss() * evaluation.total() as f64;
        }
        self.total += evaluations[0].total();
    }

    fn mean_loss(&self) -> f64 {
        self.loss.iter().sum::<f64>() / (3 * self.total) as f64
    }
}

impl std::fmt::Display for Score {
    fn fmt(&self, f: &mut std::fmt::Formatter<'_>) -> std::fmt::Result {
        for (correct, loss) in self.correct.iter().zip(self.loss) {
            let mean = loss / self.total as f64;
            write!(f, "{correct:>3} of {} ({mean:.3})  ", self.total)?;
        }
        Ok(())
    }
}

/// Learns with everything but the noise, then scores each noise of [`SIGMAS_M`].
fn score(
    setting: Setting,
    learned: &[Demonstration],
    tested: &[Demonstration],
    scores: &mut [Score],
) {
    let model = learn(learned, &setting.valid()).expect("a model");
    for (sigma_m, score) in SIGMAS_M.into_iter().zip(scores) {
        let with = Setting { sigma_m, ..setting };
        let at = |fraction| evaluate(&model, tested, &with.protocol(fraction));
        score.add(FRACTIONS.map(|fraction| at(fraction).expect("an evaluation")));
    }
}

/// The setting of least mean log-loss on one person, leaving one run out.
fn choose(person: &[Demonstration]) -> (Setting, Score) {
    let runs: BTreeSet<_> = person.iter().map(Demonstration::trial).collect();
    let mut best: Option<(Setting, Score)> = None;
    for functions in FUNCTIONS {
        for (ridge, placement_m) in RIDGES
            .into_iter()
            .flat_map(|ridge| PLACEMENTS_M.map(|placement_m| (ridge, placement_m)))
        {
            let setting = Setting {
                functions,
                ridge,
                placement_m,
                sigma_m: f64::NAN,
            };
            let mut scores = [Score::default(); SIGMAS_M.len()];
            for run in &runs {
                let (out, others): (Vec<_>, Vec<_>) =
                    person.iter().cloned().partition(|d| d.trial() == *run);
                score(setting, &others, &out, &mut scores);
            }
            for (sigma_m, score) in SIGMAS_M.into_iter().zip(scores) {
                if best.is_none_or(|(_, least)| score.mean_loss() < least.mean_loss()) {
                    best = Some((Setting { sigma_m, ..setting }, score));
                }
            }
        }
    }
    best.expect("the grid is not empty")
}

/// Chooses on `person`, tests on `other`, prints both.
fn across(
    names: (&str, &str),
    person: &[Demonstration],
    other: &[Demonstration],
) -> (String, Score) {
    let (setting, inside) = choose(person);
    let model = learn(person, &setting.valid()).expect("a model");
    let at = |fraction| evaluate(&model, other, &setting.protocol(fraction));
    let mut score = Score::default();
    score.add(FRACTIONS.map(|fraction| at(fraction).expect("an evaluation")));
    let parts = model.parts();
    let text = format!(
        "chosen on {} alone: K = {}, ridge {}, placement {} m, sigma {} m; shrinkage a = {}, b = {}; rank {}\n\
         {:<32}{inside}\n{:<32}{score}\n",
        names.0,
        setting.functions,
        setting.ridge,
        setting.placement_m,
        setting.sigma_m,
        parts.pooled_share,
        parts.diagonal_share,
        parts.rank,
        format!("  {}, one run left out", names.0),
        format!("  {} -> {}", names.0, names.1),
    );
    (text, score)
}

#[test]
fn six_actions_of_two_people() {
    let all = demonstrations();
    let (one, two): (Vec<_>, Vec<_>) = all
        .iter()
        .cloned()
        .partition(|d| d.trial().starts_with("subject1"));
    assert_eq!((one.len(), two.len()), (54, 36));

    let ((forth, on_two), (back, on_one), alone) = std::thread::scope(|scope| {
        let forth = scope.spawn(|| across(("subject 1", "subject 2"), &one, &two));
        let back = scope.spawn(|| across(("subject 2", "subject 1"), &two, &one));
        // The settings that the program has when nothing is said.
        let default = Setting {
            functions: 20,
            ridge: 1e-3,
            placement_m: 0.0,
            sigma_m: Protocol::default().sigma_m,
        };
        let protocol = default.protocol(1.0);
        let alone = leave_one_out(&all, &default.valid(), &protocol, &mut |_| ());
        let joined = "the thread ends";
        (
            forth.join().expect(joined),
            back.join().expect(joined),
            alone.expect("an evaluation"),
        )
    });

    println!("Six actions, hand position only, 10 observations, duration known (an oracle).");
    println!("Right answers (mean log-loss, nats)  whole            first half       first 30 %");
    print!("{forth}{back}");
    println!(
        "both, defaults, one demonstration left out: {} of {} ({:.3})",
        alone.correct(),
        alone.total(),
        alone.log_loss()
    );

    assert_eq!((alone.correct(), alone.total()), (90, 90));
    // Medians of 144 plain settings are 34, 31 and 22; the last two are exceeded.
    assert!(on_two.correct[0] >= 34, "whole: {on_two}");
    assert!(on_two.correct[1] >= 32, "first half: {on_two}");
    assert!(on_two.correct[2] >= 28, "first 30 %: {on_two}");
    // The other way round: the same shares of 54 would be 51, 46 and 33. From 36 demonstrations the first half falls
    // short of that, and what it reaches is held here.
    assert_eq!(on_one.total, 54);
    assert!(on_one.correct[0] >= 51, "whole: {on_one}");
    assert!(on_one.correct[1] >= 42, "first half: {on_one}");
    assert!(on_one.correct[2] >= 33, "first 30 %: {on_one}");
}

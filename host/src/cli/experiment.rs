//! `tonus experiment`: the paper's three experiments, and the same questions to recordings.

mod methods;
mod real_people;
mod text;

use std::io::{IsTerminal, stderr};
use std::path::PathBuf;

use anyhow::bail;
use clap::ValueEnum;
use serde_json::{Value, json};
use tonus::experiment::{
    self, Config, Progress as Done, Results, baselines, hand_over, object_matching, pick_and_place,
    recordings,
};
use tonus::report;

use super::progress::Progress;
use super::{UsageError, say};

const EXAMPLE: &str = "Examples:
  tonus experiment hand-over                     tables, seed 1
  tonus experiment all --seed 7 --json           one JSON document
  tonus experiment object-matching --seeds 5     means of seeds 1 to 5
  tonus experiment all --report results          also a page with figures, results/report.html
  tonus experiment baselines                     other methods on the same data
  tonus experiment recordings --data recordings/ the same questions to recordings of real people

The three experiments run on a simulated wearer: raw sEMG, the wearable's pipeline, packets of which 5 % are lost, a
tracker with its errors, a robot shown by teleoperation. Accuracy is on movements that were held out. Keys of the JSON:
pick_and_place.{leave_one_out,first_half,three_observations}.{correct,total,accuracy,log_loss},
pick_and_place.unlabelled.{components,adjusted_rand_index}, object_matching.{with_semg,without_semg}.{correct,total,
accuracy,log_loss}, hand_over.{a,b,c}.{end_point_error_m,path_rmse_m,stiffness_nrmse,coverage_95}, and more. With
--seeds every number is the mean over the seeds.";

/// Run the paper's experiments on the simulated wearer.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct ExperimentArgs {
    /// Which one; `all` is the first four, and the recordings when --data is given.
    #[arg(value_name = "EXPERIMENT")]
    which: Which,
    /// Everything random follows from it.
    #[arg(long, value_name = "S", default_value = "1")]
    seed: u64,
    /// Runs this many seeds from --seed on and gives the means.
    #[arg(long, value_name = "N", default_value = "1", value_parser = clap::value_parser!(u64).range(1..=1000))]
    seeds: u64,
    /// Folder of the recordings (vmci_pick_place_mocap, leap_digits_mit, kinesis_reach_to_grasp_mit).
    #[arg(long, value_name = "DIR")]
    data: Option<PathBuf>,
    /// Writes one self-contained page, report.html, into this folder: figures of the first seed, tables of all.
    #[arg(long, value_name = "DIR")]
    report: Option<PathBuf>,
}

#[derive(Clone, Copy, PartialEq, Eq, ValueEnum)]
enum Which {
    /// Section 3.1: pulls an elastic band to new targets, the robot meets the hand.
    HandOver,
    /// Section 3.2: three objects told apart by the muscles.
    ObjectMatching,
    /// Section 3.3: reach, pick and place.
    PickAndPlace,
    /// Other methods on the data of the three, one table each.
    Baselines,
    /// Recordings of real people.
    Recordings,
    /// All of them.
    All,
}

impl ExperimentArgs {
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        if self.which == Which::Recordings && self.data.is_none() {
            bail!(UsageError(
                "recordings are read from the folder that --data names"
            ));
        }
        if let Some(folder) = &self.report {
            report::prepare(folder)?;
        }
        let mut all = Vec::new();
        for seed in self.seed..self.seed.saturating_add(self.seeds) {
            all.push(self.one(seed, json)?);
        }
        let documents = all
            .iter()
            .map(serde_json::to_value)
            .collect::<Result<Vec<_>, _>>()?;
        let mut mean = experiment::mean_of(&documents);
        if let (Value::Object(keys), true) = (&mut mean, self.seeds > 1) {
            keys.remove("seed");
            keys.insert(
                "seeds".to_owned(),
                json!(all.iter().map(|r| r.seed).collect::<Vec<_>>()),
            );
        }
        say(&if json {
            format!("{}\n", serde_json::to_string_pretty(&mean)?)
        } else {
            text::tables(&mean)
        })?;
        // Last: numbers that took minutes are not lost to a disk that is full.
        if let Some(folder) = &self.report {
            let page = report::write_seeds(folder, &all)?;
            eprintln!("wrote {}", page.display());
        }
        Ok(())
    }

    fn one(&self, seed: u64, json: bool) -> anyhow::Result<Results> {
        let config = Config {
            seed,
            ..Config::default()
        };
        let bar = Progress::bar("experiment", !json && stderr().is_terminal());
        let mut show = |done: Done| {
            bar.says(done.what);
            bar.at(done.done, done.total);
        };
        let is = |which| self.which == which || self.which == Which::All;
        let mut results = Results::of(seed);
        if is(Which::HandOver) {
            results.hand_over = Some(hand_over::run(&config, &mut show)?);
        }
        if is(Which::ObjectMatching) {
            results.object_matching = Some(object_matching::run(&config, &mut show)?);
        }
        if is(Which::PickAndPlace) {
            results.pick_and_place = Some(pick_and_place::run(&config, &mut show)?);
        }
        if is(Which::Baselines) {
            results.baselines = Some(baselines::run(
                &config,
                &baselines::Sizes::default(),
                &mut show,
            )?);
        }
        if let (Some(folder), true) = (&self.data, is(Which::Recordings)) {
            results.recordings = Some(recordings::run(folder, &config, &mut show)?);
        }
        bar.finish();
        Ok(results)
    }
}

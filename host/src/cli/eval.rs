//! `tonus eval`: how good a model is on demonstrations.

use std::fmt::Write;
use std::io::{IsTerminal, stderr};
use std::path::PathBuf;

use serde_json::{Map, Value, json};
use tonus::model::evaluate::{Evaluation, Protocol, evaluate, leave_one_out};
use tonus::store;

use super::progress::Progress;
use super::{options, say};

const EXAMPLE: &str = "Example:
  tonus eval skills.safetensors others.csv --fraction 0.3 --noise-m 0.01 --seed 7

Phases are time over each demonstration's recorded duration, which nobody knows while a movement is going on: the
figures are those of a recogniser that is told the duration. On demonstrations the model was learnt from they say little;
--leave-one-out learns again without each one, with the model's DoFs, basis, ridge and placement.";

/// Recognise demonstrations, predict their unobserved part, and count the errors.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct EvalArgs {
    /// Model file.
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// Demonstrations, with columns `t_s`, `label`, `trial` and the model's DoFs.
    #[arg(value_name = "DEMOS.csv", required = true)]
    files: Vec<PathBuf>,
    /// How many times every DoF is observed, equally spaced from the start.
    #[arg(long, value_name = "N", default_value = "10", value_parser = clap::value_parser!(u32).range(1..=10_000))]
    observations: u32,
    /// First part of each movement that is observed, above 0 to 1.
    #[arg(long, value_name = "F", value_parser = options::fraction, default_value = "0.5")]
    fraction: f64,
    /// Standard deviation of noise added to the observed positions, metres; the recogniser knows of it.
    #[arg(long, value_name = "M", value_parser = options::not_negative, default_value = "0")]
    noise_m: f64,
    /// Standard deviation the recogniser assumes of positions besides that, metres: all that new performances differ in
    /// and the demonstrations do not show. Other DoFs: 15 % of their standard deviation in the demonstrations.
    #[arg(long, value_name = "M", value_parser = options::positive, default_value = "0.05")]
    sigma_m: f64,
    /// Seed of the noise.
    #[arg(long, value_name = "S", default_value = "0")]
    seed: u64,
    /// Learn again without each demonstration in turn, and evaluate on that one.
    #[arg(long)]
    leave_one_out: bool,
    /// Labels that are no skills.
    #[arg(
        long,
        value_name = "LABELS",
        value_delimiter = ',',
        default_value = "none,idle"
    )]
    exclude: Vec<String>,
}

impl EvalArgs {
    /// Evaluates and reports.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let model = store::load(&self.model)?;
        let demonstrations = options::demonstrations(&self.files, model.dofs(), &self.exclude)?;
        let protocol = Protocol {
            observations: self.observations as usize,
            fraction: self.fraction,
            sigma_m: self.sigma_m,
            noise_m: self.noise_m,
            seed: self.seed,
            ..Protocol::default()
        };
        let evaluation = if self.leave_one_out {
            let valid = model.hyperparameters().check()?;
            let total = demonstrations.len() as u64;
            let progress = Progress::bar("leaving one out", !json && stderr().is_terminal());
            let mut done = |count: usize| progress.at(count as u64, total);
            let evaluation = leave_one_out(&demonstrations, &valid, &protocol, &mut done)?;
            progress.finish();
            evaluation
        } else {
            evaluate(&model, &demonstrations, &protocol)?
        };
        if json {
            say(&format!("{}\n", self.summary(&evaluation)))
        } else {
            say(&self.text(&evaluation)?)
        }
    }

    fn summary(&self, evaluation: &Evaluation) -> Value {
        let (correct, total) = (evaluation.correct(), evaluation.total());
        let rmse = evaluation.rmse();
        let rmse: Map<String, Value> = rmse
            .map(|(dof, rmse)| (dof.name.clone(), json!(rmse)))
            .collect();
        let rows = evaluation.labels.iter().zip(evaluation.confusion());
        let row = |counts: Vec<usize>| -> Map<String, Value> {
            let cells = evaluation.labels.iter().zip(counts);
            cells
                .map(|(label, count)| (label.clone(), json!(count)))
                .collect()
        };
        let confusion: Map<String, Value> = rows
            .map(|(label, counts)| (label.clone(), Value::Object(row(counts))))
            .collect();
        json!({
            "correct": correct,
            "total": total,
            "accuracy": correct as f64 / total as f64,
            "log_loss": evaluation.log_loss(),
            "confusion": confusion,
            "rmse": rmse,
            "observations": self.observations,
            "fraction": self.fraction,
            "leave_one_out": self.leave_one_out,
            "duration": "known",
        })
    }

    fn text(&self, evaluation: &Evaluation) -> anyhow::Result<String> {
        let (correct, total) = (evaluation.correct(), evaluation.total());
        let mut text = format!(
            "{correct} of {total} recognised ({:.1} %) from {} observations of the first {} %, duration known\nlog-loss {:.4} nats\n",
            100.0 * correct as f64 / total as f64,
            self.observations,
            100.0 * self.fraction,
            evaluation.log_loss(),
        );
        for (dof, rmse) in evaluation.rmse() {
            match rmse {
                Some(rmse) => writeln!(
                    text,
                    "rmse of the unobserved part: {} {rmse:.4} {}",
                    dof.name, dof.unit
                )?,
                None => writeln!(
                    text,
                    "rmse of the unobserved part: {}: nothing was unobserved",
                    dof.name
                )?,
            }
        }
        let width = evaluation
            .labels
            .iter()
            .map(|label| label.chars().count())
            .max()
            .unwrap_or(0);
        writeln!(text, "performed (row), recognised (column, same order)")?;
        for (label, counts) in evaluation.labels.iter().zip(evaluation.confusion()) {
            write!(text, "{label:<width$}")?;
            for count in counts {
                write!(text, " {count:>4}")?;
            }
            writeln!(text)?;
        }
        Ok(text)
    }
}

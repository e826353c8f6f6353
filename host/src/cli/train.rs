//! `tonus train`: a model from demonstrations.

use std::io::{IsTerminal, stderr};
use std::path::PathBuf;

use serde_json::json;
use tonus::config::Config;
use tonus::demonstration::Demonstration;
use tonus::library::Library;
use tonus::model::cluster::Labelled;
use tonus::model::novelty::Gate;
use tonus::model::{
    Dof, EmConfig, Hyperparameters, HyperparametersError, Model, extend, learn, learn_em,
};
use tonus::store;
use tonus_shared::promp::Basis;

use super::progress::Progress;
use super::unlabelled::{self, UnlabelledArgs};
use super::{UsageError, keep_inputs, options, say};

const EXAMPLE: &str = "Example:
  tonus train lifts.csv pushes.csv -o skills.safetensors --dofs x,y,z,kz:N/m:log --basis gaussian:20
  tonus train more.csv --add-to skills.safetensors -o more.safetensors
  tonus train recorded.csv --live -o skills.safetensors; tonus run --model skills.safetensors

A demonstration is a contiguous run of rows with one `label` in one `trial`; `t_s` must strictly increase in it.
Sampling may be irregular; a row with an empty cell in a chosen column is a gap (but see --em). Where a
demonstration has fewer samples than basis functions, its fit goes straight from sample to sample (--ridge).

A model keeps what was fitted to each demonstration, so more can be added without the old recordings.";

/// Learn skills from demonstrations in CSV files.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct TrainArgs {
    /// Demonstrations, with columns `t_s`, `label`, `trial` and those of --dofs.
    #[arg(value_name = "DEMOS.csv", required = true)]
    files: Vec<PathBuf>,
    /// Model file to write (safetensors).
    #[arg(short, long, value_name = "MODEL")]
    output: PathBuf,
    /// Model to add the demonstrations to, as if it had been trained on all of them; its DoFs, basis, ridge and
    /// placement are kept.
    #[arg(long, value_name = "MODEL", conflicts_with_all = ["dofs", "basis", "ridge", "placement_m"])]
    add_to: Option<PathBuf>,
    /// Learn by expectation maximisation over the samples themselves: a row with an empty cell still counts for its
    /// other columns, and a demonstration may lack a column altogether. Such a model cannot be added to.
    #[arg(long, conflicts_with = "add_to")]
    em: bool,
    /// Columns to learn, as NAME, NAME:UNIT or NAME:UNIT:log (for what is positive); metres if no unit is given.
    #[arg(long, value_name = "NAMES", value_delimiter = ',', value_parser = options::dof, default_value = "x,y,z")]
    dofs: Vec<Dof>,
    /// gaussian:K (strokes), fourier:K (periodic, K odd) or bernstein:K.
    #[arg(long, value_name = "FAMILY:K", value_parser = options::basis, default_value = "gaussian:20")]
    basis: Basis,
    /// Labels that are no skills.
    #[arg(
        long,
        value_name = "LABELS",
        value_delimiter = ',',
        default_value = "none,idle"
    )]
    exclude: Vec<String>,
    /// Penalty on leaving the straight lines between the samples, DoFs scaled to unit variance.
    #[arg(long, value_name = "R", value_parser = options::positive, default_value = "0.001")]
    ridge: f64,
    /// Standard deviation of where a new person may stand, metres: a constant offset of every position that the
    /// demonstrations do not show. 0.1 or 0.2 serves recognition across people; it blurs prediction of one DoF from
    /// another.
    #[arg(long, value_name = "M", value_parser = options::not_negative, default_value = "0")]
    placement_m: f64,
    /// Learn what `tonus run --model` follows: place and stiffness of hand and robot (the columns that `tonus
    /// export` writes of demonstrations), and the gate that says what is none of the skills.
    #[arg(long, conflicts_with_all = ["add_to", "em", "dofs", "basis", "ridge", "placement_m", "unlabelled", "components"])]
    live: bool,
    /// With --live: share of known movements that may be held as unknown [default: the configuration's default].
    #[arg(long, value_name = "R", value_parser = options::fraction, requires = "live")]
    false_alarm_rate: Option<f64>,
    #[command(flatten)]
    unlabelled: UnlabelledArgs,
}

/// A model, what it was learnt from, and what clustering found there.
struct Learnt {
    model: Model,
    gate: Option<Gate>,
    demonstrations: Vec<Demonstration>,
    labelled: Option<Labelled>,
}

impl TrainArgs {
    /// Reads, learns, writes, reports.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let mut inputs = self.files.clone();
        inputs.extend(self.add_to.clone());
        keep_inputs(&inputs, &self.output)?;
        let progress = Progress::spinner("learning", !json && stderr().is_terminal());
        let Learnt {
            model,
            gate,
            demonstrations,
            labelled,
        } = self.learn()?;
        store::save(&model, gate.as_ref(), &self.output)?;
        progress.finish();
        let functions = model.parts().basis.count();
        let short = |demonstration: &&Demonstration| demonstration.t_s().len() < functions;
        let sparse = demonstrations.iter().filter(short).count();
        if json {
            let mut summary = super::info::model_summary(&model, gate.as_ref());
            summary["model"] = json!(self.output);
            summary["demonstrations"] = json!(demonstrations.len());
            summary["with_fewer_samples_than_functions"] = json!(sparse);
            if let Some(labelled) = &labelled {
                summary["clusters"] = unlabelled::summary(labelled);
            }
            return say(&format!("{summary}\n"));
        }
        let mut text = super::info::model_text(&model, gate.as_ref());
        if sparse > 0 {
            text += &format!(
                "{sparse} of {} demonstrations have fewer samples than the {functions} basis functions\n",
                demonstrations.len()
            );
        }
        if let Some(labelled) = &labelled {
            text += &unlabelled::text(labelled);
        }
        say(&format!("{}: {text}", self.output.display()))
    }

    fn learn(&self) -> anyhow::Result<Learnt> {
        let of = |model, demonstrations| Learnt {
            model,
            gate: None,
            demonstrations,
            labelled: None,
        };
        if self.live {
            let demonstrations = options::live_demonstrations(&self.files, &self.exclude)?;
            let rate = self.false_alarm_rate;
            let rate = rate.unwrap_or(Config::default().recognition.false_alarm_rate);
            let library = Library::learn(&demonstrations, rate)?;
            return Ok(Learnt {
                gate: Some(library.gate),
                ..of(library.model, demonstrations)
            });
        }
        if let Some(path) = &self.add_to {
            let old = store::load(path)?;
            let added = options::demonstrations(&self.files, old.dofs(), &self.exclude)?;
            return Ok(of(extend(&old, &added)?, added));
        }
        let hyperparameters = Hyperparameters {
            ridge: self.ridge,
            placement_m: self.placement_m,
            ..Hyperparameters::new(self.dofs.clone(), self.basis)
        };
        let valid = hyperparameters.check().map_err(|error| match error {
            HyperparametersError::SameName { .. } => {
                anyhow::Error::new(UsageError("--dofs names a column twice"))
            }
            other => other.into(),
        })?;
        let dofs = &valid.get().dofs;
        if self.unlabelled.wanted() {
            let demonstrations =
                options::unlabelled_demonstrations(&self.files, dofs, &self.exclude)?;
            let labelled = self.unlabelled.label(&demonstrations, &valid)?;
            return Ok(Learnt {
                model: learn(&labelled.demonstrations, &valid)?,
                gate: None,
                demonstrations,
                labelled: Some(labelled),
            });
        }
        if self.em {
            let demonstrations =
                options::demonstrations_with_gaps(&self.files, dofs, &self.exclude)?;
            let model = learn_em(&demonstrations, &valid, &EmConfig::default())?;
            return Ok(of(model, demonstrations));
        }
        let demonstrations = options::demonstrations(&self.files, dofs, &self.exclude)?;
        Ok(of(learn(&demonstrations, &valid)?, demonstrations))
    }
}

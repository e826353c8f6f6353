//! `tonus infer`: the rest of a movement from a few observed numbers.

use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde_json::{Map, Value, json};
use tonus::model::compose::{Joint, Plan, Present, Via};
use tonus::model::{Dof, Model, Transform, View};
use tonus::store;
use tonus_shared::promp::Mixture;

use super::options::{Instant, Start, ViaPoint};
use super::{UsageError, keep_inputs, options, say, write_atomically};

/// Rows of the output.
const SAMPLES: usize = 101;

/// How closely a start conditions the skill, as a share of the DoF's spread; the bridge does the rest.
const START_SHARE: f64 = 0.01;

const EXAMPLE: &str = "Example:
  tonus infer skills.safetensors --recognise --at 0.1 --observe x=0.42,y=-0.31 --at 0.3 --observe x=0.40 -o rest.csv

Each --at is paired with the --observe of the same rank; any of the model's DoFs may be observed. OUT.csv has the columns
`phase`, `t_s` (phase times the skill's mean duration) and, for each DoF, its mean and `<name>_std`.

  tonus infer skills.safetensors --label reach --start x=0.30/0.05 --via 0.5:z=0.25 --via 1:z=0.10 -o plan.csv

plans: the movement starts exactly where the robot is and moves as it does, and passes through what is asked.";

/// Infer a whole movement from what was observed of it.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE, group = clap::ArgGroup::new("which").required(true))]
pub(crate) struct InferArgs {
    /// Model file.
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// The skill that is performed.
    #[arg(long, value_name = "LABEL", group = "which")]
    label: Option<String>,
    /// Recognise the skill from the observations.
    #[arg(long, group = "which")]
    recognise: bool,
    /// Phase of an observation, 0 (start) to 1 (end).
    #[arg(long, value_name = "S", value_parser = options::phase)]
    at: Vec<f64>,
    /// What was observed there, in the DoFs' units.
    #[arg(long, value_name = "NAME=VALUE,...", value_parser = options::instant)]
    observe: Vec<Instant>,
    /// Standard deviation of the observations: in the DoF's unit, or as a share of the value where the DoF
    /// enters the model as its logarithm.
    #[arg(long, value_name = "STD", value_parser = options::positive, default_value = "0.01")]
    sigma: f64,
    /// Where the movement is to pass at a phase, in the DoFs' units. The skill is recognised without it.
    #[arg(long, value_name = "S:NAME=VALUE,...", value_parser = options::via_point)]
    via: Vec<ViaPoint>,
    /// Standard deviation of the via-points, as --sigma.
    #[arg(long, value_name = "STD", value_parser = options::positive, default_value = "0.001")]
    via_sigma: f64,
    /// Where the movement starts (at phase S, by default 0) and how fast it moves there, per second.
    #[arg(long, value_name = "[S:]NAME=VALUE/RATE,...", value_parser = options::start)]
    start: Option<Start>,
    /// Part of the movement after the start until the skill goes on alone.
    #[arg(long, value_name = "FRACTION", value_parser = options::fraction, default_value = "0.2")]
    overlap: f64,
    /// Trajectory to write.
    #[arg(short, long, value_name = "OUT.csv")]
    output: PathBuf,
}

impl InferArgs {
    /// Observes, infers, writes, reports.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        keep_inputs([&self.model], &self.output)?;
        if self.at.len() != self.observe.len() {
            bail!(UsageError("give as many --at as --observe, in pairs"));
        }
        if self.recognise && self.at.is_empty() {
            bail!(UsageError(
                "--recognise needs at least one --at with --observe"
            ));
        }
        let model = store::load(&self.model)?;
        let known = self.label.as_deref().map(|label| self.skill(&model, label));
        let known = known.transpose()?;
        let view = model.view()?;
        let mut mixture = view.mixture()?;
        for (&phase, Instant(values)) in self.at.iter().zip(&self.observe) {
            for (name, value) in values {
                self.observe_one(&model, &mut mixture, (phase, name, *value))?;
            }
        }
        let mut log_posterior = vec![0.0; model.labels().len()];
        mixture.log_posterior(&mut log_posterior)?;
        let skill = known.unwrap_or_else(|| mixture.most_likely());
        let mut plan = self.plan(&model, &view, &mixture, skill)?;
        write_trajectory(&self.output, &model, &mut plan)?;
        let label = &model.labels()[skill];
        let probabilities = model.labels().iter().zip(&log_posterior);
        if json {
            let of = |map: fn(f64) -> f64| -> Map<String, Value> {
                let pairs = probabilities.clone();
                pairs
                    .map(|(label, log)| (label.clone(), json!(map(*log))))
                    .collect()
            };
            let summary = json!({
                "label": label,
                "recognised": self.recognise,
                "posterior": of(libm::exp),
                "log_posterior": of(|log| log),
                "duration_s": model.durations()[skill].mean_s,
                "output": self.output,
                "rows": SAMPLES,
            });
            return say(&format!("{summary}\n"));
        }
        let mut text = format!("{}: {SAMPLES} rows of `{label}`\n", self.output.display());
        if self.recognise {
            for (label, log) in probabilities {
                text += &format!("  {label}: {:.4}\n", libm::exp(*log));
            }
        }
        say(&text)
    }

    fn skill(&self, model: &Model, label: &str) -> anyhow::Result<usize> {
        model.skill(label).with_context(|| {
            let known = model.labels().join(", ");
            format!(
                "{}: no skill `{label}`; present: {known}",
                self.model.display()
            )
        })
    }

    fn observe_one(
        &self,
        model: &Model,
        mixture: &mut Mixture<'_, f64, Vec<f64>>,
        (phase, name, value): (f64, &str, f64),
    ) -> anyhow::Result<()> {
        let dof = self.dof(model, name)?;
        let std = std_of(&model.dofs()[dof], self.sigma, value);
        let observation = model.observation(dof, phase, value, std);
        let observation = observation.context("no such DoF")?;
        let observation = observation.with_context(|| format!("--observe {name}={value:?}"))?;
        mixture
            .observe(&observation)
            .with_context(|| format!("--at {phase} --observe {name}={value:?}"))
    }

    /// The movement as observed, with what is asked of it.
    fn plan<'m>(
        &self,
        model: &'m Model,
        view: &'m View<'m>,
        mixture: &Mixture<'_, f64, Vec<f64>>,
        skill: usize,
    ) -> anyhow::Result<Plan<'m>> {
        let belief = mixture.belief(skill).context("no such skill")?;
        let duration_s = model.durations()[skill].mean_s;
        let mut plan = Plan::given(model, view, (skill, duration_s), &belief)?;
        for ViaPoint(phase, Instant(values)) in &self.via {
            for (name, value) in values {
                let dof = self.dof(model, name)?;
                let via = Via {
                    dof,
                    phase: *phase,
                    value: *value,
                    std: std_of(&model.dofs()[dof], self.via_sigma, *value),
                };
                plan.via(&via)
                    .with_context(|| format!("--via {phase}:{name}={value:?}"))?;
            }
        }
        if let Some(start) = &self.start {
            let present = start.states.iter().map(|(name, value, rate)| {
                Ok(Present {
                    dof: self.dof(model, name)?,
                    value: *value,
                    rate: *rate,
                })
            });
            let present = present.collect::<anyhow::Result<Vec<_>>>()?;
            let (phase, overlap) = (start.phase, self.overlap);
            plan.start(&present, Joint { phase, overlap }, START_SHARE)
                .context("--start")?;
        }
        Ok(plan)
    }

    fn dof(&self, model: &Model, name: &str) -> anyhow::Result<usize> {
        model.dof(name).with_context(|| {
            let names: Vec<_> = model.dofs().iter().map(|dof| dof.name.as_str()).collect();
            format!(
                "{}: no DoF `{name}`; present: {}",
                self.model.display(),
                names.join(", ")
            )
        })
    }
}

/// `sigma` in the DoF's unit, or as a share of the value where the DoF enters as its logarithm.
fn std_of(dof: &Dof, sigma: f64, value: f64) -> f64 {
    match dof.transform {
        Transform::Log => sigma * value.abs(),
        Transform::Identity => sigma,
    }
}

fn write_trajectory(path: &Path, model: &Model, plan: &mut Plan<'_>) -> anyhow::Result<()> {
    let duration_s = plan.duration_s();
    let mut writer = csv::Writer::from_writer(Vec::new());
    let names = model
        .dofs()
        .iter()
        .flat_map(|dof| [dof.name.clone(), format!("{}_std", dof.name)]);
    writer.write_record(
        ["phase".to_owned(), "t_s".to_owned()]
            .into_iter()
            .chain(names),
    )?;
    for sample in 0..SAMPLES {
        let phase = sample as f64 / (SAMPLES - 1) as f64;
        let mut record = vec![phase.to_string(), (phase * duration_s).to_string()];
        for dof in 0..model.dofs().len() {
            let planned = plan.predict(dof, phase)?;
            record.extend([planned.mean.to_string(), planned.std.to_string()]);
        }
        writer.write_record(&record)?;
    }
    write_atomically(path, &writer.into_inner()?)
}

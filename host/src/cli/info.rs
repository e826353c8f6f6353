//! `tonus info`: what a file holds.

mod recording;

use std::collections::BTreeMap;
use std::fmt::Write;
use std::fs::File;
use std::io::Read;
use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::{Value, json};
use tonus::demonstration::{Choice, Demonstration, read};
use tonus::model::novelty::Gate;
use tonus::model::{Learner, Model, Transform};
use tonus::store;
use tonus::table::Table;
use tonus_shared::promp::Family;

use super::options::NOT_SIGNALS;
use super::say;

const EXAMPLE: &str = "Example:
  tonus info skills.safetensors
  tonus info lifts.csv --exclude none
  tonus info session.mcap";

/// Say what a model file, a demonstration CSV or a recording holds.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct InfoArgs {
    /// A model file, a CSV file with columns `t_s`, `label`, `trial`, or a recording.
    #[arg(value_name = "FILE")]
    file: PathBuf,
    /// Labels of a CSV file that are no skills.
    #[arg(
        long,
        value_name = "LABELS",
        value_delimiter = ',',
        default_value = "none,idle"
    )]
    exclude: Vec<String>,
}

impl InfoArgs {
    /// Reads and reports.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        if is_safetensors(&self.file)? {
            let (model, gate) = store::load_gated(&self.file)?;
            return if json {
                say(&format!("{}\n", model_summary(&model, gate.as_ref())))
            } else {
                say(&format!(
                    "{}: {}",
                    self.file.display(),
                    model_text(&model, gate.as_ref())
                ))
            };
        }
        let is_recording = tonus::recording::is_recording(&self.file);
        if is_recording.with_context(|| format!("{}: cannot be read", self.file.display()))? {
            return recording::run(&self.file, json);
        }
        let table = Table::open(&self.file)?;
        let signals = signals(&table);
        let choice = Choice {
            dofs: &signals,
            exclude: &self.exclude,
        };
        let demonstrations = read(&table, &choice)?;
        if json {
            say(&format!(
                "{}\n",
                table_summary(&table, &signals, &demonstrations)
            ))
        } else {
            say(&table_text(&table, &signals, &demonstrations)?)
        }
    }
}

/// Safetensors begin with the header's length and its opening brace; no text has such a length.
fn is_safetensors(file: &Path) -> anyhow::Result<bool> {
    let mut start = Vec::new();
    let opened = File::open(file).with_context(|| format!("{}: cannot be read", file.display()))?;
    let mut first = opened.take(9);
    first
        .read_to_end(&mut start)
        .with_context(|| format!("{}: cannot be read", file.display()))?;
    // A length below 2^32 has zeros in its upper half.
    Ok(matches!(start.as_slice(), [_, _, _, _, 0, 0, 0, 0, b'{']))
}

/// Columns in which every cell is a number or empty, and not every one is empty.
fn signals(table: &Table) -> Vec<String> {
    let numeric = |name: &&String| {
        let cells = table.numbers_or_gaps_in(name, 0..table.rows());
        !NOT_SIGNALS.contains(&name.as_str())
            && cells.is_ok_and(|cells| cells.iter().any(Option::is_some))
    };
    table.columns().iter().filter(numeric).cloned().collect()
}

/// A model for `--json`.
pub(super) fn model_summary(model: &Model, gate: Option<&Gate>) -> Value {
    let parts = model.parts();
    let skills = parts.labels.iter().zip(&parts.counts).zip(&parts.durations);
    let predictive = parts.classes.iter().zip(&parts.freedom);
    let skills = skills.zip(predictive).map(|(((label, count), d), (class, freedom))| {
        json!({
            "label": label, "class": class, "demonstrations": count, "degrees_of_freedom": freedom,
            "duration_s": { "mean": d.mean_s, "std": d.std_s, "min": d.min_s, "max": d.max_s },
        })
    });
    json!({
        "kind": "model",
        "schema_version": store::SCHEMA_VERSION,
        "dofs": parts.dofs,
        "basis": { "family": family(model), "functions": parts.basis.count() },
        "rank": parts.rank,
        "skills": skills.collect::<Vec<_>>(),
        "ridge": parts.ridge,
        "placement_m": parts.placement_m,
        "learner": parts.learner,
        "demonstrations_kept": parts.demonstrations.len(),
        "shrinkage": { "pooled": parts.pooled_share, "diagonal": parts.diagonal_share },
        "novelty_gate": gate.map(|gate| json!({
            "false_alarm_rate": gate.parts().false_alarm_rate,
            "demonstrations": gate.parts().skills.len(),
            "dofs": gate.parts().dofs.iter().map(|(_, dof)| &dof.name).collect::<Vec<_>>(),
            "observations": gate.parts().phases.len(),
        })),
    })
}

/// A model for people.
pub(super) fn model_text(model: &Model, gate: Option<&Gate>) -> String {
    let parts = model.parts();
    let dofs = parts.dofs.iter().map(|dof| match dof.transform {
        Transform::Identity => format!("{} [{}]", dof.name, dof.unit),
        Transform::Log => format!("{} [log {}]", dof.name, dof.unit),
    });
    let mut text = format!(
        "{} skills of {}\nbasis {}:{}, rank {}, shrinkage {} pooled + {} diagonal, ridge {}, placement {} m\n",
        parts.labels.len(),
        dofs.collect::<Vec<_>>().join(", "),
        family(model),
        parts.basis.count(),
        parts.rank,
        parts.pooled_share,
        parts.diagonal_share,
        parts.ridge,
        parts.placement_m,
    );
    text += &match parts.learner {
        Learner::LeastSquares => {
            let kept = parts.demonstrations.len();
            format!("{kept} demonstrations kept: more can be added (tonus train --add-to)\n")
        }
        Learner::Em => "learnt by EM: with more demonstrations, train again from all\n".to_owned(),
    };
    if let Some(gate) = gate {
        text += &format!(
            "novelty gate of {} demonstrations, {} % false alarms: ready for tonus run --model\n",
            gate.parts().skills.len(),
            100.0 * gate.parts().false_alarm_rate
        );
    }
    let skills = parts.labels.iter().zip(&parts.counts).zip(&parts.durations);
    for (skill, ((label, count), d)) in skills.enumerate() {
        let class = &parts.classes[skill];
        let of_class = if class == label {
            String::new()
        } else {
            format!(" of class {class}")
        };
        let predictive = match parts.freedom[skill] {
            Some(freedom) => format!("Student-t of {freedom} degrees of freedom"),
            None => "Gaussian".to_owned(),
        };
        text += &format!(
            "  {label}{of_class}: {count} demonstrations, {:.2} s ({:.2} to {:.2}), {predictive}\n",
            d.mean_s, d.min_s, d.max_s
        );
    }
    text
}

const fn family(model: &Model) -> &'static str {
    match model.parts().basis.family() {
        Family::Gaussian { .. } => "gaussian",
        Family::Fourier => "fourier",
        Family::Bernstein => "bernstein",
    }
}

/// Number of demonstrations, of samples, and total time, seconds, by label.
fn by_label(demonstrations: &[Demonstration]) -> BTreeMap<&str, (usize, usize, f64)> {
    let mut all = BTreeMap::new();
    for demonstration in demonstrations {
        let (count, samples, total_s) = all.entry(demonstration.label()).or_insert((0, 0, 0.0));
        *count += 1;
        *samples += demonstration.t_s().len();
        *total_s += demonstration.duration_s();
    }
    all
}

fn table_summary(table: &Table, signals: &[String], demonstrations: &[Demonstration]) -> Value {
    let skills = by_label(demonstrations).into_iter();
    let skills = skills.map(|(label, (count, samples, total_s))| {
        json!({
            "label": label, "demonstrations": count, "samples": samples,
            "mean_duration_s": total_s / count as f64,
        })
    });
    json!({
        "kind": "demonstrations",
        "rows": table.rows(),
        "signals": signals,
        "demonstrations": demonstrations.len(),
        "skills": skills.collect::<Vec<_>>(),
    })
}

fn table_text(
    table: &Table,
    signals: &[String],
    demonstrations: &[Demonstration],
) -> anyhow::Result<String> {
    let mut text = format!(
        "{}: {} demonstrations in {} rows of {}\n",
        table.file().display(),
        demonstrations.len(),
        table.rows(),
        signals.join(", "),
    );
    for (label, (count, samples, total_s)) in by_label(demonstrations) {
        let mean_s = total_s / count as f64;
        let rate_hz = (samples - count) as f64 / total_s;
        writeln!(
            text,
            "  {label}: {count} demonstrations, {mean_s:.2} s, {rate_hz:.1} Hz"
        )?;
    }
    Ok(text)
}

//! `tonus train` without labels, or with some.

use std::fmt::Write;

use serde_json::{Value, json};
use tonus::demonstration::Demonstration;
use tonus::model::Valid;
use tonus::model::cluster::{ClusterConfig, Covariances, Labelled, label};

/// What to do about demonstrations without a label.
#[derive(clap::Args)]
pub(super) struct UnlabelledArgs {
    /// Leave all labels aside, find which demonstrations belong together and how many skills there are, and call them
    /// skill1, skill2 ...
    #[arg(long, conflicts_with_all = ["add_to", "em"])]
    unlabelled: bool,
    /// How many skills: a number, or `auto` for the number that explains demonstrations left out best. Without
    /// --unlabelled, demonstrations with a label keep it, and those whose label cell is empty join them or make
    /// skills of their own.
    #[arg(long, value_name = "N|auto", value_parser = components, conflicts_with_all = ["add_to", "em"])]
    components: Option<Components>,
}

/// How many skills.
#[derive(Clone, Copy, Debug)]
enum Components {
    Auto,
    Exactly(usize),
}

fn components(text: &str) -> Result<Components, String> {
    match text.parse() {
        _ if text == "auto" => Ok(Components::Auto),
        Ok(number) if number > 0 => Ok(Components::Exactly(number)),
        _ => Err(format!("`{text}` is neither `auto` nor a number above 0")),
    }
}

impl UnlabelledArgs {
    /// Whether demonstrations without a label are wanted.
    pub(super) fn wanted(&self) -> bool {
        self.unlabelled || self.components.is_some()
    }

    /// Labels for the demonstrations that have none (or for all).
    pub(super) fn label(
        &self,
        demonstrations: &[Demonstration],
        valid: &Valid,
    ) -> anyhow::Result<Labelled> {
        let mut config = ClusterConfig::default();
        if let Some(Components::Exactly(number)) = self.components {
            config.least_components = number;
            config.most_components = number;
        }
        if self.unlabelled {
            let without: Vec<_> = demonstrations.iter().map(|d| d.with_label("")).collect();
            return Ok(label(&without, valid, &config)?);
        }
        Ok(label(demonstrations, valid, &config)?)
    }
}

/// What was found, for `--json`: skill of each demonstration, and every number of components tried.
pub(super) fn summary(labelled: &Labelled) -> Value {
    let clusters = &labelled.clusters;
    let table = clusters.table.iter().map(|row| {
        json!({
            "components": row.components,
            "left": row.left,
            "covariances": name(row.covariances),
            "held_out_log_likelihood": row.held_out,
            "bic": row.bic,
        })
    });
    let labels = labelled.demonstrations.iter().map(Demonstration::label);
    json!({
        "components": clusters.components,
        "covariances": name(clusters.covariances),
        "labels": labels.collect::<Vec<_>>(),
        "table": table.collect::<Vec<_>>(),
        "merged": clusters.merged,
        "dropped": clusters.dropped,
    })
}

/// The same as text.
pub(super) fn text(labelled: &Labelled) -> String {
    let mut text = String::from("\ncomponents  covariances  held out (nats)       BIC\n");
    for row in &labelled.clusters.table {
        let held_out = row
            .held_out
            .map_or_else(|| "-".to_owned(), |v| format!("{v:.3}"));
        // Writing to a string does not fail.
        let _ = writeln!(
            text,
            "{:>10}  {:<11}  {held_out:>15}  {:>8.1}",
            row.components,
            name(row.covariances),
            row.bic
        );
    }
    let _ = writeln!(text, "skills found: {}", labelled.names.join(", "));
    text
}

fn name(covariances: Covariances) -> &'static str {
    match covariances {
        Covariances::Tied => "tied",
        Covariances::Own => "own",
    }
}

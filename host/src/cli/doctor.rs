//! `tonus doctor`: what this computer has and lacks.

use std::fmt::Write as _;
use std::path::PathBuf;

use anyhow::bail;
use serde_json::json;
use tonus::config::Config;
use tonus::live::Lamp;
use tonus::studio::doctor::{Finding, examine};

use super::say;

const EXAMPLE: &str = "Examples:
  tonus doctor
  tonus doctor --defaults > tonus.toml   a whole configuration to change

Keys of the JSON: findings[] (what, lamp: good, warn or bad, found, mend), configuration.";

/// Say what is here, what is missing, and how to mend it; with the configuration in use.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct DoctorArgs {
    /// The configuration [default: as for `tonus run`].
    #[arg(long, value_name = "FILE")]
    config: Option<PathBuf>,
    /// Print the default configuration and nothing else.
    #[arg(long)]
    defaults: bool,
}

impl DoctorArgs {
    /// What everything needs and is not there is a failure; what one link alone needs is not.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        if self.defaults {
            return say(&Config::default().text());
        }
        let findings = examine(self.config.as_deref());
        let config = Config::find(self.config.as_deref()).map(|(config, _)| config);
        if json {
            let config = config.ok();
            say(&format!(
                "{}\n",
                json!({ "findings": findings, "configuration": config })
            ))?;
        } else {
            say(&text(&findings))?;
            if let Ok(config) = config {
                say(&format!("\nthe configuration in use:\n\n{}", config.text()))?;
            }
        }
        if findings.iter().any(|finding| finding.lamp == Lamp::Bad) {
            bail!("something is missing that everything needs: see above");
        }
        Ok(())
    }
}

fn text(findings: &[Finding]) -> String {
    let mut out = String::new();
    for finding in findings {
        let lamp = match finding.lamp {
            Lamp::Good => "good",
            Lamp::Warn | Lamp::Off => "none",
            Lamp::Bad => "BAD ",
        };
        // Writing to a string cannot fail.
        let _ = writeln!(out, "{lamp}  {:<14} {}", finding.what, finding.found);
        if let Some(mend) = &finding.mend {
            let _ = writeln!(out, "                      -> {mend}");
        }
    }
    out
}

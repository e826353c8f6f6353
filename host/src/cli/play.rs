//! `tonus play`: a recording, run again.

use std::io::{IsTerminal, stderr};
use std::path::PathBuf;

use anyhow::bail;
use serde_json::json;
use tonus::studio::play::{Played, play};

use super::progress::Progress;
use super::say;

const EXAMPLE: &str = "Examples:
  tonus play recordings/tonus-1764180000.mcap
  tonus run --link replay:recordings/tonus-1764180000.mcap   shows it in the browser, at its own pace

Keys of the JSON: inputs, recorded, made, same (commands), first_different_us, cut, exact.";

/// Run a recording again as fast as it goes, and compare every command with the recorded one, bit for bit.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct PlayArgs {
    /// A recording of `tonus run`.
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
}

impl PlayArgs {
    /// Commands that differ are a failure.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let visible = !json && stderr().is_terminal();
        let progress = Progress::spinner("playing", visible);
        let played = play(&self.recording, |_| {})?;
        progress.finish();
        if json {
            let mut document = serde_json::to_value(&played)?;
            if let Some(object) = document.as_object_mut() {
                object.insert("exact".to_owned(), json!(played.exact()));
            }
            say(&format!("{document}\n"))?;
        } else {
            say(&text(&played))?;
        }
        if !played.exact() {
            bail!(
                "{} of {} recorded commands came out the same: was it recorded by another version of the program?",
                played.same,
                played.recorded
            );
        }
        Ok(())
    }
}

fn text(played: &Played) -> String {
    let cut = played.cut.as_ref();
    let cut = cut.map_or(String::new(), |cut| format!("cut: {cut}\n"));
    format!(
        "{} inputs, {} commands recorded, {} made again, {} the same in every bit\n{cut}",
        played.inputs, played.recorded, played.made, played.same
    )
}

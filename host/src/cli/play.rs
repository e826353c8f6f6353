//! `tonus play`: a recording, run again.

use std::io::{IsTerminal, stderr};
use std::path::PathBuf;

use anyhow::bail;
use serde_json::json;
use tonus::studio::play::{Played, Verdict, play};

use super::progress::Progress;
use super::say;

const EXAMPLE: &str = "Examples:
  tonus play recordings/tonus-1764180000.mcap
  tonus run --link replay:recordings/tonus-1764180000.mcap   shows it in the browser, at its own pace

Keys of the JSON: inputs, recorded, made, same, unrecorded (commands), setpoints, same_setpoints, uncompared_setpoints,
first_different_us, cut, verdict (exact, no_commands or different), exact.";

/// Run a recording again as fast as it goes, and compare every command and set-point with the recorded one, bit for bit.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct PlayArgs {
    /// A recording of `tonus run`.
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
}

impl PlayArgs {
    /// Commands or set-points that differ are a failure.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let visible = !json && stderr().is_terminal();
        let progress = Progress::spinner("playing", visible);
        let played = play(&self.recording, |_| {})?;
        progress.finish();
        if json {
            let mut document = serde_json::to_value(&played)?;
            if let Some(object) = document.as_object_mut() {
                object.insert("verdict".to_owned(), json!(played.verdict()));
                object.insert("exact".to_owned(), json!(played.exact()));
            }
            say(&format!("{document}\n"))?;
        } else {
            say(&text(&played))?;
        }
        if played.verdict() == Verdict::Different {
            bail!(
                "{} of {} recorded commands and {} of {} recorded set-points came out the same: was it recorded by another version of the program?",
                played.same,
                played.recorded,
                played.same_setpoints,
                played.setpoints
            );
        }
        Ok(())
    }
}

fn text(played: &Played) -> String {
    let cut = played.cut.as_ref();
    let cut = cut.map_or(String::new(), |cut| match played.unrecorded {
        0 => format!("cut: {cut}\n"),
        more => format!("cut: {cut}; commands made and no more recorded: {more}\n"),
    });
    let uncompared = match played.uncompared_setpoints {
        0 => String::new(),
        more => format!(
            "not compared: {more} set-points to a robot elsewhere; an earlier version recorded them, which does not tell of stalls\n"
        ),
    };
    let verdict = match played.verdict() {
        Verdict::Exact => "exact: everything is the same in every bit\n",
        Verdict::NoCommands => "no commands: none to compare\n",
        Verdict::Different => "",
    };
    let Played {
        inputs,
        recorded,
        made,
        same,
        setpoints,
        same_setpoints,
        ..
    } = played;
    format!(
        "{inputs} inputs, {recorded} commands recorded, {made} made again, {same} the same in every bit; \
         {setpoints} set-points recorded, {same_setpoints} the same in every bit\n{uncompared}{cut}{verdict}"
    )
}

//! A recording for other programs.

use std::path::{Path, PathBuf};

use anyhow::Context;
use serde_json::json;
use tonus::config::Config;
use tonus::export::{Demonstrated, write_bids, write_csv, write_demonstrations, write_parquet};
use tonus::live::Input;
use tonus::recording::Reading;
use tonus::source::LinkChoice;
use tonus::studio::setup;

use super::super::say;

/// Writes what the output's name asks for, and reports.
pub(super) fn run(recording: &Path, output: &Path, json: bool) -> anyhow::Result<()> {
    let extension = output.extension().and_then(|extension| extension.to_str());
    let write = match extension {
        Some("csv") => write_csv,
        Some("parquet") => write_parquet,
        _ => return dataset(recording, output, json),
    };
    // What may be refused comes first: then nothing is written.
    let demonstrated = demonstrations(recording, output)?;
    let rows = write(recording, output)?;
    if json {
        let demonstrated = demonstrated.map(|(path, found)| {
            json!({ "output": path, "demonstrations": found.demonstrations, "problems": found.problems })
        });
        let summary = json!({ "output": output, "rows": rows, "demonstrations": demonstrated });
        return say(&format!("{summary}\n"));
    }
    let mut text = format!("{}: {rows} rows\n", output.display());
    if let Some((path, found)) = demonstrated {
        if found.demonstrations > 0 {
            let count = found.demonstrations;
            text += &format!("{}: {count} demonstrations\n", path.display());
        }
        for problem in found.problems {
            text += &format!("  {problem}\n");
        }
    }
    say(&text)
}

/// Beside a table, the demonstrations of the recording as `tonus train` reads them, if it holds some.
fn demonstrations(
    recording: &Path,
    output: &Path,
) -> anyhow::Result<Option<(PathBuf, Demonstrated)>> {
    let reading = Reading::open(recording)?;
    let (config, link) = made_with(&reading.opening().configuration, recording)?;
    let mut acts = reading.inputs().map_while(Result::ok);
    if !acts.any(|timed| matches!(timed.input, Input::Act(tonus::live::Act::Record { .. }))) {
        return Ok(None);
    }
    let stem = output.file_stem().unwrap_or_default().to_string_lossy();
    let path = output.with_file_name(format!("{stem}-demonstrations.csv"));
    let (engine, body) = (setup::engine(&config, &link)?, setup::body(&config)?);
    let demonstrated = write_demonstrations(recording, engine, body, &path)?;
    Ok(Some((path, demonstrated)))
}

/// The configuration that a recording was made with; the default one where it tells none.
fn made_with(text: &str, recording: &Path) -> anyhow::Result<(Config, LinkChoice)> {
    let config = Config::parse(text, recording).context("the configuration in the recording")?;
    let link = config.wearable.link.parse()?;
    Ok((config, link))
}

fn dataset(recording: &Path, output: &Path, json: bool) -> anyhow::Result<()> {
    let written = write_bids(recording, output)?;
    if json {
        let summary = json!({
            "output": output, "signals": written.file, "channels": written.channels, "scans": written.scans,
            "missing": written.missing, "demonstrations": written.demonstrations,
        });
        return say(&format!("{summary}\n"));
    }
    say(&format!(
        "{}: {} channels, {} scans, {} of them missing and annotated, {} demonstrations\n",
        written.file.display(),
        written.channels,
        written.scans,
        written.missing,
        written.demonstrations,
    ))
}

//! A recording for other programs.

use std::path::Path;

use serde_json::json;
use tonus::export::{write_bids, write_csv, write_parquet};

use super::super::say;

/// Writes what the output's name asks for, and reports.
pub(super) fn run(recording: &Path, output: &Path, json: bool) -> anyhow::Result<()> {
    let extension = output.extension().and_then(|extension| extension.to_str());
    let rows = match extension {
        Some("csv") => write_csv(recording, output)?,
        Some("parquet") => write_parquet(recording, output)?,
        _ => return dataset(recording, output, json),
    };
    if json {
        let summary = json!({ "output": output, "rows": rows });
        return say(&format!("{summary}\n"));
    }
    say(&format!("{}: {rows} rows\n", output.display()))
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

//! `tonus recover`: a recording that was cut, made whole.

use std::path::PathBuf;

use serde_json::json;
use tonus::recording;

use super::{keep_inputs, say};

const EXAMPLE: &str = "Example:
  tonus recover lift.mcap -o lift-whole.mcap

A recording that was cut by a power loss can be read as it is, by tonus too; but viewers want the index that its end lacks.";

/// Write what is whole in a cut or damaged recording to a closed file with an index.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct RecoverArgs {
    /// The recording.
    #[arg(value_name = "RECORDING")]
    recording: PathBuf,
    /// The file to write.
    #[arg(short, long, value_name = "FILE")]
    output: PathBuf,
}

impl RecoverArgs {
    /// Reads, writes, reports.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        keep_inputs([&self.recording], &self.output)?;
        let recovered = recording::recover(&self.recording, &self.output)?;
        if json {
            let (first_us, last_us) = recovered.times_us.unzip();
            let summary = json!({
                "output": self.output, "messages": recovered.messages, "first_us": first_us, "last_us": last_us,
                "was_closed": recovered.was_closed, "lost_bytes": recovered.lost_bytes,
                "damaged": recovered.damaged, "damages": recovered.damages,
            });
            return say(&format!("{summary}\n"));
        }
        let mut text = format!("{}: {} messages", self.output.display(), recovered.messages);
        if let Some((first_us, last_us)) = recovered.times_us {
            let seconds = |us: u64| us as f64 * 1e-6;
            text += &format!(
                ", {:.3} to {:.3} s of the session",
                seconds(first_us),
                seconds(last_us)
            );
        }
        text += if recovered.was_closed {
            "; the file was closed\n"
        } else {
            "; the file was not closed\n"
        };
        if recovered.lost_bytes > 0 {
            text += &format!(
                "{} bytes at its end are no whole message and are left out\n",
                recovered.lost_bytes
            );
        }
        if recovered.damaged > 0 {
            text += &format!("{} places are damaged and left out:\n", recovered.damaged);
            for damage in &recovered.damages {
                text += &format!("  {damage}\n");
            }
        }
        say(&text)
    }
}

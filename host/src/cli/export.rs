//! `tonus export`: a model for the wearable.

use std::path::PathBuf;

use serde_json::json;
use sha2::{Digest, Sha256};
use tonus::model::image::{Export, ExportError};
use tonus::model::tempo::TempoConfig;
use tonus::store;
use tonus_shared::image::WEARABLE;
use tonus_shared::onset::OnsetConfig;

use super::{UsageError, keep_inputs, options, say, write_atomically};

const EXAMPLE: &str = "Example:
  tonus export skills.safetensors -o skills.tnsm --stiffness human_kx,human_ky,human_kz --position human_x,human_y,human_z

The wearable takes models of at most 12 DoFs, 30 basis functions, rank 16 and 4 skills. What the lower rank leaves out is
given to the noise of each DoF, so that its answers stay cautious.";

/// Write a model as the wearable keeps it: f32, of lower rank, checked against what the wearable has room for.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct ExportArgs {
    /// Model file.
    #[arg(value_name = "MODEL")]
    model: PathBuf,
    /// Image to write.
    #[arg(short, long, value_name = "IMAGE")]
    output: PathBuf,
    /// DoFs of the hand's stiffness along x, y and z.
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_delimiter = ',',
        default_value = "human_kx,human_ky,human_kz"
    )]
    stiffness: Vec<String>,
    /// DoFs of the hand's position along x, y and z; without them recognition runs on stiffness alone.
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',')]
    position: Vec<String>,
    /// Keep the model's other DoFs, though the wearable observes none of them.
    #[arg(long)]
    all: bool,
    /// Latent dimensions at most.
    #[arg(long, value_name = "R", default_value_t = WEARABLE.rank)]
    rank: usize,
    /// Standard deviation of the tracker's noise, metres.
    #[arg(long, value_name = "M", value_parser = options::positive, default_value = "0.0015")]
    position_sigma_m: f64,
    /// Standard deviation of a stiffness, as a share of it.
    #[arg(long, value_name = "SHARE", value_parser = options::positive, default_value = "0.05")]
    stiffness_sigma: f64,
    /// One observation of each sensor so often, seconds: what a sensor gets wrong it gets wrong a moment later too.
    #[arg(long, value_name = "S", value_parser = options::positive, default_value = "0.1")]
    interval_s: f64,
}

impl ExportArgs {
    /// Reads, reduces, writes, reports.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        keep_inputs([&self.model], &self.output)?;
        let three = |names: Vec<String>| <[String; 3]>::try_from(names).ok();
        let wrong = UsageError("--stiffness and --position name three DoFs: x,y,z");
        let tempo = TempoConfig::default();
        let export = Export {
            positions: match self.position.len() {
                0 => None,
                _ => Some(three(self.position).ok_or(UsageError(wrong.0))?),
            },
            stiffnesses: three(self.stiffness).ok_or(wrong)?,
            others: self.all,
            rank: self.rank,
            position_sigma_m: self.position_sigma_m,
            stiffness_sigma: self.stiffness_sigma,
            interval_s: self.interval_s,
            tempo_log_std: tempo.tempo_log_std,
            lead_s: tempo.lead_s,
            onset_late_s: tempo.onset_late_s,
            onset_std_s: tempo.onset_std_s,
            onset: OnsetConfig::default(),
            capacity: WEARABLE,
        };
        let model = store::load(&self.model)?;
        let exported = export.image(&model)?;
        write_atomically(&self.output, &exported.bytes)?;
        let view = exported
            .reduced
            .view()
            .map_err(|error| ExportError::Reduce(error.into()))?;
        let sha256: String = (Sha256::digest(&exported.bytes).iter())
            .map(|byte| format!("{byte:02x}"))
            .collect();
        let (bytes, rank) = (exported.bytes.len(), view.latent.rank());
        let (dofs, kept) = (view.latent.dofs(), exported.reduced.kept());
        if json {
            let summary = json!({
                "image": self.output, "bytes": bytes, "sha256": sha256, "dofs": dofs, "rank": rank,
                "skills": model.labels(), "variance_kept": kept,
            });
            return say(&format!("{summary}\n"));
        }
        say(&format!(
            "{}: {bytes} bytes, {} skills of {dofs} DoFs at rank {rank} of {}, {:.2} % of the variance\nsha256 {sha256}\n",
            self.output.display(),
            model.labels().len(),
            model.parts().rank,
            100.0 * kept,
        ))
    }
}

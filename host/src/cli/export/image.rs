//! A model as the wearable keeps it.

use serde_json::json;
use sha2::{Digest, Sha256};
use tonus::model::image::{Export, ExportError};
use tonus::model::tempo::TempoConfig;
use tonus::store;
use tonus_shared::image::WEARABLE;
use tonus_shared::onset::OnsetConfig;

use super::super::{UsageError, say, write_atomically};
use super::ExportArgs;

/// Reads, reduces, writes, reports.
pub(super) fn run(args: ExportArgs, json: bool) -> anyhow::Result<()> {
    let three = |names: Vec<String>| <[String; 3]>::try_from(names).ok();
    let wrong = UsageError("--stiffness and --position name three DoFs: x,y,z");
    let tempo = TempoConfig::default();
    let export = Export {
        positions: match args.position.len() {
            0 => None,
            _ => Some(three(args.position).ok_or(UsageError(wrong.0))?),
        },
        stiffnesses: three(args.stiffness).ok_or(wrong)?,
        others: args.all,
        rank: args.rank,
        position_sigma_m: args.position_sigma_m,
        stiffness_sigma: args.stiffness_sigma,
        interval_s: args.interval_s,
        tempo_log_std: tempo.tempo_log_std,
        lead_s: tempo.lead_s,
        onset_late_s: tempo.onset_late_s,
        onset_std_s: tempo.onset_std_s,
        onset: OnsetConfig::default(),
        capacity: WEARABLE,
    };
    let model = store::load(&args.input)?;
    let exported = export.image(&model)?;
    write_atomically(&args.output, &exported.bytes)?;
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
            "image": args.output, "bytes": bytes, "sha256": sha256, "dofs": dofs, "rank": rank,
            "skills": model.labels(), "variance_kept": kept,
        });
        return say(&format!("{summary}\n"));
    }
    say(&format!(
        "{}: {bytes} bytes, {} skills of {dofs} DoFs at rank {rank} of {}, {:.2} % of the variance\nsha256 {sha256}\n",
        args.output.display(),
        model.labels().len(),
        model.parts().rank,
        100.0 * kept,
    ))
}

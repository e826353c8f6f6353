//! `tonus export`: a model for the wearable, or a recording for other programs.

mod image;
mod recording;

use std::path::PathBuf;

use anyhow::Context;
use tonus_shared::image::WEARABLE;

use super::{keep_inputs, options};

const EXAMPLE: &str = "Example:
  tonus export skills.safetensors -o skills.tnsm --stiffness human_kx,human_ky,human_kz --position human_x,human_y,human_z
  tonus export session.mcap -o session.csv
  tonus export session.mcap -o session.parquet
  tonus export session.mcap -o dataset

A recording becomes a table of rows (.csv, .parquet), one for each stream packet, or, by any other name, a folder: its raw sEMG as
a dataset of BIDS, modality EMG, in EDF+ (BDF+ where 16 bits would cost resolution).

The wearable takes models of at most 12 DoFs, 30 basis functions, rank 16 and 4 skills. What the lower rank leaves out is
given to the noise of each DoF, so that its answers stay cautious.";

/// Write a model as the wearable keeps it (f32, of lower rank, checked against the wearable's room), or a recording as
/// CSV, Parquet or BIDS.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct ExportArgs {
    /// Model file, or recording.
    #[arg(value_name = "INPUT")]
    input: PathBuf,
    /// Image, table or folder to write.
    #[arg(short, long, value_name = "OUTPUT")]
    output: PathBuf,
    /// Of a model: DoFs of the hand's stiffness along x, y and z.
    #[arg(
        long,
        value_name = "X,Y,Z",
        value_delimiter = ',',
        default_value = "human_kx,human_ky,human_kz"
    )]
    stiffness: Vec<String>,
    /// Of a model: DoFs of the hand's position along x, y and z; without them recognition runs on stiffness alone.
    #[arg(long, value_name = "X,Y,Z", value_delimiter = ',')]
    position: Vec<String>,
    /// Of a model: keep the model's other DoFs, though the wearable observes none of them.
    #[arg(long)]
    all: bool,
    /// Of a model: latent dimensions at most.
    #[arg(long, value_name = "R", default_value_t = WEARABLE.rank)]
    rank: usize,
    /// Of a model: standard deviation of the tracker's noise, metres.
    #[arg(long, value_name = "M", value_parser = options::positive, default_value = "0.0015")]
    position_sigma_m: f64,
    /// Of a model: standard deviation of a stiffness, as a share of it.
    #[arg(long, value_name = "SHARE", value_parser = options::positive, default_value = "0.05")]
    stiffness_sigma: f64,
    /// Of a model: one observation of each sensor so often, seconds: what a sensor gets wrong it gets wrong a moment later too.
    #[arg(long, value_name = "S", value_parser = options::positive, default_value = "0.1")]
    interval_s: f64,
}

impl ExportArgs {
    /// Looks what the input is.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        keep_inputs([&self.input], &self.output)?;
        let is_recording = tonus::recording::is_recording(&self.input);
        if is_recording.with_context(|| format!("{}: cannot be read", self.input.display()))? {
            recording::run(&self.input, &self.output, json)
        } else {
            image::run(self, json)
        }
    }
}

//! `tonus envelope`: the wearable's envelope, or an offline form of it, of a recording in CSV.

use std::collections::BTreeSet;
use std::path::{Path, PathBuf};

use anyhow::{Context, bail};
use serde_json::json;
use tonus::envelope::{Baseline, OfflineEnvelope};
use tonus::table::Table;
use tonus_shared::semg::chain::{Chain, ChainConfig, ChainState, Conditioner, NotchConfig};
use tonus_shared::semg::design::Mains;
use tonus_shared::semg::smoother::Smoother;

use super::options::{self, NOT_SIGNALS};
use super::progress::Progress;
use super::{UsageError, keep_inputs, say, write_atomically};

/// Pole sharpness of `--notch`: a 50 Hz notch is then 1.7 Hz wide.
const NOTCH_Q: f64 = 30.0;
/// Largest difference between `--rate` and the rate of `t_s`, as a share: recordings drift, units do not.
const RATE_TOLERANCE: f64 = 0.05;

const EXAMPLE: &str = "Example:
  tonus envelope lift.csv --rate 1000 --channels emg0,emg1 --notch 50 -o lift_envelope.csv

Without --detrend or --zero-phase every sample passes through the code that runs on the wearable (f32, causal).";

/// Turn raw sEMG columns of a CSV file into envelopes.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct EnvelopeArgs {
    /// Recording: a header line, one column per channel; `t_s` is copied if present.
    #[arg(value_name = "IN.csv")]
    input: PathBuf,
    /// Sample rate, Hz (200 to 2000).
    #[arg(long, value_name = "HZ", value_parser = options::positive)]
    rate: f64,
    /// Channels by column name, separated by commas; without it every column but `t_s`, `label` and `trial` that starts
    /// with a number.
    #[arg(long, value_delimiter = ',', value_name = "NAMES")]
    channels: Vec<String>,
    /// Remove offset and drift by a 2nd-order high-pass at this frequency, Hz (the default, at 20).
    #[arg(long, value_name = "HZ", group = "baseline", value_parser = options::positive)]
    highpass: Option<f64>,
    /// Remove offset and drift by a first-order DC block at this frequency, Hz.
    #[arg(long, value_name = "HZ", group = "baseline", value_parser = options::positive)]
    dc_block: Option<f64>,
    /// Remove the least-squares line of the whole recording (offline form).
    #[arg(long, group = "baseline")]
    detrend: bool,
    /// Remove mains hum at 50 or 60 Hz.
    #[arg(long, value_name = "50|60", value_parser = ["50", "60"])]
    notch: Option<String>,
    /// What smooths the rectified signal.
    #[arg(long, value_enum, default_value_t = SmootherName::Butterworth)]
    smoother: SmootherName,
    /// Order of the Butterworth smoother, 1 to 8 [default: 3].
    #[arg(long)]
    order: Option<usize>,
    /// Cut-off of the Butterworth smoother, Hz [default: 5].
    #[arg(long, value_name = "HZ", value_parser = options::positive)]
    cutoff: Option<f64>,
    /// Window of the mean or RMS smoother, ms [default: 150].
    #[arg(long, value_name = "W", value_parser = options::positive)]
    window_ms: Option<f64>,
    /// Filter forward and backward, centre windows: no delay (offline form).
    #[arg(long)]
    zero_phase: bool,
    /// Where the envelopes go: columns `t_s`, `env_<channel>`.
    #[arg(short, long, value_name = "OUT.csv")]
    output: PathBuf,
}

#[derive(Clone, Copy, PartialEq, Eq, clap::ValueEnum)]
enum SmootherName {
    Butterworth,
    Mean,
    Rms,
}

impl EnvelopeArgs {
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let config = self.config()?;
        let chain = Chain::<f32>::design(&config)?;
        keep_inputs([&self.input], &self.output)?;
        let progress = Progress::spinner("filtering", !json);
        let table = Table::open(&self.input)?;
        let channels = self.channels(&table)?;
        let times = self.times(&table)?;
        let mut columns = Vec::with_capacity(channels.len());
        for channel in &channels {
            columns.push(self.envelope(&table, channel, (&config, &chain))?);
        }
        write_envelopes(&self.output, &times, &channels, &columns)?;
        progress.finish();
        let delay_s = if self.zero_phase {
            0.0
        } else {
            chain.delay_s()
        };
        if json {
            let summary = json!({
                "input": self.input, "output": self.output, "channels": channels,
                "samples": table.rows(), "rate_hz": self.rate, "delay_s": delay_s,
            });
            say(&format!("{summary}\n"))
        } else {
            say(&format!(
                "{}: {} samples of {} at {} Hz; each value describes the muscle {:.1} ms earlier\n",
                self.output.display(),
                table.rows(),
                channels.join(", "),
                self.rate,
                delay_s * 1e3,
            ))
        }
    }

    fn config(&self) -> Result<ChainConfig, UsageError> {
        Ok(ChainConfig {
            rate_hz: self.rate,
            conditioner: self.conditioner(),
            notch: self.notch(),
            smoother: self.smoother()?,
        })
    }

    /// The envelope of one column, one value per row.
    fn envelope(
        &self,
        table: &Table,
        channel: &str,
        (config, chain): (&ChainConfig, &Chain<f32>),
    ) -> anyhow::Result<Vec<f64>> {
        let x = table.numbers(channel)?;
        if self.detrend || self.zero_phase {
            let baseline = if self.detrend {
                Baseline::Detrend
            } else {
                Baseline::Filter(config.conditioner)
            };
            let offline = OfflineEnvelope {
                rate_hz: self.rate,
                baseline,
                notch: config.notch,
                smoother: config.smoother,
                zero_phase: self.zero_phase,
            };
            let envelope = offline.apply(&x);
            return envelope
                .with_context(|| format!("{}: column `{channel}`", self.input.display()));
        }
        let mut state = ChainState::new();
        let stepped = x.iter().enumerate().map(|(row, &value)| {
            #[allow(
                clippy::cast_possible_truncation,
                reason = "the wearable computes in f32; what overflows it is refused"
            )]
            let step = chain.step(&mut state, value as f32);
            let place = || format!("{}: {value:?}", table.place(row, channel));
            step.map(f64::from).with_context(place)
        });
        stepped.collect()
    }

    fn conditioner(&self) -> Conditioner {
        match (self.highpass, self.dc_block) {
            (Some(cutoff_hz), _) => Conditioner::HighPass {
                cutoff_hz,
                order: 2,
            },
            (None, Some(cutoff_hz)) => Conditioner::DcBlock { cutoff_hz },
            (None, None) => Conditioner::default(),
        }
    }

    fn notch(&self) -> Option<NotchConfig> {
        let mains = match self.notch.as_deref()? {
            "60" => Mains::Hz60,
            _ => Mains::Hz50,
        };
        Some(NotchConfig { mains, q: NOTCH_Q })
    }

    /// Options that the chosen smoother does not have are refused, not ignored.
    fn smoother(&self) -> Result<Smoother, UsageError> {
        let windowed = self.smoother != SmootherName::Butterworth;
        if windowed && (self.order.is_some() || self.cutoff.is_some()) {
            return Err(UsageError(
                "--order and --cutoff belong to --smoother butterworth; mean and rms take --window-ms",
            ));
        }
        if !windowed && self.window_ms.is_some() {
            return Err(UsageError(
                "--window-ms belongs to --smoother mean or rms; butterworth takes --order and --cutoff",
            ));
        }
        let window_s = self.window_ms.unwrap_or(150.0) / 1e3;
        Ok(match self.smoother {
            SmootherName::Butterworth => Smoother::Butterworth {
                order: self.order.unwrap_or(3),
                cutoff_hz: self.cutoff.unwrap_or(5.0),
            },
            SmootherName::Mean => Smoother::MovingAverage { window_s },
            SmootherName::Rms => Smoother::Rms { window_s },
        })
    }

    fn channels(&self, table: &Table) -> anyhow::Result<Vec<String>> {
        if !self.channels.is_empty() {
            let mut once = BTreeSet::new();
            if !self.channels.iter().all(|name| once.insert(name)) {
                bail!(UsageError("--channels names a column twice"));
            }
            return Ok(self.channels.clone());
        }
        // A number (NaN too) makes it a signal, and then every cell must be one; a word makes it a remark.
        let starts_with_a_number = |name: &&String| {
            let cells = table.text(name).unwrap_or_default();
            cells
                .first()
                .is_some_and(|cell| cell.parse::<f64>().is_ok())
        };
        let signals: Vec<String> = (table.columns().iter())
            .filter(|name| !NOT_SIGNALS.contains(&name.as_str()))
            .filter(starts_with_a_number)
            .cloned()
            .collect();
        if signals.is_empty() {
            bail!(
                "{}: no numeric column besides t_s, label and trial; present: {}",
                self.input.display(),
                table.columns().join(", ")
            );
        }
        Ok(signals)
    }

    /// Filters designed for another rate than the recording's would be quietly wrong.
    fn check_rate(&self, times: &[f64]) -> anyhow::Result<()> {
        let (Some(first), Some(last)) = (times.first(), times.last()) else {
            return Ok(());
        };
        #[allow(
            clippy::cast_precision_loss,
            reason = "recordings are far below 2^52 samples"
        )]
        let measured_hz = (times.len() - 1) as f64 / (last - first);
        let agrees = (measured_hz / self.rate - 1.0).abs() <= RATE_TOLERANCE;
        if times.len() > 1 && !agrees {
            bail!(
                "{}: t_s runs at {measured_hz:.1} samples/s, but --rate says {}",
                self.input.display(),
                self.rate
            );
        }
        Ok(())
    }

    /// `t_s` of the recording, or the sample number over the rate where it has none.
    fn times(&self, table: &Table) -> anyhow::Result<Vec<f64>> {
        if table.columns().iter().any(|name| name == "t_s") {
            let times = table.numbers("t_s")?;
            table.strictly_increasing("t_s", &times, 0)?;
            self.check_rate(&times)?;
            return Ok(times);
        }
        #[allow(
            clippy::cast_precision_loss,
            reason = "recordings are far below 2^52 samples"
        )]
        let times = (0..table.rows()).map(|row| row as f64 / self.rate);
        Ok(times.collect())
    }
}

fn write_envelopes(
    path: &Path,
    times: &[f64],
    channels: &[String],
    columns: &[Vec<f64>],
) -> anyhow::Result<()> {
    let mut writer = csv::Writer::from_writer(Vec::new());
    let header =
        std::iter::once("t_s".to_owned()).chain(channels.iter().map(|c| format!("env_{c}")));
    writer.write_record(header)?;
    for (row, time) in times.iter().enumerate() {
        let values = columns.iter().filter_map(|column| column.get(row));
        writer.write_record(std::iter::once(time).chain(values).map(f64::to_string))?;
    }
    write_atomically(path, &writer.into_inner()?)
}

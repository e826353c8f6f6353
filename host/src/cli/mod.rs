//! The command line: one file per verb.
//!
//! Exit code 0 is success, 1 a failure on data or files, 2 a command line that makes no sense.

mod demo;
mod doctor;
mod envelope;
mod eval;
mod experiment;
mod export;
mod hand;
mod infer;
mod info;
mod latency;
mod listen;
mod options;
mod play;
mod progress;
mod record;
mod recover;
mod run;
mod scan;
mod teach;
mod train;
mod unlabelled;
mod upload;
mod view;

use std::io::Write;
use std::path::{Path, PathBuf};
use std::process::ExitCode;

use anyhow::Context;
use clap::{Parser, Subcommand};
use tonus_shared::semg::design::DesignError;

/// Recognise what a person does and how firmly, and let a robot follow as an impedance.
///
/// Without a verb: the whole story on simulated devices, in the browser (`tonus run --link sim --story`).
#[derive(Parser)]
#[command(
    name = "tonus",
    version,
    after_help = "Examples:\n  tonus\n  tonus demo --headless --seed 7 --json"
)]
struct Tonus {
    /// Print one JSON document instead of text.
    #[arg(long, global = true)]
    json: bool,
    #[command(subcommand)]
    verb: Option<Verb>,
}

#[derive(Subcommand)]
enum Verb {
    Calibrate(record::CalibrateArgs),
    Demo(demo::DemoArgs),
    Doctor(doctor::DoctorArgs),
    Envelope(envelope::EnvelopeArgs),
    Eval(eval::EvalArgs),
    Experiment(experiment::ExperimentArgs),
    Export(export::ExportArgs),
    Hand(hand::HandArgs),
    Infer(infer::InferArgs),
    Info(info::InfoArgs),
    Latency(latency::LatencyArgs),
    Listen(listen::ListenArgs),
    Play(play::PlayArgs),
    Record(record::RecordArgs),
    Recover(recover::RecoverArgs),
    Run(run::RunArgs),
    Scan(scan::ScanArgs),
    Teach(teach::TeachArgs),
    Train(train::TrainArgs),
    Upload(upload::UploadArgs),
}

/// Parses the command line and runs the verb.
pub(crate) fn main() -> ExitCode {
    match run(Tonus::parse()) {
        Ok(()) => ExitCode::SUCCESS,
        Err(error) => {
            eprintln!("tonus: {}", once(&error));
            // Filters are asked for on the command line alone.
            if error.is::<UsageError>() || error.is::<DesignError>() {
                ExitCode::from(2)
            } else {
                ExitCode::FAILURE
            }
        }
    }
}

fn run(Tonus { json, verb }: Tonus) -> anyhow::Result<()> {
    let Some(verb) = verb else {
        return run::RunArgs::first().run(json);
    };
    match verb {
        Verb::Calibrate(args) => args.run(json),
        Verb::Demo(args) => args.run(json),
        Verb::Doctor(args) => args.run(json),
        Verb::Envelope(args) => args.run(json),
        Verb::Eval(args) => args.run(json),
        Verb::Experiment(args) => args.run(json),
        Verb::Export(args) => args.run(json),
        Verb::Hand(args) => args.run(json),
        Verb::Infer(args) => args.run(json),
        Verb::Info(args) => args.run(json),
        Verb::Latency(args) => args.run(json),
        Verb::Listen(args) => args.run(json),
        Verb::Play(args) => args.run(json),
        Verb::Record(args) => args.run(json),
        Verb::Recover(args) => args.run(json),
        Verb::Run(args) => args.run(json),
        Verb::Scan(args) => args.run(json),
        Verb::Teach(args) => args.run(json),
        Verb::Train(args) => args.run(json),
        Verb::Upload(args) => args.run(json),
    }
}

/// An error and its causes; a cause that the text before it tells already is not told again.
fn once(error: &anyhow::Error) -> String {
    let mut text = String::new();
    for cause in error.chain().map(ToString::to_string) {
        if text.is_empty() {
            text = cause;
        } else if !text.contains(&cause) {
            text = format!("{text}: {cause}");
        }
    }
    text
}

/// Options that parse one by one and make no sense together.
#[derive(Debug, thiserror::Error)]
#[error("{0}; see --help")]
pub(crate) struct UsageError(pub(crate) &'static str);

/// Prints to standard output. A reader that went away is no error.
pub(crate) fn say(text: &str) -> anyhow::Result<()> {
    match std::io::stdout().write_all(text.as_bytes()) {
        Err(error) if error.kind() == std::io::ErrorKind::BrokenPipe => Ok(()),
        outcome => outcome.context("standard output"),
    }
}

/// Refuses an output that is one of the inputs: it would be lost.
pub(crate) fn keep_inputs<'a>(
    inputs: impl IntoIterator<Item = &'a PathBuf>,
    output: &Path,
) -> Result<(), UsageError> {
    // What does not exist yet is no input.
    let Ok(there) = output.canonicalize() else {
        return Ok(());
    };
    let same = |input: &PathBuf| input.is_file() && input.canonicalize().is_ok_and(|i| i == there);
    if inputs.into_iter().any(same) {
        return Err(UsageError("--output names an input, which would be lost"));
    }
    Ok(())
}

/// Writes a file so that an interruption leaves the old one or the new one, never half of one.
pub(crate) fn write_atomically(path: &Path, bytes: &[u8]) -> anyhow::Result<()> {
    tonus::atomic::write(path, bytes)
        .with_context(|| format!("{}: cannot be written", path.display()))
}

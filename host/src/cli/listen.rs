//! `tonus listen`: what a wearable sends, as it comes.

mod compare;

use std::fmt::Write;
use std::path::PathBuf;
use std::time::{Duration, Instant};

use serde_json::{Value, json};
use tonus::link::serial::SerialLink;
use tonus_shared::wire::{Frame, Packet, SequenceTracker, WireError, decode};

use super::say;
use compare::Comparison;

const EXAMPLE: &str = "Example:
  tonus listen --link serial:/dev/ttyACM0
  tonus listen --link serial:COM3 --seconds 10 --json
  tonus listen --link serial:/dev/ttyACM0 --clock";

/// How long a silent line is waited for at once.
const PATIENCE: Duration = Duration::from_millis(100);

/// Print each packet that a wearable sends, then what was lost.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct ListenArgs {
    /// Where the wearable is: serial:PORT.
    #[arg(long, value_name = "LINK", value_parser = link)]
    link: PathBuf,
    /// Stop after this time; without it, when the wearable is unplugged.
    #[arg(long, value_name = "SECONDS", value_parser = seconds)]
    seconds: Option<Duration>,
    /// Ask for the wearable's time and print once a second how its clock compares with this computer's.
    #[arg(long)]
    clock: bool,
}

/// The name of the port in `serial:PORT`.
fn link(text: &str) -> Result<PathBuf, String> {
    match text.strip_prefix("serial:") {
        Some(port) if !port.is_empty() => Ok(PathBuf::from(port)),
        _ => Err("give serial:PORT, for example serial:/dev/ttyACM0".to_owned()),
    }
}

fn seconds(text: &str) -> Result<Duration, String> {
    let number: f64 = text
        .parse()
        .map_err(|_| "give seconds, for example 2.5".to_owned())?;
    Duration::try_from_secs_f64(number).map_err(|error| error.to_string())
}

/// What became of the packets.
#[derive(Default)]
struct Tally {
    sequence: SequenceTracker,
    refused: u64,
}

impl ListenArgs {
    /// Prints until the time is over or the wearable is gone; the losses in either case.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let mut link = SerialLink::open(&self.link)?;
        let started = Instant::now();
        let mut tally = Tally::default();
        let mut comparison = self.clock.then(|| Comparison::new(started)).transpose()?;
        let ended = loop {
            let left = self
                .seconds
                .map(|limit| limit.saturating_sub(started.elapsed()));
            if left.is_some_and(|left| left.is_zero()) {
                break Ok(());
            }
            if let Some(request) = comparison.as_mut().and_then(Comparison::request)
                && let Err(error) = link.send(&request?)
            {
                break Err(error);
            }
            match link.receive(left.map_or(PATIENCE, |left| left.min(PATIENCE))) {
                Ok(None) => {}
                Ok(Some(bytes)) => {
                    let came = decode(&bytes);
                    say(&tally.line(&came, json))?;
                    if let (Some(comparison), Ok(frame)) = (&mut comparison, &came) {
                        say(&comparison.take(frame, json))?;
                    }
                }
                Err(error) => break Err(error),
            }
        };
        say(&tally.end(link.counters().refused, json))?;
        Ok(ended?)
    }
}

impl Tally {
    /// Counts what came and describes it in one line.
    fn line(&mut self, came: &Result<Frame, WireError>, json: bool) -> String {
        match came {
            Ok(frame) => {
                self.sequence
                    .observe(frame.header.boot_id, frame.header.sequence);
                if json {
                    format!("{}\n", packet(frame))
                } else {
                    let header = &frame.header;
                    let seconds = header.device_us as f64 / 1e6;
                    format!(
                        "{:>10} {seconds:>12.6} s  {}\n",
                        header.sequence,
                        described(&frame.packet)
                    )
                }
            }
            Err(error) => {
                self.refused += 1;
                if json {
                    format!("{}\n", json!({ "refused": error.to_string() }))
                } else {
                    format!("refused: {error}\n")
                }
            }
        }
    }

    /// The last line: packets received, lost and refused; `blocks` were no block at all.
    fn end(&self, blocks: u64, json: bool) -> String {
        let counts = self.sequence.counts();
        let refused = self.refused + blocks;
        if json {
            let counts = json!({
                "received": counts.received, "lost": counts.lost, "late": counts.late,
                "duplicate": counts.duplicate, "stale": counts.stale, "boots": counts.boots,
                "refused": refused,
            });
            format!("{}\n", json!({ "counts": counts }))
        } else {
            format!(
                "{} packets, {} lost, {} late, {} duplicate, {} stale, {refused} refused, {} starts of the wearable\n",
                counts.received,
                counts.lost,
                counts.late,
                counts.duplicate,
                counts.stale,
                counts.boots
            )
        }
    }
}

/// One packet for `--json`; what a person watches is spelt out.
fn packet(frame: &Frame) -> Value {
    let header = &frame.header;
    let mut value = json!({
        "kind": frame.packet.kind().name(),
        "boot_id": header.boot_id, "sequence": header.sequence, "device_us": header.device_us,
    });
    if let Packet::Stream(stream) = &frame.packet {
        let used = usize::from(stream.channels);
        value["envelopes"] = json!(stream.envelopes.get(..used));
        value["activation"] = json!(stream.activation);
        value["stiffness_n_per_m"] = json!(stream.stiffness_n_per_m);
    }
    value
}

/// One packet for people.
fn described(packet: &Packet) -> String {
    match packet {
        Packet::Stream(stream) => {
            let mut text = "stream  envelopes".to_owned();
            for envelope in stream.envelopes.iter().take(usize::from(stream.channels)) {
                // Writing to a string cannot fail.
                let _ = write!(text, " {:.1} %", 100.0 * envelope);
            }
            let [x, y, z] = stream.stiffness_n_per_m;
            let _ = write!(text, "  stiffness {x:.0} {y:.0} {z:.0} N/m");
            text
        }
        other => format!("{other:?}"),
    }
}

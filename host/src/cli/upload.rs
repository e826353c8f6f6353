//! `tonus upload`: a model into the wearable, which then recognises by itself.

use std::io::{IsTerminal, stderr};
use std::path::PathBuf;
use std::time::Duration;

use anyhow::{Context, bail};
use serde_json::json;
use tonus::link::upload::Upload;
use tonus::live::{Input, Inputs, LinkEvent, Plug, Request, SessionClock};
use tonus::source::{LinkChoice, serial, wearable};
use tonus::studio::keyboard::Keyboard;
use tonus::studio::setup::random_boot_id;
use tonus_shared::wire::{Header, MAX_FRAME_BYTES, Packet, decode, encode};

use super::progress::Progress;
use super::run::ask_passkey;
use super::{UsageError, say};

const EXAMPLE: &str = "Examples:
  tonus export skills.safetensors -o skills.tnsm --position human_x,human_y,human_z
  tonus upload skills.tnsm --link ble
  tonus upload skills.tnsm --link serial:/dev/ttyACM0

The wearable keeps the model over a restart, and works with the one that it had until the new one is whole. An upload that was
interrupted goes on where it stopped.";

const KEPT_BY: UsageError =
    UsageError("models are kept by wearables alone: --link ble, ble:NAME or serial:PORT");

/// How long a wearable is looked for: over Bluetooth somebody may have to press a button and type a passkey.
const FOUND_WITHIN: Duration = Duration::from_secs(60);
const PLUGGED_WITHIN: Duration = Duration::from_secs(10);
/// How long an input is waited for before it is looked what is due.
const LOOK: Duration = Duration::from_millis(2);

/// Send a model to the wearable, which keeps it and recognises by it.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct UploadArgs {
    /// The model as the wearable keeps it, written by `tonus export MODEL -o IMAGE`.
    image: PathBuf,
    /// Where the wearable is: ble, ble:NAME or serial:PORT.
    #[arg(long, value_name = "LINK")]
    link: LinkChoice,
}

impl UploadArgs {
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        if !matches!(self.link, LinkChoice::Ble(_) | LinkChoice::Serial(_)) {
            bail!(KEPT_BY);
        }
        let named = || format!("{}: cannot be read", self.image.display());
        let file = std::fs::File::open(&self.image).with_context(named)?;
        let upload = Upload::read(file).with_context(named)?;
        let inputs = Inputs::new(SessionClock::start());
        let (port, plug) = inputs.port();
        let (within, source) = match self.link {
            LinkChoice::Ble(name) => {
                let ask = ask_passkey(Keyboard::default());
                let run = move || wearable::run(&port, name, &ask);
                (FOUND_WITHIN, std::thread::spawn(run))
            }
            LinkChoice::Serial(name) => {
                let run = move || serial::run(&port, &name);
                (PLUGGED_WITHIN, std::thread::spawn(run))
            }
            _ => bail!(KEPT_BY),
        };
        let sent = send(
            upload,
            &inputs,
            &plug,
            within,
            !json && stderr().is_terminal(),
        );
        plug.stop();
        // A source that panicked has nothing more to give.
        let _ended = source.join();
        let upload = sent?;
        let sha256: String = (upload.sha256().iter())
            .map(|byte| format!("{byte:02x}"))
            .collect();
        let (_, bytes) = upload.progress();
        let was_there = upload.was_there();
        if json {
            let summary = json!({
                "image": self.image, "bytes": bytes, "sha256": sha256, "was_there": was_there,
            });
            return say(&format!("{summary}\n"));
        }
        say(&format!(
            "the wearable {} this model: {bytes} bytes, sha256 {sha256}\n",
            if was_there { "had and uses" } else { "uses" },
        ))
    }
}

/// Sends it through whatever becomes of the link, and gives it back when the wearable uses it.
fn send(
    mut upload: Upload,
    inputs: &Inputs,
    plug: &Plug,
    within: Duration,
    visible: bool,
) -> anyhow::Result<Upload> {
    let progress = Progress::bar("looking for the wearable", visible);
    let boot_id = random_boot_id();
    let (mut linked, mut sequence) = (false, 0);
    let mut lost: Option<String> = None;
    let mut since_us = 0;
    while !upload.done() {
        let now_us = inputs.now_us();
        if let Some(timed) = inputs.next(LOOK) {
            match timed.input {
                Input::Link(LinkEvent::Up { mtu, .. }) => {
                    linked = true;
                    upload.up(mtu);
                    progress.says("uploading");
                }
                Input::Link(LinkEvent::Down { reason }) => {
                    if linked {
                        since_us = now_us;
                    }
                    linked = false;
                    if lost.as_ref() != Some(&reason) {
                        eprintln!("tonus: {reason} (trying again)");
                    }
                    lost = Some(reason);
                    progress.says("looking for the wearable");
                }
                Input::Frame(bytes) => {
                    // What cannot be read is asked for again.
                    if let Ok(frame) = decode(&bytes) {
                        upload.take(&frame.packet, now_us)?;
                    }
                }
                _ => {}
            }
        }
        let waited = Duration::from_micros(now_us.saturating_sub(since_us));
        if !linked && waited > within {
            let reason = lost.unwrap_or_else(|| "no wearable was found".to_owned());
            bail!("{reason} (gave up after {} s)", within.as_secs());
        }
        if linked && let Some(packet) = upload.next(sequence, now_us)? {
            plug.ask(Request::Frame(frame(boot_id, sequence, now_us, &packet)?));
            sequence = sequence.wrapping_add(1);
        }
        let (arrived, all) = upload.progress();
        progress.at(arrived as u64, all as u64);
    }
    progress.finish();
    Ok(upload)
}

fn frame(boot_id: u32, sequence: u32, device_us: u64, packet: &Packet) -> anyhow::Result<Vec<u8>> {
    let header = Header {
        boot_id,
        sequence,
        device_us,
    };
    let mut bytes = [0; MAX_FRAME_BYTES];
    let length = encode(&header, packet, &mut bytes)?;
    Ok(bytes[..length].to_vec())
}

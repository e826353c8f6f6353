//! A stream of the lab streaming layer in the wearable's place.

use std::time::{Duration, Instant};

use thiserror::Error;
use tonus_native::lsl::{Found, Inlet, Lsl, LslError};

use crate::link::lsl::{Channel, StreamError, Streamed};
use crate::live::{Input, LinkEvent, Port, Request};

/// One look for the stream takes so long: the program's end waits for it.
const LOOK: Duration = Duration::from_secs(1);
/// After so long without a sample the stream is looked for again.
const SILENCE: Duration = Duration::from_secs(2);
/// Between attempts.
const AGAIN: Duration = Duration::from_secs(2);
/// Samples are taken so often.
const PULL: Duration = Duration::from_millis(5);

/// Why nothing comes from the stream.
#[derive(Debug, Error)]
enum Ended {
    #[error(transparent)]
    Lsl(#[from] LslError),
    #[error(transparent)]
    Stream(#[from] StreamError),
    #[error("the LSL stream is silent: look at the program that sends it")]
    Silent,
}

/// Runs the stream of type EMG with this name, or the first one, until the program ends. `boot_id` tells this start from
/// others.
pub fn run(port: &Port, name: Option<&str>, mut boot_id: u32) {
    let mut said = None;
    while !port.stopping() {
        if let Err(ended) = once(port, name, boot_id, &mut said) {
            let reason = ended.to_string();
            // The same trouble is told once.
            if said.as_ref() != Some(&reason) {
                said = Some(reason.clone());
                port.input(Input::Link(LinkEvent::Down { reason }));
            }
        }
        // Each start of the stream is another wearable to the host.
        boot_id = boot_id.wrapping_add(1);
        let until = Instant::now() + AGAIN;
        while !port.stopping() && Instant::now() < until {
            // Nobody is there to answer.
            let _unanswered = port.request(PULL);
        }
    }
}

/// Finds the stream and serves it until the program ends.
fn once(
    port: &Port,
    name: Option<&str>,
    boot_id: u32,
    said: &mut Option<String>,
) -> Result<(), Ended> {
    let lsl = Lsl::load(None)?;
    let predicate = match name {
        // A quote would end the predicate's text.
        Some(name) => format!("type='EMG' and name='{}'", name.replace('\'', "")),
        None => "type='EMG'".to_owned(),
    };
    let found = Found::first(&lsl, &predicate, LOOK)?;
    let mut inlet = Inlet::open(&found, LOOK)?;
    let description = inlet.description().clone();
    let channels: Vec<Channel<'_>> = (description.channels.iter())
        .map(|channel| Channel {
            label: &channel.label,
            unit: &channel.unit,
        })
        .collect();
    let mut streamed = Streamed::new(boot_id, description.rate_hz, &channels)?;
    streamed.connected();
    *said = None;
    port.input(Input::Link(LinkEvent::Up {
        name: format!(
            "LSL stream {} ({} channels, {} Hz)",
            description.name,
            channels.len(),
            description.rate_hz
        ),
        mtu: None,
        interval_us: None,
    }));
    serve(port, &lsl, &mut inlet, &mut streamed)
}

fn serve(port: &Port, lsl: &Lsl, inlet: &mut Inlet, streamed: &mut Streamed) -> Result<(), Ended> {
    let send = |bytes: &[u8]| port.input(Input::Frame(bytes.to_vec()));
    let us = |seconds: f64| (seconds.max(0.0) * 1e6) as u64;
    let mut heard = Instant::now();
    while !port.stopping() {
        inlet.pull(PULL, |sample, at_s| {
            heard = Instant::now();
            streamed.take(sample, us(at_s), send);
        })?;
        while let Some(request) = port.request(Duration::ZERO) {
            if let Request::Frame(bytes) = request {
                streamed.request(&bytes, us(lsl.clock_s()), send);
            }
        }
        if heard.elapsed() > SILENCE {
            return Err(Ended::Silent);
        }
    }
    Ok(())
}

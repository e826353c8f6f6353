//! `tonus latency`: from a scan to the command made of it, measured in real time on this computer.

use std::cell::RefCell;
use std::net::TcpStream;
use std::rc::Rc;
use std::sync::Arc;
use std::sync::atomic::AtomicBool;
use std::thread::JoinHandle;

use anyhow::{Context, bail};
use serde_json::json;
use tonus::config::Config;
use tonus::demo::{self, DemoConfig};
use tonus::live::{Act, LatencyView, View};
use tonus::source::LinkChoice;
use tonus::studio::hands::Hands;
use tonus::studio::keep::Keeper;
use tonus::studio::run::{Plan, run};
use tungstenite::client::IntoClientRequest;
use tungstenite::http::HeaderValue;
use tungstenite::{Error, Message};

use super::options::positive;
use super::progress::Progress;
use super::say;

/// What is asked for, ms.
const P50_MS: f64 = 40.0;
const P99_MS: f64 = 60.0;

const EXAMPLE: &str = "Example:
  tonus latency --seconds 30

Simulated devices in real time: the wearable's signal path, a link of one connection interval of 7.5 ms and up to one
more, the hand tracker, recognition, the gate, the page with somebody who looks at it. Ages count from the scan to
the command, by the wearable's clock as it was fitted. Keys of the JSON: commands, p50_ms, p99_ms, clock_uncertainty_us, viewers,
views_seen, holds (p50 <= 40 ms and p99 <= 60 ms).";

/// Measure the time from a scan to the command made of it, with the page open.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct LatencyArgs {
    /// Measure for this time.
    #[arg(long, value_name = "SECONDS", default_value = "20", value_parser = positive)]
    seconds: f64,
}

#[derive(Default)]
struct Seen {
    latency: Option<LatencyView>,
    uncertainty_us: Option<f64>,
    up: bool,
}

impl LatencyArgs {
    /// Times above what is asked for are a failure.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let learning = Progress::spinner("learning from simulated demonstrations", !json);
        let library = demo::learn_skills(&DemoConfig::default())?;
        learning.finish();
        let mut config = Config::default();
        config.page.port = 0;
        let plan = Plan {
            config,
            link: LinkChoice::Simulated,
            hands: Some(Box::new(Moves::new(library.model.labels()))),
            ends_with_hands: false,
            seconds: Some(self.seconds),
            record: None,
            page: true,
            lsl: false,
            library: Some(Arc::new(library)),
            seed: 1,
            pace: 1.0,
            keeper: Keeper::default(),
            person: None,
            ask_passkey: Arc::new(|_| None),
            stop: Arc::new(AtomicBool::new(false)),
        };
        let seen = Rc::new(RefCell::new(Seen::default()));
        let look = Rc::clone(&seen);
        let mut viewer = None;
        run(
            plan,
            |url| viewer = Some(view(url)),
            move |view: &View| {
                let mut seen = look.borrow_mut();
                seen.up |= view.link.up;
                seen.latency = view.latency;
                seen.uncertainty_us = view.clock.as_ref().map(|clock| clock.uncertainty_us);
            },
        )?;
        let viewer = viewer.context("no page was served")??;
        let views_seen = viewer.join().unwrap_or(0);
        let seen = seen.borrow();
        let latency = seen
            .latency
            .context("no command was made: give it more time")?;
        let holds = latency.p50_ms <= P50_MS && latency.p99_ms <= P99_MS;
        let uncertainty_us = seen.uncertainty_us;
        say(&if json {
            let document = json!({
                "commands": latency.commands, "p50_ms": latency.p50_ms, "p99_ms": latency.p99_ms,
                "clock_uncertainty_us": uncertainty_us, "viewers": 1, "views_seen": views_seen, "holds": holds,
            });
            format!("{document}\n")
        } else {
            format!(
                "scan to command: {:.1} ms median, {:.1} ms at the 99th percentile ({} commands; the page's viewer saw {views_seen} views)\n",
                latency.p50_ms, latency.p99_ms, latency.commands
            )
        })?;
        if !holds {
            bail!(
                "slower than {P50_MS} ms median and {P99_MS} ms at the 99th percentile: is this computer busy?"
            );
        }
        Ok(())
    }
}

/// A movement is asked for so often, microseconds: half of the time the person moves.
const MOVE_EVERY_US: u64 = 6_000_000;

/// Arms the simulated robot and has the person move again and again: recognition costs most in a movement.
struct Moves {
    labels: Vec<String>,
    asked: usize,
    asked_us: u64,
}

impl Moves {
    fn new(labels: &[String]) -> Self {
        Self {
            labels: labels.to_vec(),
            asked: 0,
            asked_us: 0,
        }
    }
}

impl Hands for Moves {
    fn look(&mut self, view: &View) -> Vec<Act> {
        let mut acts = Vec::new();
        if view.robot.state == "disarmed" && view.robot.can_arm {
            acts.push(Act::Arm);
        }
        if view.at_us >= self.asked_us + MOVE_EVERY_US
            && let Some(label) = self.labels.iter().cycle().nth(self.asked)
        {
            self.asked_us = view.at_us;
            self.asked += 1;
            let label = label.clone();
            acts.push(Act::Ask { label });
        }
        acts
    }

    fn over(&self) -> bool {
        false
    }
}

/// Somebody who looks at the page; counts what they see until the page ends.
fn view(url: &str) -> anyhow::Result<JoinHandle<u64>> {
    let (address, token) = url.split_once("/#").context("an address without a token")?;
    let host = address.trim_start_matches("http://").to_owned();
    let mut request = format!("ws://{host}/socket").into_client_request()?;
    let protocols = HeaderValue::from_str(&format!("tonus, {token}"))?;
    request
        .headers_mut()
        .insert("Sec-WebSocket-Protocol", protocols);
    let stream = TcpStream::connect(&host)?;
    let (mut socket, _) = tungstenite::client(request, stream)?;
    let look = move || {
        let mut views = 0;
        loop {
            match socket.read() {
                Ok(Message::Text(text)) => {
                    views += 1;
                    let number = serde_json::from_str::<serde_json::Value>(&text)
                        .ok()
                        .and_then(|view| view.get("number")?.as_u64());
                    let Some(number) = number else { continue };
                    let seen = json!({ "seen": number }).to_string();
                    if socket.send(Message::text(seen)).is_err() {
                        return views;
                    }
                }
                Ok(_) => {}
                Err(Error::Io(error)) if error.kind() == std::io::ErrorKind::Interrupted => {}
                Err(_) => return views,
            }
        }
    };
    Ok(std::thread::Builder::new()
        .name("viewer".to_owned())
        .spawn(look)?)
}

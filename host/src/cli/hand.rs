//! `tonus hand`: what a hand tracker sees, as it comes.

use std::time::{Duration, Instant};

use anyhow::bail;
use serde_json::json;
use tonus::leap::{
    Backoff, Config, Counts, Leap, Loss, Origin, Protocol, Side, Sight, Update, Wanted,
};

use super::options::positive;
use super::say;

const EXAMPLE: &str = "Example:
  tonus hand
  tonus hand --leap ws://127.0.0.1:6437 --hand left --seconds 10 --json
  tonus hand --leap leapc";

/// How long a silent service is waited for at once.
const PATIENCE: Duration = Duration::from_millis(100);

/// Print where the hand is that a Leap Motion controller sees.
///
/// Needs the Leap service; with Gemini or later also Ultraleap's library LeapC, or the bridge UltraleapTrackingWebSocket.
#[derive(clap::Args)]
#[command(after_help = EXAMPLE)]
pub(crate) struct HandArgs {
    /// Where the service is, or leapc[:FILE] for the library LeapC.
    #[arg(long, value_name = "URL", default_value = "ws://127.0.0.1:6437")]
    leap: Origin,
    /// Which hand.
    #[arg(long, value_enum, default_value_t = Which::Right)]
    hand: Which,
    /// Stop after this time.
    #[arg(long, value_name = "SECONDS", value_parser = positive)]
    seconds: Option<f64>,
}

#[derive(Clone, Copy, clap::ValueEnum)]
enum Which {
    Left,
    Right,
    Either,
}

impl HandArgs {
    /// Prints until the time is over. Without one answer of a service in that time it failed.
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        let started = Instant::now();
        let mut leap = Leap::new(
            Config {
                origin: self.leap,
                wanted: match self.hand {
                    Which::Left => Wanted::Only(Side::Left),
                    Which::Right => Wanted::Only(Side::Right),
                    Which::Either => Wanted::Either,
                },
                transport_us: 0,
                backoff: Backoff::default(),
            },
            started,
        );
        let (mut answered, mut last_loss) = (false, None);
        loop {
            let elapsed_s = started.elapsed().as_secs_f64();
            if self.seconds.is_some_and(|limit| elapsed_s >= limit) {
                break;
            }
            match leap.receive(PATIENCE) {
                None | Some(Update::Unseen | Update::Refused(_)) => {}
                Some(Update::Connected { protocol }) => {
                    (answered, last_loss) = (true, None);
                    say(&connected(protocol, json))?;
                }
                Some(Update::Lost(loss)) => {
                    // Attempt after attempt for the same reason is told once.
                    let text = loss.to_string();
                    if last_loss.as_ref() != Some(&text) {
                        say(&lost(&loss, json))?;
                    }
                    last_loss = Some(text);
                }
                Some(Update::Seen(sight)) => say(&seen(&sight, leap.now_us(), json))?,
            }
        }
        say(&end(&leap.counts(), json))?;
        match last_loss {
            Some(loss) if !answered => bail!(loss),
            _ => Ok(()),
        }
    }
}

fn connected(protocol: Protocol, json: bool) -> String {
    if json {
        let protocol = match protocol {
            Protocol::WebSocket(version) => json!(version),
            Protocol::LeapC => json!("leapc"),
        };
        format!("{}\n", json!({ "connected": { "protocol": protocol } }))
    } else {
        format!("connected, {protocol}\n")
    }
}

fn lost(loss: &Loss, json: bool) -> String {
    if json {
        format!("{}\n", json!({ "lost": loss.to_string() }))
    } else {
        format!("{loss}; trying again\n")
    }
}

fn seen(sight: &Sight, now_us: u64, json: bool) -> String {
    let hand = &sight.hand;
    let side = match hand.side {
        Some(Side::Left) => "left",
        Some(Side::Right) => "right",
        None => "hand",
    };
    let age_us = sight.age_us(now_us);
    if json {
        let document = json!({
            "frame": sight.frame_id, "hand": hand.id, "side": side, "exposed_us": sight.exposed_us,
            "age_us": age_us, "uncertainty_us": sight.uncertainty_us, "palm_m": hand.palm_m,
            "grab": hand.grab, "pinch": hand.pinch, "confidence": hand.confidence,
            "new_hand": sight.new_hand,
        });
        return format!("{document}\n");
    }
    let [x, y, z] = hand.palm_m.map(|metres| 1e3 * metres);
    let seconds = sight.exposed_us as f64 / 1e6;
    let age_ms = age_us as f64 / 1e3;
    format!("{seconds:>12.6} s  {side:<5} x {x:7.1} y {y:7.1} z {z:7.1} mm  {age_ms:.1} ms old\n")
}

fn end(counts: &Counts, json: bool) -> String {
    let Counts {
        seen,
        unseen,
        malformed,
        repeated,
        settling,
        stale,
    } = counts;
    if json {
        let counts = json!({
            "seen": seen, "unseen": unseen, "malformed": malformed, "repeated": repeated,
            "settling": settling, "stale": stale,
        });
        format!("{}\n", json!({ "counts": counts }))
    } else {
        format!(
            "{seen} frames with the hand, {unseen} without, {malformed} unreadable, {repeated} repeated, {settling} before \
             the clock was known, {stale} stale\n"
        )
    }
}

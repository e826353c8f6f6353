//! The wearable's clock beside this computer's.

use std::collections::VecDeque;
use std::collections::hash_map::RandomState;
use std::hash::{BuildHasher, Hasher};
use std::time::{Duration, Instant};

use serde_json::json;
use tonus::clock::{ClockConfig, ClockError, DeviceClock, Health, Notice, RoundTrip};
use tonus_shared::wire::{Frame, Header, MAX_FRAME_BYTES, Packet, Ping, WireError, encode};

/// How often the wearable is asked, and how often the answer is printed.
const ASK_EVERY: Duration = Duration::from_millis(250);
const PRINT_EVERY: Duration = Duration::from_secs(1);
/// Questions that an answer is still taken for.
const OPEN: usize = 8;

/// Asks, compares and prints.
pub(super) struct Comparison {
    clock: DeviceClock,
    epoch: Instant,
    boot_id: u32,
    asked: u32,
    /// Number and host time of the newest questions.
    open: VecDeque<(u32, u64)>,
    ask_at: Instant,
    print_at: Instant,
}

impl Comparison {
    /// Host time counts from `epoch`.
    pub(super) fn new(epoch: Instant) -> Result<Self, ClockError> {
        Ok(Self {
            clock: DeviceClock::new(ClockConfig::default())?,
            epoch,
            // As every sender's: random, so that a restart shows.
            boot_id: RandomState::new().build_hasher().finish() as u32,
            asked: 0,
            open: VecDeque::with_capacity(OPEN),
            ask_at: epoch,
            print_at: epoch + PRINT_EVERY,
        })
    }

    fn now_us(&self) -> u64 {
        u64::try_from(self.epoch.elapsed().as_micros()).unwrap_or(u64::MAX)
    }

    /// The next question as a frame, if it is time to ask.
    pub(super) fn request(&mut self) -> Option<Result<Vec<u8>, WireError>> {
        if Instant::now() < self.ask_at {
            return None;
        }
        self.ask_at = Instant::now() + ASK_EVERY;
        let (id, requested_us) = (self.asked, self.now_us());
        let header = Header {
            boot_id: self.boot_id,
            sequence: id,
            device_us: requested_us,
        };
        self.asked = id.wrapping_add(1);
        if self.open.len() == OPEN {
            self.open.pop_front();
        }
        self.open.push_back((id, requested_us));
        let mut buffer = [0; MAX_FRAME_BYTES];
        let packet = Packet::Ping(Ping::Request { id, requested_us });
        let length = encode(&header, &packet, &mut buffer);
        Some(length.map(|length| buffer.iter().copied().take(length).collect()))
    }

    /// Counts a frame in, and describes what is new: a fresh start of the comparison, and once a second how it stands.
    pub(super) fn take(&mut self, frame: &Frame, json: bool) -> String {
        let arrived_us = self.now_us();
        let header = &frame.header;
        let told = match frame.packet {
            Packet::Ping(Ping::Reply {
                id,
                requested_us,
                received_us,
                replied_us,
            }) if self.open.contains(&(id, requested_us)) => {
                self.open.retain(|(open, _)| *open != id);
                let trip = RoundTrip {
                    requested_us,
                    received_us,
                    replied_us,
                    arrived_us,
                };
                self.clock.answered(header.boot_id, &trip)
            }
            _ => Ok(self
                .clock
                .arrived(header.boot_id, header.device_us, arrived_us)),
        };
        let mut text = match told {
            Ok(None) => String::new(),
            Ok(Some(notice)) => noticed(&notice, json),
            Err(error) => line(json, &json!({ "refused": error.to_string() }), || {
                format!("refused: {error}")
            }),
        };
        if Instant::now() >= self.print_at
            && let Some(health) = self.clock.health()
        {
            self.print_at = Instant::now() + PRINT_EVERY;
            text += &stands(&health, json);
        }
        text
    }
}

fn line(json: bool, document: &serde_json::Value, text: impl FnOnce() -> String) -> String {
    if json {
        format!("{document}\n")
    } else {
        text() + "\n"
    }
}

fn noticed(notice: &Notice, json: bool) -> String {
    let (kind, what) = match notice {
        Notice::Started { boot_id } => (
            "started",
            format!("following the wearable's clock, boot {boot_id:#010x}"),
        ),
        Notice::Rebooted { boot_id } => (
            "rebooted",
            format!("the wearable restarted, boot {boot_id:#010x}: its clock is learnt anew"),
        ),
        Notice::Stepped { by_us } => (
            "stepped",
            format!(
                "the wearable's clock, or the shortest delay, stepped by {:.1} ms: learnt anew",
                by_us / 1e3
            ),
        ),
        Notice::Late { by_us } => (
            "late",
            format!(
                "packets come {:.1} ms later than at first: older, unless pings show that the clock was set",
                by_us / 1e3
            ),
        ),
        Notice::Resumed { silence_us } => (
            "resumed",
            format!(
                "after {:.0} s of silence the wearable's clock is learnt anew",
                *silence_us as f64 / 1e6
            ),
        ),
    };
    line(json, &json!({ "clock": { "notice": kind } }), || {
        format!("clock: {what}")
    })
}

fn stands(health: &Health, json: bool) -> String {
    let document = json!({ "clock": {
        "boot_id": health.boot_id, "offset_us": health.offset_us, "rate_ppm": health.rate_ppm,
        "residual_us": health.residual_us, "uncertainty_us": health.uncertainty_us,
        "round_trip_us": health.round_trip_us, "settled": health.settled,
    }});
    line(json, &document, || {
        let rate = if health.settled {
            format!(
                "rate {:+.1} ppm, residual {:.2} ms",
                health.rate_ppm,
                health.residual_us / 1e3
            )
        } else {
            "rate not known yet".to_owned()
        };
        let trip = health.round_trip_us.map_or_else(
            || "no ping answered".to_owned(),
            |us| format!("round trip {:.2} ms", us / 1e3),
        );
        format!(
            "clock: offset {:.6} s within {:.2} ms, {rate}, {trip}",
            health.offset_us / 1e6,
            health.uncertainty_us / 1e3
        )
    })
}

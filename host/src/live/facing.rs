//! Which way is forward: a wearable's attitude sensor does not feel it, and is told in the one posture that shows it.
//!
//! That is the step in which the elbow is bent against a weight, of the calibration and of the check after re-donning: the
//! upper arm hangs, the forearm points forward. The wearable refuses where its own attitude says otherwise, and is asked again
//! while the posture is held. One without an attitude sensor has nothing to be told.

use tonus_shared::wire::{Control, Kind, Packet, Refusal, Reply};

use super::engine::Engine;
use super::request::Request;
use super::world::World;

/// The arm is where it belongs, and at rest, from this share of the step on.
const HELD_FROM: f64 = 0.5;
/// Time between two requests, microseconds; the link answers within a fraction of it.
const AGAIN_US: u64 = 300_000;

const UNKNOWN: &str = "the wearable's attitude does not count: which way is forward shows in the step with the bent elbow of calibration and check";

/// What became of asking in the step under way.
#[derive(Debug, Default, Clone, Copy, PartialEq, Eq)]
pub(super) enum Facing {
    /// Not asked yet.
    #[default]
    Open,
    /// Asked by the frame of this number, at this time.
    Asked { sequence: u32, at_us: u64 },
    /// It did not hang.
    Refused { at_us: u64 },
    /// It knows, or there is nothing that could.
    Settled,
}

impl Engine {
    /// Once for each stream packet: asks while the posture is held, and says so if that was in vain.
    pub(super) fn face(&mut self, world: &mut impl World) {
        let now_us = self.now_us;
        let Some(progress) = self.calibrating.bent() else {
            match std::mem::take(&mut self.facing) {
                Facing::Refused { .. } => self.tell(
                    true,
                    "the upper arm did not hang while the elbow was bent, so that the wearable does not know where forward is: do that step again".to_owned(),
                ),
                Facing::Asked { .. } => self.tell(
                    true,
                    "the wearable did not answer where forward is: do the step with the bent elbow again".to_owned(),
                ),
                Facing::Open | Facing::Settled => {}
            }
            return;
        };
        let due = match self.facing {
            Facing::Open => progress >= HELD_FROM,
            Facing::Asked { at_us, .. } | Facing::Refused { at_us } => now_us >= at_us + AGAIN_US,
            Facing::Settled => false,
        };
        if !due {
            return;
        }
        let face = Packet::Control(Control::FaceForward);
        if let Some((sequence, frame)) = self.wearable.request(face, now_us) {
            self.facing = Facing::Asked {
                sequence,
                at_us: now_us,
            };
            world.ask(now_us, Request::Frame(frame));
        }
    }

    /// What the wearable answered.
    pub(super) fn faced(&mut self, reply: &Reply) {
        let Facing::Asked { sequence, at_us } = self.facing else {
            return;
        };
        if reply.answered != Kind::Control || reply.sequence != sequence {
            return;
        }
        self.facing = match reply.outcome {
            Err(Refusal::OutOfRange) => Facing::Refused { at_us },
            _ => Facing::Settled,
        };
        if reply.outcome.is_ok() {
            self.tell(
                false,
                "the wearable knows where forward is: its attitude counts".to_owned(),
            );
        }
    }

    /// What to warn of: attitudes come, but none of them is used.
    pub(super) fn unfaced(&self) -> Option<&'static str> {
        self.wearable.attitude_without_heading().then_some(UNKNOWN)
    }
}

//! The wearable as it is heard: frames in, their times in session time; requests out, numbered.

use std::collections::VecDeque;

use tonus_shared::wire::{
    self, Calibration, Configuration, Control, Frame, HandPosition, Header, MAX_FRAME_BYTES,
    Packet, Ping, Refusal, Reply, SequenceCounts, SequenceTracker, Status, Stream, StreamFlags,
};

use crate::clock::{ClockConfig, ClockError, DeviceClock, Health, Notice, RoundTrip};

/// Time between two questions for the clock, microseconds.
const PING_EVERY_US: u64 = 1_000_000;
/// Pings that may be on their way, the newest: the oldest of them is lost.
const PINGS: usize = 8;
/// An answer to a request that did not come for so long will not come, microseconds.
const ANSWER_WITHIN_US: u64 = 3_000_000;
/// An attitude comes with every stream packet, but for those that are lost, microseconds.
const ATTITUDE_WITHIN_US: u64 = 200_000;

/// A frame that came in order.
#[derive(Debug)]
pub(super) struct Heard {
    /// Its device time is session time.
    pub(super) frame: Frame,
    /// The clock's comparison began anew.
    pub(super) notice: Option<Notice>,
}

/// What is known of the wearable.
#[derive(Debug)]
pub(super) struct Wearable {
    clock: DeviceClock,
    sequence: SequenceTracker,
    pub(super) refused: u64,
    pub(super) configuration: Option<Configuration>,
    pub(super) calibration: Option<Calibration>,
    /// Whether the wearable is to read it back, so that a recording holds it.
    pub(super) unconfirmed: bool,
    pub(super) status: Option<Status>,
    pub(super) newest: Option<Newest>,
    host_boot_id: u32,
    sent: u32,
    pinged_us: Option<u64>,
    pings: VecDeque<(u32, u64)>,
    /// Session time of the newest attitude, microseconds.
    attitude_us: Option<u64>,
    /// A calibration on its way: its sequence number, and when it left.
    calibrating: Option<(u32, u64)>,
}

/// The newest stream packet.
#[derive(Debug, Clone, Copy)]
pub(super) struct Newest {
    pub(super) stream: Stream,
    /// Session time of its newest scan, microseconds.
    pub(super) acquired_us: u64,
}

/// What became of a calibration that was sent.
#[derive(Debug, Clone, Copy, PartialEq, Eq)]
pub(super) enum Calibrated {
    Done,
    Refused(Refusal),
    Silent,
}

impl Wearable {
    pub(super) fn new(clock: ClockConfig, host_boot_id: u32) -> Result<Self, ClockError> {
        Ok(Self {
            // It is asked for the clock every second.
            clock: DeviceClock::new(ClockConfig {
                answers_pings: true,
                ..clock
            })?,
            sequence: SequenceTracker::new(),
            refused: 0,
            configuration: None,
            calibration: None,
            unconfirmed: false,
            status: None,
            newest: None,
            host_boot_id,
            sent: 0,
            pinged_us: None,
            pings: VecDeque::new(),
            attitude_us: None,
            calibrating: None,
        })
    }

    /// Takes the bytes of a frame; `None` for what cannot be read, came again or too late, or by a clock not known yet.
    pub(super) fn hear(&mut self, bytes: &[u8], at_us: u64) -> Option<Heard> {
        let Ok(mut frame) = wire::decode(bytes) else {
            self.refused += 1;
            return None;
        };
        let Header {
            boot_id,
            sequence,
            device_us,
        } = frame.header;
        let newest = self.sequence.observe(boot_id, sequence).is_newest();
        let notice = match &frame.packet {
            Packet::Ping(Ping::Reply {
                id,
                requested_us,
                received_us,
                replied_us,
            }) if self.asked(*id, *requested_us) => {
                let trip = RoundTrip {
                    requested_us: *requested_us,
                    received_us: *received_us,
                    replied_us: *replied_us,
                    arrived_us: at_us,
                };
                // Times that contradict each other tell nothing.
                self.clock.answered(boot_id, &trip).unwrap_or_default()
            }
            _ => self.clock.arrived(boot_id, device_us, at_us),
        };
        let mapped = self.clock.host_us(boot_id, device_us).ok()?;
        if !newest {
            return None;
        }
        frame.header.device_us = mapped.at_us;
        match &frame.packet {
            Packet::Configuration(configuration) => self.configuration = Some(*configuration),
            Packet::Status(status) => self.status = Some(*status),
            Packet::Orientation(_) => self.attitude_us = Some(mapped.at_us),
            Packet::Calibration(calibration) => {
                self.calibration = Some(*calibration);
                self.unconfirmed = false;
            }
            Packet::Stream(stream) => {
                self.newest = Some(Newest {
                    stream: *stream,
                    acquired_us: mapped.at_us,
                });
            }
            _ => {}
        }
        Some(Heard { frame, notice })
    }

    /// Whether attitudes come while no posture rests on them.
    pub(super) fn attitude_without_heading(&self) -> bool {
        let (Some(newest), Some(attitude_us)) = (&self.newest, self.attitude_us) else {
            return false;
        };
        newest.acquired_us.abs_diff(attitude_us) <= ATTITUDE_WITHIN_US
            && !newest.stream.flags.contains(StreamFlags::ORIENTATION_SEEN)
    }

    /// Whether it has told what it is and what it is calibrated for.
    pub(super) fn introduced(&self) -> bool {
        self.configuration.is_some() && self.calibration.is_some()
    }

    fn asked(&mut self, id: u32, requested_us: u64) -> bool {
        let known = self
            .pings
            .iter()
            .position(|ping| *ping == (id, requested_us));
        known.is_some_and(|place| self.pings.remove(place).is_some())
    }

    /// The link is gone: nothing on its way comes back.
    pub(super) fn unlinked(&mut self) {
        self.pings.clear();
        self.newest = None;
        self.attitude_us = None;
        self.pinged_us = None;
    }

    /// What is due by itself: a ping, and once the wearable's calibration.
    pub(super) fn due(&mut self, raw: bool, now_us: u64) -> Vec<Vec<u8>> {
        let mut out = Vec::new();
        let due = self
            .pinged_us
            .is_none_or(|last_us| now_us >= last_us + PING_EVERY_US);
        if !due || self.newest.is_none() {
            return out;
        }
        self.pinged_us = Some(now_us);
        let id = self.sent;
        if self.pings.len() == PINGS {
            self.pings.pop_front();
        }
        self.pings.push_back((id, now_us));
        out.extend(self.frame(
            Packet::Ping(Ping::Request {
                id,
                requested_us: now_us,
            }),
            now_us,
        ));
        // A wearable that restarted has forgotten.
        if self.configuration.is_some_and(|told| told.raw != raw) {
            out.extend(self.frame(Packet::Control(Control::Raw(raw)), now_us));
        }
        let wanted = self.calibration.is_none() || self.unconfirmed;
        if wanted && self.calibrating.is_none() {
            out.extend(self.frame(Packet::Control(Control::SendCalibration), now_us));
        }
        out
    }

    /// The hand for the wearable, in the shoulder frame; `None` before its clock is known.
    pub(super) fn hand(&mut self, exposed_us: u64, hand_m: Option<[f64; 3]>) -> Option<Vec<u8>> {
        let boot_id = self.clock.health()?.boot_id;
        let device = self.clock.device_us(boot_id, exposed_us).ok()?;
        #[allow(clippy::cast_possible_truncation, reason = "the packet carries f32")]
        let position_m = hand_m.map(|hand_m| hand_m.map(|x| x as f32));
        self.frame(
            Packet::HandPosition(HandPosition { position_m }),
            device.at_us,
        )
    }

    /// A calibration; [`Wearable::calibrated`] tells what becomes of it.
    pub(super) fn calibrate(&mut self, calibration: Calibration, now_us: u64) -> Option<Vec<u8>> {
        self.calibrating = Some((self.sent, now_us));
        self.frame(Packet::Calibration(calibration), now_us)
    }

    /// What became of the calibration on its way, once: by a reply, or by silence.
    pub(super) fn calibrated(&mut self, reply: Option<&Reply>, now_us: u64) -> Option<Calibrated> {
        let (sequence, sent_us) = self.calibrating?;
        let outcome = match reply {
            Some(reply)
                if reply.answered == wire::Kind::Calibration && reply.sequence == sequence =>
            {
                reply
                    .outcome
                    .map_or_else(Calibrated::Refused, |()| Calibrated::Done)
            }
            _ if now_us >= sent_us + ANSWER_WITHIN_US => Calibrated::Silent,
            _ => return None,
        };
        self.calibrating = None;
        Some(outcome)
    }

    /// Any request, and the number by which its reply names it.
    pub(super) fn request(&mut self, packet: Packet, now_us: u64) -> Option<(u32, Vec<u8>)> {
        let sequence = self.sent;
        Some((sequence, self.frame(packet, now_us)?))
    }

    fn frame(&mut self, packet: Packet, device_us: u64) -> Option<Vec<u8>> {
        let header = Header {
            boot_id: self.host_boot_id,
            sequence: self.sent,
            device_us,
        };
        self.sent = self.sent.wrapping_add(1);
        let mut bytes = [0; MAX_FRAME_BYTES];
        // What the wire cannot carry was checked where it came in.
        let length = wire::encode(&header, &packet, &mut bytes).ok()?;
        Some(bytes[..length].to_vec())
    }

    pub(super) fn clock(&self) -> Option<Health> {
        self.clock.health()
    }

    pub(super) fn counts(&self) -> SequenceCounts {
        self.sequence.counts()
    }
}

#[cfg(test)]
mod tests {
    use tonus_shared::semg::quality::Quality;

    use super::*;

    #[test]
    fn pings_that_are_lost_do_not_end_pinging() {
        let mut wearable = Wearable::new(ClockConfig::default(), 1).unwrap();
        wearable.newest = Some(Newest {
            stream: Stream {
                describes_before_us: 64_000,
                envelopes: [0.0; 8],
                activation: 0.1,
                co_contraction: 1.2,
                stiffness_n_per_m: [100.0; 3],
                quality: [Quality::GOOD; 8],
                channels: 4,
                flags: StreamFlags::default(),
            },
            acquired_us: 0,
        });
        let mut asked = Vec::new();
        for second in 1..=20_u64 {
            for bytes in wearable.due(false, second * PING_EVERY_US) {
                if let Packet::Ping(Ping::Request { id, requested_us }) =
                    wire::decode(&bytes).unwrap().packet
                {
                    asked.push((id, requested_us));
                }
            }
        }
        assert_eq!(asked.len(), 20);
        // The newest can be answered, once; the oldest is given up.
        let (first, last) = (asked[0], asked[19]);
        assert!(!wearable.asked(first.0, first.1));
        assert!(wearable.asked(last.0, last.1));
        assert!(!wearable.asked(last.0, last.1));
    }
}

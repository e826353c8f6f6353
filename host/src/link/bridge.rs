//! What is no wearable speaks as one: scans of any source go through the wearable's own signal path and leave as
//! frames, and requests are answered as the firmware answers them.
//!
//! So the simulated wearer, a Myo armband and any other source of sEMG need nothing of their own behind the link.
//! Nothing is kept over the end of the program but what the host keeps, and no model runs here: the host recognises.

use tonus_shared::pipeline::{Board, CalibrationError, Health, InputError, Pipeline};
use tonus_shared::sample::Scan;
use tonus_shared::wire::{
    Calibration, Control, Frame, LastWords, MAX_FRAME_BYTES, ModelState, ModelUpload, Packet, Ping,
    Refusal, Reply, ResetReason, StatusFlags, decode,
};

/// A wearable of `C` channels made of whatever gives scans.
///
/// Frames leave through the `send` of each call, encoded, in the order of their numbers.
#[derive(Debug)]
pub struct Bridge<const C: usize> {
    board: Board,
    pipeline: Pipeline<C>,
    calibration: Calibration,
    raw: bool,
    health: Health,
}

impl<const C: usize> Bridge<C> {
    /// Starts with a calibration; raw sEMG is off. Revision 0 counts as not calibrated, and the status says so.
    ///
    /// # Errors
    /// [`CalibrationError`] when this board cannot work with the calibration.
    pub fn new(board: Board, calibration: &Calibration) -> Result<Self, CalibrationError> {
        Ok(Self {
            board,
            pipeline: Pipeline::new(&board.config(calibration, false)?)?,
            calibration: *calibration,
            raw: false,
            health: Health {
                reset_reason: ResetReason::PowerOn,
                flags: flags(calibration),
                ..Health::default()
            },
        })
    }

    /// The calibration in use.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// The random number that every frame of this start carries.
    #[must_use]
    pub fn boot_id(&self) -> u32 {
        self.board.boot_id
    }

    /// Battery of the device behind, mV; none when nobody measures it. The status tells.
    pub fn set_battery_mv(&mut self, battery_mv: Option<u16>) {
        self.health.battery_mv = battery_mv;
    }

    /// A host has connected to the device behind once more; the status counts it.
    pub fn connected(&mut self) {
        self.health.links = self.health.links.wrapping_add(1);
    }

    /// What the source itself says of its electrodes, from now on.
    pub fn set_lead_off(&mut self, lead_off: [bool; C]) {
        self.pipeline.set_lead_off(lead_off);
    }

    /// Takes one scan; see [`Pipeline::push_scan`].
    ///
    /// # Errors
    /// [`InputError`] for a scan that is not newer than the last; it is counted and changes nothing.
    pub fn push_scan(
        &mut self,
        scan: &Scan<C>,
        mut send: impl FnMut(&[u8]),
    ) -> Result<(), InputError> {
        self.pipeline.push_scan(scan)?;
        self.pipeline.set_health(self.health);
        while let Some(frame) = self.pipeline.next_frame() {
            self.leave(&frame, &mut send);
        }
        Ok(())
    }

    /// The upper arm's attitude (unit quaternion x, y, z, w) at device time `acquired_us`; it leaves with the next
    /// scan. See [`Pipeline::set_orientation`].
    ///
    /// # Errors
    /// [`InputError`]; it is counted and changes nothing.
    pub fn set_orientation(&mut self, xyzw: [f32; 4], acquired_us: u64) -> Result<(), InputError> {
        self.pipeline.set_orientation(xyzw, acquired_us)
    }

    /// The same in a level frame whose heading a host finds out by a request. See [`Pipeline::set_attitude`].
    ///
    /// # Errors
    /// [`InputError`]; it is counted and changes nothing.
    pub fn set_attitude(&mut self, xyzw: [f32; 4], acquired_us: u64) -> Result<(), InputError> {
        self.pipeline.set_attitude(xyzw, acquired_us)
    }

    /// Does what the bytes of one frame ask for, at device time `now_us`, and answers.
    ///
    /// What is no frame, or none that a host sends, is counted as refused, and the status tells.
    pub fn request(&mut self, bytes: &[u8], now_us: u64, mut send: impl FnMut(&[u8])) {
        let Ok(Frame { header, packet }) = decode(bytes) else {
            return self.refuse();
        };
        let answered = packet.kind();
        let outcome = match packet {
            Packet::Ping(Ping::Request { id, requested_us }) => {
                let reply = Packet::Ping(Ping::Reply {
                    id,
                    requested_us,
                    received_us: now_us,
                    replied_us: now_us,
                });
                return self.say(reply, now_us, &mut send);
            }
            Packet::HandPosition(hand) => {
                // A hand that is refused is counted by the pipeline.
                let _counted = self.pipeline.set_hand(hand.position_m, header.device_us);
                return;
            }
            Packet::Calibration(calibration) => self.calibrate(&calibration),
            // No model has room here, so none can be begun.
            Packet::ModelUpload(ModelUpload::Begin { .. }) => Err(Refusal::TooLarge),
            Packet::ModelUpload(_) => Err(Refusal::WrongState),
            Packet::Control(control) => self.command(control, now_us, &mut send),
            _ => return self.refuse(),
        };
        let reply = Reply {
            answered,
            sequence: header.sequence,
            outcome: outcome.map(|_| ()),
            detail: 0,
        };
        self.say(Packet::Reply(reply), now_us, &mut send);
        if outcome == Ok(Effect::Restart) {
            self.restart();
        }
    }

    fn calibrate(&mut self, calibration: &Calibration) -> Result<Effect, Refusal> {
        let config = self.board.config(calibration, self.raw);
        let config = config.map_err(|_| Refusal::OutOfRange)?;
        let taken = self.pipeline.reconfigure(&config);
        taken.map_err(|_| Refusal::OutOfRange)?;
        self.calibration = *calibration;
        self.health.flags = flags(calibration);
        Ok(Effect::None)
    }

    fn command(
        &mut self,
        control: Control,
        now_us: u64,
        send: &mut impl FnMut(&[u8]),
    ) -> Result<Effect, Refusal> {
        let told = match control {
            Control::Raw(raw) => {
                let set = self.pipeline.set_raw(raw);
                set.map_err(|_| Refusal::WrongState)?;
                self.raw = raw;
                return Ok(Effect::None);
            }
            Control::Restart { boot_id } if boot_id == self.board.boot_id => {
                return Ok(Effect::Restart);
            }
            Control::Restart { .. } => return Err(Refusal::WrongState),
            Control::FaceForward => {
                self.pipeline.face_forward()?;
                return Ok(Effect::None);
            }
            Control::SendCalibration => Packet::Calibration(self.calibration),
            Control::SendModelState => Packet::ModelState(ModelState {
                active: None,
                receiving: None,
                capacity_bytes: 0,
            }),
            Control::SendLastWords => Packet::LastWords(LastWords::default()),
        };
        self.say(told, now_us, send);
        Ok(Effect::None)
    }

    /// Begins anew under another boot id, calibrated as before; raw sEMG is off.
    fn restart(&mut self) {
        let board = Board {
            boot_id: self.board.boot_id.wrapping_add(1),
            ..self.board
        };
        // What worked a moment ago works again; if it did not, the old start goes on, and its boot id says so.
        if let Ok(new) = Self::new(board, &self.calibration) {
            let battery_mv = self.health.battery_mv;
            *self = new;
            self.health.battery_mv = battery_mv;
            self.health.reset_reason = ResetReason::Software;
        }
    }

    fn say(&mut self, packet: Packet, device_us: u64, send: &mut impl FnMut(&[u8])) {
        let frame = self.pipeline.number(packet, device_us);
        self.leave(&frame, send);
    }

    /// What no frame may hold is counted as dropped; its number is used up.
    fn leave(&mut self, frame: &Frame, send: &mut impl FnMut(&[u8])) {
        let mut bytes = [0; MAX_FRAME_BYTES];
        match frame.encode(&mut bytes) {
            Ok(length) => send(&bytes[..length]),
            Err(_) => self.health.dropped_packets = self.health.dropped_packets.wrapping_add(1),
        }
    }

    fn refuse(&mut self) {
        self.health.refused_requests = self.health.refused_requests.wrapping_add(1);
    }
}

/// What else is to be done once the answer has left.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
enum Effect {
    None,
    Restart,
}

/// What is always missing here, and what a calibration of nobody is.
fn flags(calibration: &Calibration) -> StatusFlags {
    StatusFlags::NO_MODEL.with(StatusFlags::NOT_CALIBRATED, calibration.revision == 0)
}

#[cfg(test)]
mod tests;

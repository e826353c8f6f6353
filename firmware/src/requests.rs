//! What a host asks of the wearable, whatever transport the frame came by: one place answers it.
//!
//! What needs the flash is handed to the [`crate::keeper`], which may take a tenth of a second and answers itself.

use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, channel::Channel};
use tonus_shared::wire::{
    Calibration, Control, Frame, Kind, LastWords, ModelUpload, Packet, Ping, Refusal, Reply,
};

use crate::{outbox::Outbox, recognition, signal_path::SignalPath};

/// Jobs that wait: as many as a host's burst of model pieces within one connection interval.
pub const JOBS: usize = 4;

/// For the keeper.
pub type Jobs = Channel<CriticalSectionRawMutex, Job, JOBS>;

/// A request that needs the flash.
#[derive(Clone, Debug, PartialEq)]
pub struct Job {
    /// Which request.
    pub asked: Asked,
    /// What it asks for.
    pub work: Work,
}

/// The request that is answered.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Asked {
    /// Its kind.
    pub kind: Kind,
    /// Its sequence number, by its sender's count.
    pub sequence: u32,
}

/// What needs the flash.
#[derive(Clone, Debug, PartialEq)]
pub enum Work {
    /// Keep a calibration that this board can work with, then use it.
    Calibrate(Calibration),
    /// A step of sending a model.
    Upload(ModelUpload),
    /// Tell which models there are.
    ModelState,
}

/// What a request may need beside the signal path.
#[derive(Clone, Copy)]
pub struct Desk<'a> {
    /// Where answers go.
    pub outbox: &'a Outbox,
    /// What needs the flash.
    pub jobs: &'a Jobs,
    /// Hands go there too.
    pub recognition: &'a recognition::Inbox,
    /// What the last panic said.
    pub last_words: &'a LastWords,
}

/// What else is to be done.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Nothing.
    None,
    /// Restart, as soon as the answer had time to leave.
    Restart,
}

impl Asked {
    /// The answer to it.
    #[must_use]
    pub const fn answered(self, outcome: Result<(), Refusal>, detail: u32) -> Packet {
        Packet::Reply(Reply {
            answered: self.kind,
            sequence: self.sequence,
            outcome,
            detail,
        })
    }
}

/// Does what a frame asks for, at device time `now_us`, and leaves the answer at the desk.
///
/// A refusal changes nothing. An answer for which there is no room is counted by the outbox, and the status tells;
/// the host asks again.
pub fn handle<const C: usize>(
    path: &mut SignalPath<C>,
    frame: Frame,
    now_us: u64,
    desk: Desk<'_>,
) -> Effect {
    let Frame { header, packet } = frame;
    let asked = Asked {
        kind: packet.kind(),
        sequence: header.sequence,
    };
    let handed_over = |work| {
        let job = Job { asked, work };
        desk.jobs.try_send(job).map_err(|_| Refusal::Busy)
    };
    let outcome = match packet {
        Packet::Ping(Ping::Request { id, requested_us }) => {
            // The signal path sets the time of the reply when it numbers it.
            let reply = Ping::Reply {
                id,
                requested_us,
                received_us: now_us,
                replied_us: now_us,
            };
            answer(path, Packet::Ping(reply), now_us, desk.outbox);
            return Effect::None;
        }
        Packet::HandPosition(hand) => {
            // A hand that is refused is counted by the pipeline.
            if path.set_hand(hand.position_m, header.device_us).is_ok() {
                desk.recognition.hand(header.device_us, hand.position_m);
            }
            return Effect::None;
        }
        Packet::Calibration(calibration) => match path.check(&calibration) {
            Ok(()) => handed_over(Work::Calibrate(calibration)).map(|()| Answer::Later),
            Err(_) => Err(Refusal::OutOfRange),
        },
        Packet::ModelUpload(step) => handed_over(Work::Upload(step)).map(|()| Answer::Later),
        Packet::Control(Control::SendModelState) => {
            handed_over(Work::ModelState).map(|()| Answer::Later)
        }
        Packet::Control(control) => command(path, control, now_us, desk),
        // The inbox lets no other kind pass.
        _ => return Effect::None,
    };
    let (outcome, effect) = match outcome {
        Ok(Answer::Later) => return Effect::None,
        Ok(Answer::Now(effect)) => (Ok(()), effect),
        Err(refusal) => (Err(refusal), Effect::None),
    };
    answer(path, asked.answered(outcome, 0), now_us, desk.outbox);
    effect
}

/// When a request that is granted is answered.
enum Answer {
    Now(Effect),
    Later,
}

fn command<const C: usize>(
    path: &mut SignalPath<C>,
    control: Control,
    now_us: u64,
    desk: Desk<'_>,
) -> Result<Answer, Refusal> {
    match control {
        Control::Raw(raw) => path.set_raw(raw).map_err(|_| Refusal::WrongState)?,
        Control::SendCalibration => {
            let calibration = Packet::Calibration(*path.calibration());
            answer(path, calibration, now_us, desk.outbox);
        }
        Control::SendLastWords => {
            let words = Packet::LastWords(desk.last_words.clone());
            answer(path, words, now_us, desk.outbox);
        }
        Control::FaceForward => path.face_forward()?,
        Control::Restart { boot_id } if boot_id == path.boot_id() => {
            return Ok(Answer::Now(Effect::Restart));
        }
        // The latter is the keeper's.
        Control::Restart { .. } | Control::SendModelState => return Err(Refusal::WrongState),
    }
    Ok(Answer::Now(Effect::None))
}

fn answer<const C: usize>(path: &mut SignalPath<C>, packet: Packet, now_us: u64, outbox: &Outbox) {
    // A full queue is counted there.
    let _counted = path.answer(packet, now_us, outbox);
}

#[cfg(test)]
mod tests;

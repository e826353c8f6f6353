//! What a host asks of the wearable, whatever transport the frame came by: one place answers it.

use tonus_shared::wire::{Control, Frame, Header, ModelState, Packet, Ping, Refusal, Reply};

use crate::outbox::Outbox;
use crate::signal_path::SignalPath;

/// What else a request changed.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Effect {
    /// Nothing beside the signal path.
    None,
    /// The calibration in use is another one.
    Recalibrated,
}

/// Does what a frame asks for, at device time `now_us`, and leaves the answer in `outbox`.
///
/// A refusal changes nothing. An answer for which there is no room is counted by the outbox, and the status tells;
/// the host asks again. A calibration lasts until the next reset, and no model is taken yet.
pub fn handle<const C: usize>(
    path: &mut SignalPath<C>,
    frame: Frame,
    now_us: u64,
    outbox: &Outbox,
) -> Effect {
    let Frame { header, packet } = frame;
    let answered = packet.kind();
    let mut effect = Effect::None;
    let outcome = match packet {
        Packet::Ping(Ping::Request { id, requested_us }) => {
            // The signal path sets the time of the reply when it numbers it.
            let reply = Ping::Reply {
                id,
                requested_us,
                received_us: now_us,
                replied_us: now_us,
            };
            answer(path, Packet::Ping(reply), now_us, outbox);
            return effect;
        }
        Packet::HandPosition(hand) => {
            // A hand that is refused is counted by the pipeline.
            let _counted = path.set_hand(hand.position_m, header.device_us);
            return effect;
        }
        Packet::Calibration(calibration) => match path.recalibrate(&calibration) {
            Ok(()) => {
                effect = Effect::Recalibrated;
                Ok(())
            }
            Err(_) => Err(Refusal::OutOfRange),
        },
        Packet::Control(asked) => control(path, asked, now_us, outbox),
        Packet::ModelUpload(_) => Err(Refusal::StorageFailed),
        // The inbox lets no other kind pass.
        _ => return effect,
    };
    let Header { sequence, .. } = header;
    let reply = Reply {
        answered,
        sequence,
        outcome,
        detail: 0,
    };
    answer(path, Packet::Reply(reply), now_us, outbox);
    effect
}

fn control<const C: usize>(
    path: &mut SignalPath<C>,
    asked: Control,
    now_us: u64,
    outbox: &Outbox,
) -> Result<(), Refusal> {
    match asked {
        Control::Raw(raw) => path.set_raw(raw).map_err(|_| Refusal::WrongState)?,
        Control::SendCalibration => {
            let calibration = *path.calibration();
            answer(path, Packet::Calibration(calibration), now_us, outbox);
        }
        Control::SendModelState => {
            let none = ModelState {
                active: None,
                receiving: None,
                capacity_bytes: 0,
            };
            answer(path, Packet::ModelState(none), now_us, outbox);
        }
        Control::Restart { .. } | Control::SendLastWords => return Err(Refusal::WrongState),
    }
    Ok(())
}

fn answer<const C: usize>(path: &mut SignalPath<C>, packet: Packet, now_us: u64, outbox: &Outbox) {
    // A full queue is counted there.
    let _counted = path.answer(packet, now_us, outbox);
}

#[cfg(test)]
mod tests;

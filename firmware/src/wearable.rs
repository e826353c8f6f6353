//! The loop through which all goes: scans, attitudes, what a host asks and what other tasks have to say in, numbered
//! frames out.

use core::convert::Infallible;

use embassy_futures::select::{Either4, select4};
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, signal::Signal};
use tonus_shared::{
    pipeline::Health,
    wire::{Calibration, Kind, Packet, Refusal, ResetReason, StatusFlags},
};

use crate::{
    acquisition::{Event, EventQueue},
    afe::ads129x::Ads129xError,
    inbox::Inbox,
    keeper::{Word, Words},
    requests::{self, Desk, Effect},
    signal_path::{SendError, SignalPath},
    vitals::Vitals,
};

/// The newest attitude of the upper arm (unit quaternion x, y, z, w) and its device time, us.
pub type Attitude = Signal<CriticalSectionRawMutex, ([f32; 4], u64)>;

/// Where everything comes from; the desk is where it goes.
#[derive(Clone, Copy)]
pub struct Ports<'a, const C: usize, const N: usize> {
    /// Scans, and what went wrong with them.
    pub events: &'a EventQueue<C, N>,
    /// Attitudes.
    pub attitude: &'a Attitude,
    /// Frames of a host.
    pub inbox: &'a Inbox,
    /// What other tasks have to say.
    pub words: &'a Words,
    /// How those tasks fare.
    pub vitals: &'a Vitals,
    /// Why the wearable started.
    pub reset_reason: ResetReason,
    /// Where answers go.
    pub desk: Desk<'a>,
}

/// What the wearable's surroundings are told.
#[derive(Clone, Copy, Debug, PartialEq)]
pub enum Notice<'a> {
    /// A front end was heard of: the loop goes on.
    Alive,
    /// A host asks for something, by the frame of this number.
    Asked(Kind, u32),
    /// This calibration is in use from now on.
    Calibrated(&'a Calibration),
    /// The front end stumbles; it is being mended.
    Stumbled(Ads129xError),
    /// The front end failed; it is tried again every second.
    Failed(Ads129xError),
    /// A packet did not get into the outbox.
    NotSent(SendError),
    /// A host asks for a restart.
    Restart,
}

/// Runs for ever; `now_us` is the device clock. `tell` is called within the loop and must be short.
pub async fn run<const C: usize, const N: usize>(
    path: &mut SignalPath<C>,
    ports: Ports<'_, C, N>,
    now_us: impl Fn() -> u64,
    mut tell: impl FnMut(Notice<'_>),
) -> Infallible {
    tell(Notice::Calibrated(path.calibration()));
    loop {
        let next = select4(
            ports.events.take(),
            ports.attitude.wait(),
            ports.inbox.take(),
            ports.words.receive(),
        );
        match next.await {
            Either4::First(event) => {
                tell(Notice::Alive);
                path.set_health(ports.health());
                take(path, event, &ports, &mut tell);
            }
            // One that is refused is counted by the pipeline.
            Either4::Second((xyzw, at_us)) => _ = path.set_attitude(xyzw, at_us),
            Either4::Third(frame) => {
                tell(Notice::Asked(frame.packet.kind(), frame.header.sequence));
                match requests::handle(path, frame, now_us(), ports.desk) {
                    Effect::Restart => tell(Notice::Restart),
                    Effect::None => {}
                }
            }
            Either4::Fourth(word) => say(path, word, &ports, now_us(), &mut tell),
        }
    }
}

fn take<const C: usize, const N: usize>(
    path: &mut SignalPath<C>,
    event: Event<C>,
    ports: &Ports<'_, C, N>,
    tell: &mut impl FnMut(Notice<'_>),
) {
    let failed = match event {
        Event::Scan { scan, lead_off } => {
            path.set_lead_off(lead_off);
            if let Err(error) = path.push_scan(&scan, ports.desk.outbox) {
                tell(Notice::NotSent(error));
            }
            if let Some((acquired_us, stream)) = path.take_stream() {
                ports.desk.recognition.stream(acquired_us, stream);
            }
            false
        }
        // Whether it failed before stands: one more fault says nothing else.
        Event::Fault(error) => return tell(Notice::Stumbled(error)),
        Event::Failed(error) => {
            tell(Notice::Failed(error));
            true
        }
    };
    ports.vitals.set(StatusFlags::FRONT_END_FAILED, failed);
}

fn say<const C: usize, const N: usize>(
    path: &mut SignalPath<C>,
    word: Word,
    ports: &Ports<'_, C, N>,
    now_us: u64,
    tell: &mut impl FnMut(Notice<'_>),
) {
    let (packet, device_us) = match word {
        Word::Say(packet) => (packet, now_us),
        Word::Infer(at_us, inference) => (Packet::Inference(inference), at_us),
        Word::Calibrated(calibration, asked) => {
            // It was checked before it was kept, so that this cannot fail; if it did, nothing would be in use that is not kept.
            let outcome = path.recalibrate(&calibration);
            if outcome.is_ok() {
                ports.vitals.set(StatusFlags::NOT_CALIBRATED, false);
                tell(Notice::Calibrated(path.calibration()));
            }
            let outcome = outcome.map_err(|_| Refusal::OutOfRange);
            (asked.answered(outcome, 0), now_us)
        }
    };
    if let Err(error) = path.answer(packet, device_us, ports.desk.outbox) {
        tell(Notice::NotSent(error));
    }
}

impl<const C: usize, const N: usize> Ports<'_, C, N> {
    fn health(&self) -> Health {
        let health = self.vitals.health(self.reset_reason);
        Health {
            overruns: health.overruns.wrapping_add(self.events.overruns()),
            refused_requests: self.inbox.refused(),
            dropped_hypotheses: self.desk.recognition.dropped(),
            ..health
        }
    }
}

#[cfg(test)]
mod tests;

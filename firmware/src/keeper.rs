//! The task that owns the flash: keeps calibrations and models for a host, and answers it.
//!
//! It runs in the thread, below everything that is in a hurry: writing a word takes 41 us, erasing a page 85 ms.

use core::convert::Infallible;

use embassy_futures::select::{Either, select};
use embassy_sync::{blocking_mutex::raw::CriticalSectionRawMutex, channel::Channel, mutex::Mutex};
use embassy_time::{Duration, Timer};
use embedded_storage_async::nor_flash::MultiwriteNorFlash;
use heapless::Vec;
use tonus_shared::{
    image::{ModelImage, WEARABLE},
    wire::{
        self, ActiveModel, Calibration, Header, Inference, MAX_FRAME_BYTES, ModelState,
        ModelUpload, Packet, Reception, Refusal, VERSION,
    },
};

use crate::{
    recognition,
    requests::{Asked, Job, Jobs, Work},
    storage::{Model, Record, Storage, StorageError},
};

/// What others than the signal path have to say, which waits for a number.
pub const WORDS: usize = 8;
/// Between two signs of life while there is nothing to do.
const IDLE: Duration = Duration::from_secs(1);

/// The flash, shared by the tasks of the thread.
pub type Flash<F> = Mutex<CriticalSectionRawMutex, Storage<F>>;

/// To the signal path, which numbers all that leaves.
pub type Words = Channel<CriticalSectionRawMutex, Word, WORDS>;

/// Something to be said, or to be done first.
#[derive(Clone, Debug, PartialEq)]
pub enum Word {
    /// Send this.
    Say(Packet),
    /// Send this, which describes a time of its own, us.
    Infer(u64, Inference),
    /// This calibration is kept: use it from now on, and answer that it is done.
    Calibrated(Calibration, Asked),
}

/// What the keeper works with; `mapped` gives the bytes of a model where they lie in the flash.
pub struct Keeper<'a, F: MultiwriteNorFlash, M> {
    /// The flash.
    pub flash: &'a Flash<F>,
    /// A model's bytes, which stay until the upload after the one that replaces it begins.
    pub mapped: M,
    /// Who uses the model.
    pub recognition: &'a recognition::Inbox,
    /// Where answers go.
    pub words: &'a Words,
}

impl<F: MultiwriteNorFlash, M: Fn(Model) -> &'static [u8]> Keeper<'_, F, M> {
    /// Does what comes for ever; `alive` is called at least once a second.
    pub async fn run(&self, jobs: &Jobs, mut alive: impl FnMut()) -> Infallible {
        loop {
            alive();
            if let Either::First(job) = select(jobs.receive(), Timer::after(IDLE)).await {
                self.work(job).await;
            }
        }
    }

    async fn work(&self, Job { asked, work }: Job) {
        let word = match work {
            Work::Calibrate(calibration) => match self.keep(&calibration).await {
                Ok(()) => Word::Calibrated(calibration, asked),
                Err(refusal) => Word::Say(asked.answered(Err(refusal), 0)),
            },
            Work::Upload(step) => {
                let outcome = self.upload(step).await;
                let (outcome, detail) = match outcome {
                    Ok(detail) => (Ok(()), detail),
                    Err((refusal, detail)) => (Err(refusal), detail),
                };
                Word::Say(asked.answered(outcome, detail))
            }
            Work::ModelState => {
                let state = self.state().await;
                self.words.send(Word::Say(Packet::ModelState(state))).await;
                Word::Say(asked.answered(Ok(()), 0))
            }
        };
        self.words.send(word).await;
    }

    async fn keep(&self, calibration: &Calibration) -> Result<(), Refusal> {
        let record = encoded(calibration).ok_or(Refusal::OutOfRange)?;
        let mut flash = self.flash.lock().await;
        let kept = flash.keep_calibration(&record).await;
        kept.map_err(|_| Refusal::StorageFailed)
    }

    /// One step; gives what the answer's `detail` is.
    async fn upload(&self, step: ModelUpload) -> Result<u32, (Refusal, u32)> {
        let mut flash = self.flash.lock().await;
        let capacity_bytes = flash.model_capacity();
        let refused =
            |error: StorageError<F::Error>| (refusal(&error), detail(&error, capacity_bytes));
        match step {
            ModelUpload::Begin {
                total_bytes,
                sha256,
            } => {
                flash
                    .begin_upload(total_bytes, sha256)
                    .await
                    .map_err(refused)?;
                Ok(0)
            }
            ModelUpload::Piece {
                offset_bytes,
                bytes,
            } => {
                flash
                    .receive_piece(offset_bytes, &bytes)
                    .await
                    .map_err(refused)?;
                let received = flash.upload().map(|progress| progress.received);
                Ok(received.unwrap_or(0))
            }
            ModelUpload::Finish => {
                let fits = |model| parsed((self.mapped)(model)).is_some();
                flash.finish_upload(fits).await.map_err(refused)?;
                drop(flash);
                // The next upload erases what recognition has read from up to now.
                self.recognition.change_over().await;
                Ok(0)
            }
            ModelUpload::Abandon => {
                flash.abandon_upload().await.map_err(refused)?;
                Ok(0)
            }
        }
    }

    async fn state(&self) -> ModelState {
        let flash = self.flash.lock().await;
        let active = flash.model().and_then(|model| {
            let image = parsed((self.mapped)(model))?;
            let count = |number: usize| u8::try_from(number).unwrap_or(u8::MAX);
            Some(ActiveModel {
                hash: first(&model.sha256),
                skills: count(image.skills().len()),
                dofs: count(image.dofs().len()),
                functions: count(image.basis().count()),
                rank: count(image.latent().rank()),
            })
        });
        let receiving = flash.upload().map(|progress| Reception {
            hash: first(&progress.sha256),
            received_bytes: progress.received,
            total_bytes: progress.length,
        });
        ModelState {
            active,
            receiving,
            capacity_bytes: flash.model_capacity(),
        }
    }
}

/// The calibration that was kept last; none when there is none, or none that this version reads.
///
/// # Errors
/// [`StorageError::Damaged`], [`StorageError::Flash`]: the person must be calibrated anew.
pub async fn calibration<F: MultiwriteNorFlash>(
    flash: &mut Storage<F>,
) -> Result<Option<Calibration>, StorageError<F::Error>> {
    let record = flash.calibration().await?;
    let frame = record.and_then(|record| wire::decode(&record.bytes).ok());
    Ok(frame.and_then(|frame| match frame.packet {
        Packet::Calibration(calibration) => Some(calibration),
        _ => None,
    }))
}

/// As a frame, which carries its version and is checked when it is read.
fn encoded(calibration: &Calibration) -> Option<Record> {
    let header = Header {
        boot_id: 0,
        sequence: 0,
        device_us: 0,
    };
    let mut frame = [0; MAX_FRAME_BYTES];
    let packet = Packet::Calibration(*calibration);
    let length = wire::encode(&header, &packet, &mut frame).ok()?;
    Some(Record {
        version: u16::from(VERSION),
        bytes: Vec::from_slice(&frame[..length]).ok()?,
    })
}

fn parsed(bytes: &[u8]) -> Option<ModelImage<'_>> {
    ModelImage::parse(bytes, &WEARABLE).ok()
}

fn first(sha256: &[u8; 32]) -> [u8; 8] {
    core::array::from_fn(|byte| sha256[byte])
}

fn refusal<E: core::fmt::Debug>(error: &StorageError<E>) -> Refusal {
    match error {
        StorageError::WrongLength { .. } => Refusal::TooLarge,
        StorageError::NotReceiving | StorageError::Incomplete { .. } => Refusal::WrongState,
        StorageError::WrongOffset { .. } => Refusal::WrongOffset,
        StorageError::TooMuch { .. } => Refusal::OutOfRange,
        StorageError::HashMismatch { .. } => Refusal::HashMismatch,
        StorageError::NotFitting => Refusal::NotFitting,
        StorageError::Flash { .. }
        | StorageError::WrongFlash { .. }
        | StorageError::OutsidePartition { .. }
        | StorageError::Damaged { .. }
        | StorageError::NotKept { .. } => Refusal::StorageFailed,
    }
}

const fn detail<E: core::fmt::Debug>(error: &StorageError<E>, capacity_bytes: u32) -> u32 {
    match error {
        StorageError::WrongOffset { expected, .. } => *expected,
        StorageError::WrongLength { .. } => capacity_bytes,
        _ => 0,
    }
}

#[cfg(test)]
mod tests;

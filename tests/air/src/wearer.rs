//! Who wears it: seeded noise for sEMG, into the loop that the chip runs, with the chip's keeper and recognition beside it.

use std::convert::Infallible;

use embassy_futures::select::select4;
use embassy_time::{Duration, Instant, Timer};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use tonus_firmware::{
    acquisition::{CHANNELS, Event, EventQueue, MUSCLES, PERIOD_US, RATE_HZ},
    ble::Shown,
    inbox::Inbox,
    keeper::{self, Flash, Keeper, Word, Words},
    outbox::Outbox,
    recognition,
    requests::{Desk, Jobs},
    signal_path::SignalPath,
    vitals::Vitals,
    wearable::{self, Attitude, Notice, Ports},
};
use tonus_shared::{
    pipeline::{self, Board, CalibrationError},
    recognition::Storage as Hypotheses,
    sample::{AdcScale, AdcScaleError, Scan},
    wire::{Calibration, LastWords, ResetReason, StatusFlags},
};

use crate::flash::FileFlash;

/// Scans behind one stream packet.
const STREAM_SCANS: u32 = RATE_HZ / 100;
/// Counts of a 24-bit converter, and its volts.
const COUNTS: (i32, i32) = (-(1 << 23), (1 << 23) - 1);
const VOLTS_PER_COUNT: f64 = 1e-7;
const SEED: u64 = 0x7013;
/// Counts of the noise, far from the converter's rails.
const NOISE_COUNTS: i32 = 2_000;

#[derive(Debug, thiserror::Error)]
pub(crate) enum WearerError {
    #[error(transparent)]
    Scale(#[from] AdcScaleError),
    #[error(transparent)]
    Calibration(#[from] CalibrationError),
}

/// What the tasks share.
pub(crate) struct Wearer<'a> {
    pub(crate) boot_id: u32,
    pub(crate) outbox: &'a Outbox,
    pub(crate) inbox: &'a Inbox,
    pub(crate) shown: &'a Shown,
    pub(crate) flash: &'a Flash<FileFlash>,
    /// The same flash, where models are read.
    pub(crate) models: &'a FileFlash,
    pub(crate) vitals: &'a Vitals,
}

impl Wearer<'_> {
    /// Wears it for ever, at `stream_hz` stream packets per second: above 100 the wearer's time runs faster
    /// than the host's.
    pub(crate) async fn run(&self, stream_hz: u32) -> Result<Infallible, WearerError> {
        let mut path = SignalPath::new(self.board()?, &self.calibration().await)?;
        let events = EventQueue::<CHANNELS, 32>::new();
        let (attitude, jobs, words) = (Attitude::new(), Jobs::new(), Words::new());
        let recognition = recognition::Inbox::new();
        let ports = Ports {
            events: &events,
            attitude: &attitude,
            inbox: self.inbox,
            words: &words,
            vitals: self.vitals,
            reset_reason: ResetReason::PowerOn,
            desk: Desk {
                outbox: self.outbox,
                jobs: &jobs,
                recognition: &recognition,
                last_words: &LastWords::default(),
            },
        };
        let keeper = Keeper {
            flash: self.flash,
            mapped: |model| self.models.mapped(model),
            recognition: &recognition,
            words: &words,
        };
        let now_us = || Instant::now().as_micros();
        let mut hypotheses = Box::new(Hypotheses::new());
        let model = async || {
            let model = self.flash.lock().await.model();
            model.map(|model| self.models.mapped(model))
        };
        let recognising = recognition::serve(
            model,
            &mut hypotheses,
            &recognition,
            now_us,
            |at_us, inference| _ = words.try_send(Word::Infer(at_us, inference)),
            |notice| self.notice(notice),
        );
        select4(
            wear(&events, stream_hz),
            wearable::run(&mut path, ports, now_us, |notice| self.tell(notice)),
            keeper.run(&jobs, || {}),
            recognising,
        )
        .await;
        unreachable!("none of them ends")
    }

    fn board(&self) -> Result<Board, WearerError> {
        Ok(Board {
            boot_id: self.boot_id,
            firmware_hash: [0; 8],
            adc: AdcScale::new(VOLTS_PER_COUNT, 0, COUNTS.0, COUNTS.1)?,
            rates_hz: &[RATE_HZ],
        })
    }

    async fn calibration(&self) -> Calibration {
        let kept = keeper::calibration(&mut *self.flash.lock().await).await;
        let kept = kept.unwrap_or_else(|error| {
            println!("calibration not read: {error}");
            None
        });
        self.vitals.set(StatusFlags::NOT_CALIBRATED, kept.is_none());
        kept.unwrap_or_else(|| pipeline::illustrative(MUSCLES, RATE_HZ))
    }

    fn tell(&self, notice: Notice<'_>) {
        match notice {
            Notice::Alive => {}
            Notice::Asked(kind, sequence) => println!("taken {kind} {sequence}"),
            Notice::Calibrated(calibration) => {
                if let Err(error) = self.shown.show(self.boot_id, calibration) {
                    println!("calibration not shown: {error}");
                }
            }
            // As a reset does: whoever started it starts it again.
            Notice::Restart => std::process::exit(0),
            other => println!("{other:?}"),
        }
    }

    fn notice(&self, notice: recognition::Notice) {
        match notice {
            recognition::Notice::Alive => {}
            recognition::Notice::Model(there) => {
                self.vitals.set(StatusFlags::NO_MODEL, !there);
                println!("model {there}");
            }
            recognition::Notice::Refused(error) => println!("model refused: {error}"),
        }
    }
}

/// Converts noise for ever.
async fn wear(events: &EventQueue<CHANNELS, 32>, stream_hz: u32) -> Infallible {
    let mut random = StdRng::seed_from_u64(SEED);
    let pause = Duration::from_hz(u64::from(stream_hz.max(1)));
    let mut index = 0_u32;
    loop {
        Timer::after(pause).await;
        for _ in 0..STREAM_SCANS {
            let scan = Scan {
                index,
                acquired_us: u64::from(index) * u64::from(PERIOD_US),
                counts: std::array::from_fn(|_| random.random_range(-NOISE_COUNTS..=NOISE_COUNTS)),
            };
            index = index.wrapping_add(1);
            events.put(Event::Scan {
                scan,
                lead_off: [false; CHANNELS],
            });
        }
    }
}

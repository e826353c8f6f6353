//! Who wears it: seeded noise for sEMG through the wearable's signal path, and answers to what a host writes.

use std::{cell::RefCell, convert::Infallible};

use embassy_time::{Duration, Instant, Timer};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use tonus_firmware::{ble::Shown, inbox::Inbox, outbox::Outbox, signal_path::SignalPath};
use tonus_shared::{
    pipeline::{self, Board, CalibrationError},
    sample::{AdcScale, AdcScaleError, Scan},
    wire::{
        self, Calibration, Control, Frame, Header, Kind, MAX_FRAME_BYTES, ModelState, Muscle,
        Packet, Ping, Refusal, Reply,
    },
};

const CHANNELS: usize = 4;
const MUSCLES: [Muscle; CHANNELS] = [
    Muscle::BicepsShort,
    Muscle::BicepsLong,
    Muscle::TricepsLateral,
    Muscle::TricepsLong,
];
const SCAN_HZ: u32 = 1000;
const SCAN_PERIOD_US: u64 = 1_000_000 / SCAN_HZ as u64;
/// Scans behind one stream packet.
const SCANS_PER_STREAM: u32 = SCAN_HZ / 100;
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

pub(crate) struct Wearer<'a> {
    boot_id: u32,
    path: RefCell<SignalPath<CHANNELS>>,
    outbox: &'a Outbox,
    shown: &'a Shown,
}

impl<'a> Wearer<'a> {
    pub(crate) fn new(
        boot_id: u32,
        outbox: &'a Outbox,
        shown: &'a Shown,
    ) -> Result<Self, WearerError> {
        let board = Board {
            boot_id,
            firmware_hash: [0; 8],
            adc: AdcScale::new(VOLTS_PER_COUNT, 0, COUNTS.0, COUNTS.1)?,
            rates_hz: &[SCAN_HZ],
        };
        let calibration = pipeline::illustrative(MUSCLES, SCAN_HZ);
        let wearer = Self {
            boot_id,
            path: RefCell::new(SignalPath::new(board, &calibration)?),
            outbox,
            shown,
        };
        wearer.show(calibration);
        Ok(wearer)
    }

    /// Wears it for ever, at `stream_hz` stream packets per second: above 100 the wearer's time runs faster
    /// than the host's.
    pub(crate) async fn wear(&self, stream_hz: u32) -> Infallible {
        let mut random = StdRng::seed_from_u64(SEED);
        let pause = Duration::from_hz(u64::from(stream_hz.max(1)));
        let mut index = 0_u32;
        loop {
            Timer::after(pause).await;
            for _ in 0..SCANS_PER_STREAM {
                let scan = Scan {
                    index,
                    acquired_us: u64::from(index) * SCAN_PERIOD_US,
                    counts: std::array::from_fn(|_| {
                        random.random_range(-NOISE_COUNTS..=NOISE_COUNTS)
                    }),
                };
                index = index.wrapping_add(1);
                if let Err(error) = self.path.borrow_mut().push_scan(&scan, self.outbox) {
                    println!("scan {index}: {error}");
                }
            }
        }
    }

    /// Takes what a host wrote, and answers it. The calibration is kept in memory; there is none for models.
    pub(crate) async fn handle(&self, inbox: &Inbox) -> Infallible {
        loop {
            let Frame { header, packet } = inbox.take().await;
            let answered = packet.kind();
            println!("taken {answered} {}", header.sequence);
            let outcome = match packet {
                Packet::Ping(Ping::Request { id, requested_us }) => {
                    let received_us = Instant::now().as_micros();
                    self.answer(Packet::Ping(Ping::Reply {
                        id,
                        requested_us,
                        received_us,
                        replied_us: received_us,
                    }));
                    continue;
                }
                Packet::Calibration(calibration) => self.recalibrate(calibration),
                Packet::Control(control) => self.control(control),
                Packet::ModelUpload(_) => Err(Refusal::StorageFailed),
                _ => continue,
            };
            self.answer(Packet::Reply(Reply {
                answered,
                sequence: header.sequence,
                outcome,
                detail: 0,
            }));
        }
    }

    fn recalibrate(&self, calibration: Calibration) -> Result<(), Refusal> {
        self.path
            .borrow_mut()
            .recalibrate(&calibration)
            .map_err(|_| Refusal::OutOfRange)?;
        self.show(calibration);
        Ok(())
    }

    fn control(&self, control: Control) -> Result<(), Refusal> {
        match control {
            Control::Raw(raw) => {
                let set = self.path.borrow_mut().set_raw(raw);
                return set.map_err(|_| Refusal::WrongState);
            }
            Control::SendCalibration => {
                let calibration = *self.path.borrow().calibration();
                self.answer(Packet::Calibration(calibration));
            }
            Control::SendModelState => self.answer(Packet::ModelState(ModelState {
                active: None,
                receiving: None,
                capacity_bytes: 0,
            })),
            Control::Restart { .. } | Control::SendLastWords => return Err(Refusal::WrongState),
        }
        Ok(())
    }

    fn answer(&self, packet: Packet) {
        let now_us = Instant::now().as_micros();
        let answered = self.path.borrow_mut().answer(packet, now_us, self.outbox);
        if let Err(error) = answered {
            println!("no answer: {error}");
        }
    }

    /// Lets a host read this calibration. What is read is not numbered: its sequence is 0.
    fn show(&self, calibration: Calibration) {
        let header = Header {
            boot_id: self.boot_id,
            sequence: 0,
            device_us: 0,
        };
        let mut bytes = [0; MAX_FRAME_BYTES];
        match wire::encode(&header, &Packet::Calibration(calibration), &mut bytes) {
            Ok(length) => self.shown.show(&bytes[..length].iter().copied().collect()),
            Err(error) => println!("{} not shown: {error}", Kind::Calibration),
        }
    }
}

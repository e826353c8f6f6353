//! Who wears it: seeded noise for sEMG through the wearable's signal path, and answers to what a host writes.

use std::{cell::RefCell, convert::Infallible};

use embassy_time::{Duration, Instant, Timer};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use tonus_firmware::{
    ble::Shown,
    inbox::Inbox,
    outbox::Outbox,
    requests::{self, Effect},
    signal_path::SignalPath,
};
use tonus_shared::{
    pipeline::{self, Board, CalibrationError},
    sample::{AdcScale, AdcScaleError, Scan},
    wire::Muscle,
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
            path: RefCell::new(SignalPath::new(board, &calibration)?),
            outbox,
            shown,
        };
        wearer.show();
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

    /// Answers what a host wrote as the chip does.
    pub(crate) async fn handle(&self, inbox: &Inbox) -> Infallible {
        loop {
            let frame = inbox.take().await;
            println!("taken {} {}", frame.packet.kind(), frame.header.sequence);
            let now_us = Instant::now().as_micros();
            let effect = requests::handle(&mut self.path.borrow_mut(), frame, now_us, self.outbox);
            match effect {
                Effect::Recalibrated => self.show(),
                Effect::None => {}
            }
        }
    }

    fn show(&self) {
        let path = self.path.borrow();
        if let Err(error) = self.shown.show(path.boot_id(), path.calibration()) {
            println!("calibration not shown: {error}");
        }
    }
}

//! Who wears it: seeded noise for sEMG through the shared pipeline, and answers to what a host writes.

use std::cell::RefCell;

use embassy_time::{Instant, Timer};
use rand::{RngExt, SeedableRng, rngs::StdRng};
use tonus_firmware::{
    ble::Shown,
    inbox::Inbox,
    outbox::{EncodedFrame, Outbox},
};
use tonus_shared::{
    pipeline::{
        ChannelConfig, DEFAULT_ACTIVATION_WINDOW_S, Pipeline, PipelineConfig, PipelineError,
    },
    sample::{AdcScale, AdcScaleError, Scan},
    semg::chain::ChainConfig,
    stiffness::ArmStiffness,
    wire::{Frame, MAX_FRAME_BYTES, Muscle, Packet, Ping, Refusal, Reply},
};

const CHANNELS: usize = 4;
const SCAN_HZ: u32 = 1000;
const SCAN_PERIOD_US: u64 = 1_000_000 / SCAN_HZ as u64;
/// Scans behind one stream packet.
const SCANS_PER_STREAM: u32 = SCAN_HZ / 100;
const SEED: u64 = 0x7013;
/// Counts of the noise, far from the converter's rails.
const NOISE_COUNTS: i32 = 2_000;

#[derive(Debug, thiserror::Error)]
pub(crate) enum WearerError {
    #[error(transparent)]
    Scale(#[from] AdcScaleError),
    #[error(transparent)]
    Pipeline(#[from] PipelineError),
}

pub(crate) struct Wearer<'a> {
    pipeline: RefCell<Pipeline<CHANNELS>>,
    outbox: &'a Outbox,
}

impl<'a> Wearer<'a> {
    pub(crate) fn new(boot_id: u32, outbox: &'a Outbox) -> Result<Self, WearerError> {
        let muscles = [
            Muscle::BicepsShort,
            Muscle::BicepsLong,
            Muscle::TricepsLateral,
            Muscle::TricepsLong,
        ];
        let pipeline = Pipeline::new(&PipelineConfig {
            boot_id,
            firmware_hash: [0; 8],
            adc: AdcScale::new(1e-7, 0, -(1 << 23), (1 << 23) - 1)?,
            chain: ChainConfig::at_rate(f64::from(SCAN_HZ)),
            channels: muscles.map(|muscle| ChannelConfig {
                muscle,
                rest_v: 10e-6,
                mvc_v: 500e-6,
            }),
            activation_window_s: DEFAULT_ACTIVATION_WINDOW_S,
            arm: ArmStiffness::illustrative(),
            raw: false,
        })?;
        Ok(Self {
            pipeline: RefCell::new(pipeline),
            outbox,
        })
    }

    /// Wears it for ever, at `stream_hz` stream packets per second: above 100 the wearer's time runs faster
    /// than the host's.
    pub(crate) async fn wear(&self, stream_hz: u32) -> std::convert::Infallible {
        let mut random = StdRng::seed_from_u64(SEED);
        let pause = embassy_time::Duration::from_hz(u64::from(stream_hz.max(1)));
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
                if self.pipeline.borrow_mut().push_scan(&scan).is_err() {
                    println!("scan {index} refused");
                }
                while let Some(frame) = self.next_frame() {
                    self.put(&frame);
                }
            }
        }
    }

    fn next_frame(&self) -> Option<Frame> {
        self.pipeline.borrow_mut().next_frame()
    }

    /// Takes what a host wrote, and answers it. The calibration is kept in memory; there is none for models.
    pub(crate) async fn handle(&self, inbox: &Inbox, shown: &Shown) -> std::convert::Infallible {
        loop {
            let Frame { header, packet } = inbox.take().await;
            let answered = packet.kind();
            println!("taken {answered} {}", header.sequence);
            let outcome = match packet {
                Packet::Ping(Ping::Request { id, requested_us }) => {
                    let now_us = Instant::now().as_micros();
                    self.answer(Packet::Ping(Ping::Reply {
                        id,
                        requested_us,
                        received_us: now_us,
                        replied_us: now_us,
                    }));
                    continue;
                }
                Packet::HandPosition(_) => continue,
                Packet::Calibration(_) => {
                    let mut bytes = [0; MAX_FRAME_BYTES];
                    let frame = self.number(packet);
                    match frame.encode(&mut bytes) {
                        Ok(length) => {
                            shown.show(&bytes[..length].iter().copied().collect());
                            Ok(())
                        }
                        Err(_) => Err(Refusal::OutOfRange),
                    }
                }
                Packet::ModelUpload(_) => Err(Refusal::StorageFailed),
                _ => Ok(()),
            };
            self.answer(Packet::Reply(Reply {
                answered,
                sequence: header.sequence,
                outcome,
                detail: 0,
            }));
        }
    }

    fn number(&self, packet: Packet) -> Frame {
        let now_us = Instant::now().as_micros();
        self.pipeline.borrow_mut().number(packet, now_us)
    }

    fn answer(&self, packet: Packet) {
        self.put(&self.number(packet));
    }

    fn put(&self, frame: &Frame) {
        let mut bytes = [0; MAX_FRAME_BYTES];
        let encoded = frame
            .encode(&mut bytes)
            .ok()
            .and_then(|length| EncodedFrame::from_slice(bytes.get(..length)?).ok());
        match encoded {
            Some(encoded) => self.outbox.put(frame.packet.kind(), encoded),
            None => println!("frame {} not encoded", frame.header.sequence),
        }
    }
}

//! A simulated ADS1294 in virtual time, with the faults that real ones have. Tests only.
//!
//! It follows the sheet, not the driver: it wakes in continuous reading, ignores RREG there, converts while START is
//! high, and makes its test signal from its own clock.

use std::{
    cell::RefCell,
    convert::Infallible,
    future::{Future, pending, poll_fn},
    pin::Pin,
    rc::Rc,
    task::{Context, Poll, Waker},
};

use embedded_hal::{
    digital::{self, OutputPin},
    spi::{self, Operation},
};
use embedded_hal_async::{delay::DelayNs, spi::SpiDevice};

use super::{Ads129x, Settings};
use crate::afe::{DataReady, Edge};

pub(crate) const CHANNELS: usize = 4;
/// Settling of the filter after START, in halves of a period.
const SETTLING_HALVES: u64 = 9;

/// What is wrong with it.
#[derive(Clone, Default)]
pub(crate) struct Faults {
    pub(crate) no_edges: bool,
    /// So many edges are lost, then they come again.
    pub(crate) lost_edges: u32,
    pub(crate) spi_fails: bool,
    pub(crate) spi_hangs: bool,
    /// Bits by which frames slip to the right.
    pub(crate) slip: u32,
    pub(crate) id: Option<u8>,
    /// A register that always reads this.
    pub(crate) stuck: Option<(u8, u8)>,
    /// The test signal's height over what it should be.
    pub(crate) reference: Option<f64>,
    /// Noise of the second channel with shorted inputs, counts.
    pub(crate) noise: i32,
}

pub(crate) struct State {
    now_ns: u64,
    alarms_ns: Vec<u64>,
    registers: [u8; 26],
    continuous: bool,
    started: bool,
    next_edge_ns: Option<u64>,
    edge_ns: Option<u64>,
    pub(crate) conversions: u64,
    pub(crate) ppm: i64,
    pub(crate) faults: Faults,
    pub(crate) input: fn(conversion: u64, channel: usize) -> i32,
    /// LOFF_STATP and LOFF_STATN.
    pub(crate) lead_off: [u8; 2],
    pub(crate) resets: u32,
}

impl State {
    fn reset(&mut self) {
        self.registers = [0; 26];
        self.registers[0x00] = 0x90;
        self.registers[0x01] = 0x06;
        self.registers[0x03] = 0x40;
        self.registers[0x14] = 0x0f;
        self.continuous = true;
        self.resets += 1;
        self.restart();
    }

    fn period_ns(&self) -> u64 {
        let nominal: i64 = match self.registers[0x01] {
            0x85 => 1_000_000,
            0x84 => 500_000,
            0x06 => 4_000_000,
            other => panic!("CONFIG1 {other:#04x} is not simulated"),
        };
        u64::try_from(nominal + nominal * self.ppm / 1_000_000).unwrap()
    }

    fn restart(&mut self) {
        self.edge_ns = None;
        self.next_edge_ns = self
            .started
            .then(|| self.now_ns + SETTLING_HALVES * self.period_ns() / 2);
    }

    /// Goes on to the next thing that happens.
    fn advance(&mut self) {
        let now_ns = self.now_ns;
        self.alarms_ns.retain(|alarm_ns| *alarm_ns > now_ns);
        let next = self
            .alarms_ns
            .iter()
            .copied()
            .chain(self.next_edge_ns)
            .min();
        self.now_ns = next.expect("everything waits for what never comes");
        if self.next_edge_ns == Some(self.now_ns) {
            self.next_edge_ns = Some(self.now_ns + self.period_ns());
            self.conversions += 1;
            if self.faults.lost_edges > 0 {
                self.faults.lost_edges -= 1;
            } else if !self.faults.no_edges {
                self.edge_ns = Some(self.now_ns);
            }
        }
    }

    fn exchange(&mut self, bytes: &mut [u8]) {
        match *bytes {
            [0x11] => self.continuous = false,
            [0x10] => self.continuous = true,
            _ if self.continuous => self.frame(bytes),
            [read, count, ..] if read & 0xe0 == 0x20 => {
                assert_eq!(bytes.len(), usize::from(count) + 3);
                let first = usize::from(read & 0x1f);
                let length = usize::from(count) + 1;
                bytes[2..].copy_from_slice(&self.registers[first..first + length]);
                for (address, byte) in (first..).zip(&mut bytes[2..]) {
                    match (self.faults.stuck, self.faults.id) {
                        (Some((stuck, value)), _) if usize::from(stuck) == address => *byte = value,
                        (_, Some(id)) if address == 0 => *byte = id,
                        _ => {}
                    }
                }
            }
            [write, count, ..] if write & 0xe0 == 0x40 => {
                assert_eq!(bytes.len(), usize::from(count) + 3);
                let first = usize::from(write & 0x1f);
                for (address, byte) in (first..).zip(&bytes[2..]) {
                    assert!(
                        !matches!(address, 0x00 | 0x09..=0x0c | 0x12 | 0x13 | 0x1a..),
                        "an ADS1294 has no register {address:#04x} to write"
                    );
                    self.registers[address] = *byte;
                }
                if first <= 0x01 {
                    self.restart();
                }
            }
            _ => panic!("no command: {bytes:02x?}"),
        }
    }

    fn frame(&self, bytes: &mut [u8]) {
        let [p, n] = self.lead_off;
        let (p, n) = (p & self.registers[0x0f], n & self.registers[0x10]);
        let mut frame = u128::from(0b1100_u8) << 20 | u128::from(p) << 12 | u128::from(n) << 4;
        for channel in 0..CHANNELS {
            let word = u32::from_be_bytes(self.code(channel).to_be_bytes()) & 0xff_ffff;
            frame = frame << 24 | u128::from(word);
        }
        let all = (frame >> self.faults.slip).to_be_bytes();
        let length = 3 * (1 + CHANNELS);
        for (byte, value) in bytes.iter_mut().zip(&all[all.len() - length..]) {
            *byte = *value;
        }
    }

    fn code(&self, channel: usize) -> i32 {
        let set = self.registers[0x05 + channel];
        if set & 0x80 != 0 {
            return 0;
        }
        match set & 0x07 {
            0b000 => (self.input)(self.conversions, channel),
            0b001 => {
                let noise = if channel == 1 { self.faults.noise } else { 0 };
                // An offset, and noise of plus and minus `5 + noise` counts.
                let sign = if self.conversions.count_ones().is_multiple_of(2) {
                    1
                } else {
                    -1
                };
                1_000 + sign * (5 + noise)
            }
            0b101 => {
                assert_eq!(
                    self.registers[0x02], 0x11,
                    "internal signal, 1 x, f_CLK / 2^20"
                );
                assert_eq!(set & 0x70, 0, "gain 6");
                let clocks = self.conversions * (self.period_ns() / 1_000_000 * 2048).max(1024);
                let sign = if clocks >> 19 & 1 == 0 { -1.0 } else { 1.0 };
                // 1 mV of 0.4 V full scale, and an offset.
                let code = 20_971.5 * self.faults.reference.unwrap_or(1.0);
                (sign * code) as i32 + 3_000
            }
            other => panic!("input {other} is not simulated"),
        }
    }
}

/// The chip, its bus, its lines and the time: all of it is one thing here.
#[derive(Clone)]
pub(crate) struct Chip(Rc<RefCell<State>>);

pub(crate) type Driver = Ads129x<CHANNELS, Chip, Reset, Start, Chip>;

impl Chip {
    /// `start_us`: when the simulation begins, so that a timer's wrap can be met.
    pub(crate) fn new(start_us: u64) -> Self {
        let mut state = State {
            now_ns: start_us * 1_000,
            alarms_ns: Vec::new(),
            registers: [0; 26],
            continuous: true,
            started: false,
            next_edge_ns: None,
            edge_ns: None,
            conversions: 0,
            ppm: 0,
            faults: Faults::default(),
            input: |_, _| 0,
            lead_off: [0; 2],
            resets: 0,
        };
        state.reset();
        Self(Rc::new(RefCell::new(state)))
    }

    pub(crate) fn driver(&self, settings: Settings<CHANNELS>) -> Driver {
        Ads129x::new(
            self.clone(),
            Reset(self.clone()),
            Start(self.clone()),
            self.clone(),
            settings,
        )
    }

    pub(crate) fn now_us(&self) -> u64 {
        self.0.borrow().now_ns / 1_000
    }

    pub(crate) fn with<A>(&self, change: impl FnOnce(&mut State) -> A) -> A {
        change(&mut self.0.borrow_mut())
    }

    /// Runs a future to its end; one that waits for ever is a panic.
    pub(crate) fn run<F: Future>(&self, future: F) -> F::Output {
        let mut future = std::pin::pin!(future);
        loop {
            if let Poll::Ready(output) = self.poll(&mut future.as_mut()) {
                return output;
            }
            self.with(State::advance);
        }
    }

    /// Runs a future that never ends until device time `until_us`.
    pub(crate) fn run_until<F: Future>(&self, future: &mut Pin<&mut F>, until_us: u64) {
        self.with(|chip| chip.alarms_ns.push(until_us * 1_000));
        while self.now_us() < until_us {
            assert!(self.poll(future).is_pending(), "it must not end");
            self.with(State::advance);
        }
        self.with(|chip| {
            chip.alarms_ns
                .retain(|alarm_ns| *alarm_ns != until_us * 1_000)
        });
    }

    fn poll<F: Future>(&self, future: &mut Pin<&mut F>) -> Poll<F::Output> {
        future
            .as_mut()
            .poll(&mut Context::from_waker(Waker::noop()))
    }

    async fn wait_ns(&self, ns: u64) {
        let alarm_ns = self.with(|chip| {
            let alarm_ns = chip.now_ns + ns;
            chip.alarms_ns.push(alarm_ns);
            alarm_ns
        });
        poll_fn(|_| {
            if self.with(|chip| chip.now_ns) >= alarm_ns {
                Poll::Ready(())
            } else {
                Poll::Pending
            }
        })
        .await;
    }
}

/// Ticks of a 16 MHz timer of 32 bits.
fn ticks(ns: u64) -> u32 {
    (u128::from(ns) * 16 / 1_000) as u32
}

impl DataReady for Chip {
    async fn edge(&mut self) -> Edge {
        poll_fn(|_| {
            self.with(|chip| match chip.edge_ns.take() {
                Some(edge_ns) => Poll::Ready(Edge {
                    captured: ticks(edge_ns),
                    seen: ticks(chip.now_ns),
                    seen_us: chip.now_ns / 1_000,
                }),
                None => Poll::Pending,
            })
        })
        .await
    }

    fn clear(&mut self) {
        self.with(|chip| chip.edge_ns = None);
    }
}

impl DelayNs for Chip {
    async fn delay_ns(&mut self, ns: u32) {
        self.wait_ns(u64::from(ns)).await;
    }
}

impl spi::ErrorType for Chip {
    type Error = spi::ErrorKind;
}

impl SpiDevice for Chip {
    async fn transaction(
        &mut self,
        operations: &mut [Operation<'_, u8>],
    ) -> Result<(), spi::ErrorKind> {
        let faults = self.with(|chip| chip.faults.clone());
        if faults.spi_hangs {
            pending::<()>().await;
        }
        if faults.spi_fails {
            return Err(spi::ErrorKind::Other);
        }
        for operation in operations {
            match operation {
                // 4 MHz.
                Operation::TransferInPlace(bytes) => {
                    self.wait_ns(bytes.len() as u64 * 2_000).await;
                    self.with(|chip| chip.exchange(bytes));
                }
                Operation::DelayNs(ns) => self.wait_ns(u64::from(*ns)).await,
                other => panic!("not simulated: {other:?}"),
            }
        }
        Ok(())
    }
}

pub(crate) struct Reset(Chip);
pub(crate) struct Start(Chip);

impl digital::ErrorType for Reset {
    type Error = Infallible;
}

impl OutputPin for Reset {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.with(State::reset);
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        Ok(())
    }
}

impl digital::ErrorType for Start {
    type Error = Infallible;
}

impl OutputPin for Start {
    fn set_low(&mut self) -> Result<(), Infallible> {
        self.0.with(|chip| {
            chip.started = false;
            chip.restart();
        });
        Ok(())
    }

    fn set_high(&mut self) -> Result<(), Infallible> {
        self.0.with(|chip| {
            chip.started = true;
            chip.restart();
        });
        Ok(())
    }
}

//! UARTE: a serial port with DMA (PS 6.34), 8 data bits, one start and one stop bit.

use std::collections::VecDeque;

use super::{Around, CYCLES_PER_S, Common, Kept, Peripheral};

/// Address of the first one.
pub const BASE: u32 = 0x4000_2000;
const RECEIVED: u32 = 2;
const RECEIVE_END: u32 = 4;
const SENT: u32 = 7;
const SEND_END: u32 = 8;
const ERROR: u32 = 9;
const RECEIVER_STOPPED: u32 = 17;
const RECEIVE_STARTED: u32 = 19;
const SEND_STARTED: u32 = 20;
const SENDER_STOPPED: u32 = 22;
const ERRORSRC: u32 = 0x480;
const BAUD: u32 = 0x524;
const RECEIVE_POINTER: u32 = 0x534;
const SEND_POINTER: u32 = 0x544;
/// Start bit, eight data bits, stop bit.
const BITS: u64 = 10;
/// PS 6.34, "Reception": bytes that the receiver keeps without a buffer.
const FIFO_BYTES: usize = 4;

/// A transfer by DMA.
#[derive(Clone, Copy, Debug, Default)]
struct Transfer {
    pointer: u32,
    left: u32,
    amount: u32,
}

/// One port.
#[derive(Clone, Debug)]
pub struct Uarte {
    common: Common,
    kept: Kept,
    errors: u32,
    sending: Transfer,
    sent: Option<u64>,
    receiving: Option<Transfer>,
    received: u32,
    fifo: VecDeque<u8>,
    /// When the byte that the host is sending is complete.
    arrives: Option<u64>,
}

impl Default for Uarte {
    fn default() -> Self {
        let unconnected = [0x508, 0x50C, 0x510, 0x514].map(|offset| (offset, u32::MAX));
        let zero =
            [0x500, RECEIVE_POINTER, 0x538, SEND_POINTER, 0x548, 0x56C].map(|offset| (offset, 0));
        let registers = [&unconnected[..], &zero[..], &[(BAUD, 0x0400_0000)]].concat();
        Self {
            common: Common::new(BASE, 0x5A_0397, 0x60),
            kept: Kept::new(&registers),
            errors: 0,
            sending: Transfer::default(),
            sent: None,
            receiving: None,
            received: 0,
            fifo: VecDeque::new(),
            arrives: None,
        }
    }
}

impl Uarte {
    /// Cycles of one byte on the line: PS 6.34, register BAUDRATE, the rate is the register's value by 2^32 of 16 MHz.
    fn byte_cycles(&self) -> u64 {
        let baud = (u64::from(self.kept.value(BAUD)) * 16_000_000) >> 32;
        BITS * CYCLES_PER_S / baud.max(1)
    }

    fn send_next(&mut self, at: u64, around: &mut Around<'_>) {
        let mut byte = [0];
        if let Err(fault) = around.memory.load(self.sending.pointer, &mut byte) {
            around.effects.fault = Some(fault);
            return;
        }
        around.world.serial.sent.push((at, byte[0]));
        self.sending.pointer += 1;
        self.sending.left -= 1;
        self.sending.amount += 1;
        self.common.raise(SENT, around);
        self.sent = (self.sending.left > 0).then(|| at + self.byte_cycles());
        if self.sent.is_none() {
            self.common.raise(SEND_END, around);
        }
    }

    /// Moves what came into the buffer, as far as there is one.
    fn store(&mut self, around: &mut Around<'_>) {
        while let (Some(transfer), Some(byte)) = (&mut self.receiving, self.fifo.front()) {
            if let Err(fault) = around.memory.store(transfer.pointer, &[*byte]) {
                around.effects.fault = Some(fault);
                return;
            }
            self.fifo.pop_front();
            transfer.pointer += 1;
            transfer.left -= 1;
            transfer.amount += 1;
            if transfer.left == 0 {
                self.received = transfer.amount;
                self.receiving = None;
                self.common.raise(RECEIVE_END, around);
            }
        }
    }

    fn arrive(&mut self, at: u64, around: &mut Around<'_>) {
        if let Some(byte) = around.world.serial.to_send.pop_front() {
            if self.fifo.len() < FIFO_BYTES {
                self.fifo.push_back(byte);
                self.common.raise(RECEIVED, around);
                self.store(around);
            } else {
                self.errors |= 1;
                self.common.raise(ERROR, around);
            }
        }
        let more = !around.world.serial.to_send.is_empty();
        self.arrives = more.then(|| at + self.byte_cycles());
    }

    /// The host has begun to send.
    pub fn line_taken(&mut self, now: u64) {
        self.arrives = self.arrives.or(Some(now + self.byte_cycles()));
    }

    fn start_receiving(&mut self, around: &mut Around<'_>) {
        self.receiving = Some(Transfer {
            pointer: self.kept.value(RECEIVE_POINTER),
            left: self.kept.value(0x538),
            amount: 0,
        });
        self.common.raise(RECEIVE_STARTED, around);
        self.store(around);
    }

    fn start_sending(&mut self, now: u64, around: &mut Around<'_>) {
        self.sending = Transfer {
            pointer: self.kept.value(SEND_POINTER),
            left: self.kept.value(0x548),
            amount: 0,
        };
        self.common.raise(SEND_STARTED, around);
        if self.sending.left == 0 {
            self.common.raise(SEND_END, around);
        } else {
            self.sent = Some(now + self.byte_cycles());
        }
    }
}

impl Peripheral for Uarte {
    fn read(&mut self, offset: u32, _now: u64, _around: &mut Around<'_>) -> Option<u32> {
        match offset {
            ERRORSRC => Some(self.errors),
            0x53C => Some(self.received),
            0x54C => Some(self.sending.amount),
            _ => self.common.read(offset).or_else(|| self.kept.get(offset)),
        }
    }

    fn write(&mut self, offset: u32, value: u32, now: u64, around: &mut Around<'_>) -> Option<()> {
        match offset {
            0x000 => self.start_receiving(around),
            0x004 => {
                if let Some(transfer) = self.receiving.take() {
                    self.received = transfer.amount;
                    self.common.raise(RECEIVE_END, around);
                }
                self.common.raise(RECEIVER_STOPPED, around);
            }
            0x008 => self.start_sending(now, around),
            0x00C => {
                self.sent = None;
                self.common.raise(SENDER_STOPPED, around);
            }
            ERRORSRC => self.errors &= !value,
            _ => {
                return self
                    .common
                    .write(offset, value)
                    .or_else(|| self.kept.set(offset, value));
            }
        }
        Some(())
    }

    fn deadline(&self) -> Option<u64> {
        [self.sent, self.arrives].into_iter().flatten().min()
    }

    fn fire(&mut self, at: u64, around: &mut Around<'_>) {
        if self.sent == Some(at) {
            self.send_next(at, around);
        }
        if self.arrives == Some(at) {
            self.arrive(at, around);
        }
    }

    fn line(&self) -> bool {
        self.common.line()
    }
}

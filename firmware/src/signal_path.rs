//! From scans and requests to encoded frames: the shared pipeline, which numbers all that the wearable sends.

use tonus_shared::{
    pipeline::{Board, CalibrationError, Health, InputError, Pipeline, PipelineError},
    sample::Scan,
    wire::{Calibration, Frame, MAX_FRAME_BYTES, Packet, Ping, WireError},
};

use crate::{
    acquisition::Block,
    outbox::{EncodedFrame, Outbox, QueueFull},
};

/// Why a packet did not get into the outbox.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
pub enum SendError {
    /// It holds what no frame may.
    #[error(transparent)]
    Encode(#[from] WireError),
    /// Too many reports wait. The outbox counted it and the status tells.
    #[error(transparent)]
    Queue(#[from] QueueFull),
}

/// The wearable's signal path with `C` channels, independent of the front end that converts them.
pub struct SignalPath<const C: usize> {
    board: Board,
    pipeline: Pipeline<C>,
    calibration: Calibration,
    raw: bool,
    health: Health,
    /// Scans lost in buffers that were overwritten.
    lost: u32,
}

impl<const C: usize> SignalPath<C> {
    /// A signal path of this board, calibrated so; raw sEMG is off.
    ///
    /// # Errors
    /// [`CalibrationError`] when this board cannot work with the calibration.
    pub fn new(board: Board, calibration: &Calibration) -> Result<Self, CalibrationError> {
        Ok(Self {
            board,
            pipeline: Pipeline::new(&board.config(calibration, false)?)?,
            calibration: *calibration,
            raw: false,
            health: Health::default(),
            lost: 0,
        })
    }

    /// The random number that every packet of this start carries.
    #[must_use]
    pub const fn boot_id(&self) -> u32 {
        self.board.boot_id
    }

    /// The calibration in use.
    #[must_use]
    pub fn calibration(&self) -> &Calibration {
        &self.calibration
    }

    /// Changes over to another calibration and goes on numbering. Filters are designed anew, which takes longer than
    /// a scan: a gap may follow, and is flagged. A scan rate that differs needs the front end to change too.
    ///
    /// # Errors
    /// [`CalibrationError`]; the calibration in use stands then.
    pub fn recalibrate(&mut self, calibration: &Calibration) -> Result<(), CalibrationError> {
        let config = self.board.config(calibration, self.raw)?;
        self.pipeline.reconfigure(&config)?;
        self.calibration = *calibration;
        Ok(())
    }

    /// Whether raw sEMG is sent from now on.
    ///
    /// # Errors
    /// [`PipelineError::RawRange`] for a converter of more than 24 bits; nothing has changed then.
    pub fn set_raw(&mut self, raw: bool) -> Result<(), PipelineError> {
        self.pipeline.set_raw(raw)?;
        self.raw = raw;
        Ok(())
    }

    /// Where the hand was at device time `acquired_us`; see [`Pipeline::set_hand`].
    ///
    /// # Errors
    /// [`InputError`]; it is counted and changes nothing.
    pub fn set_hand(
        &mut self,
        position_m: Option<[f32; 3]>,
        acquired_us: u64,
    ) -> Result<(), InputError> {
        self.pipeline.set_hand(position_m, acquired_us)
    }

    /// The upper arm's attitude at device time `acquired_us`; see [`Pipeline::set_orientation`]. It goes out with the
    /// next scan.
    ///
    /// # Errors
    /// [`InputError`]; it is counted and changes nothing.
    pub fn set_orientation(&mut self, xyzw: [f32; 4], acquired_us: u64) -> Result<(), InputError> {
        self.pipeline.set_orientation(xyzw, acquired_us)
    }

    /// The front end's own lead-off detection, per channel, from now on.
    pub fn set_lead_off(&mut self, lead_off: [bool; C]) {
        self.pipeline.set_lead_off(lead_off);
    }

    /// What only the board knows, for the status packets from now on. What this path and the outbox count themselves
    /// (overwritten buffers, replaced frames, refused reports) is added to it.
    pub fn set_health(&mut self, health: Health) {
        self.health = health;
    }

    /// Takes one scan and leaves what is due in `outbox`. A scan that is not newer than the last is counted by the
    /// pipeline, and the status tells.
    ///
    /// **Budget.** See [`Pipeline::push_scan`].
    ///
    /// # Errors
    /// [`SendError`] of the last packet that could not be left; the scan is taken all the same.
    pub fn push_scan(&mut self, scan: &Scan<C>, outbox: &Outbox) -> Result<(), SendError> {
        if self.pipeline.push_scan(scan).is_err() {
            return Ok(());
        }
        self.tell_health(outbox);
        let mut left = Ok(());
        while let Some(frame) = self.pipeline.next_frame() {
            if let Err(error) = leave(&frame, outbox) {
                left = Err(error);
            }
        }
        left
    }

    /// Takes one full buffer of scans, `period_us` apart, which `block` places in time.
    ///
    /// **Budget.** One buffer's time: afterwards the converter overwrites the next buffer. That is not queued for; the
    /// pipeline sees the gap and says so in its packets.
    ///
    /// # Errors
    /// As [`Self::push_scan`].
    pub fn buffer_full<const N: usize>(
        &mut self,
        block: Block,
        period_us: u32,
        buffer: &[[i16; C]; N],
        outbox: &Outbox,
    ) -> Result<(), SendError> {
        self.lost = self.lost.wrapping_add(block.lost);
        let mut left = Ok(());
        for (number, counts) in (0_u32..).zip(buffer) {
            let scan = Scan {
                index: block.first_index.wrapping_add(number),
                acquired_us: block.first_acquired_us + u64::from(number * period_us),
                counts: counts.map(i32::from),
            };
            if let Err(error) = self.push_scan(&scan, outbox) {
                left = Err(error);
            }
        }
        left
    }

    /// Numbers a packet that others made, and leaves it in `outbox`. `device_us` is the time of the newest measurement in
    /// it or, if it rests on none, the present; a ping's reply says that it left then.
    ///
    /// # Errors
    /// [`SendError`]; its number is used up.
    pub fn answer(
        &mut self,
        packet: Packet,
        device_us: u64,
        outbox: &Outbox,
    ) -> Result<(), SendError> {
        let packet = match packet {
            Packet::Ping(Ping::Reply {
                id,
                requested_us,
                received_us,
                ..
            }) => Packet::Ping(Ping::Reply {
                id,
                requested_us,
                received_us,
                replied_us: device_us.max(received_us),
            }),
            other => other,
        };
        leave(&self.pipeline.number(packet, device_us), outbox)
    }

    fn tell_health(&mut self, outbox: &Outbox) {
        let counts = outbox.counts();
        let health = &self.health;
        self.pipeline.set_health(Health {
            overruns: health.overruns.wrapping_add(self.lost),
            dropped_packets: health.dropped_packets.wrapping_add(counts.replaced),
            lost_reports: health.lost_reports.wrapping_add(counts.refused),
            ..*health
        });
    }
}

fn leave(frame: &Frame, outbox: &Outbox) -> Result<(), SendError> {
    let mut bytes = [0; MAX_FRAME_BYTES];
    let length = frame.encode(&mut bytes)?;
    let mut encoded = EncodedFrame::from_array(bytes);
    encoded.truncate(length);
    outbox.put(frame.packet.kind(), encoded)?;
    Ok(())
}

#[cfg(test)]
mod tests;

//! From scans and requests to encoded frames: the shared pipeline, which numbers all that the wearable sends.

use tonus_shared::{
    pipeline::{
        Board, CalibrationError, HeadingError, Health, InputError, Pipeline, PipelineError,
    },
    sample::Scan,
    wire::{Calibration, Frame, MAX_FRAME_BYTES, Packet, Ping, Stream, WireError},
};

use crate::outbox::{EncodedFrame, Outbox, QueueFull};

/// Why a packet did not get into the outbox.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[cfg_attr(target_os = "none", derive(defmt::Format))]
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
    /// The newest stream packet and its device time, us, until somebody takes it.
    newest: Option<(u64, Stream)>,
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
            newest: None,
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

    /// Whether this board could work with a calibration; nothing changes.
    ///
    /// # Errors
    /// [`CalibrationError`], as [`Self::recalibrate`] would give.
    pub fn check(&self, calibration: &Calibration) -> Result<(), CalibrationError> {
        let config = self.board.config(calibration, self.raw)?;
        Ok(Pipeline::<C>::check(&config)?)
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

    /// The upper arm's attitude at device time `acquired_us`; see [`Pipeline::set_attitude`]. It goes out with the
    /// next scan.
    ///
    /// # Errors
    /// [`InputError`]; it is counted and changes nothing.
    pub fn set_attitude(&mut self, xyzw: [f32; 4], acquired_us: u64) -> Result<(), InputError> {
        self.pipeline.set_attitude(xyzw, acquired_us)
    }

    /// The upper arm hangs, the elbow bent forward; see [`Pipeline::face_forward`].
    ///
    /// # Errors
    /// [`HeadingError`]; what was known stands.
    pub fn face_forward(&mut self) -> Result<(), HeadingError> {
        self.pipeline.face_forward()
    }

    /// The front end's own lead-off detection, per channel, from now on.
    pub fn set_lead_off(&mut self, lead_off: [bool; C]) {
        self.pipeline.set_lead_off(lead_off);
    }

    /// What only the board knows, for the status packets from now on. What this path and the outbox count themselves
    /// (replaced frames, refused reports) is added to it.
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
            if let Packet::Stream(stream) = &frame.packet {
                self.newest = Some((frame.header.device_us, *stream));
            }
            if let Err(error) = leave(&frame, outbox) {
                left = Err(error);
            }
        }
        left
    }

    /// The stream packet that the last scans completed and the device time of its newest scan, us; once.
    pub const fn take_stream(&mut self) -> Option<(u64, Stream)> {
        self.newest.take()
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

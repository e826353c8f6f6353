//! Raw sEMG of a recording as one continuous series, with what is missing said.

use std::path::Path;

use tonus_shared::wire::{Configuration, Header, Muscle, Packet, RawSemg, decode};

use crate::clock::DeviceClock;
use crate::live::{Act, Input, Timed};
use crate::recording::{Opening, Reading};

use super::clock;
use super::error::ExportError;
use super::rows::configuration;

/// The most scans of one file: a day at 10 kHz.
const LIMIT: u64 = 864_000_000;

/// Raw sEMG, scan by scan at a constant rate; scans that are missing hold the count that means zero volts.
#[derive(Clone, Debug)]
pub struct Scans {
    /// What was known when the recording began, and whom it named first, if nobody was known.
    pub opening: Opening,
    /// How the wearable was set.
    pub configuration: Configuration,
    /// When the first scan was taken, session time, microseconds.
    pub start_us: u64,
    /// `counts[channel][scan]`.
    pub counts: Vec<Vec<i32>>,
    /// Runs of scans that are missing, in order.
    pub gaps: Vec<Gap>,
    /// Demonstrations: begin and end, session time, microseconds, and label. None for one that did not end.
    pub demonstrations: Vec<(u64, Option<u64>, String)>,
}

/// Scans that are missing.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Gap {
    /// The first of them.
    pub first: usize,
    /// How many.
    pub scans: usize,
}

/// Puts packets where they belong.
struct Placing {
    configuration: Configuration,
    clock: Option<DeviceClock>,
    /// Boot, index and place of the first scan of this boot.
    base: Option<(u32, u32, u64)>,
    start_us: u64,
    counts: Vec<Vec<i32>>,
    there: Vec<bool>,
}

impl Scans {
    /// Reads the raw sEMG of a recording. Packets that came late fill the gap that they left.
    ///
    /// # Errors
    /// [`ExportError`] where there is none, or it is of more than one setting.
    pub fn read(path: &Path) -> Result<Self, ExportError> {
        let (found, _) = configuration(path)?;
        let reading = Reading::open(path)?;
        let mut opening = reading.opening().clone();
        let mut clock = clock(&opening, path)?;
        let mut placing = None;
        let mut demonstrations: Vec<(u64, Option<u64>, String)> = Vec::new();
        for timed in reading.inputs() {
            let Timed { at_us, input } = timed?;
            opening.subject = opening.subject.or_else(|| input.wearer().cloned());
            match input {
                Input::Act(Act::Record { label }) => demonstrations.push((at_us, None, label)),
                Input::Act(Act::Stop) => {
                    if let Some((_, end_us @ None, _)) = demonstrations.last_mut() {
                        *end_us = Some(at_us);
                    }
                }
                Input::Frame(bytes) => {
                    let Ok(frame) = decode(&bytes) else { continue };
                    if placing.is_none() && matches!(frame.packet, Packet::RawSemg(_)) {
                        let found = found.ok_or(ExportError::NoScale)?;
                        placing = Some(Placing::new(found, clock.take()));
                    }
                    if let Some(placing) = &mut placing {
                        placing.take(&frame.header, &frame.packet, at_us)?;
                    }
                }
                _ => {}
            }
        }
        let placed = placing.ok_or(ExportError::NoScans)?;
        Ok(Self {
            opening,
            configuration: placed.configuration,
            start_us: placed.start_us,
            gaps: gaps(&placed.there),
            counts: placed.counts,
            demonstrations,
        })
    }

    /// Scans per second.
    #[must_use]
    pub fn rate_hz(&self) -> f64 {
        f64::from(self.configuration.semg_hz)
    }

    /// Scans from the first to the last, missing ones included.
    #[must_use]
    pub fn len(&self) -> usize {
        self.counts.first().map_or(0, Vec::len)
    }

    /// Whether there are none.
    #[must_use]
    pub fn is_empty(&self) -> bool {
        self.len() == 0
    }

    /// Where each channel sits.
    #[must_use]
    pub fn muscles(&self) -> &[Muscle] {
        let muscles = &self.configuration.muscles;
        muscles.get(..self.counts.len()).unwrap_or(muscles)
    }

    /// Microvolts at the electrodes of one count, and the count that means zero.
    #[must_use]
    pub fn scale(&self) -> (f64, i32) {
        let scale = &self.configuration;
        (f64::from(scale.volts_per_count) * 1e6, scale.offset_counts)
    }
}

impl Placing {
    fn new(configuration: Configuration, clock: Option<DeviceClock>) -> Self {
        Self {
            clock,
            base: None,
            start_us: 0,
            counts: vec![Vec::new(); usize::from(configuration.channels)],
            there: Vec::new(),
            configuration,
        }
    }

    fn take(&mut self, header: &Header, packet: &Packet, at_us: u64) -> Result<(), ExportError> {
        if let Some(clock) = &mut self.clock {
            clock.arrived(header.boot_id, header.device_us, at_us);
        }
        let at_s = at_us as f64 * 1e-6;
        match packet {
            Packet::Configuration(now) => {
                let setting = |of: &Configuration| {
                    let scale = (of.semg_hz.to_bits(), of.volts_per_count.to_bits());
                    (scale, of.offset_counts, of.channels)
                };
                if setting(now) != setting(&self.configuration) {
                    return Err(ExportError::Changed { at_s });
                }
            }
            Packet::RawSemg(raw) if usize::from(raw.channels) != self.counts.len() => {
                return Err(ExportError::Changed { at_s });
            }
            Packet::RawSemg(raw) => self.place(header, raw, at_us)?,
            _ => {}
        }
        Ok(())
    }

    fn place(&mut self, header: &Header, raw: &RawSemg, at_us: u64) -> Result<(), ExportError> {
        let channels = self.counts.len();
        let scans = raw.counts.len() / channels.max(1);
        let (_, index, place) = match self.base {
            Some(base) if base.0 == header.boot_id => base,
            _ => {
                // Where another boot's scans lie beside the first one's, time alone says.
                let first_us = self.first_scan_us(header, scans, at_us);
                let place = if self.there.is_empty() {
                    self.start_us = first_us;
                    0
                } else {
                    let since_s = first_us.saturating_sub(self.start_us) as f64 * 1e-6;
                    let place = (since_s * f64::from(self.configuration.semg_hz)).round();
                    (place as u64).max(self.there.len() as u64)
                };
                *self.base.insert((header.boot_id, raw.first_index, place))
            }
        };
        // Indexes wrap; one from before the first of its boot is left out.
        let ahead = raw.first_index.wrapping_sub(index).cast_signed();
        let Ok(ahead) = u64::try_from(ahead) else {
            return Ok(());
        };
        let first = place + ahead;
        let end = first + scans as u64;
        if end > LIMIT {
            return Err(ExportError::TooLong {
                at_s: at_us as f64 * 1e-6,
                scans: end,
                limit: LIMIT,
            });
        }
        let (Ok(first), Ok(end)) = (usize::try_from(first), usize::try_from(end)) else {
            return Ok(());
        };
        if self.there.len() < end {
            self.there.resize(end, false);
            for counts in &mut self.counts {
                counts.resize(end, self.configuration.offset_counts);
            }
        }
        for (scan, values) in raw.counts.chunks_exact(channels).enumerate() {
            self.there[first + scan] = true;
            for (counts, &value) in self.counts.iter_mut().zip(values) {
                counts[first + scan] = value;
            }
        }
        Ok(())
    }

    /// When the first scan of a packet was taken, session time, microseconds.
    fn first_scan_us(&self, header: &Header, scans: usize, at_us: u64) -> u64 {
        let mapped = (self.clock.as_ref())
            .and_then(|clock| clock.host_us(header.boot_id, header.device_us).ok());
        let last_us = mapped.map_or(at_us, |mapped| mapped.at_us);
        let before_s = scans.saturating_sub(1) as f64 / f64::from(self.configuration.semg_hz);
        last_us.saturating_sub((before_s * 1e6).round() as u64)
    }
}

fn gaps(there: &[bool]) -> Vec<Gap> {
    let mut gaps: Vec<Gap> = Vec::new();
    for (scan, _) in there.iter().enumerate().filter(|(_, there)| !**there) {
        match gaps.last_mut() {
            Some(gap) if gap.first + gap.scans == scan => gap.scans += 1,
            _ => gaps.push(Gap {
                first: scan,
                scans: 1,
            }),
        }
    }
    gaps
}

//! The rows of a recording: one for each stream packet, with the newest of everything else beside it.

use std::path::Path;

use tonus_shared::wire::{Configuration, Header, Muscle, Packet, SequenceTracker, Stream, decode};

use crate::clock::DeviceClock;
use crate::live::{HandSeen, Input, RecognitionView, RobotSeen};
use crate::recording::{Entry, ReadError, Reading};
use crate::robot::gate::State;
use crate::robot::limits::Setpoint;

use super::clock;
use super::column::{Cell, Column, columns};
use super::error::ExportError;

/// Cells in the order of [`Rows::columns`].
pub type Row = Vec<Cell>;

/// Rows in the order in which they came. Packets that came behind a newer one, or again, are left out.
#[derive(Debug)]
pub struct Rows {
    reading: Reading,
    columns: Vec<Column>,
    channels: usize,
    clock: Option<DeviceClock>,
    order: SequenceTracker,
    newest: Newest,
}

/// The newest of what is no stream.
#[derive(Debug, Default)]
struct Newest {
    hand: Option<HandSeen>,
    robot: Option<RobotSeen>,
    setpoint: Option<(Setpoint, State)>,
    skill: Option<String>,
}

/// Reads until the wearable says how it is set. Its channels alone where it never does; none where it never streams.
pub(super) fn configuration(path: &Path) -> Result<(Option<Configuration>, usize), ReadError> {
    let mut channels = 0;
    for entry in Reading::open(path)?.inputs() {
        let Input::Frame(bytes) = entry?.input else {
            continue;
        };
        match decode(&bytes).map(|frame| frame.packet) {
            Ok(Packet::Configuration(configuration)) => {
                return Ok((Some(configuration), usize::from(configuration.channels)));
            }
            Ok(Packet::Stream(stream)) => channels = usize::from(stream.channels),
            _ => {}
        }
    }
    Ok((None, channels))
}

impl Rows {
    /// Opens a recording.
    ///
    /// # Errors
    /// [`ExportError`] where it is none, or its configuration is.
    pub fn open(path: &Path) -> Result<Self, ExportError> {
        let (configuration, channels) = configuration(path)?;
        let muscles = configuration.map_or([Muscle::Other; 8], |found| found.muscles);
        let reading = Reading::open(path)?;
        Ok(Self {
            clock: clock(reading.opening(), path)?,
            reading,
            columns: columns(muscles.get(..channels).unwrap_or(&muscles)),
            channels,
            order: SequenceTracker::new(),
            newest: Newest::default(),
        })
    }

    /// What the cells of every row are.
    #[must_use]
    pub fn columns(&self) -> &[Column] {
        &self.columns
    }

    fn take(&mut self, entry: Entry) -> Option<Row> {
        match entry {
            Entry::Input(timed) => match timed.input {
                Input::Frame(bytes) => return self.frame(&bytes, timed.at_us),
                Input::Hand(hand) => self.newest.hand = hand,
                Input::Robot(robot) => self.newest.robot = Some(robot),
                _ => {}
            },
            Entry::Setpoint {
                setpoint, state, ..
            } => self.newest.setpoint = Some((setpoint, state)),
            Entry::Recognition { recognition, .. } => self.newest.skill = skill(recognition),
            Entry::Command { .. } | Entry::Message(_) => {}
        }
        None
    }

    fn frame(&mut self, bytes: &[u8], at_us: u64) -> Option<Row> {
        let frame = decode(bytes).ok()?;
        let header = frame.header;
        let arrival = self.order.observe(header.boot_id, header.sequence);
        if !arrival.is_newest() {
            return None;
        }
        let mut taken_us = at_us;
        if let Some(clock) = &mut self.clock {
            clock.arrived(header.boot_id, header.device_us, at_us);
            let mapped = clock.host_us(header.boot_id, header.device_us);
            taken_us = mapped.map_or(at_us, |mapped| mapped.at_us);
        }
        match frame.packet {
            Packet::Stream(stream) => Some(self.row(&header, &stream, taken_us, at_us)),
            _ => None,
        }
    }

    fn row(&self, header: &Header, stream: &Stream, taken_us: u64, at_us: u64) -> Row {
        let describes_us = taken_us.saturating_sub(u64::from(stream.describes_before_us));
        let mut row: Row = [
            seconds(taken_us),
            seconds(at_us),
            seconds(describes_us),
            header.device_us as f64,
            f64::from(header.boot_id),
            f64::from(header.sequence),
        ]
        .map(Cell::Number)
        .into();
        let numbers = |row: &mut Row, values: &[f32]| {
            row.extend(values.iter().map(|&value| Cell::Number(value.into())));
        };
        let used = usize::from(stream.channels);
        for channel in 0..self.channels {
            let envelope = stream.envelopes.get(channel).filter(|_| channel < used);
            row.push(envelope.map_or(Cell::Missing, |&value| Cell::Number(value.into())));
        }
        for channel in 0..self.channels {
            let quality = stream.quality.get(channel).filter(|_| channel < used);
            row.push(quality.map_or(Cell::Missing, |quality| Cell::Number(quality.bits().into())));
        }
        numbers(&mut row, &[stream.activation, stream.co_contraction]);
        numbers(&mut row, &stream.stiffness_n_per_m);
        row.push(Cell::Number(stream.flags.bits().into()));
        self.newest.cells(&mut row);
        row
    }
}

impl Newest {
    fn cells(&self, row: &mut Row) {
        three(row, self.hand.map(|hand| hand.position_m));
        row.push(known(self.hand.map(|hand| seconds(hand.exposed_us))));
        three(row, self.robot.map(|robot| robot.position_m));
        three(row, self.robot.map(|robot| robot.stiffness_n_per_m));
        row.push(known(self.robot.map(|robot| seconds(robot.measured_us))));
        let setpoint = self.setpoint.map(|(setpoint, _)| setpoint);
        three(row, setpoint.map(|setpoint| setpoint.position_m));
        three(row, setpoint.map(|setpoint| setpoint.stiffness_n_per_m));
        row.push(self.setpoint.map_or(Cell::Missing, |(_, state)| {
            let name = match state {
                State::Disarmed(_) => "disarmed",
                State::Following => "following",
                State::Holding => "holding",
                State::FallingBack => "falling_back",
            };
            Cell::Text(name.to_owned())
        }));
        row.push(self.skill.clone().map_or(Cell::Missing, Cell::Text));
    }
}

impl Iterator for Rows {
    type Item = Result<Row, ReadError>;

    fn next(&mut self) -> Option<Self::Item> {
        loop {
            match self.reading.next()? {
                Ok(entry) => {
                    if let Some(row) = self.take(entry) {
                        return Some(Ok(row));
                    }
                }
                Err(error) => return Some(Err(error)),
            }
        }
    }
}

fn skill(recognition: RecognitionView) -> Option<String> {
    if recognition.unknown {
        return Some("unknown".to_owned());
    }
    recognition.decision.map(|(skill, _)| skill)
}

fn seconds(us: u64) -> f64 {
    us as f64 * 1e-6
}

/// A number where there is one; what is not finite is none.
fn known(value: Option<f64>) -> Cell {
    let value = value.filter(|value| value.is_finite());
    value.map_or(Cell::Missing, Cell::Number)
}

fn three(row: &mut Row, values: Option<[f64; 3]>) {
    row.extend((0..3).map(|axis| known(values.map(|values| values[axis]))));
}

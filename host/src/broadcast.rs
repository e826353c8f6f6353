//! What the wearable measures, for other programs: a stream of the lab streaming layer.

mod speaker;

pub use speaker::{Speaker, SpeakerError};

use tonus_native::lsl::{ChannelDescription, Description, Lsl, LslError, Outlet};
use tonus_shared::wire::{Configuration, Packet, SequenceTracker, Stream, decode};

use crate::clock::{ClockConfig, DeviceClock};
use crate::live::{Input, Timed};

/// Sends each stream packet as a sample: envelopes, activation, co-contraction, stiffness of the hand.
///
/// The stream opens when the wearable has told its channels. A sample is stamped with the time of the newest scan in it;
/// what it describes lies before that by the filters' delay.
#[derive(Debug)]
pub struct Broadcast {
    lsl: Lsl,
    source_id: String,
    clock: Option<DeviceClock>,
    order: SequenceTracker,
    open: Option<(Outlet, Configuration)>,
    /// Of the last sample, LSL's clock, seconds.
    stamped_s: f64,
}

impl Broadcast {
    /// Waits for a wearable. `link` names it; with the same name the stream keeps its source id, so that listeners find it
    /// again after a restart. `clock` says how the wearable's clock is read.
    #[must_use]
    pub fn new(lsl: Lsl, link: &str, clock: ClockConfig) -> Self {
        Self {
            lsl,
            source_id: format!("tonus:{link}"),
            clock: DeviceClock::new(clock).ok(),
            order: SequenceTracker::new(),
            open: None,
            stamped_s: f64::NEG_INFINITY,
        }
    }

    /// Takes an input of the engine; `now_us` is session time now. What is no frame of the wearable is nothing to it.
    ///
    /// # Errors
    /// [`LslError`] when the stream cannot be opened or written.
    pub fn take(&mut self, timed: &Timed, now_us: u64) -> Result<(), LslError> {
        let Input::Frame(bytes) = &timed.input else {
            return Ok(());
        };
        let Ok(frame) = decode(bytes) else {
            return Ok(());
        };
        let header = frame.header;
        if !(self.order.observe(header.boot_id, header.sequence)).is_newest() {
            return Ok(());
        }
        let mut taken_us = timed.at_us;
        if let Some(clock) = &mut self.clock {
            clock.arrived(header.boot_id, header.device_us, timed.at_us);
            let mapped = clock.host_us(header.boot_id, header.device_us);
            taken_us = mapped.map_or(taken_us, |mapped| mapped.at_us);
        }
        match frame.packet {
            Packet::Configuration(configuration) => self.configure(&configuration),
            Packet::Stream(stream) => {
                let age_s = now_us.saturating_sub(taken_us) as f64 * 1e-6;
                self.push(&stream, self.lsl.clock_s() - age_s)
            }
            _ => Ok(()),
        }
    }

    /// Whether somebody listens.
    #[must_use]
    pub fn has_listeners(&self) -> bool {
        self.open
            .as_ref()
            .is_some_and(|(outlet, _)| outlet.has_listeners())
    }

    fn configure(&mut self, configuration: &Configuration) -> Result<(), LslError> {
        let same = |open: &Configuration| {
            open.muscles == configuration.muscles && open.stream_hz == configuration.stream_hz
        };
        if self.open.as_ref().is_some_and(|(_, open)| same(open)) {
            return Ok(());
        }
        // The old stream ends before the new one of the same source begins.
        self.open = None;
        let outlet = Outlet::open(&self.lsl, &description(configuration, &self.source_id))?;
        self.open = Some((outlet, *configuration));
        Ok(())
    }

    fn push(&mut self, stream: &Stream, at_s: f64) -> Result<(), LslError> {
        // An earlier arrival shifts what the clock says of all: listeners take time that falls for a fault.
        let at_s = at_s.max(self.stamped_s + 1e-6);
        self.stamped_s = at_s;
        let Some((outlet, configuration)) = &self.open else {
            return Ok(());
        };
        let channels = usize::from(configuration.channels);
        let mut sample: Vec<f32> = stream.envelopes.iter().copied().take(channels).collect();
        sample.extend([stream.activation, stream.co_contraction]);
        sample.extend(stream.stiffness_n_per_m);
        outlet.push(&sample, at_s)
    }
}

fn description(configuration: &Configuration, source_id: &str) -> Description {
    let channel = |label: String, unit: &str, kind: &str| ChannelDescription {
        label,
        unit: unit.to_owned(),
        kind: kind.to_owned(),
    };
    let muscles = configuration
        .muscles
        .iter()
        .take(configuration.channels.into());
    let mut channels: Vec<ChannelDescription> = (1..)
        .zip(muscles)
        .map(|(number, muscle)| {
            channel(
                format!("envelope_{number}_{}", muscle.name()),
                "share of maximum",
                "EMG",
            )
        })
        .collect();
    channels.push(channel(
        "activation".to_owned(),
        "share of maximum",
        "Activation",
    ));
    channels.push(channel("co_contraction".to_owned(), "1", "Activation"));
    for axis in ["x", "y", "z"] {
        channels.push(channel(format!("stiffness_{axis}"), "N/m", "Stiffness"));
    }
    Description {
        name: "Tonus".to_owned(),
        kind: "EMG".to_owned(),
        rate_hz: configuration.stream_hz.into(),
        source_id: source_id.to_owned(),
        channels,
    }
}

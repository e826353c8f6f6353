//! From counts to activation: what all channels go through at every scan.

use crate::Real;
use crate::real::not_negative;
use crate::sample::difference;
use crate::semg::activation::{Activation, ActivationState, Normalisation};
use crate::semg::chain::{Chain, ChainState};
use crate::semg::quality::{Quality, QualityMonitor, QualityState};
use crate::semg::smoother::{WINDOW_CAPACITY, window_samples};
use crate::wire::{MAX_CHANNELS, MAX_ENVELOPE, Muscle};

use super::config::{PipelineConfig, PipelineError};

/// Warnings under which a channel's envelope is not believed. Hum is not among them: a steady one is in the rest level
/// and taken off with it. Whether to act on the bit is for the receiver of the packet.
const UNBELIEVABLE: [Quality; 3] = [Quality::SATURATED, Quality::FLAT, Quality::LEAD_OFF];
/// How many of its delays a chain remembers a disturbance for.
const MEMORY_DELAYS: f64 = 3.0;

/// As laid out: what a scan touches lies within the reach of the chip's loads (1 kB), ahead of the chain's ring.
#[repr(C)]
#[derive(Clone, Copy, Debug)]
struct Channel {
    normalisation: Normalisation<f32>,
    /// Share in the activation: one over the number of channels on the same head; none off the four heads.
    weight: Option<f32>,
    quality: QualityState,
    /// Newest normalised envelope.
    envelope: f32,
    /// What stands in the activation: the newest one that was believed.
    believed: f32,
    /// Those at the ends of the last two blocks found good, newest last. A fault is found up to a block after it
    /// began, and may have begun unnoticed in the block before; the older of these is from before it. Rest, until there are two.
    sound: [f32; 2],
    doubted: bool,
    warnings: Quality,
    warnings_since_status: Quality,
    chain: ChainState<f32>,
}

impl Channel {
    /// Takes the newest envelope if it is believed, and keeps the last good one if not. True if a fault has just been
    /// found that had spoiled envelopes already taken: an earlier one stands now, and they must leave the activation.
    fn judge(&mut self, believed: bool) -> bool {
        let just_doubted = !believed && !self.doubted;
        self.doubted = !believed;
        if believed {
            self.believed = self.envelope;
            if self.quality.just_judged() {
                self.sound = [self.sound[1], self.envelope];
            }
            return false;
        }
        let spoiled = just_doubted && self.found_late();
        if spoiled {
            self.believed = self.sound[0];
            self.sound[1] = self.sound[0];
        }
        spoiled
    }

    /// Whether the present warnings took time to prove. A rail shows at once, and so does the front end's lead-off.
    fn found_late(&self) -> bool {
        let lead_off = self.warnings.contains(Quality::LEAD_OFF) && self.quality.just_judged();
        let flat = self.warnings.contains(Quality::FLAT);
        (flat || lead_off) && !self.warnings.contains(Quality::SATURATED)
    }
}

/// What a configuration makes of all channels, less than a tenth of what they remember: so it is made and checked before
/// anything that works is touched.
#[derive(Clone, Debug)]
pub(super) struct Design<const C: usize> {
    zero_count: i32,
    volts_per_count: f32,
    chain: Chain<f32>,
    monitor: QualityMonitor,
    activation: Activation<C>,
    activation_delay_s: f64,
    normalisations: [Normalisation<f32>; C],
    weights: [Option<f32>; C],
}

/// All channels.
#[derive(Clone, Debug)]
pub(super) struct Signals<const C: usize> {
    /// The front end's own detection.
    pub(super) lead_off: [bool; C],
    design: Design<C>,
    channels: [Channel; C],
    activation_state: ActivationState<f32>,
    newest_activation: f32,
    held: bool,
}

impl<const C: usize> Design<C> {
    pub(super) fn new(config: &PipelineConfig<C>) -> Result<Self, PipelineError> {
        let rate_hz = config.chain.rate_hz;
        let window = window_samples(config.activation_window_s, rate_hz, WINDOW_CAPACITY - 1)?;
        let mut normalisations = [normalisation(config, 0)?; C];
        for (index, normalised) in normalisations.iter_mut().enumerate() {
            *normalised = normalisation(config, index)?;
        }
        let weights = core::array::from_fn(|index| weight(config, index));
        let activation = Activation::new(weights.map(|weight| weight.is_some()), window)?;
        Ok(Self {
            zero_count: config.adc.offset_counts(),
            volts_per_count: f32::of(config.adc.volts_per_count()),
            chain: Chain::design(&config.chain)?,
            monitor: QualityMonitor::new(rate_hz, config.adc)?,
            activation,
            activation_delay_s: activation.delay_s(rate_hz),
            normalisations,
            weights,
        })
    }

    /// Delay of the envelopes, s.
    pub(super) fn chain_delay_s(&self) -> f64 {
        self.chain.delay_s()
    }

    /// Delay of the activation, s.
    pub(super) fn delay_s(&self) -> f64 {
        self.chain.delay_s() + self.activation_delay_s
    }

    /// How long a disturbance shows, s.
    pub(super) fn memory_s(&self) -> f64 {
        MEMORY_DELAYS * self.delay_s()
    }
}

impl<const C: usize> Signals<C> {
    /// Before the first scan.
    pub(super) fn new(design: Design<C>) -> Self {
        let channel = |index| Channel {
            normalisation: design.normalisations[index],
            weight: design.weights[index],
            chain: ChainState::new(),
            quality: QualityState::new(),
            envelope: 0.0,
            believed: 0.0,
            sound: [0.0; 2],
            doubted: false,
            warnings: Quality::GOOD,
            warnings_since_status: Quality::GOOD,
        };
        Self {
            lead_off: [false; C],
            channels: core::array::from_fn(channel),
            design,
            activation_state: ActivationState::new(),
            newest_activation: 0.0,
            held: false,
        }
    }

    /// Starts the filters anew, as after a long gap; the last believed envelopes stay.
    pub(super) fn restart(&mut self) {
        for channel in &mut self.channels {
            channel.chain.reset();
        }
    }

    /// Goes over to another design: what was last believed stands until its filters have settled.
    pub(super) fn change_over(&mut self, design: Design<C>) {
        for (index, channel) in self.channels.iter_mut().enumerate() {
            channel.normalisation = design.normalisations[index];
            channel.weight = design.weights[index];
            channel.chain.reset();
            channel.quality = QualityState::new();
            channel.doubted = false;
            channel.warnings = Quality::GOOD;
        }
        self.activation_state.reset();
        self.held = false;
        self.design = design;
    }

    /// One scan. While `settling`, no envelope is believed. Gives the number of samples refused.
    pub(super) fn step(&mut self, counts: &[i32; C], settling: bool) -> u32 {
        let mut refused = 0;
        let mut weighted = [0.0; C];
        let mut spoiled = false;
        self.held = false;
        let Design {
            zero_count,
            volts_per_count,
            chain,
            monitor,
            activation,
            ..
        } = &self.design;
        // As `AdcScale::volts`, the scale rounded beforehand.
        let volts = counts.map(|count| difference::<f32>(count, *zero_count) * *volts_per_count);
        let chains = self.channels.each_mut().map(|channel| &mut channel.chain);
        let envelopes = chain.step_all(chains, volts);
        let slots = self.channels.iter_mut().zip(&mut weighted).zip(envelopes);
        for (((channel, weighted), envelope), (count, lead_off)) in
            slots.zip(counts.iter().zip(&self.lead_off))
        {
            channel.warnings = monitor.step(&mut channel.quality, *count, *lead_off);
            channel.warnings_since_status = channel.warnings_since_status.with(channel.warnings);
            let bad = |bad: &Quality| channel.warnings.contains(*bad);
            let mut believed = !settling && !UNBELIEVABLE.iter().any(bad);
            match envelope.map(|envelope| channel.normalisation.apply(envelope)) {
                Ok(envelope) if envelope <= MAX_ENVELOPE => channel.envelope = envelope,
                Ok(_) | Err(_) => {
                    refused += 1;
                    believed = false;
                }
            }
            spoiled |= channel.judge(believed) && channel.weight.is_some();
            if let Some(weight) = channel.weight {
                *weighted = weight * channel.believed;
                self.held |= !believed;
            }
        }
        if spoiled {
            self.activation_state.reset();
        }
        match activation.step(&mut self.activation_state, &weighted) {
            // A mean of what is not negative; the window's running sum may round to just below zero.
            Ok(activation) => self.newest_activation = not_negative(activation),
            Err(_) => refused += 1,
        }
        refused
    }

    /// Newest activation (eq. 4), and whether a value in it is held.
    pub(super) fn activation(&self) -> (f32, bool) {
        (self.newest_activation, self.held)
    }

    /// Newest normalised envelopes.
    pub(super) fn envelopes(&self) -> [f32; C] {
        self.channels.each_ref().map(|channel| channel.envelope)
    }

    /// Newest warnings.
    pub(super) fn quality(&self) -> [Quality; C] {
        self.channels.each_ref().map(|channel| channel.warnings)
    }

    /// Warnings since this was last asked.
    pub(super) fn take_quality_since_status(&mut self) -> [Quality; C] {
        let mut warnings = [Quality::GOOD; C];
        for (warnings, channel) in warnings.iter_mut().zip(&mut self.channels) {
            *warnings = core::mem::take(&mut channel.warnings_since_status);
        }
        warnings
    }
}

fn normalisation<const C: usize>(
    config: &PipelineConfig<C>,
    channel: usize,
) -> Result<Normalisation<f32>, PipelineError> {
    let levels = &config.channels[channel];
    Normalisation::new(f32::of(levels.rest_v), f32::of(levels.mvc_v))
        .map_err(|source| PipelineError::Calibration { channel, source })
}

fn weight<const C: usize>(config: &PipelineConfig<C>, channel: usize) -> Option<f32> {
    activation_weight(&config.channels.map(|channel| channel.muscle), channel)
}

/// Share of a channel's normalised envelope in the activation (eq. 4): one over the number of channels on the same
/// head, so that eight electrodes do not count double; none off the four heads.
#[must_use]
pub fn activation_weight(muscles: &[Muscle], channel: usize) -> Option<f32> {
    let muscle = *muscles.get(channel)?;
    let on_same = muscles.iter().filter(|other| **other == muscle).count();
    match muscle {
        Muscle::BicepsShort | Muscle::BicepsLong | Muscle::TricepsLateral | Muscle::TricepsLong => {
            Some(1.0 / on_same as f32)
        }
        Muscle::Absent | Muscle::Other => None,
    }
}

/// Channel values in the packet's slots; unused slots are zero.
pub(super) fn slots<V: Copy + Default, const C: usize>(values: [V; C]) -> [V; MAX_CHANNELS] {
    let mut slots = [V::default(); MAX_CHANNELS];
    for (slot, value) in slots.iter_mut().zip(values) {
        *slot = value;
    }
    slots
}

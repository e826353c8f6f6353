//! What the electrodes picked up during a movement, and the envelopes that the wearable made of it: for looking at.

use super::muscle::CHANNELS;
use super::rig::{Rig, RigConfig, RigError};
use super::wearer::{Span, Task, Wearer};
use tonus_shared::wire::Packet;

/// One movement.
#[derive(Debug, Clone, Default, PartialEq)]
pub struct Signals {
    /// Times of the raw samples since the movement began, seconds.
    pub raw_t_s: Vec<f64>,
    /// `[channel][sample]`, volts.
    pub raw_v: Vec<Vec<f64>>,
    /// Times that the envelope's samples describe, since the movement began, seconds.
    pub t_s: Vec<f64>,
    /// `[channel][sample]`, shares of maximum voluntary contraction.
    pub envelope: Vec<Vec<f64>>,
}

/// Lets a wearer do the tasks one after another and keeps the signals of each.
///
/// # Errors
/// [`RigError`] as from [`Rig`].
pub fn record(tasks: &[Task], config: &RigConfig) -> Result<Vec<Signals>, RigError> {
    let empty = Signals {
        raw_v: vec![Vec::new(); CHANNELS],
        envelope: vec![Vec::new(); CHANNELS],
        ..Signals::default()
    };
    let mut signals = vec![empty; tasks.len()];
    // The wearer is the same as the rig's: tasks, noise and seed make it.
    let wearer = Wearer::new(tasks, config.noise, config.seed)?;
    let (spans, scale) = (wearer.spans().to_vec(), wearer.scale());
    for moment in wearer {
        if let Some((movement, t_s)) = within(&spans, moment.scan.acquired_us)
            && let Some(of) = signals.get_mut(movement)
        {
            of.raw_t_s.push(t_s);
            for (series, count) in of.raw_v.iter_mut().zip(moment.scan.counts) {
                series.push(scale.volts(count));
            }
        }
    }
    let mut rig = Rig::new(tasks, config)?;
    let mut delay_us = 0;
    while let Some(step) = rig.step()? {
        for frame in step.sent {
            match frame.packet {
                Packet::Configuration(configuration) => {
                    delay_us = u64::from(configuration.chain_delay_us);
                }
                Packet::Stream(stream) => {
                    let describes_us = frame.header.device_us.saturating_sub(delay_us);
                    let Some((movement, t_s)) = within(&spans, describes_us) else {
                        continue;
                    };
                    let Some(of) = signals.get_mut(movement) else {
                        continue;
                    };
                    of.t_s.push(t_s);
                    for (series, value) in of.envelope.iter_mut().zip(stream.envelopes) {
                        series.push(f64::from(value));
                    }
                }
                _ => {}
            }
        }
    }
    Ok(signals)
}

/// The movement under way, and the time since it began, seconds.
#[allow(clippy::cast_precision_loss, reason = "seconds")]
fn within(spans: &[Span], at_us: u64) -> Option<(usize, f64)> {
    let movement = spans.partition_point(|span| span.end_us <= at_us);
    let since_us = at_us.checked_sub(spans.get(movement)?.start_us)?;
    Some((movement, since_us as f64 * 1e-6))
}

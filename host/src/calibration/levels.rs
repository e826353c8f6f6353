//! Envelopes at rest and at maximum, and the activation that follows from them.

use tonus_shared::pipeline::activation_weight;
use tonus_shared::semg::activation::Normalisation;
use tonus_shared::wire::Muscle;

use super::measurement::Measurement;
use super::{Estimate, muscle_name};

/// At rest the highest half second may be so many times the median one; beyond, a muscle moved.
const STEADY: f64 = 2.0;
/// A maximum contraction lifts every channel's envelope to at least so many times its level at rest: arm muscles reach ten
/// and more, the weakest gestures of a forearm two to three.
const LEAST_RISE: f64 = 3.0;

/// The envelopes at rest, V, or why it was no rest.
pub(super) fn rest(measured: &Measurement, muscles: &[Muscle]) -> Result<Vec<Estimate>, String> {
    let moved = muscles.iter().enumerate().filter(|(channel, _)| {
        let unsteady = measured.unsteadiness(*channel);
        unsteady.is_some_and(|unsteady| unsteady > STEADY)
    });
    let moved: Vec<&str> = moved.map(|(_, muscle)| muscle_name(*muscle)).collect();
    if !moved.is_empty() {
        return Err(format!(
            "Not at rest: {}. Let the arm hang, lay the hand in the lap if it will not rest, then do this step again.",
            moved.join(", ")
        ));
    }
    each(muscles, |channel| measured.mean(channel))
}

/// The envelopes at maximum, V, or why it was none.
pub(super) fn maximum(
    measured: &Measurement,
    muscles: &[Muscle],
    rest: &[Estimate],
) -> Result<Vec<Estimate>, String> {
    let peaks = each(muscles, |channel| measured.peak(channel))?;
    strong(&peaks, muscles, rest).map(|()| peaks)
}

/// Whether these maxima, V, are well above rest, or what is to be done.
pub(super) fn strong(
    peaks: &[Estimate],
    muscles: &[Muscle],
    rest: &[Estimate],
) -> Result<(), String> {
    let weak = muscles
        .iter()
        .zip(peaks)
        .zip(rest)
        .filter_map(|((muscle, peak), rest)| {
            let rise = peak.value / rest.value;
            let weak = peak.value <= 0.0 || rise < LEAST_RISE;
            weak.then(|| {
                let (peak_uv, rest_uv) = (1e6 * peak.value, 1e6 * rest.value);
                format!(
                    "{} {peak_uv:.1} uV against {rest_uv:.1} uV at rest",
                    muscle_name(*muscle)
                )
            })
        });
    let weak: Vec<String> = weak.collect();
    if weak.is_empty() {
        return Ok(());
    }
    Err(format!(
        "Too weak (at least {LEAST_RISE} times the level at rest is needed): {}. Tense with all strength and do this step \
         again; if the muscles were not at rest before, go back to the rest.",
        weak.join(", ")
    ))
}

fn each(
    muscles: &[Muscle],
    level: impl Fn(usize) -> Option<Estimate>,
) -> Result<Vec<Estimate>, String> {
    let levels: Option<Vec<Estimate>> = (0..muscles.len()).map(level).collect();
    let finite = levels.filter(|levels| levels.iter().all(|level| level.value.is_finite()));
    finite.ok_or_else(|| "Too few good samples arrived: do this step again.".into())
}

/// The scale of each channel, and what it counts in the activation.
#[derive(Debug, Clone)]
pub(super) struct Scale {
    channels: Vec<Option<(Normalisation<f64>, f64)>>,
}

impl Scale {
    /// None where a maximum does not exceed its rest.
    pub(super) fn new(muscles: &[Muscle], rest: &[Estimate], mvc: &[Estimate]) -> Option<Self> {
        let levels = rest.iter().zip(mvc).enumerate();
        let channels = levels.map(|(channel, (rest, mvc))| {
            let scale = Normalisation::new(rest.value, mvc.value).ok()?;
            let weight = activation_weight(muscles, channel);
            Some(weight.map(|weight| (scale, f64::from(weight))))
        });
        let channels = channels.collect::<Option<Vec<_>>>()?;
        Some(Self { channels })
    }

    /// Activation (eq. 4) of these envelopes, V.
    pub(super) fn activation(&self, envelope_v: impl Fn(usize) -> f64) -> f64 {
        let counted = self.channels.iter().enumerate();
        let counted = counted.filter_map(|(channel, scale)| Some((channel, (*scale)?)));
        counted
            .map(|(channel, (scale, weight))| weight * scale.apply(envelope_v(channel)))
            .sum()
    }

    /// The activation with every muscle at its maximum: the number of heads.
    pub(super) fn full(&self) -> f64 {
        self.channels
            .iter()
            .flatten()
            .map(|(_, weight)| weight)
            .sum()
    }
}

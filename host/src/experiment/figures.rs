//! What the figures of a report show, as numbers: series in the units of [`DOFS`](crate::session::DOFS).

/// A value that inference was given.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Observed {
    /// Index into [`DOFS`](crate::session::DOFS).
    pub dof: usize,
    /// Phase, 0 to 1.
    pub phase: f64,
    /// The value, metres or N/m.
    pub value: f64,
}

/// One DoF over the phases of an [`Inference`].
#[derive(Debug, Clone, PartialEq)]
pub struct Band {
    /// Expected value.
    pub mean: Vec<f64>,
    /// Lower end of the pointwise 95 % interval of a recorded value.
    pub low: Vec<f64>,
    /// Its upper end.
    pub high: Vec<f64>,
    /// What was recorded.
    pub truth: Vec<f64>,
}

/// A movement, what of it was observed, and what was inferred of all of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Inference {
    /// For a legend: `motion 2 (between), scheme c`.
    pub name: String,
    /// Label of what was done.
    pub performed: String,
    /// Label of the skill that the bands are from.
    pub recognised: String,
    /// What was observed.
    pub observed: Vec<Observed>,
    /// Phases of the bands.
    pub phases: Vec<f64>,
    /// One for each of [`DOFS`](crate::session::DOFS), in that order.
    pub bands: Vec<Band>,
}

/// Recognition of one movement while it is observed.
#[derive(Debug, Clone, PartialEq)]
pub struct Trace {
    /// Label of what was done.
    pub performed: String,
    /// Labels of the model.
    pub labels: Vec<String>,
    /// Phase of each observation.
    pub phases: Vec<f64>,
    /// `[observation][label]`: posterior probability after it.
    pub posterior: Vec<Vec<f64>>,
    /// `[observation][label]`: natural logarithm of the joint density of all observations so far, less that of the
    /// likeliest label (densities of different units have no size of their own).
    pub log_likelihood: Vec<Vec<f64>>,
}

/// Raw sEMG of one movement and the envelopes that the wearable made of it.
#[derive(Debug, Clone, PartialEq)]
pub struct Envelopes {
    /// Label of what was done.
    pub performed: String,
    /// Names of the channels.
    pub channels: Vec<String>,
    /// Times of the raw samples since the movement began, seconds.
    pub raw_t_s: Vec<f64>,
    /// `[channel][sample]`, volts.
    pub raw_v: Vec<Vec<f64>>,
    /// Times that the envelope samples describe, seconds.
    pub t_s: Vec<f64>,
    /// `[channel][sample]`, shares of maximum voluntary contraction.
    pub envelope: Vec<Vec<f64>>,
}

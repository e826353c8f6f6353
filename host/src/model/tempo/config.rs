//! How duration and onset are guessed, checked before it is used.

/// How duration and onset are guessed.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct TempoConfig {
    /// Durations of each skill, at least 1: so many points evenly spaced over the log-normal's ±2.5 standard deviations.
    pub durations: usize,
    /// Standard deviation of log duration between people and days, from 0, on top of what the skill's demonstrations
    /// show. 0.2 is a fifth faster or slower.
    pub tempo_log_std: f64,
    /// Onsets, at least 1: so many points over ±2.5 standard deviations of the detector's error.
    pub onsets: usize,
    /// What the onset detected is late by on average (negative: early), seconds.
    pub onset_late_s: f64,
    /// Standard deviation of the detector's error, seconds, from 0.
    pub onset_std_s: f64,
    /// How long observations are kept before a movement begins, and how much of them is replayed: up to so long
    /// before the detected onset, seconds, from 0.
    pub lead_s: f64,
    /// Hypotheses followed at most; the least likely are dropped beyond it.
    pub capacity: usize,
    /// Log-odds against the best below which a hypothesis is dropped, nats; `None` keeps all.
    pub floor_nats: Option<f64>,
}

impl Default for TempoConfig {
    fn default() -> Self {
        Self {
            durations: 9,
            tempo_log_std: 0.2,
            onsets: 5,
            onset_late_s: 0.0,
            onset_std_s: 0.08,
            lead_s: 0.1,
            capacity: 1024,
            floor_nats: Some(25.0),
        }
    }
}

/// A number of a [`TempoConfig`] that cannot be.
#[derive(Clone, Copy, Debug, PartialEq, thiserror::Error)]
#[error("{what} is {value}: give {range}")]
pub struct TempoError {
    /// Which number.
    what: &'static str,
    /// The number.
    value: f64,
    /// What it may be.
    range: &'static str,
}

impl TempoConfig {
    /// # Errors
    /// The first number outside its range.
    pub fn check(&self) -> Result<(), TempoError> {
        let count = |what, value: usize| {
            let fine = (1..=10_000).contains(&value);
            let (value, range) = (value as f64, "1 to 10000");
            if fine {
                Ok(())
            } else {
                Err(TempoError { what, value, range })
            }
        };
        let spread = |what, value: f64| {
            let range = "a number from 0 to 10";
            if (0.0..=10.0).contains(&value) {
                Ok(())
            } else {
                Err(TempoError { what, value, range })
            }
        };
        count("the number of durations", self.durations)?;
        count("the number of onsets", self.onsets)?;
        count("the number of hypotheses", self.capacity)?;
        spread("the tempo's log deviation", self.tempo_log_std)?;
        spread("the onset's deviation", self.onset_std_s)?;
        spread("the lead", self.lead_s)?;
        spread(
            "what the onset is late by, on average,",
            self.onset_late_s.abs(),
        )?;
        match self.floor_nats {
            Some(value) if !(value.is_finite() && value > 0.0) => Err(TempoError {
                what: "the floor",
                value,
                range: "a positive number of nats",
            }),
            _ => Ok(()),
        }
    }
}

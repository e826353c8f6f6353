//! What a run of the demo was worth: recognition, the robot against the truth, age of the commands.

use serde::Serialize;

/// One performed action.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct ActionScore {
    /// Label of what the person did.
    pub performed: String,
    /// Label with the highest posterior at the end of the movement.
    pub recognised: String,
    /// That posterior.
    pub posterior: f64,
    /// Time from the movement's begin to the first posterior that sufficed, seconds; none if there was none.
    pub seconds_to_decision: Option<f64>,
    /// The label decided on then.
    pub decided: Option<String>,
    /// Label with the highest posterior at the end, from positions alone.
    pub recognised_without_semg: String,
    /// Whether the novelty gate named it unknown, a false alarm: nothing was decided on then, and the robot held.
    pub unknown: bool,
    /// Class of the demonstration that the gate found nearest in the end; none if it saw nothing.
    pub nearest: Option<String>,
    /// Distance from that, in standard deviations of one performance from another.
    pub distance: Option<f64>,
}

/// Sums of squares of one quantity.
#[derive(Debug, Clone, Copy, Default)]
pub(super) struct SquaredError {
    sum: f64,
    count: u64,
}

impl SquaredError {
    /// Adds one error.
    pub(super) fn add(&mut self, error: f64) {
        self.sum += error * error;
        self.count += 1;
    }

    /// Root of the mean square; none without errors.
    #[allow(clippy::cast_precision_loss, reason = "counts of samples")]
    pub(super) fn root_mean(&self) -> Option<f64> {
        (self.count > 0).then(|| (self.sum / self.count as f64).sqrt())
    }
}

/// Smallest and largest value seen.
#[derive(Debug, Clone, Copy)]
pub(super) struct Range {
    low: f64,
    high: f64,
}

impl Range {
    pub(super) const NOTHING: Self = Self {
        low: f64::INFINITY,
        high: f64::NEG_INFINITY,
    };

    pub(super) fn add(&mut self, value: f64) {
        self.low = self.low.min(value);
        self.high = self.high.max(value);
    }

    pub(super) fn width(&self) -> f64 {
        self.high - self.low
    }
}

/// The robot against what the script wanted of it, while the person moved.
#[derive(Debug, Clone)]
pub(super) struct Following {
    distance_m: SquaredError,
    stiffness: [SquaredError; 3],
    truth: [Range; 3],
}

impl Following {
    pub(super) fn new() -> Self {
        Self {
            distance_m: SquaredError::default(),
            stiffness: [SquaredError::default(); 3],
            truth: [Range::NOTHING; 3],
        }
    }

    /// One millisecond: where the robot was and where it should have been, how stiff it was set and should
    /// have been.
    pub(super) fn add(
        &mut self,
        (robot_m, truth_m): ([f64; 3], [f64; 3]),
        (set_n_per_m, truth_n_per_m): ([f64; 3], [f64; 3]),
    ) {
        let way = robot_m.iter().zip(truth_m).map(|(a, b)| (a - b) * (a - b));
        self.distance_m.add(way.sum::<f64>().sqrt());
        for axis in 0..3 {
            self.stiffness[axis].add(set_n_per_m[axis] - truth_n_per_m[axis]);
            self.truth[axis].add(truth_n_per_m[axis]);
        }
    }

    /// Root mean square distance, metres.
    pub(super) fn rmse_m(&self) -> Option<f64> {
        self.distance_m.root_mean()
    }

    /// Root mean square error of the stiffness over its true range, mean of the axes.
    pub(super) fn stiffness_nrmse(&self) -> Option<f64> {
        let axes = self.stiffness.iter().zip(&self.truth);
        let shares = axes.map(|(error, range)| Some(error.root_mean()? / range.width()));
        let shares: Option<Vec<f64>> = shares.collect();
        shares.map(|shares| shares.iter().sum::<f64>() / 3.0)
    }
}

/// The `share` quantile (nearest rank) of unordered values; none of an empty list.
pub(super) fn quantile(values: &[f64], share: f64) -> Option<f64> {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    #[allow(
        clippy::cast_precision_loss,
        clippy::cast_possible_truncation,
        clippy::cast_sign_loss,
        reason = "a share of a list's length"
    )]
    let rank = (share * sorted.len() as f64).ceil() as usize;
    sorted.get(rank.max(1) - 1).copied()
}

#[cfg(test)]
mod tests {
    use super::{Following, quantile};

    #[test]
    fn quantiles_by_nearest_rank() {
        let values = [15.0, 20.0, 35.0, 40.0, 50.0];
        assert_eq!(quantile(&values, 0.05), Some(15.0));
        assert_eq!(quantile(&values, 0.30), Some(20.0));
        assert_eq!(quantile(&values, 0.40), Some(20.0));
        assert_eq!(quantile(&values, 1.0), Some(50.0));
        assert_eq!(quantile(&[], 0.5), None);
    }

    #[test]
    fn errors_of_known_size() {
        let mut following = Following::new();
        assert_eq!(following.rmse_m(), None);
        following.add(([0.3, 0.0, 0.4], [0.0; 3]), ([110.0; 3], [100.0; 3]));
        following.add(([0.3, 0.0, 0.4], [0.0; 3]), ([190.0; 3], [200.0; 3]));
        assert!((following.rmse_m().unwrap() - 0.5).abs() < 1e-12);
        // 10 N/m of error over a range of 100 N/m.
        assert!((following.stiffness_nrmse().unwrap() - 0.1).abs() < 1e-12);
    }
}

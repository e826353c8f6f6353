//! Figures over many movements.

/// The middle value, or the mean of the two in the middle; NaN of none.
pub(crate) fn median(values: &[f64]) -> f64 {
    let mut sorted = values.to_vec();
    sorted.sort_by(f64::total_cmp);
    let half = sorted.len() / 2;
    match (sorted.get(half), sorted.len() % 2) {
        (Some(&middle), 1) => middle,
        (Some(&upper), _) => 0.5 * (upper + sorted[half - 1]),
        (None, _) => f64::NAN,
    }
}

/// A Gaussian's standard deviation over its median distance from the middle.
const NORMAL_MAD: f64 = 1.4826;

/// The median, and the standard deviation of a Gaussian that has the values' median distance from it: both whatever a few
/// blunders say; NaN of none.
pub(crate) fn median_and_spread(values: &[f64]) -> (f64, f64) {
    let middle = median(values);
    let distances: Vec<f64> = values.iter().map(|value| (value - middle).abs()).collect();
    (middle, NORMAL_MAD * median(&distances))
}

/// Mean; NaN of none.
pub(crate) fn mean(values: &[f64]) -> f64 {
    values.iter().sum::<f64>() / values.len() as f64
}

/// Root of the mean square; NaN of none.
pub(crate) fn root_mean_square(values: &[f64]) -> f64 {
    libm::sqrt(values.iter().map(|v| v * v).sum::<f64>() / values.len() as f64)
}

/// Spearman's rank correlation; values are taken to differ.
pub(crate) fn rank_correlation(pairs: &[(f64, f64)]) -> f64 {
    let (first, second): (Vec<f64>, Vec<f64>) = pairs.iter().copied().unzip();
    let (first, second) = (ranks(&first), ranks(&second));
    let middle = 0.5 * (pairs.len() as f64 - 1.0);
    let product: f64 = first
        .iter()
        .zip(&second)
        .map(|(a, b)| (a - middle) * (b - middle))
        .sum();
    let spread: f64 = first.iter().map(|a| (a - middle) * (a - middle)).sum();
    product / spread
}

fn ranks(values: &[f64]) -> Vec<f64> {
    let mut order: Vec<usize> = (0..values.len()).collect();
    order.sort_by(|&a, &b| values[a].total_cmp(&values[b]));
    let mut ranks = vec![0.0; values.len()];
    for (rank, index) in order.into_iter().enumerate() {
        ranks[index] = rank as f64;
    }
    ranks
}

#[cfg(test)]
mod tests {
    use super::*;

    #[test]
    fn known_figures() {
        assert_eq!(median(&[3.0, 1.0, 2.0]), 2.0);
        assert_eq!(median(&[4.0, 1.0, 2.0, 3.0]), 2.5);
        assert!(median(&[]).is_nan());
        // Distances 2, 1, 0, 1, 997: the blunder counts as any other.
        let (middle, spread) = median_and_spread(&[1.0, 2.0, 3.0, 4.0, 1000.0]);
        assert_eq!(middle, 3.0);
        assert!((spread - 1.4826).abs() < 1e-12, "{spread}");
        assert_eq!(root_mean_square(&[3.0, -4.0, 0.0, 0.0]), 2.5);
        assert_eq!(mean(&[1.0, 2.0, 6.0]), 3.0);
    }

    #[test]
    fn rank_correlation_of_scipy() {
        // scipy.stats.spearmanr([1, 2, 3, 4, 5], [5, 6, 7, 8, 7.5]) and of its reverse.
        let pairs = [(1.0, 5.0), (2.0, 6.0), (3.0, 7.0), (4.0, 8.0), (5.0, 7.5)];
        assert!((rank_correlation(&pairs) - 0.9).abs() < 1e-12);
        let reversed = pairs.map(|(a, b)| (-a, b));
        assert!((rank_correlation(&reversed) + 0.9).abs() < 1e-12);
    }
}

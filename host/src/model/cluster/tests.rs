//! EM on points, from given starts. What clustering makes of demonstrations is in the suite `cluster`.

use nalgebra::DMatrix;

use super::em::{Data, Fit};
use super::space::Space;
use super::{ClusterConfig, ClusterError, Covariances};
use super::{adjusted_rand_index, in_space};

/// Points of three overlapping groups of 40, and scikit-learn's log-likelihood of three components with one
/// covariance.
fn golden() -> (Space, f64) {
    let text = include_str!("../../../../tests/golden/mixture_points.csv");
    let mut lines = text.lines();
    let first = lines.next().and_then(|line| line.split_once(','));
    let log_likelihood = first.unwrap().1.parse().unwrap();
    let numbers: Vec<f64> = lines
        .flat_map(|line| line.split(','))
        .map(|cell| cell.parse().unwrap())
        .collect();
    let columns = DMatrix::from_vec(2, numbers.len() / 2, numbers);
    (
        Space::principal(columns, 2, 0.999_999).unwrap(),
        log_likelihood,
    )
}

fn free(space: &Space) -> Vec<Option<usize>> {
    vec![None; space.count()]
}

/// Gaussian components on points without classes.
fn gaussians<'a>(space: &'a Space, labels: &'a [Option<usize>]) -> Data<'a> {
    Data {
        space,
        labels,
        classes: 0,
        tails: f64::INFINITY,
    }
}

fn thirds() -> Vec<usize> {
    (0..120).map(|i| i / 40).collect()
}

/// The objective never falls from one iteration to the next, but for rounding.
fn rises(objective: &[f64]) -> bool {
    let falls = |pair: &[f64]| pair[1] < pair[0] - 1e-9 * pair[0].abs();
    objective.len() > 1 && !objective.windows(2).any(falls)
}

#[test]
fn the_likelihood_is_that_of_another_implementation() {
    let (space, log_likelihood) = golden();
    let labels = free(&space);
    let data = gaussians(&space, &labels);
    let fit = Fit::tied(data, &thirds(), 3).unwrap();
    // The noise counts as one point of 121.
    let difference = fit.log_likelihood - log_likelihood;
    assert!(difference.abs() < 0.02, "{difference}");
    assert!(difference <= 1e-6, "above the greatest: {difference}");
    assert!(rises(&fit.objective), "{:?}", fit.objective);
}

#[test]
fn own_covariances_raise_the_objective_and_fit_better() {
    let (space, _) = golden();
    let labels = free(&space);
    let data = gaussians(&space, &labels);
    let tied = Fit::tied(data, &thirds(), 3).unwrap();
    let own = tied.own(data).unwrap();
    let phase = &own.objective[tied.objective.len()..];
    assert!(rises(phase), "{phase:?}");
    assert!(own.log_likelihood > tied.log_likelihood);
}

#[test]
fn an_empty_component_is_started_anew() {
    let (space, log_likelihood) = golden();
    let labels = free(&space);
    let data = gaussians(&space, &labels);
    // Two groups start as one, and the third component without a point.
    let start: Vec<usize> = thirds().iter().map(|&of| of.min(1)).collect();
    let fit = Fit::tied(data, &start, 3).unwrap();
    assert_eq!(fit.mixture.len(), 3);
    assert!(fit.restarted >= 1);
    assert!((fit.log_likelihood - log_likelihood).abs() < 0.02);
}

#[test]
fn more_components_than_kinds_of_points_are_merged_or_dropped() {
    // Two points, each ten times.
    let columns = DMatrix::from_fn(2, 20, |row, i| if i % 2 == row { 1.0 } else { 0.0 });
    let space = Space::principal(columns, 2, 0.99).unwrap();
    let labels = free(&space);
    let data = gaussians(&space, &labels);
    // Each of the two starts as two components, and a fifth component without a point.
    let start: Vec<usize> = (0..20).map(|i| i % 4).collect();
    let fit = Fit::tied(data, &start, 5).unwrap();
    assert_eq!(fit.mixture.len(), 2);
    assert_eq!(fit.merged + fit.dropped, 3);
    let truth: Vec<usize> = (0..20).map(|i| i % 2).collect();
    let of: Vec<bool> = (0..20)
        .map(|i| fit.memberships[(i, 0)] > fit.memberships[(i, 1)])
        .collect();
    assert_eq!(adjusted_rand_index(&of, &truth), Some(1.0));
}

#[test]
fn labels_stay() {
    let (space, _) = golden();
    // Labelled against where they lie: it is not for EM to know better.
    let mut labels = free(&space);
    labels[0] = Some(1);
    labels[50] = Some(0);
    let config = ClusterConfig {
        least_components: 3,
        most_components: 3,
        ..ClusterConfig::default()
    };
    let clusters = in_space(&space, &labels, 2, &config).unwrap();
    assert_eq!((clusters.assignment[0], clusters.assignment[50]), (1, 0));
    assert_eq!(
        clusters.log_membership[0],
        [f64::NEG_INFINITY, 0.0, f64::NEG_INFINITY]
    );
}

#[test]
fn points_in_one_place_cannot_be_told_apart() {
    let same = DMatrix::from_element(3, 8, 2.0);
    let refused = Space::principal(same, 3, 0.99);
    assert!(matches!(refused, Err(ClusterError::Identical)));
}

#[test]
fn three_overlapping_groups_are_three() {
    let (space, _) = golden();
    let clusters = in_space(&space, &free(&space), 0, &ClusterConfig::default()).unwrap();
    assert_eq!(clusters.components, 3);
    assert_eq!(clusters.covariances, Covariances::Tied);
    let agreement = adjusted_rand_index(&clusters.assignment, &thirds()).unwrap();
    assert!(agreement > 0.9, "{agreement}");
}

/// One point far out is in nobody's way: the three groups' means stay, and it does not become a fourth.
#[test]
fn tails_bear_what_is_far_out() {
    let (space, _) = golden();
    let (p, n) = space.points.shape();
    let mut points = space.points.clone().insert_column(n, 0.0);
    points[(0, n)] = 40.0 * space.points.amax();
    let far = Space {
        points,
        noise: space.noise,
    };
    let labels = free(&far);
    let start: Vec<usize> = thirds().into_iter().chain([0]).collect();
    let fits = [4.0, f64::INFINITY].map(|tails| {
        let data = Data {
            tails,
            ..gaussians(&far, &labels)
        };
        let fit = Fit::tied(data, &start, 3).unwrap();
        assert!(rises(&fit.objective), "{:?}", fit.objective);
        let own = fit.own(data).unwrap();
        assert!(rises(&own.objective[fit.objective.len()..]));
        fit
    });
    let [heavy, gaussian] = fits.map(|fit| {
        let of: Vec<usize> = (0..n)
            .map(|i| {
                let row = fit.memberships.row(i);
                (0..row.len())
                    .max_by(|&a, &b| row[a].total_cmp(&row[b]))
                    .unwrap()
            })
            .collect();
        adjusted_rand_index(&of, &thirds()).unwrap()
    });
    assert!(p == far.points.nrows() && heavy > 0.9, "{heavy}");
    assert!(gaussian < heavy, "{gaussian} for {heavy}");
}

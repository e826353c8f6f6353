//! What cannot be clustered, and what the refusal says.

use tonus::model::cluster::{ClusterConfig, ClusterError, cluster};

use super::planted::{plane, planted};

type Change = fn(&mut ClusterConfig);

/// A refused setting and all that is said of it.
const SETTINGS: [(Change, &str); 13] = [
    (
        |config| config.least_components = 0,
        "the least number of components is 0: give at least 1",
    ),
    (
        |config| config.most_components = 0,
        "the greatest number of components is 0: give at least the least number",
    ),
    (
        |config| (config.least_components, config.most_components) = (3, 2),
        "the greatest number of components is 2: give at least the least number",
    ),
    (
        |config| config.restarts = 0,
        "the number of restarts is 0: give at least 1",
    ),
    (
        |config| config.folds = 1,
        "the number of folds is 1: give at least 2",
    ),
    (
        |config| config.standard_errors = -0.5,
        "the number of standard errors is -0.5: give a finite number from 0",
    ),
    (
        |config| config.standard_errors = f64::INFINITY,
        "the number of standard errors is inf: give a finite number from 0",
    ),
    (
        |config| config.standard_errors = f64::NAN,
        "the number of standard errors is NaN: give a finite number from 0",
    ),
    (
        |config| config.variance_kept = 0.0,
        "the share of variance is 0: give above 0 and below 1",
    ),
    (
        |config| config.variance_kept = 1.0,
        "the share of variance is 1: give above 0 and below 1",
    ),
    (
        |config| config.variance_kept = f64::NAN,
        "the share of variance is NaN: give above 0 and below 1",
    ),
    (
        |config| config.freedom = 2.0,
        "the number of degrees of freedom is 2: give above 2, infinite for Gaussians",
    ),
    (
        |config| config.freedom = f64::NAN,
        "the number of degrees of freedom is NaN: give above 2, infinite for Gaussians",
    ),
];

#[test]
fn settings() {
    let (demonstrations, _) = planted(&[10], 0.0, 1);
    for (change, expected) in SETTINGS {
        let mut config = ClusterConfig::default();
        change(&mut config);
        let error = cluster(&demonstrations, &plane(), &[None; 10], &config);
        let error = error.expect_err(expected);
        assert!(matches!(error, ClusterError::Config { .. }), "{error}");
        assert_eq!(error.to_string(), expected);
    }
}

/// Values at the ends of what is allowed are allowed.
#[test]
fn settings_at_their_ends() {
    let (demonstrations, _) = planted(&[10], 0.0, 1);
    let least = ClusterConfig {
        least_components: 1,
        most_components: 1,
        restarts: 1,
        folds: 2,
        standard_errors: 0.0,
        variance_kept: 0.01,
        freedom: 2.01,
        seed: u64::MAX,
    };
    let gaussians = ClusterConfig {
        freedom: f64::INFINITY,
        variance_kept: 0.99,
        folds: 1000,
        ..least
    };
    for config in [least, gaussians] {
        let clusters = cluster(&demonstrations, &plane(), &[None; 10], &config);
        assert_eq!(clusters.expect("clusters").components, 1);
    }
}

#[test]
fn labels_that_do_not_fit() {
    let (demonstrations, _) = planted(&[10], 0.0, 1);
    let refuse = |labels: &[Option<usize>], least_components| {
        let config = ClusterConfig {
            least_components,
            most_components: usize::MAX,
            ..ClusterConfig::default()
        };
        let clusters = cluster(&demonstrations, &plane(), labels, &config);
        clusters.expect_err("refused").to_string()
    };
    let free = [None; 10];
    assert_eq!(
        refuse(&free[1..], 1),
        "9 labels for 10 demonstrations: give one each, or none for an unlabelled one"
    );
    for last in [1, usize::MAX] {
        let mut gap = free;
        gap[3] = Some(last);
        assert_eq!(
            refuse(&gap, 1),
            "class 0 has no labelled demonstration, a later one has: number the classes from 0 without gaps"
        );
    }
    // Labelled classes need no more, the others two demonstrations each.
    let two = [0, 1, 0, 1, 0, 1, 0].map(Some);
    let labelled = [&two[..], &[None; 3]].concat();
    for (labels, components) in [
        (&free[..], 6),
        (&free[..], usize::MAX),
        (&labelled[..], 4),
        (&labelled[..], usize::MAX),
    ] {
        assert_eq!(
            refuse(labels, components),
            format!(
                "10 demonstrations and {components} components: each component needs 2 unlabelled demonstrations or a \
                 label, and 3 demonstrations are the least"
            )
        );
    }
}

#[test]
fn demonstrations_that_are_too_few_or_the_same() {
    let (demonstrations, _) = planted(&[10], 0.0, 1);
    let plain = ClusterConfig::default();
    let error = cluster(&demonstrations[..2], &plane(), &[None; 2], &plain);
    let error = error.expect_err("refused");
    assert!(
        matches!(
            error,
            ClusterError::TooFew {
                found: 2,
                components: 1
            }
        ),
        "{error}"
    );
    let error = cluster(&[], &plane(), &[], &plain).expect_err("refused");
    assert!(
        matches!(error, ClusterError::TooFew { found: 0, .. }),
        "{error}"
    );

    let same = vec![demonstrations[0].clone(); 10];
    let error = cluster(&same, &plane(), &[None; 10], &plain).expect_err("refused");
    assert!(matches!(error, ClusterError::Identical), "{error}");
    assert_eq!(
        error.to_string(),
        "the demonstrations are identical: there is nothing to tell apart"
    );
}

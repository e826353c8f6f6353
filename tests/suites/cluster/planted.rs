//! Kinds that were put there: found, counted, and helped by labels.

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus::demonstration::Demonstration;
use tonus::model::cluster::{ClusterConfig, adjusted_rand_index, cluster};
use tonus::model::{Dof, Valid};

use super::{demonstration, unlabelled, valid};

/// Movements of two DoFs drawn from Gaussians over five sines: `sizes` of each kind, the kinds' means `apart` standard
/// deviations from each other in random directions. Demonstrations and kinds, shuffled together.
pub(super) fn planted(sizes: &[usize], apart: f64, seed: u64) -> (Vec<Demonstration>, Vec<usize>) {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let mut normal = |std: f64| {
        let value: f64 = StandardNormal.sample(&mut rng);
        std * value
    };
    let mut all = Vec::new();
    for (kind, &size) in sizes.iter().enumerate() {
        let direction: Vec<f64> = (0..10).map(|_| normal(1.0)).collect();
        let length = direction.iter().map(|v| v * v).sum::<f64>().sqrt();
        let mean: Vec<f64> = direction.iter().map(|v| apart * v / length).collect();
        for _ in 0..size {
            let amplitudes: Vec<f64> = mean.iter().map(|m| m + normal(1.0)).collect();
            let mut values = vec![Vec::new(); 2];
            for step in 0..60 {
                let phase = f64::from(step) / 59.0;
                for (dof, series) in values.iter_mut().enumerate() {
                    let wave = |n: usize| {
                        let angle = std::f64::consts::PI * (n + 1) as f64 * phase;
                        amplitudes[5 * dof + n] * angle.sin()
                    };
                    series.push((0..5).map(wave).sum::<f64>() + normal(0.01));
                }
            }
            let t_s: Vec<f64> = (0..60).map(|step| f64::from(step) / 59.0).collect();
            all.push((demonstration("", t_s, values), kind));
        }
    }
    let order: Vec<f64> = all.iter().map(|_| normal(1.0)).collect();
    let mut all: Vec<_> = all.into_iter().zip(order).collect();
    all.sort_by(|one, other| one.1.total_cmp(&other.1));
    all.into_iter().map(|(pair, _)| pair).unzip()
}

pub(super) fn plane() -> Valid {
    valid(["x", "y"].map(Dof::position).to_vec(), 12)
}

#[test]
fn planted_kinds_are_found_and_counted() {
    let sizes: [&[usize]; 6] = [
        &[40],
        &[30, 20],
        &[25, 25, 25],
        &[30, 15, 20, 25],
        &[20, 20, 20, 20, 20],
        &[25, 15, 20, 20, 15, 25],
    ];
    for (index, sizes) in sizes.iter().enumerate() {
        for seed in 1..=5 {
            let (demonstrations, kinds) = planted(sizes, 8.0, seed);
            let clusters = unlabelled(&demonstrations, &plane(), seed);
            let agreement = adjusted_rand_index(&clusters.assignment, &kinds);
            assert_eq!(clusters.components, index + 1, "seed {seed}: {clusters:?}");
            assert!(
                agreement >= Some(0.99),
                "{} kinds, seed {seed}: {agreement:?}",
                index + 1
            );
        }
    }
}

#[test]
fn the_same_seed_gives_the_same_clusters_and_memberships_are_probabilities() {
    let (demonstrations, _) = planted(&[15, 15], 3.0, 7);
    let clusters = unlabelled(&demonstrations, &plane(), 3);
    assert_eq!(clusters, unlabelled(&demonstrations, &plane(), 3));
    for row in &clusters.log_membership {
        let total: f64 = row.iter().map(|v| v.exp()).sum();
        assert!((total - 1.0).abs() < 1e-12, "{row:?}");
    }
    assert_eq!(
        clusters.assignment[0], 0,
        "components in the order they come"
    );
}

#[test]
fn copies_are_merged() {
    let (demonstrations, _) = planted(&[6, 6], 8.0, 5);
    // Two movements, many times each: six components are asked for and two are left.
    let two = vec![demonstrations[..2].to_vec(); 10].concat();
    let config = ClusterConfig {
        least_components: 6,
        most_components: 6,
        ..ClusterConfig::default()
    };
    let clusters = cluster(&two, &plane(), &[None; 20], &config).expect("clusters");
    assert_eq!(clusters.components, 2);
    assert_eq!(clusters.dropped + clusters.merged, 4);
}

#[test]
fn some_labels_are_kept_and_help() {
    let mut with = 0.0;
    let mut without = 0.0;
    for seed in 1..=10 {
        // Kinds that overlap: labels must help.
        let (demonstrations, kinds) = planted(&[30, 30, 30], 2.5, seed);
        let mut rng = ChaCha8Rng::seed_from_u64(100 + seed);
        let labels: Vec<_> = kinds
            .iter()
            .map(|&kind| (rng.random::<f64>() < 0.3).then_some(kind))
            .collect();
        let config = ClusterConfig {
            least_components: 3,
            most_components: 3,
            seed,
            ..ClusterConfig::default()
        };
        let free = vec![None; kinds.len()];
        // Agreement on the unlabelled ones alone.
        let agreement = |labels_used: &[Option<usize>]| {
            let clusters = cluster(&demonstrations, &plane(), labels_used, &config);
            let clusters = clusters.expect("clusters");
            for (label, of) in labels_used.iter().zip(&clusters.assignment) {
                assert!(
                    label.is_none_or(|label| label == *of),
                    "a label was changed"
                );
            }
            let rest = (0..kinds.len()).filter(|&i| labels[i].is_none());
            let (found, truth): (Vec<_>, Vec<_>) =
                rest.map(|i| (clusters.assignment[i], kinds[i])).unzip();
            adjusted_rand_index(&found, &truth).expect("an index")
        };
        with += agreement(&labels) / 10.0;
        without += agreement(&free) / 10.0;
    }
    println!("overlapping kinds: agreement {with:.3} with 30 % labels, {without:.3} without");
    assert!(with > without + 0.05, "{with} {without}");
}

#[test]
fn labelled_kinds_and_one_that_nobody_labelled() {
    for seed in 1..=5 {
        let (demonstrations, kinds) = planted(&[25, 25, 25], 8.0, seed);
        // Every third is labelled, of the first two kinds alone.
        let label = |(i, &kind): (usize, &usize)| (i % 3 == 0 && kind < 2).then_some(kind);
        let labels: Vec<_> = kinds.iter().enumerate().map(label).collect();
        let config = ClusterConfig {
            seed,
            ..ClusterConfig::default()
        };
        let clusters = cluster(&demonstrations, &plane(), &labels, &config).expect("clusters");
        // Not up to names: classes keep their numbers, and the new kind comes after them.
        let wrong = clusters
            .assignment
            .iter()
            .zip(&kinds)
            .filter(|(found, kind)| found != kind);
        assert_eq!(wrong.count(), 0, "seed {seed}");
    }
}

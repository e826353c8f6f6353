//! Demonstrations without labels: which belong together and how many kinds there are.
#![allow(missing_docs, reason = "test suite")]

mod planted;
mod program;
mod recorded;
mod refusals;
mod variants;

use tonus::demonstration::Demonstration;
use tonus::model::cluster::{ClusterConfig, Clusters, adjusted_rand_index, cluster};
use tonus::model::{Dof, Hyperparameters, Valid};
use tonus_shared::promp::Basis;

fn valid(dofs: Vec<Dof>, functions: usize) -> Valid {
    let basis = Basis::gaussian(functions).expect("a basis");
    let hyperparameters = Hyperparameters::new(dofs, basis);
    hyperparameters.check().expect("in range")
}

fn demonstration(label: &str, t_s: Vec<f64>, values: Vec<Vec<f64>>) -> Demonstration {
    Demonstration::new(label, "1", "planted", t_s, values).expect("a demonstration")
}

fn unlabelled(demonstrations: &[Demonstration], valid: &Valid, seed: u64) -> Clusters {
    let config = ClusterConfig {
        seed,
        ..ClusterConfig::default()
    };
    let labels = vec![None; demonstrations.len()];
    cluster(demonstrations, valid, &labels, &config).expect("clusters")
}

fn print_table(clusters: &Clusters) {
    println!("components left covariances  held out      BIC");
    for row in &clusters.table {
        println!(
            "{:>10} {:>4} {:<11} {:>9.3} {:>8.1}",
            row.components,
            row.left,
            format!("{:?}", row.covariances),
            row.held_out.unwrap_or(f64::NAN),
            row.bic
        );
    }
}

#[test]
fn the_adjusted_rand_index_is_that_of_another_implementation() {
    let lines = include_str!("../../golden/adjusted_rand.csv")
        .lines()
        .skip(1);
    let mut compared = 0;
    for line in lines {
        let cells: Vec<&str> = line.split(',').collect();
        let grouping = |cell: &str| -> Vec<u32> {
            let numbers = cell.split(' ').map(|text| text.parse().expect("a group"));
            numbers.collect()
        };
        let expected: f64 = cells[2].parse().expect("an index");
        let got = adjusted_rand_index(&grouping(cells[0]), &grouping(cells[1]));
        assert!(
            (got.expect("an index") - expected).abs() < 1e-12,
            "{line}: {got:?}"
        );
        compared += 1;
    }
    assert_eq!(compared, 11);
    assert_eq!(adjusted_rand_index(&[1, 2], &[1, 2, 3]), None);
    assert_eq!(adjusted_rand_index::<u8, u8>(&[], &[]), None);
}

//! Demonstrations without labels: which belong together and how many kinds there are.
#![allow(missing_docs, reason = "test suite")]

use std::path::{Path, PathBuf};
use std::process::Command;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};
use tonus::demonstration::{Choice, Demonstration, read};
use tonus::model::cluster::{
    ClusterConfig, ClusterError, Clusters, adjusted_rand_index, cluster, variants,
};
use tonus::model::{Dof, Hyperparameters, Valid, learn};
use tonus::table::Table;
use tonus_shared::promp::Basis;

fn valid(dofs: Vec<Dof>, functions: usize) -> Valid {
    let basis = Basis::gaussian(functions).expect("a basis");
    let hyperparameters = Hyperparameters::new(dofs, basis);
    hyperparameters.check().expect("in range")
}

/// Movements of two DoFs drawn from Gaussians over five sines: `sizes` of each kind, the kinds' means `apart` standard
/// deviations from each other in random directions. Demonstrations and kinds, shuffled together.
fn planted(sizes: &[usize], apart: f64, seed: u64) -> (Vec<Demonstration>, Vec<usize>) {
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

fn demonstration(label: &str, t_s: Vec<f64>, values: Vec<Vec<f64>>) -> Demonstration {
    Demonstration::new(label, "1", "planted", t_s, values).expect("a demonstration")
}

fn plane() -> Valid {
    valid(["x", "y"].map(Dof::position).to_vec(), 12)
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
    let lines = include_str!("../golden/adjusted_rand.csv").lines().skip(1);
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

#[test]
fn three_classes_of_the_reference_without_labels() {
    let (demonstrations, classes) = reference();
    let names = ["hx", "hy", "hz"].map(Dof::position);
    let stiffness = ["Khx", "Khy", "Khz"].map(Dof::stiffness);
    let robot = ["rx", "ry", "rz"].map(Dof::position);
    let robot_stiffness = ["Krx", "Kry", "Krz"].map(Dof::stiffness);
    let dofs = [names, stiffness, robot, robot_stiffness].concat();
    let valid = valid(dofs, 20);
    for seed in 1..=5 {
        let clusters = unlabelled(&demonstrations, &valid, seed);
        if seed == 1 {
            print_table(&clusters);
        }
        assert_eq!(clusters.components, 3, "seed {seed}");
        assert_eq!(
            adjusted_rand_index(&clusters.assignment, &classes),
            Some(1.0)
        );
    }
    // What clustering gives is a model's labels.
    let clusters = unlabelled(&demonstrations, &valid, 1);
    let relabelled = demonstrations.iter().zip(&clusters.assignment);
    let relabelled: Vec<_> = relabelled
        .map(|(demonstration, of)| demonstration.with_label(format!("skill{of}")))
        .collect();
    let model = learn(&relabelled, &valid).expect("a model");
    assert_eq!(model.labels(), ["skill0", "skill1", "skill2"]);
}

/// `reference/demos.csv`: 30 demonstrations of 12 DoFs, and their classes.
fn reference() -> (Vec<Demonstration>, Vec<String>) {
    let file = tonus_tests::reference().join("demos.csv");
    let mut reader = csv::Reader::from_path(file).expect("the reference");
    let mut series: Vec<(String, String, Vec<Vec<f64>>)> = Vec::new();
    for record in reader.records() {
        let record = record.expect("a row");
        let cell = |column: usize| record[column].parse::<f64>().expect("a number");
        if series.last().is_none_or(|(demo, ..)| *demo != record[0]) {
            series.push((
                record[0].to_owned(),
                record[1].to_owned(),
                vec![Vec::new(); 13],
            ));
        }
        if let Some((.., columns)) = series.last_mut() {
            for (index, column) in columns.iter_mut().enumerate() {
                column.push(cell(4 + index));
            }
        }
    }
    let one = |(_, class, mut columns): (String, String, Vec<Vec<f64>>)| {
        let t_s = columns.remove(0);
        (demonstration("", t_s, columns), class)
    };
    series.into_iter().map(one).unzip()
}

#[test]
fn six_actions_of_two_people_without_labels() {
    let folder = tonus_tests::recordings().join("vmci_pick_place_mocap/csv");
    let entries = std::fs::read_dir(&folder).expect("the folder of the recording");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    let names = ["x", "y", "z"].map(str::to_owned);
    let exclude = ["none", "idle"].map(str::to_owned);
    let choice = Choice {
        dofs: &names,
        exclude: &exclude,
    };
    let of_file = |file| read(&Table::open(file).expect("a table"), &choice);
    let all: Vec<_> = files
        .iter()
        .flat_map(|file| of_file(file).expect("demonstrations"))
        .collect();
    let valid = valid(["x", "y", "z"].map(Dof::position).to_vec(), 20);
    for (who, wanted, floor) in [("subject1", 54, 0.8), ("subject2", 36, 0.4), ("", 90, 0.5)] {
        let of_them = |d: &&Demonstration| d.trial().starts_with(who);
        let theirs: Vec<_> = all.iter().filter(of_them).cloned().collect();
        assert_eq!(theirs.len(), wanted);
        let actions: Vec<_> = theirs.iter().map(Demonstration::label).collect();
        let clusters = cluster(
            &theirs,
            &valid,
            &vec![None; theirs.len()],
            &ClusterConfig {
                most_components: 14,
                ..ClusterConfig::default()
            },
        );
        let clusters = clusters.expect("clusters");
        print_table(&clusters);
        let agreement = adjusted_rand_index(&clusters.assignment, &actions).expect("an index");
        println!(
            "{who}: {} components, agreement {agreement:.3}",
            clusters.components
        );
        assert!(agreement >= floor, "{who}: {agreement}");
    }
}

/// `reference/demos.csv` as the program reads it, the labels of these demonstrations emptied.
fn file_without(folder: &Path, emptied: impl Fn(usize) -> bool) -> PathBuf {
    let text = std::fs::read_to_string(tonus_tests::reference().join("demos.csv"));
    let text = text.expect("the reference");
    let mut out = String::from("label,trial,t_s,hx,Khx,rz\n");
    for line in text.lines().skip(1) {
        let cells: Vec<&str> = line.split(',').collect();
        let demo: usize = cells[0].parse().expect("a number");
        let label = if emptied(demo) { "" } else { cells[1] };
        out += &[label, cells[0], cells[4], cells[5], cells[8], cells[13]].join(",");
        out.push('\n');
    }
    let file = folder.join("demos.csv");
    std::fs::write(&file, out).expect("a file");
    file
}

fn train(file: &Path, options: &[&str]) -> serde_json::Value {
    let model = file.with_extension("safetensors");
    let output = Command::new(tonus_tests::program())
        .args(["--json", "train"])
        .arg(file)
        .arg("-o")
        .arg(model)
        .args(["--dofs", "hx,Khx:N/m:log,rz"])
        .args(options)
        .output()
        .expect("the program");
    let errors = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{options:?}: {errors}");
    serde_json::from_slice(&output.stdout).expect("JSON")
}

#[test]
fn the_program_trains_without_labels_and_with_some() {
    let (_, classes) = reference();
    let folder = tempfile::tempdir().expect("a folder");
    let labels = |summary: &serde_json::Value| -> Vec<String> {
        let labels = summary["clusters"]["labels"].as_array().expect("labels");
        let text = |label: &serde_json::Value| label.as_str().expect("a label").to_owned();
        labels.iter().map(text).collect()
    };
    let agreement = |found: &[String]| adjusted_rand_index(found, &classes);

    let none = file_without(folder.path(), |_| true);
    let summary = train(&none, &["--unlabelled"]);
    assert_eq!(summary["clusters"]["components"], 3, "{summary}");
    let found = labels(&summary);
    assert_eq!(found[0], "skill1");
    assert_eq!(agreement(&found), Some(1.0));
    let two = train(&none, &["--unlabelled", "--components", "2"]);
    assert_eq!(two["clusters"]["components"], 2);

    // Three of each class are labelled.
    let some = file_without(folder.path(), |demo| demo % 10 >= 3);
    let found = labels(&train(&some, &["--components", "auto"]));
    assert_eq!(found, classes);
}

#[test]
fn a_class_performed_in_two_ways_is_split_and_one_in_one_way_is_not() {
    for seed in 1..=5 {
        let (two_ways, ways) = planted(&[20, 20], 8.0, seed);
        let (one_way, _) = planted(&[30], 8.0, 50 + seed);
        let demonstrations: Vec<_> = two_ways
            .iter()
            .map(|d| d.with_label("wave"))
            .chain(one_way.iter().map(|d| d.with_label("push")))
            .collect();
        let config = ClusterConfig {
            most_components: 3,
            seed,
            ..ClusterConfig::default()
        };
        let split = variants(&demonstrations, &plane(), &config).expect("variants");
        let classes: Vec<_> = split.classes.iter().map(|one| one.class.as_str()).collect();
        assert_eq!(classes, ["push", "wave"]);
        assert_eq!(split.classes[0].sizes, [30], "seed {seed}");
        assert_eq!(split.classes[1].sizes, [20, 20], "seed {seed}");
        let labels: Vec<_> = split
            .demonstrations
            .iter()
            .map(Demonstration::label)
            .collect();
        assert!(labels[40..].iter().all(|label| *label == "push"));
        assert_eq!(adjusted_rand_index(&labels[..40], &ways), Some(1.0));
        assert_eq!(labels[0], "wave#1");
        assert!(labels[..40].contains(&"wave#2"));
    }
}

#[test]
fn what_cannot_be_clustered_is_refused() {
    let (demonstrations, _) = planted(&[10], 0.0, 1);
    let plain = ClusterConfig::default();
    let refuse = |labels: &[Option<usize>], config: ClusterConfig| {
        cluster(&demonstrations, &plane(), labels, &config).expect_err("refused")
    };
    let free = [None; 10];
    let wrong = [
        ClusterConfig {
            least_components: 0,
            ..plain
        },
        ClusterConfig {
            most_components: 0,
            ..plain
        },
        ClusterConfig {
            restarts: 0,
            ..plain
        },
        ClusterConfig { folds: 1, ..plain },
        ClusterConfig {
            standard_errors: f64::NAN,
            ..plain
        },
        ClusterConfig {
            variance_kept: 1.0,
            ..plain
        },
        ClusterConfig {
            variance_kept: f64::NAN,
            ..plain
        },
    ];
    for config in wrong {
        let error = refuse(&free, config);
        assert!(
            matches!(error, ClusterError::Config { .. }),
            "{config:?}: {error}"
        );
    }
    let error = refuse(&free[1..], plain);
    assert!(matches!(error, ClusterError::Labels { .. }), "{error}");
    let mut gap = free;
    gap[3] = Some(1);
    let error = refuse(&gap, plain);
    assert!(
        matches!(error, ClusterError::NoneOfClass { class: 0 }),
        "{error}"
    );
    let many = ClusterConfig {
        least_components: 6,
        ..plain
    };
    let error = refuse(&free, many);
    assert!(
        matches!(
            error,
            ClusterError::TooFew {
                found: 10,
                components: 6
            }
        ),
        "{error}"
    );
    let same = vec![demonstrations[0].clone(); 10];
    let error = cluster(&same, &plane(), &free, &plain).expect_err("refused");
    assert!(matches!(error, ClusterError::Identical), "{error}");
}

//! Kinds of recordings and of the reference.

use tonus::demonstration::{Choice, Demonstration, read};
use tonus::model::cluster::{ClusterConfig, adjusted_rand_index, cluster};
use tonus::model::{Dof, learn};
use tonus::table::Table;

use super::{print_table, unlabelled, valid};

/// All DoFs of the reference: the hand's position and stiffness, then the robot's.
const DOFS: [&str; 12] = [
    "hx", "hy", "hz", "Khx", "Khy", "Khz", "rx", "ry", "rz", "Krx", "Kry", "Krz",
];

/// The demonstrations of the reference, without their labels, and their classes.
pub(super) fn reference() -> (Vec<Demonstration>, Vec<String>) {
    let all = tonus_tests::demos(&DOFS);
    let apart = |one: &Demonstration| (one.with_label(""), one.label().to_owned());
    all.iter().map(apart).unzip()
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

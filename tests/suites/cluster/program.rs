//! `tonus train --unlabelled` and `--components`.

use std::path::{Path, PathBuf};
use std::process::Command;

use tonus::model::cluster::adjusted_rand_index;

use super::recorded::reference;

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

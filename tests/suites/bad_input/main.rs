//! Bad input to the program: each case with the error it must give, none a panic.
//!
//! Exit code 1 is bad data, 2 a command line that makes no sense; 101 would be a panic.

mod csv_files;
mod model_files;
mod options;
mod recordings;
mod signals;

use std::path::Path;
use std::process::{Command, Output, Stdio};

/// A command line and what must come of it.
struct Case {
    /// Split at spaces; run in the folder of [`prepare`].
    line: &'static str,
    code: i32,
    /// All of these must be in the error.
    says: &'static [&'static str],
}

/// A command line on bad data.
const fn data(line: &'static str, says: &'static [&'static str]) -> Case {
    Case {
        line,
        code: 1,
        says,
    }
}

/// A command line that makes no sense.
const fn usage(line: &'static str, says: &'static [&'static str]) -> Case {
    Case {
        line,
        code: 2,
        says,
    }
}

/// Runs the program in a folder; standard input is empty.
fn tonus(folder: &Path, arguments: &[&str]) -> Output {
    let mut command = Command::new(tonus_tests::program());
    command.args(arguments).current_dir(folder);
    command.stdin(Stdio::null());
    command.output().expect("the program starts")
}

/// Writes every file that the cases name.
fn prepare(folder: &Path) {
    csv_files::write(folder);
    signals::write(folder);
    recordings::write(folder);
    let line = "train good.csv -o good.safetensors --dofs x --basis gaussian:5";
    let output = tonus(folder, &line.split(' ').collect::<Vec<_>>());
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "the good file is refused: {error}");
    let output = tonus(
        folder,
        &"train good.csv -o em.safetensors --em --dofs x --basis gaussian:5"
            .split(' ')
            .collect::<Vec<_>>(),
    );
    assert!(output.status.success(), "EM refuses the good file");
    model_files::write(folder);
}

/// What is wrong with the outcome of a case, if anything.
fn complaint(folder: &Path, case: &Case) -> Option<String> {
    let output = tonus(folder, &case.line.split(' ').collect::<Vec<_>>());
    let error = String::from_utf8_lossy(&output.stderr);
    let code = output.status.code();
    let wrong = if code != Some(case.code) {
        format!("exit code {code:?}, not {}", case.code)
    } else if let Some(missing) = case.says.iter().find(|text| !error.contains(**text)) {
        format!("the error does not say `{missing}`")
    } else if error.contains("panicked") {
        "it panicked".to_owned()
    } else if !output.stdout.is_empty() {
        "it printed a result".to_owned()
    } else if std::fs::remove_file(folder.join("out")).is_ok() {
        "it wrote a result".to_owned()
    } else {
        return None;
    };
    Some(format!("tonus {}\n  {wrong}\n  {error}", case.line))
}

fn check(cases: &[Case]) {
    let folder = tempfile::tempdir().unwrap();
    prepare(folder.path());
    let complaints: Vec<_> = cases
        .iter()
        .filter_map(|case| complaint(folder.path(), case))
        .collect();
    assert!(
        complaints.is_empty(),
        "{} of {} cases:\n{}",
        complaints.len(),
        cases.len(),
        complaints.join("\n")
    );
}

#[test]
fn there_are_enough_cases() {
    let all = csv_files::CASES.len()
        + model_files::CASES.len()
        + options::CASES.len()
        + recordings::CASES.len()
        + signals::CASES.len();
    assert!(all >= 40, "{all}");
}

#[test]
fn csv_files() {
    check(csv_files::CASES);
}

#[test]
fn model_files() {
    check(model_files::CASES);
}

#[test]
fn command_lines() {
    check(options::CASES);
}

#[test]
fn recordings() {
    check(recordings::CASES);
}

#[test]
fn signals() {
    check(signals::CASES);
}

#[test]
fn every_verb_has_help_with_an_example() {
    let folder = tempfile::tempdir().unwrap();
    for verb in [
        "demo",
        "envelope",
        "eval",
        "experiment",
        "infer",
        "info",
        "train",
    ] {
        let output = tonus(folder.path(), &[verb, "--help"]);
        let text = String::from_utf8_lossy(&output.stdout);
        assert!(output.status.success(), "{verb}");
        let (_, examples) = text.split_once("Example").expect("an example");
        assert!(
            examples.contains(&format!("\n  tonus {verb} ")),
            "{verb}: {text}"
        );
        assert!(text.contains("--json"), "{verb}: {text}");
    }
}

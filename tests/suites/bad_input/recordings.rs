//! Folders of recordings that are not what they should be: not there, empty, cut off, of something else.

use std::fs;
use std::path::Path;

use super::{Case, data};

const ACTIONS: &str = "vmci_pick_place_mocap/csv";
const DIGITS: &str = "leap_digits_mit/csv";
const ACTION: &str = "subject1_run1.csv";
const DIGIT: &str = "digit0.csv";

pub(super) const CASES: &[Case] = &[
    data(
        "experiment recordings --data nowhere",
        &[
            "nowhere/vmci_pick_place_mocap/csv: no recording can be read there",
            "give the folder that holds all three recordings",
            "No such file",
        ],
    ),
    data(
        "experiment recordings --data good.csv",
        &["good.csv/vmci_pick_place_mocap/csv: no recording can be read there"],
    ),
    data(
        "experiment recordings --data alone",
        &["alone/vmci_pick_place_mocap/csv: 6 movements of 90: copy the whole recording there"],
    ),
    data(
        "experiment recordings --data no_digits",
        &["no_digits/leap_digits_mit/csv: no recording can be read there"],
    ),
    // 12 columns; the 99th row ends in its fourth.
    data(
        "experiment recordings --data cut",
        &["cut/vmci_pick_place_mocap/csv/subject1_run1.csv:100: 4 cells, but the header has 12"],
    ),
    data(
        "experiment recordings --data cut_digits",
        &["cut_digits/leap_digits_mit/csv/digit0.csv:50: 2 cells, but the header has"],
    ),
    data(
        "experiment recordings --data emptied",
        &["subject1_run1.csv: empty, it needs a header line and rows"],
    ),
    data(
        "experiment recordings --data header",
        &["subject1_run1.csv: no rows after the header line"],
    ),
    data(
        "experiment recordings --data renamed",
        &["subject1_run1.csv:1: no column `z`; present: t_s, x, y, height"],
    ),
    data(
        "experiment recordings --data word",
        &["subject1_run1.csv:7", "column `y`", "`high`"],
    ),
    data(
        "experiment recordings --data backwards",
        &["subject1_run1.csv:9", "t_s"],
    ),
];

/// Cuts the text off in its `line`, counted from 1, after so many cells of it.
fn cut(text: &str, line: usize, cells: usize) -> String {
    let mut lines: Vec<&str> = text.lines().take(line).collect();
    let last = lines.pop().expect("as many lines");
    let last: Vec<&str> = last.split(',').take(cells).collect();
    format!("{}\n{}", lines.join("\n"), last.join(","))
}

/// The text with one cell changed: line and column from 1.
fn with_cell(text: &str, (line, column): (usize, usize), cell: &str) -> String {
    let lines = (1..).zip(text.lines()).map(|(number, whole)| {
        let mut cells: Vec<&str> = whole.split(',').collect();
        if number == line {
            cells[column - 1] = cell;
        }
        cells.join(",") + "\n"
    });
    lines.collect()
}

/// A folder with the six actions' first file, as changed.
fn actions(folder: &Path, name: &str, text: &str) {
    let place = folder.join(name).join(ACTIONS);
    fs::create_dir_all(&place).unwrap();
    fs::write(place.join(ACTION), text).unwrap();
}

pub(super) fn write(folder: &Path) {
    let all = tonus_tests::recordings();
    let action = fs::read_to_string(all.join(ACTIONS).join(ACTION)).unwrap();
    let digit = fs::read_to_string(all.join(DIGITS).join(DIGIT)).unwrap();
    let header = action.lines().next().unwrap();

    actions(folder, "alone", &action);
    actions(folder, "cut", &cut(&action, 100, 4));
    actions(folder, "emptied", "");
    actions(folder, "header", &format!("{header}\n"));
    actions(folder, "renamed", &with_cell(&action, (1, 4), "height"));
    actions(folder, "word", &with_cell(&action, (7, 3), "high"));
    actions(folder, "backwards", &with_cell(&action, (9, 1), "0.0"));

    for name in ["no_digits", "cut_digits"] {
        for file in fs::read_dir(all.join(ACTIONS)).unwrap() {
            let file = file.unwrap();
            let place = folder.join(name).join(ACTIONS);
            fs::create_dir_all(&place).unwrap();
            fs::copy(file.path(), place.join(file.file_name())).unwrap();
        }
    }
    let digits = folder.join("cut_digits").join(DIGITS);
    fs::create_dir_all(&digits).unwrap();
    fs::write(digits.join(DIGIT), cut(&digit, 50, 2)).unwrap();
}

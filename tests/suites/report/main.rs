//! `tonus experiment … --report DIR`: one page that loads nothing, whose numbers are those of `--json` and whose figures
//! say what they show; and folders that it must refuse before the experiment runs.
#![allow(missing_docs, reason = "test suite")]

mod drawing;
mod numbers;

use std::fs;
use std::path::Path;
use std::process::{Command, Output, Stdio};

use roxmltree::{Document, Node, ParsingOptions};
use serde_json::Value;

/// A seed of development.
const SEED: &str = "17";
const PAGE: &str = "report.html";

fn experiment(which: &str, report: &Path) -> Output {
    let mut command = Command::new(tonus_tests::program());
    command
        .args(["--json", "experiment", which, "--seed", SEED, "--report"])
        .arg(report)
        .stdin(Stdio::null());
    command.output().expect("the program starts")
}

/// The page is well-formed XML, so that a program can read it; a browser forgives anything.
fn parsed(page: &str) -> Document<'_> {
    let doctype = ParsingOptions {
        allow_dtd: true,
        ..ParsingOptions::default()
    };
    Document::parse_with_options(page, doctype).expect("the page is well-formed")
}

fn named<'a, 'input>(node: Node<'a, 'input>, name: &'static str) -> Vec<Node<'a, 'input>> {
    let all = node.descendants();
    all.filter(|node| node.tag_name().name() == name).collect()
}

fn attribute<'a>(node: Node<'a, '_>, name: &str) -> &'a str {
    let value = node.attribute(name);
    value.unwrap_or_else(|| panic!("<{}> has no {name}", node.tag_name().name()))
}

/// What the page names is on the page: nothing is loaded, no link leads to nowhere, no name is given twice.
fn stands_alone(page: &Document, text: &str) {
    let mut ids: Vec<&str> = page
        .descendants()
        .filter_map(|node| node.attribute("id"))
        .collect();
    ids.sort_unstable();
    let twice = ids.windows(2).find(|pair| pair[0] == pair[1]);
    assert_eq!(twice, None, "an id given twice");
    let here = |id: &str| ids.binary_search(&id).is_ok();

    for node in page.descendants().filter(Node::is_element) {
        let name = node.tag_name().name();
        let loads = [
            "script", "link", "iframe", "img", "image", "object", "embed", "base", "use",
        ];
        assert!(!loads.contains(&name), "<{name}>");
        for attribute in node.attributes() {
            match attribute.name() {
                "href" => {
                    let target = attribute.value().strip_prefix('#');
                    let target = target.unwrap_or_else(|| panic!("{}", attribute.value()));
                    assert!(here(target), "#{target} is nowhere");
                }
                "src" | "srcset" | "data" | "action" | "style" => panic!("{attribute:?}"),
                name => assert!(!name.starts_with("on"), "{attribute:?}"),
            }
        }
    }
    assert!(!text.contains("@import"));
    for reference in text.split("url(").skip(1) {
        let target = reference.split_once(')').expect("url(…) ends").0;
        let target = target.trim_matches(['"', '\'']).strip_prefix('#');
        assert!(target.is_some_and(here), "url({target:?})");
    }
    // The name of SVG's own vocabulary is the only address.
    let addresses = text.replace("xmlns=\"http://www.w3.org/2000/svg\"", "");
    assert!(!addresses.contains("://"), "an address on the page");
}

/// One experiment's page, beside the JSON of the same run. `figures` of them are drawn.
fn page_of(which: &str, report: &Path, figures: &[&str]) {
    let output = experiment(which, report);
    let said = String::from_utf8_lossy(&output.stderr);
    assert!(output.status.success(), "{said}");
    assert!(said.contains("report.html"), "{said}");
    let found: Value = serde_json::from_slice(&output.stdout).expect("JSON");

    let text = fs::read_to_string(report.join(PAGE)).expect("the page");
    let page = parsed(&text);
    stands_alone(&page, &text);
    assert!(text.starts_with("<!DOCTYPE html>") && text.ends_with("</html>\n"));
    let numbers = numbers::agree(&page, &found);
    let (drawn, panels) = drawing::check(&page);
    println!("{which}: {numbers} numbers, {panels} panels");
    for figure in figures {
        assert!(drawn.iter().any(|id| id == figure), "{figure} is empty");
    }
    assert_eq!(files(report), [PAGE], "nothing else is left");
}

fn files(folder: &Path) -> Vec<String> {
    let entries = fs::read_dir(folder).expect("a folder");
    let names = entries.map(|entry| entry.expect("an entry").file_name());
    names
        .map(|name| name.into_string().expect("text"))
        .collect()
}

#[test]
fn page_of_hand_over() {
    // Folders that are not there are made.
    let folder = tempfile::tempdir().expect("a folder");
    page_of(
        "hand-over",
        &folder.path().join("a/b"),
        &[
            "fig-bases",
            "fig-weights",
            "fig-conditioning",
            "fig-hand-over-demonstrations",
            "fig-hand-over-paths",
            "fig-hand-over-stiffness",
            "fig-hand-over-human",
        ],
    );
}

#[test]
fn page_of_object_matching() {
    // The old page is replaced by a new file, not written over: who has it open reads it to its end.
    let (folder, elsewhere) = (
        tempfile::tempdir().expect("a folder"),
        tempfile::tempdir().expect("a folder"),
    );
    let kept = elsewhere.path().join("kept");
    let old = "an old page\n".repeat(1 << 18);
    fs::write(folder.path().join(PAGE), &old).expect("written");
    fs::hard_link(folder.path().join(PAGE), &kept).expect("linked");
    page_of(
        "object-matching",
        folder.path(),
        &[
            "fig-envelopes",
            "fig-lifts",
            "fig-matching",
            "fig-matching-recognition",
        ],
    );
    assert!(fs::read_to_string(&kept).expect("read") == old, "touched");
}

#[test]
fn page_of_pick_and_place() {
    let folder = tempfile::tempdir().expect("a folder");
    page_of(
        "pick-and-place",
        folder.path(),
        &[
            "fig-embedding",
            "fig-priors",
            "fig-recognition",
            "fig-pick-inference",
            "fig-fraction",
            "fig-observations",
            "fig-noise",
        ],
    );
}

/// Refused before the experiment runs: there are no numbers, and nothing is left behind.
fn refused(report: &Path, named: &Path) {
    let output = experiment("object-matching", report);
    let said = String::from_utf8_lossy(&output.stderr);
    assert_eq!(output.status.code(), Some(1), "{said}");
    assert!(output.stdout.is_empty(), "the experiment ran");
    let expected = format!("tonus: {}: cannot be written: ", named.display());
    assert!(said.starts_with(&expected), "{said}");
    assert!(said.contains("name a folder that can"), "{said}");
    assert_eq!(said.lines().count(), 1, "{said}");
}

#[test]
fn folders_that_cannot_be_written() {
    let folder = tempfile::tempdir().expect("a folder");
    let file = folder.path().join("file");
    fs::write(&file, "a file\n").expect("written");
    refused(&file, &file);
    let below = file.join("results");
    refused(&below, &below);
    assert_eq!(fs::read_to_string(&file).expect("read"), "a file\n");
    assert_eq!(files(folder.path()), ["file"]);

    // Where the page would be is a folder.
    let taken = folder.path().join("taken");
    fs::create_dir_all(taken.join(PAGE)).expect("made");
    refused(&taken, &taken.join(PAGE));
    assert_eq!(files(&taken), [PAGE]);
    assert!(files(&taken.join(PAGE)).is_empty());
}

/// A folder that is there and takes no file, whoever asks: permissions do not stop everybody.
#[cfg(target_os = "linux")]
#[test]
fn folders_that_take_no_file() {
    refused(Path::new("/proc"), Path::new("/proc/report.html"));
    refused(Path::new("/proc/results"), Path::new("/proc/results"));
}

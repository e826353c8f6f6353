//! The program's verbs with the library and without it.

use std::path::Path;
use std::process::Command;

use serde_json::Value;
use tempfile::TempDir;
use tonus::leap::{Loss, Origin, Update};
use tonus_native::leapc::LeapCError;

use super::{Library, PATIENCE, begin, is_lost, live};
use crate::service::{follow, updates};

fn tonus(arguments: &[&str], leapc: &Path) -> std::process::Output {
    Command::new(tonus_tests::program())
        .args(arguments)
        .env("TONUS_LEAPC", leapc)
        .output()
        .unwrap()
}

#[test]
fn the_program_prints_the_hand() {
    let mut script = begin();
    script.extend(live(0..300));
    let library = Library::playing(&[script]);
    let output = tonus(
        &["hand", "--leap", "leapc", "--seconds", "1.5", "--json"],
        &library.file(),
    );
    assert!(output.status.success(), "{output:?}");
    let lines: Vec<Value> = String::from_utf8(output.stdout)
        .unwrap()
        .lines()
        .map(|line| serde_json::from_str(line).unwrap())
        .collect();
    assert_eq!(lines[0]["connected"]["protocol"], "leapc");
    let hands: Vec<&Value> = lines
        .iter()
        .filter(|line| line["side"] == "right")
        .collect();
    assert!(hands.len() > 20, "{lines:?}");
    for hand in hands {
        let expected = hand["frame"].as_f64().unwrap() / 1e3;
        assert!(
            (hand["palm_m"][1].as_f64().unwrap() - expected).abs() < 1e-6,
            "{hand}"
        );
    }
}

#[test]
fn the_program_says_what_to_do_without_the_library() {
    let output = tonus(
        &["hand", "--leap", "leapc", "--seconds", "0.4"],
        Path::new("/nowhere/libLeapC.so"),
    );
    assert_eq!(output.status.code(), Some(1));
    let errors = String::from_utf8(output.stderr).unwrap();
    for part in [
        "/nowhere/libLeapC.so",
        "install",
        "TONUS_LEAPC",
        "ws://127.0.0.1:6437",
    ] {
        assert!(errors.contains(part), "{errors}");
    }
    // A library of others is told from it.
    let all = updates(
        &mut follow(Origin::LeapC(Some("libm.so.6".into()))),
        PATIENCE,
        is_lost,
    );
    let Some(Update::Lost(loss @ Loss::LeapC(LeapCError::Foreign { .. }))) = all.last() else {
        panic!("{all:?}");
    };
    assert!(loss.to_string().contains("lacks LeapGetNow"), "{loss}");
}

#[test]
fn the_doctor_looks_for_the_library_that_the_configuration_names() {
    let directory = TempDir::new().unwrap();
    let config = directory.path().join("tonus.toml");
    std::fs::write(&config, "[tracker]\nleap = \"leapc\"\n").unwrap();
    let config = config.to_str().unwrap();
    let tracker = |leapc: &Path| {
        let output = tonus(&["doctor", "--json", "--config", config], leapc);
        let text = String::from_utf8(output.stdout).unwrap();
        let all: Value = serde_json::from_str(&text).unwrap();
        let findings = all
            .as_array()
            .or_else(|| all["findings"].as_array())
            .unwrap();
        let of = |finding: &&Value| finding["what"] == "hand tracker";
        findings.iter().find(of).unwrap().clone()
    };
    let library = Library::playing(&[]);
    let there = tracker(&library.file());
    assert_eq!(there["lamp"], "good", "{there}");
    assert!(
        there["found"].as_str().unwrap().contains("libLeapC.so"),
        "{there}"
    );
    let absent = tracker(Path::new("/nowhere/libLeapC.so"));
    assert_eq!(absent["lamp"], "warn", "{absent}");
    for part in ["/nowhere/libLeapC.so", "install", "TONUS_LEAPC"] {
        assert!(absent["found"].as_str().unwrap().contains(part), "{absent}");
    }
    assert!(
        absent["mend"]
            .as_str()
            .unwrap()
            .contains("ws://127.0.0.1:6437"),
        "{absent}"
    );
}

//! What a newcomer meets in the first ten minutes on a computer with nothing plugged in: every refusal says what to do.

use std::process::{Command, Output};

fn tonus(arguments: &[&str]) -> Output {
    let directory = tempfile::tempdir().unwrap();
    // Nothing here takes a minute; what hangs is a failure, not a wait.
    Command::new("timeout")
        .arg("60")
        .arg(tonus_tests::program())
        .args(arguments)
        .current_dir(directory.path())
        // Neither the user's configuration nor their bus.
        .env("XDG_CONFIG_HOME", directory.path())
        .env("HOME", directory.path())
        .env_remove("DBUS_SYSTEM_BUS_ADDRESS")
        .output()
        .unwrap()
}

/// The arguments, and what the refusal must say.
const MET: &[(&[&str], &[&str])] = &[
    (
        &["run", "--link", "bluetooth"],
        &["`bluetooth` is no link", "ble", "serial:PORT", "sim"],
    ),
    (
        &["run", "--link", "serial:"],
        &["is no link", "serial:/dev/ttyACM0"],
    ),
    (
        &["run", "--link", "ble", "--story"],
        &["--story needs --link sim"],
    ),
    (
        &["run", "--config", "mine.toml"],
        &["mine.toml", "cannot be read"],
    ),
    (
        &["run", "--robot", "franka"],
        &["`franka` is no robot", "udp:"],
    ),
    (&["run", "--robot", "udp:nowhere"], &["nowhere", "PORT"]),
    (&["run", "--link", "replay:none.mcap"], &["none.mcap"]),
    (
        &[
            "run",
            "--link",
            "replay:none.mcap",
            "--pace",
            "4",
            "--robot",
            "udp:5005",
        ],
        &["--pace needs", "--robot simulated"],
    ),
    (&["run", "--demonstrations", "none.csv"], &["none.csv"]),
    (&["run", "--seconds", "0"], &["--seconds", "not above 0"]),
    (&["play", "none.mcap"], &["none.mcap"]),
    (
        &["recover", "none.mcap", "-o", "mended.mcap"],
        &["none.mcap"],
    ),
    (&["export", "none.mcap", "-o", "x.csv"], &["none.mcap"]),
    (&["info", "none.mcap"], &["none.mcap"]),
    (
        &["scan", "--seconds", "1"],
        &["no Bluetooth", "--link serial:PORT", "--link sim"],
    ),
    (
        &["hand", "--leap", "ws://127.0.0.1:9", "--seconds", "1"],
        &["no Leap service", "start it"],
    ),
    (&["hand", "--leap", "http://a"], &["ws://HOST:PORT"]),
    (
        &["listen", "--link", "serial:/dev/nothing", "--seconds", "1"],
        &["/dev/nothing", "check the name"],
    ),
    (&["teach"], &["--shoulder", "--point"]),
    (&["teach", "--point", "1,2"], &["three numbers"]),
    (
        &[
            "calibrate",
            "--link",
            "sim",
            "--name",
            "a",
            "--mass",
            "75",
            "--height",
            "175",
        ],
        &["height", "metres"],
    ),
    (
        &[
            "calibrate",
            "--link",
            "sim",
            "--name",
            " ",
            "--mass",
            "75",
            "--height",
            "1.75",
        ],
        &["no name", "1 to 64 bytes"],
    ),
    (
        &["record", "--link", "sim", "--label", "lift_book"],
        &["--output"],
    ),
    (
        &["upload", "none.tnsm", "--link", "ble"],
        &["none.tnsm", "cannot be read"],
    ),
    (
        &[
            "upload",
            concat!(env!("CARGO_MANIFEST_DIR"), "/Cargo.toml"),
            "--link",
            "ble",
        ],
        &["Cargo.toml", "tonus export MODEL -o IMAGE"],
    ),
    (&["upload", "none.tnsm", "--link", "sim"], &["--link ble"]),
    (&["frobnicate"], &["frobnicate", "--help"]),
];

#[test]
fn every_refusal_says_what_to_do() {
    for (arguments, says) in MET {
        let output = tonus(arguments);
        let told = String::from_utf8_lossy(&output.stderr).into_owned();
        assert!(!output.status.success(), "{arguments:?} was taken: {told}");
        for part in *says {
            assert!(
                told.contains(part),
                "{arguments:?} does not say `{part}`: {told}"
            );
        }
        assert!(!told.contains("panicked"), "{arguments:?}: {told}");
        let reason = "No such file or directory (os error 2)";
        assert!(
            told.matches(reason).count() < 2,
            "{arguments:?} says it twice: {told}"
        );
        println!("tonus {}\n    {}", arguments.join(" "), told.trim());
    }
}

#[test]
fn the_doctor_names_what_is_missing_and_how_to_mend_it() {
    let output = tonus(&["doctor"]);
    let told = String::from_utf8_lossy(&output.stdout).into_owned();
    assert!(output.status.success(), "{told}");
    for part in [
        "Bluetooth LE",
        "--link sim",
        "hand tracker",
        "start the Leap service",
        "[robot]",
        "port =",
    ] {
        assert!(told.contains(part), "no `{part}` in {told}");
    }
    let output = tonus(&["doctor", "--json", "--config", "none.toml"]);
    assert!(!output.status.success());
    let told: serde_json::Value = serde_json::from_slice(&output.stdout).unwrap();
    let findings = told["findings"].as_array().unwrap();
    let bad: Vec<&str> = (findings.iter())
        .filter(|finding| finding["lamp"] == "bad")
        .map(|finding| finding["what"].as_str().unwrap())
        .collect();
    assert_eq!(bad, ["configuration"]);
    assert!(
        findings
            .iter()
            .all(|f| f["lamp"] == "good" || f["mend"].is_string())
    );
}

#[test]
fn the_defaults_it_prints_are_a_configuration() {
    let output = tonus(&["doctor", "--defaults"]);
    let text = String::from_utf8(output.stdout).unwrap();
    let config = tonus::config::Config::parse(&text, std::path::Path::new("printed")).unwrap();
    assert_eq!(config, tonus::config::Config::default());
}

use super::*;

fn refused(text: &str) -> String {
    let refusal = Config::parse(text, Path::new("x.toml")).unwrap_err();
    refusal.to_string()
}

#[test]
fn an_empty_file_is_the_defaults_and_their_text_gives_them_back() {
    let empty = Config::parse("", Path::new("x.toml")).unwrap();
    assert_eq!(empty, Config::default());
    let again = Config::parse(&empty.text(), Path::new("x.toml")).unwrap();
    assert_eq!(again, empty);
}

#[test]
fn a_part_of_a_table_leaves_the_rest() {
    let config = Config::parse("[robot]\nto = \"udp:10.0.0.2:5005\"", Path::new("x")).unwrap();
    assert_eq!(config.robot.to, "udp:10.0.0.2:5005");
    assert_eq!(config.robot.home_m, Robot::default().home_m);
}

#[test]
fn errors_name_file_line_and_key() {
    let unknown = refused("[robot]\nspeed = 3");
    assert!(
        unknown.starts_with("x.toml: ") && unknown.contains("line 2"),
        "{unknown}"
    );
    assert!(
        unknown.contains("`speed`") && unknown.contains("speed_m_per_s"),
        "{unknown}"
    );
    let typed = refused("[page]\nport = \"high\"");
    assert!(typed.contains("line 2") && typed.contains("u16"), "{typed}");
    for (text, parts) in [
        (
            "[recognition]\ndecide_at = 1.5",
            ["recognition.decide_at is 1.5", "0.5 to 1"],
        ),
        (
            "[wearable]\ntransport_ms = nan",
            ["wearable.transport_ms is NaN", "0 to 1000"],
        ),
        (
            "[tracker]\nhand = \"third\"",
            ["tracker.hand is \"third\"", "\"either\""],
        ),
        ("[robot]\nspeed_m_per_s = -1.0", ["[robot]", "speed"]),
        (
            "[robot]\nhome_m = [5, 0, 0]",
            ["[robot]", "outside the limits"],
        ),
    ] {
        let refusal = refused(text);
        assert!(parts.iter().all(|part| refusal.contains(part)), "{refusal}");
    }
}

#[test]
fn what_is_taught_is_kept_beside_what_the_file_says() {
    let directory = tempfile::tempdir().unwrap();
    let file = directory.path().join("tonus.toml");
    std::fs::write(&file, "[robot]\nto = \"udp:10.0.0.2:5005\"\n").unwrap();
    let shoulder = Shoulder {
        centre_m: [0.22, 0.38, 0.41],
        turned_left_rad: 0.0,
    };
    let robot = Stored {
        rotation_xyzw: [0.5, -0.5, -0.5, 0.5],
        translation_m: [0.6, 0.0, -0.1],
    };
    let read = || Config::read(&file).unwrap();
    read().taught(Some(shoulder), None).keep(&file).unwrap();
    // The second leaves the first as it is.
    read().taught(None, Some(robot)).keep(&file).unwrap();
    let kept = read();
    assert_eq!(kept.robot.to, "udp:10.0.0.2:5005");
    assert_eq!(kept.tracker.shoulder, Some(shoulder));
    assert_eq!(kept.tracker.robot, Some(robot));
    let nowhere = directory.path().join("none").join("tonus.toml");
    let refused = kept.keep(&nowhere).unwrap_err().to_string();
    assert!(
        refused.contains("none") && refused.contains("cannot be written"),
        "{refused}"
    );
}

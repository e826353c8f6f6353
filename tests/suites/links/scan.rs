//! `tonus scan` where there is no Bluetooth.

use std::process::Command;

#[test]
#[cfg(target_os = "linux")]
fn a_computer_without_bluetooth_is_told_what_to_do() {
    for arguments in [&["scan"][..], &["scan", "--json", "--seconds", "1"]] {
        let output = Command::new(tonus_tests::program())
            .args(arguments)
            .env("DBUS_SYSTEM_BUS_ADDRESS", "unix:path=/nonexistent")
            .output()
            .unwrap();
        assert_eq!(output.status.code(), Some(1), "{output:?}");
        let text = String::from_utf8(output.stderr).unwrap();
        for part in [
            "no Bluetooth",
            "apt-get install bluez",
            "--link serial:PORT",
            "--link sim",
        ] {
            assert!(text.contains(part), "{part}: {text}");
        }
        assert!(output.stdout.is_empty());
    }
}

#[test]
fn seconds_that_are_none_are_a_wrong_command_line() {
    let output = Command::new(tonus_tests::program())
        .args(["scan", "--seconds", "-1"])
        .output()
        .unwrap();
    assert_eq!(output.status.code(), Some(2), "{output:?}");
}

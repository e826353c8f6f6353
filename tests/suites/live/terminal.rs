//! Arming and disarming at a terminal, where there is no page.

use std::io::{BufRead as _, BufReader, Write as _};
use std::path::Path;
use std::process::{Command, Stdio};
use std::sync::mpsc::channel;
use std::time::Duration;

/// Nothing that is waited for takes so long on a busy machine.
const WITHIN: Duration = Duration::from_secs(40);

/// The program at a terminal of its own (that of util-linux' `script`), with these skills.
pub(crate) fn arms_and_disarms(skills: &Path) {
    let command = format!(
        "exec {} run --link sim --no-page --model {} --seconds 120",
        tonus_tests::program().display(),
        skills.display()
    );
    let mut program = Command::new("script")
        .args(["-qec", &command, "/dev/null"])
        .stdin(Stdio::piped())
        .stdout(Stdio::piped())
        .spawn()
        .unwrap();
    let (sender, lines) = channel();
    let output = BufReader::new(program.stdout.take().unwrap());
    std::thread::spawn(move || {
        for line in output.lines().map_while(Result::ok) {
            // Nobody waits any more when this fails.
            let _waiting = sender.send(line);
        }
    });
    let mut told = Vec::new();
    let mut wait = |text: &str| {
        loop {
            let line = lines.recv_timeout(WITHIN);
            let line = line.unwrap_or_else(|_| panic!("`{text}` was not told: {told:?}"));
            let found = line.contains(text);
            told.push(line);
            if found {
                return;
            }
        }
    };
    let mut person = program.stdin.take().unwrap();
    let mut types = |text: &str| {
        person.write_all(text.as_bytes()).unwrap();
        person.flush().unwrap();
    };
    wait("robot disarmed: not armed yet; a and Enter arms");
    types("a\n");
    wait("; Enter disarms");
    types("\n");
    wait("robot disarmed: disarmed by a person");
    types("\n");
    wait("the robot is disarmed: a and Enter arms");
    // Ctrl-C.
    types("\u{3}");
    let status = program.wait().unwrap();
    assert!(status.success(), "{status}");
}

//! The lab streaming layer against pylsl, in a network of their own: liblsl listens on every address it finds.
//!
//! A test here runs itself again within `unshare -n`; what it does there is the function behind `inside`.

mod inlet;
mod outlet;

use std::process::{Child, Command, Stdio};

use tonus_native::lsl::{Lsl, LslError};

/// Says that this is the program within.
const INSIDE: &str = "TONUS_TEST_INSIDE";
/// Where liblsl lies, to any program of Tonus.
const LIBRARY: &str = "TONUS_LSL";

/// Runs the test of this name again in a network of its own, or, where it is that, `work`.
fn inside(test: &str, work: impl FnOnce(Lsl)) {
    if std::env::var_os(INSIDE).is_some() {
        return work(Lsl::load(None).expect("pylsl's liblsl loads"));
    }
    let script = "import pathlib, pylsl; print(next(pathlib.Path(pylsl.__file__).parent.glob('lib/liblsl.so')))";
    let found = Command::new("python3").args(["-c", script]).output();
    let found = found.expect("python3 is needed for this test");
    let error = String::from_utf8_lossy(&found.stderr);
    assert!(found.status.success(), "pylsl is needed: {error}");
    let library = String::from_utf8(found.stdout).expect("a path");
    let output = Command::new("unshare")
        .args(["-rn", "sh", "-c"])
        .arg(r#"ip link set lo up; ip link set lo multicast on; ip route add 224.0.0.0/4 dev lo; exec "$@""#)
        .arg("sh")
        .arg(std::env::current_exe().expect("a running test has a path"))
        .args(["--exact", test, "--nocapture"])
        .env(INSIDE, "1")
        .env(LIBRARY, library.trim())
        .output()
        .expect("unshare is needed for this test");
    let said = String::from_utf8_lossy(&output.stdout);
    let error = String::from_utf8_lossy(&output.stderr);
    assert!(
        output.status.success() && said.contains("1 passed"),
        "{said}\n{error}"
    );
}

/// A program of Python that goes on beside the test.
fn python(script: &str) -> Child {
    let mut command = Command::new("python3");
    command.args(["-u", "-c", script]);
    command
        .stdin(Stdio::null())
        .stdout(Stdio::piped())
        .stderr(Stdio::null());
    command.spawn().expect("python3 is needed for this test")
}

#[test]
fn without_the_library_it_says_what_to_do() {
    let refused = Lsl::load(Some("/nowhere/liblsl.so".as_ref())).expect_err("no such file");
    assert!(matches!(refused, LslError::Absent { .. }));
    let text = refused.to_string();
    assert!(
        text.contains("/nowhere/liblsl.so")
            && text.contains("https://github.com/sccn/liblsl/releases"),
        "{text}"
    );
    assert!(text.contains("TONUS_LSL"), "{text}");
}

#[test]
fn another_library_is_refused_by_what_it_lacks() {
    // The C library is there on every machine that runs this.
    let refused = Lsl::load(Some("libc.so.6".as_ref())).expect_err("not liblsl");
    assert!(
        refused.to_string().contains("it lacks lsl_library_version"),
        "{refused}"
    );
}

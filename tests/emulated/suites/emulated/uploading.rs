//! `tonus upload`, the program itself, at the other end of the image's serial line.

use std::fmt::Write as _;
use std::io::ErrorKind;
use std::os::fd::AsRawFd;
use std::path::{Path, PathBuf};
use std::process::{Child, Command, Output, Stdio};
use std::time::Duration;

use serial2::SerialPort;
use tonus_emulated::Machine;

use super::models;
use super::{root, started};

/// The chip runs for so long between two looks at the line, microseconds.
const SLICE_US: u64 = 10_000;
/// After two minutes of the chip's time the program is taken to hang.
const MOST_SLICES: usize = 12_000;

/// The chip on a pseudo-terminal, whose other end must stay open.
struct Line {
    machine: Machine,
    chip: SerialPort,
    _host: SerialPort,
    name: PathBuf,
    /// Bytes of the chip that were passed on.
    passed: usize,
    /// Bytes of the program that the chip was sent.
    taken: usize,
}

impl Line {
    fn new(machine: Machine) -> Self {
        let (mut chip, host) = SerialPort::pair().unwrap();
        chip.set_read_timeout(Duration::from_millis(1)).unwrap();
        let name = std::fs::read_link(format!("/proc/self/fd/{}", host.as_raw_fd())).unwrap();
        let passed = machine.world().unwrap().serial.sent.len();
        Self {
            machine,
            chip,
            _host: host,
            name,
            passed,
            taken: 0,
        }
    }

    /// Starts the program.
    fn upload(&self, image: &Path) -> Child {
        Command::new(program())
            .args(["--json", "upload"])
            .arg(image)
            .arg("--link")
            .arg(format!("serial:{}", self.name.display()))
            .stdout(Stdio::piped())
            .stderr(Stdio::piped())
            .spawn()
            .unwrap()
    }

    /// Passes bytes to and fro for a while.
    fn slice(&mut self) {
        let mut bytes = [0; 4096];
        match self.chip.read(&mut bytes) {
            Ok(length) => {
                self.machine.send(&bytes[..length]);
                self.taken += length;
            }
            Err(error) if error.kind() == ErrorKind::TimedOut => {}
            Err(error) => panic!("{error}"),
        }
        let until_us = self.machine.now_us() + SLICE_US;
        self.machine.run_through(until_us).unwrap();
        let sent = &self.machine.world().unwrap().serial.sent;
        let new: Vec<u8> = sent[self.passed..].iter().map(|(_, byte)| *byte).collect();
        self.passed = sent.len();
        self.chip.write_all(&new).unwrap();
    }

    /// Until the program ends, or has sent so many bytes and is killed.
    fn serve(&mut self, mut program: Child, kill_after_bytes: Option<usize>) -> Output {
        let before = self.taken;
        for _ in 0..MOST_SLICES {
            let over = program.try_wait().unwrap().is_some();
            let kill = kill_after_bytes.is_some_and(|bytes| self.taken - before > bytes);
            if kill && !over {
                program.kill().unwrap();
            }
            if kill || over {
                return program.wait_with_output().unwrap();
            }
            self.slice();
        }
        program.kill().unwrap();
        panic!("{:?}", program.wait_with_output())
    }
}

/// The program, built from this tree.
fn program() -> PathBuf {
    let cargo = std::env::var_os("CARGO").unwrap_or_else(|| "cargo".into());
    let status = Command::new(cargo)
        .args([
            "build",
            "--quiet",
            "--locked",
            "--release",
            "--package",
            "tonus",
        ])
        .current_dir(root())
        .status()
        .unwrap();
    assert!(status.success(), "the program does not build");
    let target = std::env::var_os("CARGO_TARGET_DIR");
    let target = target.map_or_else(|| root().join("target"), PathBuf::from);
    target.join("release/tonus")
}

/// A model of two skills, learnt and exported by the program; its SHA-256's first bytes, as the program tells.
fn exported(folder: &Path) -> (PathBuf, String) {
    let mut table =
        "t_s,label,trial,human_x,human_y,human_z,human_kx,human_ky,human_kz\n".to_owned();
    for trial in 0..12_u32 {
        let label = ["lift", "push"][trial as usize % 2];
        // No two trials are alike.
        let shift = f64::from(trial % 5) * 0.01;
        for step in 0..=60_u32 {
            let s = f64::from(step) / 60.0;
            let bell = (std::f64::consts::PI * s).sin() * (0.2 + shift);
            let (up, on) = if trial % 2 == 0 {
                (bell, 0.0)
            } else {
                (0.0, bell)
            };
            let firm = 200.0 + 900.0 * (up + on + shift * s);
            let place = (0.3 + on, 0.1 * s + shift, up - 0.2);
            let _always = writeln!(
                table,
                "{},{label},{trial},{},{},{},{firm},{},{}",
                2.0 * s,
                place.0,
                place.1,
                place.2,
                0.8 * firm + 50.0 * s,
                1.1 * firm,
            );
        }
    }
    let [demonstrations, model, image] =
        ["shown.csv", "skills.safetensors", "skills.tnsm"].map(|name| folder.join(name));
    std::fs::write(&demonstrations, table).unwrap();
    let run = |arguments: &[&std::ffi::OsStr]| {
        let output = Command::new(program()).args(arguments).output().unwrap();
        let errors = String::from_utf8_lossy(&output.stderr);
        assert!(output.status.success(), "{errors}");
        String::from_utf8(output.stdout).unwrap()
    };
    let dofs = "human_x,human_y,human_z,human_kx:N/m:log,human_ky:N/m:log,human_kz:N/m:log";
    let _learnt = run(&[
        "train".as_ref(),
        demonstrations.as_ref(),
        "--dofs".as_ref(),
        dofs.as_ref(),
        "-o".as_ref(),
        model.as_ref(),
    ]);
    let told = run(&[
        "export".as_ref(),
        model.as_ref(),
        "-o".as_ref(),
        image.as_ref(),
        "--position".as_ref(),
        "human_x,human_y,human_z".as_ref(),
    ]);
    let (_, sha256) = told.split_once("sha256 ").unwrap();
    (image, sha256.trim()[..16].to_owned())
}

/// What the chip says that it works with, as hexadecimal digits.
fn active(line: &mut Line) -> Option<String> {
    let hash = models::active(&mut line.machine);
    // What came meanwhile was for this question.
    line.passed = line.machine.world().unwrap().serial.sent.len();
    hash.map(|hash| hash.map(|byte| format!("{byte:02x}")).concat())
}

#[test]
fn what_was_learnt_and_exported_gets_into_the_chip() {
    let folder = tempfile::tempdir().unwrap();
    let (image, hash) = exported(folder.path());
    let mut line = Line::new(started());
    assert_eq!(active(&mut line), None);
    // Killed in the midst: nothing of it is used.
    let program = line.upload(&image);
    let killed = line.serve(program, Some(2_000));
    assert!(!killed.status.success(), "{killed:?}");
    assert_eq!(active(&mut line), None);
    for was_there in [false, true] {
        let program = line.upload(&image);
        let output = line.serve(program, None);
        let [told, errors] =
            [output.stdout, output.stderr].map(|bytes| String::from_utf8(bytes).unwrap());
        assert!(output.status.success(), "{errors}");
        let expected = format!("\"was_there\":{was_there}");
        assert!(told.contains(&expected), "{told}");
        assert_eq!(active(&mut line).as_ref(), Some(&hash));
    }
}

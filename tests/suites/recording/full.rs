//! A disk that fills: recording stops and says why, the rest goes on, and the file can be read.

use std::io::Read;

use tonus::recording::Reading;

use crate::child;

/// Records until the file may grow no more, and says what the child said.
fn fill(line: &[String], path: &std::path::Path) -> String {
    let (mut child, mut out) = child::start(line, path);
    let mut said = String::new();
    out.read_to_string(&mut said).unwrap();
    assert!(child.wait().unwrap().success(), "{said}");
    said
}

#[test]
fn where_a_file_may_not_grow_recording_stops_and_the_rest_goes_on() {
    let folder = tempfile::tempdir().unwrap();
    let path = folder.path().join("limited.mcap");
    let mut line = vec!["sh".to_owned(), "-c".to_owned()];
    // 300 blocks of 512 bytes (1024 in some shells); a signal would end the program otherwise.
    line.push(r#"trap "" XFSZ; ulimit -f 300; exec "$@""#.to_owned());
    line.push("sh".to_owned());
    line.extend(child::command_line());
    let said = fill(&line, &path);
    let problem = said
        .lines()
        .find_map(|line| line.strip_prefix("problem "))
        .unwrap();
    let (slowest_us, why) = problem.split_once(' ').unwrap();
    assert!(why.contains("File too large"), "{why}");
    assert!(
        slowest_us.parse::<u64>().unwrap() < 100_000,
        "noting took {slowest_us} us"
    );
    let finish = said
        .lines()
        .find_map(|line| line.strip_prefix("finish "))
        .unwrap();
    assert!(
        finish.contains("recording stopped") && finish.contains("limited.mcap"),
        "{finish}"
    );

    let (mut read, mut at_us) = (0, 0);
    for entry in Reading::open(&path).unwrap() {
        let entry = entry.unwrap();
        assert_eq!(entry, child::entry(read, entry.at_us()));
        (read, at_us) = (read + 1, entry.at_us());
    }
    let bytes = path.metadata().unwrap().len();
    assert!(
        bytes <= 300 * 1024,
        "{bytes} bytes where 300 blocks are allowed"
    );
    assert!(
        read > 100,
        "{read} entries until {at_us} us in {bytes} bytes"
    );
    let noted = child::last_noted(said.as_bytes()).unwrap();
    assert!(
        noted.1 >= at_us + 1_000_000,
        "it went on until {} us",
        noted.1
    );
}

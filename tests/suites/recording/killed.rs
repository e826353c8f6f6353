//! `kill -9` at any moment: the file is readable, and at most a second is lost.

use std::path::Path;
use std::time::Duration;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus::recording::{End, Reading, recover};

use crate::child;

/// At most so much may be lost, microseconds.
const LOST_US: u64 = 1_000_000;

#[test]
fn a_killed_program_leaves_a_readable_file_and_loses_at_most_a_second() {
    let kills: u64 = if std::env::var_os("TONUS_FULL").is_some() {
        200
    } else {
        20
    };
    let folder = tempfile::tempdir().unwrap();
    // Four at a time: they sleep most of the time.
    let mut lost_us: Vec<u64> = std::thread::scope(|scope| {
        let workers: Vec<_> = (0..4)
            .map(|worker| {
                let folder = folder.path();
                let numbers = (0..kills).filter(move |number| number % 4 == worker);
                scope.spawn(move || numbers.map(|number| kill(folder, number)).collect())
            })
            .collect();
        let lost = workers.into_iter().map(|worker| worker.join().unwrap());
        lost.flat_map(|lost: Vec<u64>| lost).collect()
    });
    lost_us.sort_unstable();
    let (median, worst) = (lost_us[lost_us.len() / 2], lost_us[lost_us.len() - 1]);
    println!("{kills} kills: lost {median} us in the middle, {worst} us at worst");
    assert!(worst <= LOST_US, "{worst} us were lost");
    // Something is in memory at most moments: where nothing is ever lost, nobody was killed.
    assert!(median > 1000, "{median} us were lost in the middle");
}

/// Kills one and says how much of what it had noted is not in the file, microseconds.
fn kill(folder: &Path, number: u64) -> u64 {
    let mut random = ChaCha8Rng::seed_from_u64(number);
    let path = folder.join(format!("{number}.mcap"));
    let (mut running, out) = child::start(&child::command_line(), &path);
    let listening = std::thread::spawn(move || child::last_noted(out));
    while !path.exists() {
        std::thread::sleep(Duration::from_millis(1));
    }
    std::thread::sleep(Duration::from_micros(random.random_range(0..2_500_000)));
    running.kill().unwrap();
    running.wait().unwrap();
    let noted = listening.join().unwrap();

    let opened = Reading::open(&path);
    let Some((count, last_us)) = noted else {
        // Killed before the first entry: nothing was recorded that could be lost.
        return 0;
    };
    let mut reading = opened.unwrap();
    assert_eq!(*reading.opening(), child::opening());
    let (mut read, mut read_us) = (0, 0);
    for entry in reading.by_ref() {
        let entry = entry.unwrap();
        assert_eq!(entry, child::entry(read, entry.at_us()));
        read += 1;
        read_us = entry.at_us();
    }
    assert!(matches!(reading.end(), Some(End::Cut { .. })));

    let mended = folder.join(format!("{number}-mended.mcap"));
    let recovered = recover(&path, &mended).unwrap();
    assert_eq!((recovered.messages, recovered.damaged), (read, 0));
    let mut reading = Reading::open(&mended).unwrap();
    let again = reading.by_ref().enumerate();
    for (number, entry) in again {
        let entry = entry.unwrap();
        assert_eq!(entry, child::entry(number as u64, entry.at_us()));
    }
    assert_eq!(reading.end(), Some(End::Closed));
    // The child may have noted one more than it could say.
    if read >= count {
        return 0;
    }
    last_us - read_us
}

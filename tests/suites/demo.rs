//! The whole chain on simulated people whose seeds were not used while it was built.

use std::ops::ControlFlow;
use std::process::Command;
use std::thread;

use tonus::demo::{DemoConfig, Report, learn_skills, perform};

/// Never run before the demo was finished; `tests/full` adds as many again.
const SEEDS: std::ops::RangeInclusive<u64> = 9_001..=9_020;
const MORE_SEEDS: std::ops::RangeInclusive<u64> = 9_021..=9_080;

fn report(seed: u64) -> Report {
    let config = DemoConfig {
        seed,
        ..DemoConfig::default()
    };
    assert!((config.loss - 0.05).abs() < 1e-12, "the stated packet loss");
    let model = learn_skills(&config).unwrap();
    perform(&config, &model, |_| ControlFlow::Continue(())).unwrap()
}

/// Two workers: the machine that runs the tests has two cores.
fn reports(seeds: &[u64]) -> Vec<Report> {
    let (one, other) = seeds.split_at(seeds.len() / 2);
    thread::scope(|scope| {
        let other = scope.spawn(|| other.iter().copied().map(report).collect::<Vec<_>>());
        let mut all: Vec<_> = one.iter().copied().map(report).collect();
        all.extend(other.join().unwrap());
        all
    })
}

fn share(right: usize, total: usize) -> f64 {
    right as f64 / total as f64
}

#[test]
fn recognises_with_semg_and_cannot_without() {
    let mut seeds: Vec<u64> = SEEDS.collect();
    if std::env::var_os("TONUS_FULL").is_some() {
        seeds.extend(MORE_SEEDS);
    }
    let reports = reports(&seeds);
    let actions = || reports.iter().flat_map(|report| &report.actions);
    let correct: usize = reports.iter().map(|report| report.correct).sum();
    let counted = actions().filter(|a| a.recognised == a.performed).count();
    assert_eq!(correct, counted);
    let total = actions().count();
    let lifts = || actions().filter(|a| a.performed.starts_with("lift_"));
    let without = lifts()
        .filter(|a| a.recognised_without_semg == a.performed)
        .count();
    let (with_semg, without_semg) = (share(correct, total), share(without, lifts().count()));
    let decided = actions().filter_map(|a| a.seconds_to_decision);
    let mut decided: Vec<f64> = decided.collect();
    decided.sort_by(f64::total_cmp);
    println!(
        "{} seeds, 5 % of packets lost: {correct} of {total} recognised ({with_semg:.3}); the three lifts from \
         positions alone {without} of {} ({without_semg:.3}); {} decided before the end, median after {:.2} s",
        seeds.len(),
        lifts().count(),
        decided.len(),
        decided[decided.len() / 2],
    );
    let mean = |of: fn(&Report) -> Option<f64>| {
        reports.iter().filter_map(of).sum::<f64>() / reports.len() as f64
    };
    println!(
        "robot {:.1} mm and {:.3} of the stiffness range from the truth (means of the runs' RMS)",
        1e3 * mean(|report| report.robot_rmse_m),
        mean(|report| report.stiffness_nrmse),
    );
    assert!(with_semg >= 0.95, "{with_semg}");
    assert!(without_semg <= 0.5, "{without_semg}");
    for report in &reports {
        let packets = report.packets;
        let lost = packets.lost as f64 / packets.sent as f64;
        assert!((0.03..0.07).contains(&lost), "{lost}");
        assert_eq!(packets.corrupt, 0, "this link loses, it does not corrupt");
        let latency = report.latency_ms.unwrap();
        // One interval of delay and up to one of jitter, 15 ms, and the millisecond in which it is noticed.
        assert!(
            latency.p50 <= latency.p99 && latency.p99 <= 16.0,
            "{latency:?}"
        );
    }
}

#[test]
fn one_seed_prints_the_same_json_twice_and_another_does_not() {
    let run = |seed: &str| {
        let output = Command::new(tonus_tests::program())
            .args(["--json", "demo", "--seconds", "20", "--seed", seed])
            .output()
            .unwrap();
        assert!(
            output.status.success(),
            "{}",
            String::from_utf8_lossy(&output.stderr)
        );
        String::from_utf8(output.stdout).unwrap()
    };
    let first = run("31");
    assert_eq!(first, run("31"));
    assert_ne!(first, run("32"));
    let report: serde_json::Value = serde_json::from_str(&first).unwrap();
    for key in [
        "actions",
        "correct",
        "total",
        "accuracy_without_semg",
        "stiffness_nrmse",
        "robot_rmse_m",
        "packets",
        "latency_ms",
    ] {
        assert!(report.get(key).is_some(), "no `{key}` in {first}");
    }
    let action = &report["actions"][0];
    for key in [
        "performed",
        "recognised",
        "posterior",
        "seconds_to_decision",
    ] {
        assert!(action.get(key).is_some(), "no `{key}` in {action}");
    }
}

#[test]
fn the_run_ends_when_it_is_told_to() {
    let config = DemoConfig {
        seed: 3,
        seconds: Some(8.0),
        ..DemoConfig::default()
    };
    let model = learn_skills(&config).unwrap();
    let mut last_us = 0;
    let report = perform(&config, &model, |snapshot| {
        last_us = snapshot.now_us;
        ControlFlow::Continue(())
    })
    .unwrap();
    // Two actions of 2 s after pauses of 1.5 s.
    assert_eq!((report.total, last_us), (2, 7_980_000));
    let mut looks = 0;
    let broken = perform(&config, &model, |_| {
        looks += 1;
        ControlFlow::Break(())
    })
    .unwrap();
    assert_eq!((broken.total, looks), (0, 1));
}

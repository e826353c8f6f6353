//! `tonus demo`: the whole chain on a simulated wearer, live in the terminal or headless.

use std::io::{IsTerminal, stderr, stdin, stdout};
use std::ops::ControlFlow;

use anyhow::bail;
use tonus::demo::{self, DemoConfig, Report};

use super::progress::Progress;
use super::view::View;
use super::{UsageError, say};

const EXAMPLE: &str = "Examples:
  tonus demo                            watch it in the terminal (q or Ctrl-C ends it)
  tonus demo --headless --seed 7 --json as fast as possible, one JSON document

Keys of the JSON: seed, actions[] (performed, recognised, posterior, seconds_to_decision, decided,
recognised_without_semg, unknown, nearest, distance), correct, total, false_alarms, outside[] (performed,
named_unknown, seconds_to_unknown, nearest, distance, held, moved_m: what is in no demonstration),
accuracy_without_semg (the three lifts), stiffness_nrmse, robot_rmse_m, packets (sent, lost, corrupt), latency_ms
(p50, p99). Start and duration of each movement are announced to the recogniser unless --inferred; latency is
virtual time from the newest scan to the command.";

/// Watch the whole chain work on simulated people: learn, recognise, follow.
#[derive(clap::Args, Default, PartialEq)]
#[command(after_help = EXAMPLE)]
pub(crate) struct DemoArgs {
    /// Run as fast as possible without the terminal view (the default where there is no terminal).
    #[arg(long)]
    headless: bool,
    /// End the run after this much of its time, seconds.
    #[arg(long, value_name = "N")]
    seconds: Option<f64>,
    /// Everything random follows from it [default: 1].
    #[arg(long, value_name = "S")]
    seed: Option<u64>,
    /// Infer when each movement begins and how long it takes, instead of announcing both; the person rests before and after
    /// each way then.
    #[arg(long)]
    inferred: bool,
}

impl DemoArgs {
    pub(crate) fn run(self, json: bool) -> anyhow::Result<()> {
        if self.seconds.is_some_and(|s| !(s.is_finite() && s > 0.0)) {
            bail!(UsageError("--seconds takes a number above zero"));
        }
        let default = DemoConfig::default();
        let config = DemoConfig {
            seed: self.seed.unwrap_or(default.seed),
            seconds: self.seconds,
            inferred: self.inferred,
            ..default
        };
        let live = !self.headless && !json && stdin().is_terminal() && stdout().is_terminal();
        let visible = !json && stderr().is_terminal();
        let learning = Progress::spinner("learning from simulated demonstrations", visible);
        let library = demo::learn_skills(&config)?;
        learning.finish();
        let report = if live {
            let mut view = View::open()?;
            let report = demo::perform(&config, &library, |snapshot| view.show(snapshot));
            view.close()?;
            report?
        } else {
            let progress = Progress::bar("performing", visible);
            let report = demo::perform(&config, &library, |snapshot| {
                progress.at(snapshot.now_us, snapshot.end_us);
                ControlFlow::Continue(())
            });
            progress.finish();
            report?
        };
        if json {
            say(&format!("{}\n", serde_json::to_string_pretty(&report)?))
        } else {
            say(&text(&report, config.inferred))
        }
    }
}

/// What the person did that no demonstration shows.
fn outside(out: &mut String, report: &Report) {
    use std::fmt::Write as _;
    if report.outside.is_empty() {
        return;
    }
    out.push_str("\nIn no demonstration:\n\n  performed      named unknown  nearest        distance  robot held  had moved\n");
    for action in &report.outside {
        let named = action
            .seconds_to_unknown
            .map_or("never".to_owned(), |s| format!("after {s:.2} s"));
        let _infallible = writeln!(
            out,
            "{} {:<14} {named:>13}  {:<14} {:>8}  {:>10}  {:>6.0} mm",
            if action.named_unknown { ' ' } else { '!' },
            action.performed,
            action.nearest.as_deref().unwrap_or("-"),
            action
                .distance
                .map_or("-".to_owned(), |d| format!("{d:.1}")),
            if action.held { "yes" } else { "no" },
            action.moved_m * 1e3,
        );
    }
}

/// The report for people.
fn text(report: &Report, inferred: bool) -> String {
    use std::fmt::Write as _;
    let told = if inferred { "inferred" } else { "known" };
    let mut out = format!(
        "Simulated wearer, recognised while moving (start and duration of each movement {told}):\n\n  \
         performed      recognised     posterior  decided after  positions alone\n",
    );
    for action in &report.actions {
        let wrong = if action.performed == action.recognised {
            ' '
        } else {
            '!'
        };
        let decided = action
            .seconds_to_decision
            .map_or("never".to_owned(), |s| format!("{s:.2} s"));
        let _infallible = writeln!(
            out,
            "{wrong} {:<14} {:<14} {:>9.4}  {decided:>13}  {}{}",
            action.performed,
            action.recognised,
            action.posterior,
            action.recognised_without_semg,
            if action.unknown {
                " (held: taken for unknown)"
            } else {
                ""
            },
        );
    }
    outside(&mut out, report);
    let share =
        |value: Option<f64>| value.map_or("-".to_owned(), |v| format!("{:.0} %", v * 100.0));
    let _infallible = writeln!(
        out,
        "\nrecognised            {} of {} (the three lifts from positions alone: {})",
        report.correct,
        report.total,
        share(report.accuracy_without_semg),
    );
    let named = report.outside.iter().filter(|a| a.named_unknown).count();
    let held = report.outside.iter().filter(|a| a.held).count();
    let _infallible = writeln!(
        out,
        "not in the library    {named} of {} named so, the robot held in {held}; {} of the {} known taken for it",
        report.outside.len(),
        report.false_alarms,
        report.total,
    );
    if let (Some(stiffness), Some(path_m)) = (report.stiffness_nrmse, report.robot_rmse_m) {
        let _infallible = writeln!(
            out,
            "robot                 {:.1} mm from where it should be, stiffness within {:.1} % of its range (RMS)",
            path_m * 1e3,
            stiffness * 100.0,
        );
    }
    let packets = report.packets;
    let _infallible = writeln!(
        out,
        "packets               {} sent, {} lost, {} corrupt",
        packets.sent, packets.lost, packets.corrupt
    );
    if let Some(latency) = report.latency_ms {
        let _infallible = writeln!(
            out,
            "scan to command       {:.1} ms median, {:.1} ms at the 99th percentile (virtual time)",
            latency.p50, latency.p99
        );
    }
    out
}

//! What was found on recordings of real people.

use std::fmt::Write as _;

use serde_json::Value;

use super::text::{items, number, round, words};

/// Everything of them.
pub(super) fn tables(out: &mut String, found: &Value) {
    for set in items(found, "sets") {
        recording(out, set);
    }
    line(out, "All of these together, tempered on training parts");
    calibration(out, found);
    line(
        out,
        "Each class left out of the library in turn (2 % false alarms asked for)",
    );
    for one in items(found, "novelty") {
        novelty(out, one);
    }
    out.push('\n');
}

fn line(out: &mut String, text: &str) {
    out.push_str(text);
    out.push('\n');
}

fn recording(out: &mut String, found: &Value) {
    let _infallible = writeln!(
        out,
        "{}: {} ({} classes, {} demonstrations, {} observations), duration known",
        words(found, "name"),
        words(found, "held_out"),
        round(number(found, "classes")),
        round(number(found, "demonstrations")),
        round(number(found, "observations")),
    );
    line(
        out,
        "  chosen on the training part alone; weights in the mixture, temperatures after 20, 30, 50, 100 %",
    );
    for one in items(found, "chosen") {
        chosen(out, one);
    }
    if let Some(training) = found.get("training") {
        let _infallible = writeln!(out, "  training (no accuracy)  {}", score(training));
    }
    let known = found.get("unknown_tempo").unwrap_or(&Value::Null);
    let onset = format!("part seen, tempo unknown, onset {}", words(known, "onset"));
    for (of, key, what) in [
        (found, "by_fraction", "part of the movement seen"),
        (known, "by_fraction", onset.as_str()),
        (
            found,
            "by_observations",
            "observations: one against several",
        ),
        (found, "by_noise_m", "m of white noise on positions"),
    ] {
        let _infallible = writeln!(out, "  by {what}");
        for point in items(of, key) {
            let _infallible = writeln!(out, "  {:>6}  {}", number(point, "at"), score(point));
        }
    }
    in_runs(out, items(known, "chosen"));
    line(out, "  calibration");
    calibration(out, found);
    decided(out, found);
    others(out, found);
    out.push('\n');
}

fn decided(out: &mut String, found: &Value) {
    if let Some(decision) = found.get("decision") {
        let of = |key: &str| number(decision, key);
        let median_s = decision.get("median_time_s").and_then(Value::as_f64);
        let after = median_s.map_or_else(String::new, |s| format!(", median after {s:.2} s"));
        let _infallible = writeln!(
            out,
            "  decided at {:.0} %: {} of {}, {} wrong{after}",
            100.0 * of("confidence"),
            round(of("decided")),
            round(of("total")),
            round(of("wrong")),
        );
    }
}

fn others(out: &mut String, found: &Value) {
    line(
        out,
        "  other methods, whole movement                   right, %  log-loss",
    );
    for row in items(found, "others") {
        let cell = |name: &str, scale: f64, digits: usize| {
            let value = row.get(name).and_then(Value::as_f64);
            value.map_or_else(|| "-".to_owned(), |v| format!("{:.digits$}", v * scale))
        };
        let _infallible = writeln!(
            out,
            "  {:46} {:>9} {:>9}",
            words(row, "method"),
            cell("accuracy", 100.0, 1),
            cell("log_loss", 1.0, 3),
        );
    }
}

fn in_runs(out: &mut String, chosen: &[Value]) {
    if chosen.is_empty() {
        return;
    }
    line(
        out,
        "  watched with the tempo unknown, log-loss on what the training part leaves out in turn (* is taken)",
    );
    for one in chosen {
        watched(out, one);
    }
}

fn watched(out: &mut String, one: &Value) {
    let _infallible = writeln!(out, "    {}", words(one, "part"));
    let taken = one.get("watched").and_then(Value::as_u64);
    for (place, tried) in (0..).zip(items(one, "tried")) {
        let _infallible = writeln!(
            out,
            "    {} {:.4}  {}",
            if taken == Some(place) { '*' } else { ' ' },
            number(tried, "log_loss"),
            words(tried, "name"),
        );
    }
    let mixture = items(one, "mixture");
    if let Some(heaviest) = mixture.first() {
        let of = |key: &str| number(heaviest, key);
        let _infallible = writeln!(
            out,
            "      {} settings, weights up to {:.3}: by {}, K {}, placement {} m, sigma {} m",
            mixture.len(),
            of("weight"),
            words(heaviest, "phase"),
            round(of("functions")),
            of("placement_m"),
            of("sigma_m"),
        );
    }
}

fn chosen(out: &mut String, one: &Value) {
    let _infallible = writeln!(
        out,
        "    {}: temperatures {}",
        words(one, "part"),
        listed(one, "temperatures"),
    );
    for member in items(one, "mixture") {
        let of = |key: &str| number(member, key);
        let shares = match items(member, "shares") {
            [pooled, diagonal] => format!("shares {pooled} and {diagonal}"),
            _ => "shares by likelihood".to_owned(),
        };
        let freedom = member.get("freedom").and_then(Value::as_f64);
        let freedom = freedom.map_or_else(String::new, |f| format!(", freedom {f}"));
        let _infallible = writeln!(
            out,
            "      weights {}: {}, phase by {}, K {}, ridge {}, placement {} m, {shares}{freedom}, sigma {} m",
            listed(member, "weights"),
            words(member, "ways").replace('_', " "),
            words(member, "phase"),
            round(of("functions")),
            of("ridge"),
            of("placement_m"),
            of("sigma_m"),
        );
    }
}

fn listed(of: &Value, key: &str) -> String {
    let numbers = items(of, key).iter();
    let numbers = numbers.map(|n| format!("{:.2}", n.as_f64().unwrap_or(f64::NAN)));
    numbers.collect::<Vec<_>>().join(" ")
}

fn calibration(out: &mut String, found: &Value) {
    for one in items(found, "calibration") {
        let of = |key: &str| number(one, key);
        let raw = one.get("untempered").unwrap_or(&Value::Null);
        let _infallible = writeln!(
            out,
            "  {:<15} calibration error {:.3} (by chance {:.3}), log-loss {:.3}; untempered {:.3}, {:.3}",
            words(one, "name"),
            of("expected_calibration_error"),
            of("by_chance"),
            of("log_loss"),
            number(raw, "expected_calibration_error"),
            number(raw, "log_loss"),
        );
    }
}

fn novelty(out: &mut String, one: &Value) {
    let of = |key: &str| number(one, key);
    let _infallible = writeln!(
        out,
        "  {}: {} of {} named unknown ({:.1} %), {} of {} false alarms ({:.1} %), AUROC {:.3}",
        words(one, "name"),
        round(of("named_unknown")),
        round(of("novel")),
        100.0 * of("named_unknown_share"),
        round(of("false_alarms")),
        round(of("known")),
        100.0 * of("false_alarm_share"),
        of("auroc"),
    );
    for pair in items(one, "nearest") {
        let _infallible = writeln!(
            out,
            "    instead of {}: {} ({} of {})",
            words(pair, "class"),
            words(pair, "nearest"),
            round(number(pair, "movements")),
            round(number(pair, "total")),
        );
    }
}

fn score(point: &Value) -> String {
    let of = |name: &str| number(point, name);
    format!(
        "{} of {} ({:.1} %), log-loss {:.3}",
        round(of("correct")),
        round(of("total")),
        100.0 * of("accuracy"),
        of("log_loss"),
    )
}

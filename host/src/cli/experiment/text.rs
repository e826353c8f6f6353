//! Results as tables for people, read from the JSON document so that means of many seeds look the same.

use std::fmt::Write as _;

use serde_json::Value;

/// Tables of everything in the document.
pub(super) fn tables(document: &Value) -> String {
    let mut out = String::new();
    if let Some(seeds) = document.get("seeds").and_then(Value::as_array) {
        line(&mut out, &format!("Means of {} seeds", seeds.len()));
    }
    if let Some(found) = document.get("hand_over") {
        hand_over(&mut out, found);
    }
    if let Some(found) = document.get("object_matching") {
        object_matching(&mut out, found);
    }
    if let Some(found) = document.get("pick_and_place") {
        pick_and_place(&mut out, found);
    }
    if let Some(found) = document.get("baselines") {
        super::methods::tables(&mut out, found);
    }
    if let Some(found) = document.get("recordings") {
        super::real_people::tables(&mut out, found);
    }
    out
}

fn line(out: &mut String, text: &str) {
    out.push_str(text);
    out.push('\n');
}

/// The number below these keys; NaN where there is none.
pub(super) fn number(found: &Value, path: &str) -> f64 {
    let at = path
        .split('.')
        .try_fold(found, |value, key| match key.parse::<usize>() {
            Ok(index) => value.get(index),
            Err(_) => value.get(key),
        });
    at.and_then(Value::as_f64).unwrap_or(f64::NAN)
}

pub(super) fn items<'v>(found: &'v Value, key: &str) -> &'v [Value] {
    found
        .get(key)
        .and_then(Value::as_array)
        .map_or(&[], Vec::as_slice)
}

pub(super) fn words<'v>(found: &'v Value, key: &str) -> &'v str {
    found.get(key).and_then(Value::as_str).unwrap_or_default()
}

/// `149 of 150 (99.3 %), log-loss 0.012`.
fn score(found: &Value, key: &str) -> String {
    let of = |name: &str| number(found, &format!("{key}.{name}"));
    format!(
        "{} of {} ({:.1} %), log-loss {:.3}",
        round(of("correct")),
        round(of("total")),
        100.0 * of("accuracy"),
        of("log_loss"),
    )
}

/// Means of counts have a fraction.
pub(super) fn round(count: f64) -> String {
    if count.fract() == 0.0 {
        format!("{count:.0}")
    } else {
        format!("{count:.2}")
    }
}

fn hand_over(out: &mut String, found: &Value) {
    line(
        out,
        "Hand-over: the robot's part inferred from the person's; new motions, half of them between the",
    );
    line(
        out,
        "demonstrated cases; tracker jitter without slow bias. Target: (c) median end-point error at most",
    );
    line(
        out,
        "10 mm, 95 % intervals of every DoF cover 92 to 98 %.\n",
    );
    line(
        out,
        "                                                        end point  path RMS  stiffness  95 % covers  (DoFs)",
    );
    for (scheme, what) in [
        ("a", "x-y at 2 s"),
        ("b", "x-y and stiffness at 2 s"),
        ("c", "x-y and stiffness at 1.4, 1.6, 1.8, 2 s"),
    ] {
        let of = |name: &str| number(found, &format!("{scheme}.{name}"));
        let by_dof = found.get(scheme).and_then(|s| s.get("coverage_95_by_dof"));
        let shares: Vec<f64> = by_dof
            .and_then(Value::as_object)
            .map_or_else(Vec::new, |dofs| {
                dofs.values().filter_map(Value::as_f64).collect()
            });
        let least = shares.iter().copied().fold(f64::INFINITY, f64::min);
        let most = shares.iter().copied().fold(f64::NEG_INFINITY, f64::max);
        let _infallible = writeln!(
            out,
            "  ({scheme}) {what:<40} {:>4} motions {:>6.1} mm {:>6.1} mm {:>8.1} % {:>10.1} %  ({:.1} to {:.1} %)",
            round(of("motions")),
            1e3 * of("end_point_error_m"),
            1e3 * of("path_rmse_m"),
            100.0 * of("stiffness_nrmse"),
            100.0 * of("coverage_95"),
            100.0 * least,
            100.0 * most,
        );
    }
    six_motions(out, found);
    bias(out, found);
    unknown_end(out, found);
    hand_over_sweeps(out, found);
    out.push('\n');
}

fn six_motions(out: &mut String, found: &Value) {
    line(
        out,
        "\n  The paper's six new motions: end-point error (path RMS), mm, by scheme",
    );
    for motion in items(found, "six") {
        let of = |name: &str| number(motion, name);
        let place = if motion.get("between").and_then(Value::as_bool) == Some(true) {
            "between cases"
        } else {
            "demonstrated case"
        };
        let _infallible = write!(
            out,
            "  {} {place:<18} y {:.3} m ",
            round(of("index")),
            of("target_y_m")
        );
        for (scheme, name) in ["a", "b", "c"].iter().enumerate() {
            let _infallible = write!(
                out,
                "  ({name}) {:>5.1} ({:>4.1})",
                1e3 * of(&format!("end_point_error_m.{scheme}")),
                1e3 * of(&format!("path_rmse_m.{scheme}")),
            );
        }
        out.push('\n');
    }
}

/// Believing in a bias, and what a larger reach does.
fn bias(out: &mut String, found: &Value) {
    let bias = |name: &str| number(found, &format!("believing_in_bias.{name}"));
    let _infallible = writeln!(
        out,
        "\n  Reach in y and inferred stiffness in y: rank correlation {:.3}; {}\n  \
         A tracker that is off by {:.0} mm: path RMS {:.0} mm from one observation, {:.0} mm from four; robot position \
         covered {:.0} %, {:.0} %, {:.0} % when told of the bias\n",
        number(found, "reach_stiffness_correlation"),
        items(found, "stiffness_y_by_reach")
            .iter()
            .map(|r| format!(
                "{:.0} N/m at {:.2} m",
                number(r, "human_ky_n_per_m"),
                number(r, "target_y_m")
            ))
            .collect::<Vec<_>>()
            .join(", "),
        1e3 * bias("bias_sd_m"),
        1e3 * bias("path_rmse_one_m"),
        1e3 * bias("path_rmse_several_m"),
        100.0 * bias("coverage_95_one"),
        100.0 * bias("coverage_95_several"),
        100.0 * bias("coverage_95_several_told"),
    );
}

fn hand_over_sweeps(out: &mut String, found: &Value) {
    for (key, what) in [
        ("by_observations", "observations in the last third"),
        ("by_fraction", "of the movement seen"),
        ("by_noise_m", "m of noise on positions"),
    ] {
        let _infallible = writeln!(
            out,
            "  end point, mm (without sEMG), stiffness error, % (without), coverage, %, by {what}"
        );
        for point in items(found, key) {
            let of = |name: &str| number(point, name);
            let _infallible = writeln!(
                out,
                "  {:>5} {:>7.1} ({:>5.1}) {:>6.1} ({:>4.1}) {:>6.1}",
                of("at"),
                1e3 * of("end_point_error_m"),
                1e3 * of("end_point_error_without_semg_m"),
                100.0 * of("stiffness_nrmse"),
                100.0 * of("stiffness_nrmse_without_semg"),
                100.0 * of("coverage_95"),
            );
        }
    }
}

fn object_matching(out: &mut String, found: &Value) {
    line(
        out,
        "Object matching: new trials under the tracker's stated noise. Target: at least 98 % with sEMG, near chance",
    );
    line(
        out,
        "(33.3 %) without, robot stiffness within 10 % of its range where right.\n",
    );
    let _infallible = writeln!(
        out,
        "  with sEMG          {}\n  positions alone    {} (the best possible recogniser: {:.1} %)\n  demonstrations     {} \
         (no accuracy)\n  robot, where right stiffness {:.1} % of its range (positions alone {:.1} %), path {:.0} mm; 95 % \
         intervals cover {:.1} %\n  one observation    {}\n  ten observations   {}\n",
        score(found, "with_semg"),
        score(found, "without_semg"),
        100.0 * number(found, "best_possible_without_semg"),
        score(found, "training"),
        100.0 * number(found, "robot_stiffness_nrmse"),
        100.0 * number(found, "robot_stiffness_nrmse_without_semg"),
        1e3 * number(found, "robot_path_rmse_m"),
        100.0 * number(found, "coverage_95"),
        score(found, "one_against_ten.0"),
        score(found, "one_against_ten.1"),
    );
    unknown_tempo(out, found);
    sweeps(out, found);
}

fn pick_and_place(out: &mut String, found: &Value) {
    line(
        out,
        "Pick and place: 3 x 50 demonstrations, the one tested left out. Target: all of 150; 98 % on the first half; 97 %",
    );
    line(
        out,
        "with three observations; without labels three clusters, adjusted Rand index at least 0.99.\n",
    );
    for (key, what) in [
        ("leave_one_out", "ten observations"),
        ("first_half", "first half"),
        ("three_observations", "three observations"),
        ("training", "training (no accuracy)"),
    ] {
        let _infallible = writeln!(out, "  {what:<24} {}", score(found, key));
    }
    if let Some(clusters) = found.get("unlabelled") {
        let _infallible = writeln!(
            out,
            "  {:<24} {} clusters, adjusted Rand index {:.3}",
            "without labels",
            round(number(clusters, "components")),
            number(clusters, "adjusted_rand_index"),
        );
    }
    unknown_tempo(out, found);
    sweeps(out, found);
}

fn unknown_tempo(out: &mut String, found: &Value) {
    let Some(tempo) = found.get("unknown_tempo") else {
        return;
    };
    for (key, what) in [
        ("inferred", "tempo and onset inferred"),
        ("inferred_first_half", "  on the first half"),
        ("announced", "announced"),
        ("assumed", "taken as demonstrated"),
    ] {
        let _infallible = writeln!(out, "  {what:<24} {}", score(tempo, key));
    }
    duration_error(out, tempo);
}

fn duration_error(out: &mut String, tempo: &Value) {
    let _infallible = writeln!(
        out,
        "  {:<24} {:.1} % (RMS)\n",
        "error of the duration",
        100.0 * number(tempo, "duration_error")
    );
}

/// Where the hand will be at the end, foretold half-way.
fn unknown_end(out: &mut String, found: &Value) {
    let Some(tempo) = found.get("unknown_tempo") else {
        return;
    };
    line(
        out,
        "  Pulls at 0.7 to 1.4 times the demonstrated duration: the hand's end, foretold half-way",
    );
    for (key, what) in [
        ("inferred", "tempo and onset inferred"),
        ("announced", "announced"),
        ("assumed", "taken as demonstrated"),
    ] {
        let of = |name: &str| number(tempo, &format!("{key}.{name}"));
        let _infallible = writeln!(
            out,
            "  {what:<24} {:.1} mm, stiffness {:.1} % of its range, {} motions",
            1e3 * of("hand_end_point_error_m"),
            100.0 * of("hand_stiffness_nrmse"),
            round(of("motions")),
        );
    }
    duration_error(out, tempo);
}

fn sweeps(out: &mut String, found: &Value) {
    for (key, what) in [
        ("by_fraction", "part of the movement seen"),
        ("by_observations", "observations"),
        ("by_noise_m", "m of white noise on positions"),
    ] {
        let _infallible = writeln!(
            out,
            "  by {what:<32} with sEMG                          positions alone"
        );
        for point in items(found, key) {
            let _infallible = writeln!(
                out,
                "  {:>6}  {:<44} {}",
                number(point, "at"),
                score(point, "with_semg"),
                score(point, "without_semg"),
            );
        }
    }
    out.push('\n');
}

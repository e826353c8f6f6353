//! Tables of other methods on the same data.

use std::fmt::Write as _;

use serde_json::Value;

/// One table for each experiment.
pub(super) fn tables(out: &mut String, found: &Value) {
    for (key, what) in [
        (
            "hand_over",
            "Hand-over, x-y and stiffness at 1.4, 1.6, 1.8 and 2 s: one skill, nothing to recognise",
        ),
        (
            "object_matching",
            "Object matching, ten observations of the whole movement",
        ),
        (
            "pick_and_place",
            "Pick and place, ten observations of the first half, five folds",
        ),
    ] {
        let _infallible = writeln!(
            out,
            "{what}\n\n  {:46} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8}",
            "", "right, %", "log-loss", "end, mm", "path, mm", "stiff., %", "cover, %"
        );
        for row in found
            .get(key)
            .and_then(Value::as_array)
            .into_iter()
            .flatten()
        {
            let cell = |name: &str, scale: f64, digits: usize| {
                let value = row.get(name).and_then(Value::as_f64);
                value.map_or_else(|| "-".to_owned(), |v| format!("{:.digits$}", v * scale))
            };
            let _infallible = writeln!(
                out,
                "  {:46} {:>8} {:>8} {:>8} {:>8} {:>9} {:>8}",
                row.get("method")
                    .and_then(Value::as_str)
                    .unwrap_or_default(),
                cell("accuracy", 100.0, 1),
                cell("log_loss", 1.0, 3),
                cell("end_point_error_m", 1e3, 1),
                cell("path_rmse_m", 1e3, 1),
                cell("stiffness_nrmse", 100.0, 1),
                cell("coverage_95", 100.0, 1),
            );
        }
        out.push('\n');
    }
}

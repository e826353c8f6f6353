//! What is watched where nobody says how fast somebody moves.

use serde_json::Value;

use super::{SETS, header, items, words};
use crate::report::html::{Cell, Table};
use crate::report::tables::number;

/// A row for each choice on each training part.
pub(super) fn table(document: &Value, sets: &[Value]) -> Table {
    let mut rows = Vec::new();
    for (i, set) in sets.iter().enumerate() {
        for (j, one) in items(set, "/unknown_tempo/chosen").iter().enumerate() {
            let taken = one.get("watched").and_then(Value::as_u64);
            for (place, tried) in (0..).zip(items(one, "/tried")) {
                let path = format!("{SETS}.{i}.unknown_tempo.chosen.{j}.tried.{place}.log_loss");
                let mark = if taken == Some(place) { "taken" } else { "" };
                rows.push(vec![
                    words(set, "held_out"),
                    words(one, "part"),
                    words(tried, "name"),
                    number(document, &path),
                    Cell::Text(mark.to_owned()),
                ]);
            }
        }
    }
    Table {
        id: "table-recordings-watched",
        title: "Six actions, tempo and onset unknown: what is watched".to_owned(),
        caption: "Log-loss on runs that the training part leaves out in turn, models and weights both without them. By path: \
                  the length of the hand's path in place of the time. The upper arm is where the elbow is from the shoulder, as a \
                  wearable's attitude sensor tells."
            .to_owned(),
        header: header(&["held out", "training part", "watched", "log-loss", ""]),
        rows,
    }
}

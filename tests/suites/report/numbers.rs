//! Numbers on the page are those of the JSON document.

use std::collections::BTreeMap;

use roxmltree::{Document, Node};
use serde_json::{Number, Value};

use super::{attribute, named};

/// Numbers of a document by their dotted paths.
fn leaves(path: &str, value: &Value, into: &mut BTreeMap<String, Number>) {
    let below = |key: &str| {
        let dot = if path.is_empty() { "" } else { "." };
        format!("{path}{dot}{key}")
    };
    match value {
        Value::Number(number) => {
            into.insert(path.to_owned(), number.clone());
        }
        Value::Array(items) => {
            for (place, item) in items.iter().enumerate() {
                leaves(&below(&place.to_string()), item, into);
            }
        }
        Value::Object(keys) => {
            for (key, item) in keys {
                leaves(&below(key), item, into);
            }
        }
        Value::Null | Value::Bool(_) | Value::String(_) => {}
    }
}

/// Half a unit of the last place that is shown.
fn rounding(shown: &str) -> f64 {
    let (digits, power) = shown.split_once('e').unwrap_or((shown, "0"));
    let decimals = digits.split_once('.').map_or(0, |(_, after)| after.len());
    let power: i32 = power.parse().expect("a power of ten");
    0.5 * 10_f64.powi(power - i32::try_from(decimals).expect("few"))
}

/// Every number in a table is the document's at its path, rounded where it is shown; the last table has them all.
/// Returns how many numbers the tables have.
pub(super) fn agree(page: &Document, found: &Value) -> usize {
    let mut expected = BTreeMap::new();
    leaves("", found, &mut expected);
    assert!(expected.len() > 50, "{} numbers", expected.len());

    let cells: Vec<Node> = named(page.root(), "td");
    let cells = cells
        .into_iter()
        .filter(|cell| cell.has_attribute("data-key"));
    let mut shown = 0;
    for cell in cells {
        let (key, value) = (attribute(cell, "data-key"), attribute(cell, "data-value"));
        let number = expected.get(key);
        let number = number.unwrap_or_else(|| panic!("no {key} in the document"));
        assert_eq!(value, number.to_string(), "{key}");
        let text = cell.text().expect("a number is shown");
        let exact = number.as_f64().expect("a number");
        let off = (text.parse::<f64>().expect("a number") - exact).abs();
        assert!(
            off <= rounding(text) * (1.0 + 1e-9),
            "{key}: {text} for {value}"
        );
        shown += 1;
    }

    let everything = page.descendants();
    let mut everything = everything.filter(|node| node.attribute("id") == Some("table-numbers"));
    let everything = everything.next().expect("a table of all numbers");
    let keys = named(everything, "td");
    let mut keys: Vec<&str> = keys
        .iter()
        .filter_map(|cell| cell.attribute("data-key"))
        .collect();
    keys.sort_unstable();
    assert!(keys.iter().eq(expected.keys()), "each number once");
    shown
}

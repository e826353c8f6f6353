//! Whether probabilities mean what they say.

use serde_json::Value;

use super::{absent, key};
use crate::report::chart::{Ink, Mark, Panel, Series, Stroke, class};
use crate::report::html::Figure;

const HONEST: Mark = Mark::Line(Ink::Grey, Stroke::Dotted, 1.6);

/// Every `reliability` list of the document: bins of `confidence`, `accuracy` and `count`.
pub(super) fn figure(document: &Value) -> Figure {
    let id = "fig-reliability";
    let title = "Reliability: confidence against accuracy";
    let mut found = Vec::new();
    collect("", document, &mut found);
    if found.is_empty() {
        return absent(id, title);
    }
    let mark = |i: usize| {
        let (ink, stroke, shape) = class(i);
        (Mark::Line(ink, stroke, 1.6), Mark::Dots(ink, shape, 4.5))
    };
    let mut series = vec![Series::new(HONEST, [(0.0, 0.0), (1.0, 1.0)])];
    for (i, (_, bins)) in found.iter().enumerate() {
        let (line, dots) = mark(i);
        series.extend([
            Series::new(line, bins.clone()),
            Series::new(dots, bins.clone()),
        ]);
    }
    let mut panel = Panel::new(
        "answers by confidence",
        "mean probability given to the answer, 0 to 1",
        "accuracy, share right",
        series,
    );
    panel.y_range = Some((0.0, 1.0));
    panel.size = (560.0, 420.0);
    let mut keys = vec![key(HONEST, "honest")];
    let names = found.iter().enumerate();
    keys.extend(names.map(|(i, (name, _))| key(mark(i).0, name)));
    Figure {
        id,
        title: title.to_owned(),
        caption: "Answers in bins of equal count by the probability they were given with, against the share that was \
                  right. Below the dotted line an answer is more certain than it is right."
            .to_owned(),
        keys,
        panels: vec![panel],
        columns: 1,
        ..Figure::default()
    }
}

fn collect(path: &str, value: &Value, found: &mut Vec<(String, Vec<(f64, f64)>)>) {
    match value {
        Value::Object(keys) => {
            for (name, below) in keys {
                if let (true, Some(bins)) = (name == "reliability", below.as_array()) {
                    let number = |bin: &Value, key: &str| bin.get(key)?.as_f64();
                    let point =
                        |bin: &Value| Some((number(bin, "confidence")?, number(bin, "accuracy")?));
                    let points: Vec<_> = bins.iter().filter_map(point).collect();
                    if !points.is_empty() {
                        found.push((path.replace(['.', '_'], " "), points));
                    }
                    continue;
                }
                let path = if path.is_empty() {
                    name.clone()
                } else {
                    format!("{path}.{name}")
                };
                collect(&path, below, found);
            }
        }
        Value::Array(items) => {
            for (i, below) in items.iter().enumerate() {
                let name = below
                    .get("name")
                    .and_then(Value::as_str)
                    .map_or(i.to_string(), str::to_owned);
                collect(&format!("{path}.{name}"), below, found);
            }
        }
        _ => {}
    }
}

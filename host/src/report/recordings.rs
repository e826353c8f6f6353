//! Tables of what was found on recordings of real people.

mod watched;

use serde_json::Value;

use super::html::{Cell, Table};
use super::tables::number;

const SETS: &str = "recordings.sets";

/// Those of what was run.
pub(super) fn tables(document: &Value) -> Vec<Table> {
    let sets = items(document, "/recordings/sets");
    if sets.is_empty() {
        return Vec::new();
    }
    let all = [
        recognition(document, sets),
        less_known(document, sets),
        watched::table(document, sets),
        chosen(document, sets),
        temperatures(document, sets),
        calibration(document, sets),
        decisions(document, sets),
        others(document, sets),
        novelty(document),
        nearest(document),
    ];
    all.into_iter()
        .filter(|table| !table.rows.is_empty())
        .collect()
}

fn items<'v>(document: &'v Value, pointer: &str) -> &'v [Value] {
    let list = document.pointer(pointer).and_then(Value::as_array);
    list.map(Vec::as_slice).unwrap_or_default()
}

fn words(of: &Value, key: &str) -> Cell {
    Cell::Text(
        of.get(key)
            .and_then(Value::as_str)
            .unwrap_or_default()
            .to_owned(),
    )
}

fn header(names: &[&str]) -> Vec<String> {
    names.iter().map(|name| (*name).to_owned()).collect()
}

/// A row for each recording: its name, how it was held out, and these numbers.
fn of_each(document: &Value, sets: &[Value], keys: &[&str]) -> Vec<Vec<Cell>> {
    let row = |(i, set): (usize, &Value)| {
        let numbers = keys
            .iter()
            .map(|key| number(document, &format!("{SETS}.{i}.{key}")));
        [words(set, "name"), words(set, "held_out")]
            .into_iter()
            .chain(numbers)
            .collect()
    };
    sets.iter().enumerate().map(row).collect()
}

fn recognition(document: &Value, sets: &[Value]) -> Table {
    let names = [
        "recording",
        "held out",
        "classes",
        "training",
        "of",
        "first 20 %",
        "first 30 %",
        "first 50 %",
        "whole",
        "of",
        "log-loss, whole",
    ];
    let keys = [
        "classes",
        "training.correct",
        "training.total",
        "by_fraction.0.correct",
        "by_fraction.1.correct",
        "by_fraction.2.correct",
        "by_fraction.3.correct",
        "demonstrations",
        "by_fraction.3.log_loss",
    ];
    Table {
        id: "table-recordings",
        title: "Recordings of real people".to_owned(),
        caption: "Right answers; ten observations (digits: fifteen) in the first part of each movement, its duration \
                  known. Parts of digits are parts of the duration for some that answer, of the path's length for \
                  others."
            .to_owned(),
        header: header(&names),
        rows: of_each(document, sets, &keys),
    }
}

fn less_known(document: &Value, sets: &[Value]) -> Table {
    let names = [
        "recording",
        "held out",
        "tempo unknown, 30 %",
        "50 %",
        "whole",
        "known, one observation",
        "three",
        "ten",
        "of",
    ];
    let keys = [
        "unknown_tempo.by_fraction.0.correct",
        "unknown_tempo.by_fraction.1.correct",
        "unknown_tempo.by_fraction.2.correct",
        "by_observations.0.correct",
        "by_observations.2.correct",
        "by_observations.9.correct",
        "demonstrations",
    ];
    Table {
        id: "table-recordings-tempo",
        title: "Real people, tempo unknown; one observation against several".to_owned(),
        caption: "Right answers. With the tempo unknown the onset is found by the detector in the six actions, whose \
                  recordings go on, and announced in the others. A single observation is at the movement's end."
            .to_owned(),
        header: header(&names),
        rows: of_each(document, sets, &keys),
    }
}

fn chosen(document: &Value, sets: &[Value]) -> Table {
    let mut rows = Vec::new();
    for (i, set) in sets.iter().enumerate() {
        for (j, one) in items(set, "/chosen").iter().enumerate() {
            for (k, member) in items(one, "/mixture").iter().enumerate() {
                let path = format!("{SETS}.{i}.chosen.{j}.mixture.{k}");
                let of = |key: &str| number(document, &format!("{path}.{key}"));
                rows.push(vec![
                    words(set, "name"),
                    words(one, "part"),
                    words(member, "ways"),
                    words(member, "phase"),
                    of("functions"),
                    of("ridge"),
                    of("placement_m"),
                    of("shares.0"),
                    of("shares.1"),
                    of("freedom"),
                    of("sigma_m"),
                    of("weights.0"),
                    of("weights.1"),
                    of("weights.2"),
                    of("weights.3"),
                ]);
            }
        }
    }
    Table {
        id: "table-recordings-chosen",
        title: "What answers together, from each training part".to_owned(),
        caption: "Weights after a part of the movement, of least log-loss of what is left out of the training part in \
                  turn. Shares and degrees of freedom that are not given are those of greatest leave-one-out \
                  likelihood; with shares, none is a Gaussian."
            .to_owned(),
        header: header(&[
            "recording", "training part", "ways", "phase", "K", "ridge", "placement, m", "pooled", "diagonal",
            "freedom", "sigma, m", "weight, 20 %", "30 %", "50 %", "whole",
        ]),
        rows,
    }
}

fn temperatures(document: &Value, sets: &[Value]) -> Table {
    let mut rows = Vec::new();
    for (i, set) in sets.iter().enumerate() {
        for (j, one) in items(set, "/chosen").iter().enumerate() {
            let path = format!("{SETS}.{i}.chosen.{j}.temperatures");
            let of_parts = (0..4).map(|place| number(document, &format!("{path}.{place}")));
            let names = [
                words(set, "name"),
                words(set, "held_out"),
                words(one, "part"),
            ];
            rows.push(names.into_iter().chain(of_parts).collect());
        }
    }
    Table {
        id: "table-recordings-temperatures",
        title: "Temperatures, from each training part".to_owned(),
        caption:
            "Of the mixed probabilities, each setting's own tempered before: one over the mean of the inverse \
                  temperatures that what is left out of the training part in turn leaves possible, over which the \
                  probabilities are averaged."
                .to_owned(),
        header: header(&[
            "recording",
            "held out",
            "training part",
            "first 20 %",
            "first 30 %",
            "first 50 %",
            "whole",
        ]),
        rows,
    }
}

fn calibration(document: &Value, sets: &[Value]) -> Table {
    let keys = [
        "at",
        "total",
        "expected_calibration_error",
        "by_chance",
        "log_loss",
        "untempered.expected_calibration_error",
        "untempered.log_loss",
    ];
    let line = |first: [Cell; 2], path: &str| -> Vec<Cell> {
        let numbers = keys
            .iter()
            .map(|key| number(document, &format!("{path}.{key}")));
        first.into_iter().chain(numbers).collect()
    };
    let mut rows = Vec::new();
    for j in 0..items(document, "/recordings/calibration").len() {
        let name = ["all together", ""].map(|text| Cell::Text(text.to_owned()));
        rows.push(line(name, &format!("recordings.calibration.{j}")));
    }
    for (i, set) in sets.iter().enumerate() {
        for j in 0..items(set, "/calibration").len() {
            let name = [words(set, "name"), words(set, "held_out")];
            rows.push(line(name, &format!("{SETS}.{i}.calibration.{j}")));
        }
    }
    Table {
        id: "table-recordings-calibration",
        title: "Whether probabilities mean what they say".to_owned(),
        caption: "Expected calibration error in adaptive bins, about what chance alone makes it, and log-loss in nats; \
                  temperatures fitted on training parts alone."
            .to_owned(),
        header: header(&[
            "recording", "held out", "part seen", "answers", "calibration error", "by chance", "log-loss",
            "calibration error, untempered", "log-loss, untempered",
        ]),
        rows,
    }
}

fn decisions(document: &Value, sets: &[Value]) -> Table {
    let keys = ["confidence", "total", "decided", "wrong", "median_time_s"]
        .map(|key| format!("decision.{key}"));
    let keys: Vec<&str> = keys.iter().map(String::as_str).collect();
    Table {
        id: "table-recordings-decisions",
        title: "When an action is decided".to_owned(),
        caption: "The first observation after which a class is as probable as the confidence; duration known.".to_owned(),
        header: header(&[
            "recording", "held out", "confidence", "movements", "decided", "wrong", "median time, s",
        ]),
        rows: of_each(document, sets, &keys),
    }
}

fn others(document: &Value, sets: &[Value]) -> Table {
    let mut rows = Vec::new();
    for (i, set) in sets.iter().enumerate() {
        for (j, one) in items(set, "/others").iter().enumerate() {
            let of = |key: &str| number(document, &format!("{SETS}.{i}.others.{j}.{key}"));
            let names = [
                words(set, "name"),
                words(set, "held_out"),
                words(one, "method"),
            ];
            rows.push(
                names
                    .into_iter()
                    .chain([of("accuracy"), of("log_loss")])
                    .collect(),
            );
        }
    }
    Table {
        id: "table-recordings-others",
        title: "Real people, other methods".to_owned(),
        caption: "The whole movement, learnt from the training parts, phase by time, one way for each class.".to_owned(),
        header: header(&["recording", "held out", "method", "share right", "log-loss"]),
        rows,
    }
}

fn novelty(document: &Value) -> Table {
    let keys = [
        "novel",
        "named_unknown",
        "named_unknown_share",
        "known",
        "false_alarms",
        "false_alarm_share",
        "auroc",
    ];
    let all = items(document, "/recordings/novelty").iter().enumerate();
    let row = |(i, one): (usize, &Value)| {
        let numbers = keys
            .iter()
            .map(|key| number(document, &format!("recordings.novelty.{i}.{key}")));
        std::iter::once(words(one, "name")).chain(numbers).collect()
    };
    Table {
        id: "table-novelty",
        title: "Movements that no skill is".to_owned(),
        caption: "Each class left out of the library in turn; thresholds for 2 % false alarms, from the library alone."
            .to_owned(),
        header: header(&[
            "recording", "novel", "named unknown", "share", "known", "false alarms", "share", "AUROC",
        ]),
        rows: all.map(row).collect(),
    }
}

fn nearest(document: &Value) -> Table {
    let mut rows = Vec::new();
    for (i, set) in items(document, "/recordings/novelty").iter().enumerate() {
        for (j, one) in items(set, "/nearest").iter().enumerate() {
            let of = |key: &str| {
                number(
                    document,
                    &format!("recordings.novelty.{i}.nearest.{j}.{key}"),
                )
            };
            rows.push(vec![
                words(set, "name"),
                words(one, "class"),
                words(one, "nearest"),
                of("movements"),
                of("total"),
            ]);
        }
    }
    Table {
        id: "table-nearest",
        title: "What to do instead".to_owned(),
        caption: "The skill that most movements of a class left out are nearest to.".to_owned(),
        header: header(&["recording", "left out", "nearest skill", "movements", "of"]),
        rows,
    }
}

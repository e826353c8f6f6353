//! Tables from the results' JSON document.

use serde_json::Value;

use super::html::{Cell, Table};

/// The tables of what was run; those of what was not are left out.
pub(super) fn results(document: &Value) -> Vec<Table> {
    let tables = [
        recognition(document),
        hand_over(document),
        six(document),
        baselines(document),
    ];
    let recordings = super::recordings::tables(document);
    tables.into_iter().flatten().chain(recordings).collect()
}

/// Key of each row with its name, columns by key with their names.
struct Rows<'a> {
    rows: Vec<(String, String)>,
    columns: &'a [(&'a str, &'a str)],
}

impl Rows<'_> {
    /// Rows that the document has; none makes no table.
    fn table(
        &self,
        document: &Value,
        (id, title, caption): (&'static str, &str, &str),
    ) -> Option<Table> {
        let there = self
            .rows
            .iter()
            .filter(|(key, _)| at(document, key).is_some());
        let rows: Vec<_> = there
            .map(|(key, name)| {
                let cells = self.columns.iter().map(|(column, _)| {
                    let key = format!("{key}.{column}");
                    number(document, &key)
                });
                std::iter::once(Cell::Text(name.clone()))
                    .chain(cells)
                    .collect()
            })
            .collect();
        if rows.is_empty() {
            return None;
        }
        let names = self.columns.iter().map(|(_, name)| (*name).to_owned());
        Some(Table {
            id,
            title: title.to_owned(),
            caption: caption.to_owned(),
            header: std::iter::once(String::new()).chain(names).collect(),
            rows,
        })
    }
}

fn named(rows: &[(&str, &str)]) -> Vec<(String, String)> {
    let owned = rows.iter();
    owned
        .map(|(key, name)| ((*key).to_owned(), (*name).to_owned()))
        .collect()
}

fn recognition(document: &Value) -> Option<Table> {
    let rows = named(&[
        (
            "pick_and_place.leave_one_out",
            "pick and place, leave one out, 10 observations",
        ),
        (
            "pick_and_place.first_half",
            "… in the first half of the movement",
        ),
        ("pick_and_place.three_observations", "… 3 observations"),
        (
            "pick_and_place.training",
            "… training demonstrations (what the paper reports)",
        ),
        (
            "pick_and_place.unknown_tempo.inferred",
            "… tempo and onset inferred",
        ),
        (
            "pick_and_place.unknown_tempo.announced",
            "… the same movements, both announced",
        ),
        (
            "pick_and_place.unknown_tempo.assumed",
            "… the same movements, demonstrated tempo assumed",
        ),
        ("object_matching.with_semg", "object matching, with sEMG"),
        ("object_matching.without_semg", "… from positions alone"),
        ("object_matching.training", "… training demonstrations"),
        (
            "object_matching.unknown_tempo.inferred",
            "… tempo and onset inferred",
        ),
        (
            "object_matching.unknown_tempo.announced",
            "… the same lifts, both announced",
        ),
        (
            "object_matching.unknown_tempo.assumed",
            "… the same lifts, demonstrated tempo assumed",
        ),
    ]);
    let columns = &[
        ("correct", "right"),
        ("total", "of"),
        ("accuracy", "accuracy, share"),
        ("log_loss", "log-loss, nats"),
    ];
    Rows { rows, columns }.table(
        document,
        (
            "table-recognition",
            "Recognition",
            "How often the skill was named, and the mean of minus the logarithm of the probability given to the right \
             one (chance of three classes: 1.10 nats).",
        ),
    )
}

fn hand_over(document: &Value) -> Option<Table> {
    let rows = named(&[
        ("hand_over.a", "(a) x-y at 2 s"),
        ("hand_over.b", "(b) x-y and stiffness at 2 s"),
        ("hand_over.c", "(c) x-y and stiffness at 1.4, 1.6, 1.8, 2 s"),
    ]);
    let columns = &[
        ("motions", "new motions"),
        ("between", "of them between cases"),
        ("end_point_error_m", "end-point error, median, m"),
        ("path_rmse_m", "path RMSE, median, m"),
        ("stiffness_nrmse", "stiffness error, share of range"),
        ("coverage_95", "coverage of 95 % intervals"),
    ];
    Rows { rows, columns }.table(
        document,
        (
            "table-hand-over",
            "Hand-over: the three schemes of observation",
            "The robot's part of new motions, inferred from a few observations of the hand. Coverage is the share of \
             recorded values, all DoFs, inside their pointwise interval: honest is 0.95.",
        ),
    )
}

fn six(document: &Value) -> Option<Table> {
    let motions = document.pointer("/hand_over/six")?.as_array()?;
    let rows = motions.iter().enumerate();
    let rows = rows.map(|(i, motion)| {
        let between = motion.get("between").and_then(Value::as_bool) == Some(true);
        let place = if between {
            "between the cases"
        } else {
            "at a case"
        };
        (
            format!("hand_over.six.{i}"),
            format!("motion {}, {place}", i + 1),
        )
    });
    let columns = &[
        ("target_y_m", "target y, m"),
        ("end_point_error_m.0", "end-point error (a), m"),
        ("end_point_error_m.1", "(b), m"),
        ("end_point_error_m.2", "(c), m"),
        ("stiffness_nrmse.0", "stiffness error (a), share"),
        ("stiffness_nrmse.1", "(b), share"),
        ("stiffness_nrmse.2", "(c), share"),
    ];
    let rows = rows.collect();
    Rows { rows, columns }.table(
        document,
        (
            "table-six",
            "Hand-over: six new motions, one by one",
            "The counterparts of the paper's figures 10 and 11.",
        ),
    )
}

/// Any list of methods, with whatever was counted of each.
fn baselines(document: &Value) -> Option<Table> {
    let list = document.get("baselines")?;
    listed(
        ("baselines", list),
        (
            "table-baselines",
            "The same data, other methods",
            "Each a fair implementation of its source, learnt from the same demonstrations and asked the same questions.",
        ),
    )
}

/// A list or map of rows with numbers below: one column for each path that any row has.
fn listed(
    (key, list): (&str, &Value),
    (id, title, caption): (&'static str, &str, &str),
) -> Option<Table> {
    let rows: Vec<(String, &Value)> = match list {
        Value::Array(items) => {
            let name = |item: &Value| item.get("name")?.as_str().map(str::to_owned);
            let named = items.iter().enumerate();
            named
                .map(|(i, item)| (name(item).unwrap_or_else(|| i.to_string()), item))
                .collect()
        }
        Value::Object(items) => items
            .iter()
            .map(|(name, item)| (name.clone(), item))
            .collect(),
        _ => return None,
    };
    let mut columns: Vec<String> = Vec::new();
    for (_, row) in &rows {
        for (path, value) in leaves("", row) {
            if value.is_number() && !columns.contains(&path) {
                columns.push(path);
            }
        }
    }
    let places: Vec<String> = match list {
        Value::Object(items) => items.keys().cloned().collect(),
        _ => (0..rows.len()).map(|i| i.to_string()).collect(),
    };
    let body = rows.iter().zip(places).map(|((name, row), place)| {
        let cells = columns
            .iter()
            .map(|path| number_at(row, path, &format!("{key}.{place}.{path}")));
        std::iter::once(Cell::Text(name.clone()))
            .chain(cells)
            .collect()
    });
    let body: Vec<Vec<Cell>> = body.collect();
    let names = columns.iter().map(|path| path.replace(['.', '_'], " "));
    (!body.is_empty() && !columns.is_empty()).then(|| Table {
        id,
        title: title.to_owned(),
        caption: caption.to_owned(),
        header: std::iter::once(String::new()).chain(names).collect(),
        rows: body,
    })
}

/// Every leaf of the document.
pub(super) fn everything(document: &Value) -> Table {
    let rows = leaves("", document).into_iter().map(|(path, value)| {
        let cell = match value {
            Value::Number(_) => number(document, &path),
            Value::String(text) => Cell::Text(text.clone()),
            other => Cell::Text(other.to_string()),
        };
        vec![Cell::Text(path), cell]
    });
    Table {
        id: "table-numbers",
        title: "The document".to_owned(),
        caption: "Units are the last part of a name: `_m` metres, `_s` seconds; shares and scores have none.".to_owned(),
        header: vec!["path".to_owned(), "value".to_owned()],
        rows: rows.collect(),
    }
}

/// Leaves below `value` with their paths.
fn leaves<'v>(path: &str, value: &'v Value) -> Vec<(String, &'v Value)> {
    let below = |name: &str| {
        if path.is_empty() {
            name.to_owned()
        } else {
            format!("{path}.{name}")
        }
    };
    match value {
        Value::Object(keys) => {
            let each = keys.iter();
            each.flat_map(|(key, value)| leaves(&below(key), value))
                .collect()
        }
        Value::Array(items) => {
            let each = items.iter().enumerate();
            each.flat_map(|(i, value)| leaves(&below(&i.to_string()), value))
                .collect()
        }
        leaf => vec![(path.to_owned(), leaf)],
    }
}

/// What a path leads to.
pub(super) fn at<'v>(document: &'v Value, path: &str) -> Option<&'v Value> {
    document.pointer(&format!("/{}", path.replace('.', "/")))
}

/// The number at a path of the document.
pub(super) fn number(document: &Value, path: &str) -> Cell {
    number_at(document, path, path)
}

/// The number at `path` of `below`, whose path in the document is `key`.
fn number_at(below: &Value, path: &str, key: &str) -> Cell {
    match at(below, path) {
        Some(Value::Number(number)) => Cell::Number {
            key: key.to_owned(),
            value: number.to_string(),
            shown: shown(number),
        },
        Some(Value::Bool(truth)) => Cell::Text(truth.to_string()),
        _ => Cell::Text("–".to_owned()),
    }
}

/// Whole numbers as they are, others to four figures.
fn shown(number: &serde_json::Number) -> String {
    match number.as_f64() {
        Some(value) if !(number.is_i64() || number.is_u64()) => {
            let size = value.abs();
            if size >= 1000.0 {
                format!("{value:.0}")
            } else if size >= 100.0 {
                format!("{value:.1}")
            } else if size >= 10.0 {
                format!("{value:.2}")
            } else if size >= 1.0 || size == 0.0 {
                format!("{value:.3}")
            } else if size >= 1e-3 {
                format!("{value:.4}")
            } else {
                format!("{value:.2e}")
            }
        }
        _ => number.to_string(),
    }
}

//! Demonstrations out of a CSV table.

use std::ops::Range;
use std::path::PathBuf;

use super::{Demonstration, DemonstrationError};
use crate::table::{Table, TableError};

/// Which columns are DoFs and which labels are no skills.
#[derive(Clone, Copy, Debug)]
pub struct Choice<'a> {
    /// Columns to read, in the order the model will have them.
    pub dofs: &'a [String],
    /// Labels to leave out.
    pub exclude: &'a [String],
}

/// Why a file holds no usable demonstrations.
#[derive(Debug, thiserror::Error)]
pub enum ReadError {
    /// The file is no table, or a cell of it is wrong.
    #[error(transparent)]
    Table(#[from] TableError),
    /// A run of rows that is no demonstration.
    #[error("{}:{line}: the run of `{label}` that starts here: {reason}; exclude the label or mend the rows", file.display())]
    Run {
        /// The file.
        file: PathBuf,
        /// Line of its first row, from 1.
        line: u64,
        /// Its label.
        label: String,
        /// What is wrong with it.
        reason: DemonstrationError,
    },
    /// Every label is excluded.
    #[error("{}: no demonstrations left: its labels are {}", file.display(), labels.join(", "))]
    NothingLeft {
        /// The file.
        file: PathBuf,
        /// The labels it has.
        labels: Vec<String>,
    },
    /// A row without a label.
    #[error("{}:{line}: column `label`: empty, name the skill or a label to exclude (or train with --components)", file.display())]
    NoLabel {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
    },
}

/// Reads the demonstrations of a table with the columns `t_s` (seconds), `label`, `trial` and those of
/// `choice`. Rows of excluded labels may hold anything in the DoFs' columns. Rows with an empty cell in
/// a DoF's column are left out.
///
/// # Errors
/// A column that is missing, a cell that is not a finite number, an empty label, times that do not increase
/// within a demonstration, fewer than two rows of it, nothing left.
pub fn read(table: &Table, choice: &Choice<'_>) -> Result<Vec<Demonstration>, ReadError> {
    runs(table, choice, &labels(table)?, Gaps::OfRows)
}

/// The same, but a label may be empty, or the column missing: such a demonstration has an empty label, and a
/// contiguous run of rows without a label in one trial is one demonstration.
///
/// # Errors
/// As [`read`].
pub fn read_unlabelled(
    table: &Table,
    choice: &Choice<'_>,
) -> Result<Vec<Demonstration>, ReadError> {
    let labels = table.text("label");
    let labels = labels.unwrap_or_else(|_| vec![""; table.rows()]);
    runs(table, choice, &labels, Gaps::OfRows)
}

/// The same, but an empty cell is a missing value of its DoF alone; only rows without any value are left out.
///
/// # Errors
/// As [`read`].
pub fn read_with_gaps(table: &Table, choice: &Choice<'_>) -> Result<Vec<Demonstration>, ReadError> {
    runs(table, choice, &labels(table)?, Gaps::OfCells)
}

/// Label of every row, none of them empty.
fn labels(table: &Table) -> Result<Vec<&str>, ReadError> {
    let labels = table.text("label")?;
    match labels.iter().position(|label| label.is_empty()) {
        Some(row) => Err(ReadError::NoLabel {
            file: table.file().to_owned(),
            line: table.place(row, "label").line,
        }),
        None => Ok(labels),
    }
}

/// What an empty cell leaves out.
#[derive(Clone, Copy, PartialEq)]
enum Gaps {
    OfRows,
    OfCells,
}

fn runs(
    table: &Table,
    choice: &Choice<'_>,
    labels: &[&str],
    gaps: Gaps,
) -> Result<Vec<Demonstration>, ReadError> {
    let trials = table.text("trial")?;
    for dof in choice.dofs {
        table.text(dof)?;
    }
    let mut found = Vec::new();
    let mut start = 0;
    while start < table.rows() {
        let same = |row: usize| (labels[row], trials[row]) == (labels[start], trials[start]);
        let end = (start + 1..table.rows())
            .find(|&row| !same(row))
            .unwrap_or(table.rows());
        if !choice.exclude.iter().any(|name| name == labels[start]) {
            let names = (labels[start], trials[start]);
            found.push(run(table, choice.dofs, names, start..end, gaps)?);
        }
        start = end;
    }
    if found.is_empty() {
        let mut names: Vec<_> = labels.iter().map(|&label| label.to_owned()).collect();
        names.sort_unstable();
        names.dedup();
        return Err(ReadError::NothingLeft {
            file: table.file().to_owned(),
            labels: names,
        });
    }
    Ok(found)
}

fn run(
    table: &Table,
    dofs: &[String],
    (label, trial): (&str, &str),
    rows: Range<usize>,
    gaps: Gaps,
) -> Result<Demonstration, ReadError> {
    let columns = dofs
        .iter()
        .map(|dof| table.numbers_or_gaps_in(dof, rows.clone()));
    let columns = columns.collect::<Result<Vec<_>, _>>()?;
    let mut t_s: Vec<f64> = Vec::with_capacity(rows.len());
    let mut values = vec![Vec::with_capacity(rows.len()); dofs.len()];
    let times_s = table.numbers_in("t_s", rows.clone())?;
    table.strictly_increasing("t_s", &times_s, rows.start)?;
    for (offset, &time_s) in times_s.iter().enumerate() {
        let recorded = columns
            .iter()
            .filter(|column| column[offset].is_some())
            .count();
        let enough = match gaps {
            Gaps::OfRows => dofs.len(),
            Gaps::OfCells => 1,
        };
        if recorded >= enough {
            t_s.push(time_s);
            for (series, column) in values.iter_mut().zip(&columns) {
                series.push(column[offset]);
            }
        }
    }
    let made = Demonstration::with_gaps(label, trial, table.file(), t_s, &values);
    made.map_err(|reason| ReadError::Run {
        file: table.file().to_owned(),
        line: table.place(rows.start, "label").line,
        label: label.to_owned(),
        reason,
    })
}

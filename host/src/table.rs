//! CSV files with a header line: read whole, every error with its file, line and column.

mod error;

pub use error::{Place, TableError};

use std::collections::BTreeMap;
use std::fs::File;
use std::io::Read;
use std::ops::Range;
use std::path::{Path, PathBuf};

/// A CSV file in memory: a header with distinct names, and at least one row, all of the header's length.
///
/// Cells stay text until a column is asked for as numbers, so that columns nobody uses may hold anything.
#[derive(Clone, Debug)]
pub struct Table {
    file: PathBuf,
    columns: Vec<String>,
    rows: Vec<csv::StringRecord>,
    lines: Vec<u64>,
}

impl Table {
    /// Reads the file at `path`.
    ///
    /// # Errors
    /// When it cannot be read, or is not a table: see [`Table::read`].
    pub fn open(path: &Path) -> Result<Self, TableError> {
        let opened = File::open(path).map_err(|source| TableError::Io {
            file: path.to_owned(),
            source,
        })?;
        Self::read(opened, path)
    }

    /// Reads a table from `input`; `file` is the name its errors carry.
    ///
    /// # Errors
    /// When reading fails, there is no header or no row, a column has no name or another's, a row is
    /// not of the header's length, or the text is not UTF-8.
    pub fn read(mut input: impl Read, file: &Path) -> Result<Self, TableError> {
        let mut bytes = Vec::new();
        input
            .read_to_end(&mut bytes)
            .map_err(|source| TableError::Io {
                file: file.to_owned(),
                source,
            })?;
        let mut reader = csv::ReaderBuilder::new()
            .trim(csv::Trim::All)
            .from_reader(bytes.as_slice());
        let header = reader
            .headers()
            .map_err(|error| refused(error, file, &bytes))?
            .clone();
        let columns = column_names(&header, file)?;
        let mut rows = Vec::new();
        let mut lines = Vec::new();
        let mut record = csv::StringRecord::new();
        while reader
            .read_record(&mut record)
            .map_err(|error| refused(error, file, &bytes))?
        {
            lines.push(line_of(record.position(), &bytes));
            rows.push(record.clone());
        }
        if rows.is_empty() {
            return Err(TableError::NoRows {
                file: file.to_owned(),
            });
        }
        Ok(Self {
            file: file.to_owned(),
            columns,
            rows,
            lines,
        })
    }

    /// The file, as it was named when the table was read.
    #[must_use]
    pub fn file(&self) -> &Path {
        &self.file
    }

    /// Column names in the file's order.
    #[must_use]
    pub fn columns(&self) -> &[String] {
        &self.columns
    }

    /// Number of rows, at least 1; the header does not count.
    #[must_use]
    pub fn rows(&self) -> usize {
        self.rows.len()
    }

    /// A column as text, one entry per row.
    ///
    /// # Errors
    /// When there is no such column.
    pub fn text(&self, column: &str) -> Result<Vec<&str>, TableError> {
        let number = self.find(column)?;
        Ok(self
            .rows
            .iter()
            .map(|row| row.get(number).unwrap_or(""))
            .collect())
    }

    /// A column as finite numbers, one per row.
    ///
    /// # Errors
    /// When there is no such column, or a cell is empty, not a number, NaN or infinite.
    pub fn numbers(&self, column: &str) -> Result<Vec<f64>, TableError> {
        self.numbers_in(column, 0..self.rows())
    }

    /// As [`Table::numbers`], of the rows in `rows` only (from 0, cut to the table's).
    ///
    /// # Errors
    /// As [`Table::numbers`]; the other rows may hold anything.
    pub fn numbers_in(&self, column: &str, rows: Range<usize>) -> Result<Vec<f64>, TableError> {
        let start = rows.start;
        let cells = self.numbers_or_gaps_in(column, rows)?;
        let filled = cells.into_iter().enumerate().map(|(offset, cell)| {
            cell.ok_or_else(|| TableError::EmptyCell {
                place: self.place(start + offset, column),
            })
        });
        filled.collect()
    }

    /// As [`Table::numbers_in`], with `None` where a cell is empty.
    ///
    /// # Errors
    /// When there is no such column, or a cell is not a number, NaN or infinite.
    pub fn numbers_or_gaps_in(
        &self,
        column: &str,
        rows: Range<usize>,
    ) -> Result<Vec<Option<f64>>, TableError> {
        let number = self.find(column)?;
        let range = rows.start.min(self.rows())..rows.end.min(self.rows());
        let cells = range.map(|row| {
            let text = self.rows[row].get(number).unwrap_or("");
            self.number(row, column, text)
        });
        cells.collect()
    }

    /// Refuses `times_s` unless they strictly increase.
    ///
    /// `times_s` holds the numbers of `column` from row `first_row` on (from 0).
    ///
    /// # Errors
    /// [`TableError::NotIncreasing`] at the first time that does not come after its predecessor.
    pub fn strictly_increasing(
        &self,
        column: &str,
        times_s: &[f64],
        first_row: usize,
    ) -> Result<(), TableError> {
        let Some(back) = times_s.windows(2).position(|pair| pair[1] <= pair[0]) else {
            return Ok(());
        };
        Err(TableError::NotIncreasing {
            place: self.place(first_row + back + 1, column),
            previous: times_s[back],
            value: times_s[back + 1],
        })
    }

    /// Where the cell of `column` in row `row` (from 0) stands in the file.
    #[must_use]
    pub fn place(&self, row: usize, column: &str) -> Place {
        Place {
            file: self.file.clone(),
            line: self.lines.get(row).copied().unwrap_or(0),
            column: column.to_owned(),
        }
    }

    fn find(&self, column: &str) -> Result<usize, TableError> {
        let found = self.columns.iter().position(|name| name == column);
        found.ok_or_else(|| TableError::MissingColumn {
            file: self.file.clone(),
            name: column.to_owned(),
            present: self.columns.clone(),
        })
    }

    fn number(&self, row: usize, column: &str, text: &str) -> Result<Option<f64>, TableError> {
        if text.is_empty() {
            return Ok(None);
        }
        let value: f64 = text.parse().map_err(|_| TableError::NotANumber {
            place: self.place(row, column),
            text: text.chars().take(40).collect(),
        })?;
        if value.is_finite() {
            Ok(Some(value))
        } else {
            let place = self.place(row, column);
            Err(TableError::NotFinite { place, value })
        }
    }
}

fn column_names(header: &csv::StringRecord, file: &Path) -> Result<Vec<String>, TableError> {
    if header.is_empty() {
        return Err(TableError::Empty {
            file: file.to_owned(),
        });
    }
    if let [only] = header.iter().collect::<Vec<_>>()[..]
        && only.contains([';', '\t'])
    {
        return Err(TableError::Separator {
            file: file.to_owned(),
            header: only.to_owned(),
        });
    }
    let mut seen = BTreeMap::new();
    for (index, name) in header.iter().enumerate() {
        if name.is_empty() {
            return Err(TableError::UnnamedColumn {
                file: file.to_owned(),
                number: index + 1,
            });
        }
        if let Some(first) = seen.insert(name, index + 1) {
            return Err(TableError::DuplicateColumn {
                file: file.to_owned(),
                name: name.to_owned(),
                first,
                second: index + 1,
            });
        }
    }
    Ok(header.iter().map(str::to_owned).collect())
}

/// The line a record starts on. The csv crate puts the start before the blank lines it skips.
fn line_of(position: Option<&csv::Position>, bytes: &[u8]) -> u64 {
    let Some(position) = position else { return 1 };
    let start = usize::try_from(position.byte()).unwrap_or(usize::MAX);
    let rest = bytes.get(start..).unwrap_or(&[]);
    let blank = rest.iter().take_while(|b| matches!(b, b'\r' | b'\n'));
    position.line() + blank.filter(|&&b| b == b'\n').count() as u64
}

/// The csv crate's error as ours. Kinds that only its writer and serde side raise become `Io`.
fn refused(error: csv::Error, file: &Path, bytes: &[u8]) -> TableError {
    let file = file.to_owned();
    let line = line_of(error.position(), bytes);
    match error.into_kind() {
        csv::ErrorKind::Io(source) => TableError::Io { file, source },
        csv::ErrorKind::Utf8 { err, .. } => TableError::NotUtf8 {
            file,
            line,
            number: err.field() + 1,
        },
        csv::ErrorKind::UnequalLengths {
            expected_len, len, ..
        } => TableError::Ragged {
            file,
            line,
            expected: expected_len,
            found: len,
        },
        other => TableError::Io {
            file,
            source: std::io::Error::other(format!("{other:?}")),
        },
    }
}

#[cfg(test)]
mod tests;

//! Rows as CSV: a line of names, then a line for each row; what is not known is empty.

use std::io::BufWriter;
use std::path::Path;

use crate::atomic;

use super::column::Cell;
use super::error::ExportError;
use super::rows::Rows;

/// Writes the rows of a recording and says how many there are. Numbers read back as they were.
///
/// # Errors
/// [`ExportError`] where the recording cannot be read, or the file not be written; then it is left as it was.
pub fn write_csv(recording: &Path, output: &Path) -> Result<u64, ExportError> {
    let mut rows = Rows::open(recording)?;
    let write = |source| ExportError::Write {
        path: output.to_owned(),
        source,
    };
    let names: Vec<String> = rows.columns().iter().map(|c| c.name.clone()).collect();
    let mut count = 0;
    atomic::write_with(output, |file| {
        let mut lines = csv::Writer::from_writer(BufWriter::new(file));
        lines.write_record(&names).map_err(io)?;
        for row in rows.by_ref() {
            let cells = row.map_err(Fill::Read)?;
            let cells = cells.iter().map(|cell| match cell {
                Cell::Missing => String::new(),
                Cell::Number(number) => number.to_string(),
                Cell::Text(text) => text.clone(),
            });
            lines.write_record(cells).map_err(io)?;
            count += 1;
        }
        lines.flush()?;
        Ok(())
    })
    .map_err(|error| match error {
        Fill::Read(error) => error.into(),
        Fill::Write(error) => write(error),
    })?;
    Ok(count)
}

/// What can end the writing of a table.
pub(super) enum Fill {
    Read(crate::recording::ReadError),
    Write(std::io::Error),
}

impl From<std::io::Error> for Fill {
    fn from(error: std::io::Error) -> Self {
        Self::Write(error)
    }
}

fn io(error: csv::Error) -> Fill {
    Fill::Write(error.into())
}

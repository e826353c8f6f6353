//! What is wrong with a CSV file, and where.

use std::fmt;
use std::path::PathBuf;

/// A cell of a CSV file. Lines are counted from 1, the header line included.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Place {
    /// The file as the caller named it.
    pub file: PathBuf,
    /// Line in the file, from 1.
    pub line: u64,
    /// Name of the column.
    pub column: String,
}

impl fmt::Display for Place {
    fn fmt(&self, f: &mut fmt::Formatter<'_>) -> fmt::Result {
        let file = self.file.display();
        write!(f, "{file}:{}: column `{}`", self.line, self.column)
    }
}

/// Why a CSV file cannot be used. The messages name file, line and column as far as they exist.
#[derive(Debug, thiserror::Error)]
pub enum TableError {
    /// The file cannot be opened or read.
    #[error("{}: cannot be read", file.display())]
    Io {
        /// The file.
        file: PathBuf,
        /// What the system said.
        source: std::io::Error,
    },
    /// Nothing in the file, not even a header.
    #[error("{}: empty, it needs a header line and rows", file.display())]
    Empty {
        /// The file.
        file: PathBuf,
    },
    /// A header and nothing else.
    #[error("{}: no rows after the header line", file.display())]
    NoRows {
        /// The file.
        file: PathBuf,
    },
    /// A column without a name.
    #[error("{}:1: column {number} has no name", file.display())]
    UnnamedColumn {
        /// The file.
        file: PathBuf,
        /// Its number from 1.
        number: usize,
    },
    /// A header in which something else than commas separates the names.
    #[error("{}:1: one column, `{header}`: separate cells by commas, and write numbers with a point", file.display())]
    Separator {
        /// The file.
        file: PathBuf,
        /// The header line.
        header: String,
    },
    /// One name on two columns.
    #[error("{}:1: column `{name}` appears twice, as number {first} and {second}", file.display())]
    DuplicateColumn {
        /// The file.
        file: PathBuf,
        /// The name.
        name: String,
        /// Number of the first, from 1.
        first: usize,
        /// Number of the second, from 1.
        second: usize,
    },
    /// A column that was asked for is not there.
    #[error("{}:1: no column `{name}`; present: {}", file.display(), present.join(", "))]
    MissingColumn {
        /// The file.
        file: PathBuf,
        /// The name asked for.
        name: String,
        /// The names in the header.
        present: Vec<String>,
    },
    /// A row with more or fewer cells than the header.
    #[error("{}:{line}: {found} cells, but the header has {expected}", file.display())]
    Ragged {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// Columns in the header.
        expected: u64,
        /// Cells in the row.
        found: u64,
    },
    /// Bytes that are not UTF-8.
    #[error("{}:{line}: cell {number} is not UTF-8 text", file.display())]
    NotUtf8 {
        /// The file.
        file: PathBuf,
        /// Line, from 1.
        line: u64,
        /// Cell in the row, from 1.
        number: usize,
    },
    /// A cell that should hold a number holds nothing.
    #[error("{place}: empty, a number is needed")]
    EmptyCell {
        /// Where.
        place: Place,
    },
    /// A cell that should hold a number holds something else.
    #[error("{place}: `{text}` is not a number")]
    NotANumber {
        /// Where.
        place: Place,
        /// What it holds (its first 40 characters).
        text: String,
    },
    /// NaN or an infinity.
    #[error("{place}: {value:?} is not finite")]
    NotFinite {
        /// Where.
        place: Place,
        /// What it holds.
        value: f64,
    },
    /// A time that does not come after the one before it.
    #[error("{place}: {value:?} does not come after {previous:?}; times must strictly increase")]
    NotIncreasing {
        /// Where.
        place: Place,
        /// The time before.
        previous: f64,
        /// The time here.
        value: f64,
    },
}

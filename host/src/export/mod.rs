//! Recordings as files that other programs read: tables of rows (CSV, Parquet) and raw sEMG (EDF+ or BDF+ within BIDS).

mod bids;
mod column;
mod columnar;
mod demonstrations;
mod edf;
mod error;
mod lines;
mod rows;
mod scans;

pub use bids::{Written, write_bids};
pub use column::{Cell, Column};
pub use columnar::write_parquet;
pub use demonstrations::{Demonstrated, write_demonstrations};
pub use edf::{Annotation, Edf, Signal};
pub use error::ExportError;
pub use lines::write_csv;
pub use rows::{Row, Rows};
pub use scans::{Gap, Scans};

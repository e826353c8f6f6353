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

use std::path::Path;

use crate::clock::DeviceClock;
use crate::config::Config;
use crate::recording::Opening;

pub use bids::{Written, write_bids};
pub use column::{Cell, Column};
pub use columnar::write_parquet;
pub use demonstrations::{Demonstrated, write_demonstrations};
pub use edf::{Annotation, Edf, Signal};
pub use error::ExportError;
pub use lines::write_csv;
pub use rows::{Row, Rows};
pub use scans::{Gap, Scans};

/// The wearable's clock as the engine read it: by the configuration that the recording was made with, or the default one
/// where it tells none.
fn clock(opening: &Opening, recording: &Path) -> Result<Option<DeviceClock>, ExportError> {
    let config = Config::parse(&opening.configuration, recording)?;
    Ok(DeviceClock::new(config.clock()).ok())
}

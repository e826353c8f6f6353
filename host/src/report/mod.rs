//! What was found, as one page: figures after the paper's, tables, nothing loaded from anywhere.
//!
//! Every number of a table carries its path in the results' JSON document (`data-key`) and the number itself
//! (`data-value`), so that page and document can be compared by a program.

mod chart;
mod figures;
mod html;
mod recordings;
mod tables;

use std::path::{Path, PathBuf};

use serde_json::Value;

use crate::atomic;
use crate::experiment::{Results, mean_of};
use html::Page;

/// Name of the page in its folder.
pub const FILE: &str = "report.html";

/// Why there is no report.
#[derive(Debug, thiserror::Error)]
pub enum ReportError {
    /// No results at all.
    #[error("there are no results to report: run at least one seed")]
    Nothing,
    /// Results that are no JSON document.
    #[error("the results are no JSON document: {0}")]
    Document(#[from] serde_json::Error),
    /// The folder or the page.
    #[error("{}: cannot be written: {source}; name a folder that can", path.display())]
    Write {
        /// Folder or page.
        path: PathBuf,
        /// What the system says.
        source: std::io::Error,
    },
}

/// Makes `folder` if there is none and tries whether the page can be put there: to be asked before a run that takes
/// minutes. A page that is there already stays as it is.
///
/// # Errors
/// [`ReportError::Write`].
pub fn prepare(folder: &Path) -> Result<(), ReportError> {
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    let path = folder.join(FILE);
    atomic::try_to_write(&path).map_err(failed(&path))
}

/// Writes the page of one run into `folder`, which is made if there is none. The page is there whole or not at all.
///
/// # Errors
/// [`ReportError`].
pub fn write(folder: &Path, results: &Results) -> Result<PathBuf, ReportError> {
    write_seeds(folder, std::slice::from_ref(results))
}

/// As [`write()`], of several seeds: tables are their means, figures the first one's.
///
/// # Errors
/// [`ReportError`].
pub fn write_seeds(folder: &Path, results: &[Results]) -> Result<PathBuf, ReportError> {
    let page = page(results)?;
    let path = folder.join(FILE);
    std::fs::create_dir_all(folder).map_err(failed(folder))?;
    atomic::write(&path, page.as_bytes()).map_err(failed(&path))?;
    Ok(path)
}

fn failed(path: &Path) -> impl FnOnce(std::io::Error) -> ReportError {
    let path = path.to_owned();
    move |source| ReportError::Write { path, source }
}

/// The page.
fn page(results: &[Results]) -> Result<String, ReportError> {
    let first = results.first().ok_or(ReportError::Nothing)?;
    let documents = results.iter().map(serde_json::to_value);
    let documents = documents.collect::<Result<Vec<Value>, _>>()?;
    let document = mean_of(&documents);
    let seeds = match results {
        [one] => format!("seed {}", one.seed),
        several => format!(
            "the mean of {} seeds, {} to {}",
            several.len(),
            first.seed,
            several.last().map_or(first.seed, |last| last.seed)
        ),
    };
    let mut page = Page::new(
        "Tonus: what the experiments find",
        &format!(
            "The three experiments of Guan, Wang and Yang (section 3) on a simulated wearer, through raw sEMG, the \
             wearable's pipeline and packets, and the same questions to other methods and to recordings of real people \
             where they were part of the run. Numbers in tables are {seeds}; figures show seed {}. Accuracy is on \
             movements that were held out, unless a row says training.",
            first.seed
        ),
    );
    page.section(
        "results",
        "Results",
        "What was asked, and how often or how closely the answer was right. Units are in the column's name.",
    );
    for table in tables::results(&document) {
        page.table(&table);
    }
    figures::write(&mut page, first, &document);
    page.section(
        "numbers",
        "All numbers",
        "Every number of the JSON document, by its path in it.",
    );
    page.table(&tables::everything(&document));
    Ok(page.finish())
}

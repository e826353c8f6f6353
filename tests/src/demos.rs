//! The demonstrations of the reference.

use tonus::demonstration::Demonstration;
use tonus::table::Table;

use crate::reference;

/// Samples of each.
const SAMPLES: usize = 200;

/// `reference/demos.csv`: 30 demonstrations of two seconds, ten of each class one after the other, these DoFs of them.
/// Labels are the classes, trials differ.
///
/// # Panics
/// When the file does not hold them.
#[must_use]
pub fn demos(dofs: &[&str]) -> Vec<Demonstration> {
    let table = Table::open(&reference().join("demos.csv")).expect("the reference");
    let labels = table.text("label").expect("labels");
    let times_s = table.numbers("t_s").expect("times");
    let columns = dofs.iter().map(|dof| table.numbers(dof).expect("a DoF"));
    let columns: Vec<_> = columns.collect();
    let one = |start: usize| {
        let rows = start..start + SAMPLES;
        let values = columns.iter().map(|c| c[rows.clone()].to_vec()).collect();
        let (label, trial) = (labels[start], start.to_string());
        let times_s = times_s[rows].to_vec();
        Demonstration::new(label, trial, "demos.csv", times_s, values).expect("a demonstration")
    };
    (0..table.rows()).step_by(SAMPLES).map(one).collect()
}

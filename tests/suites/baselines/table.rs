//! All methods on the experiments' data (a small share of it; `tonus experiment` has all) and on motion capture.

use tonus::baseline::Row;
use tonus::demonstration::{Choice, Demonstration, read};
use tonus::experiment::Config;
use tonus::experiment::baselines::{Sizes, of_positions, run};
use tonus::model::{Dof, Hyperparameters};
use tonus::table::Table;
use tonus_shared::promp::Basis;

fn show(title: &str, rows: &[Row]) {
    println!("{title}");
    println!(
        "{:46} {:>8} {:>8} {:>9} {:>9} {:>9} {:>8}",
        "", "accuracy", "log-loss", "end, mm", "path, mm", "stiffness", "cover"
    );
    let cell = |value: Option<f64>, scale: f64, digits: usize| {
        value.map_or_else(|| "-".to_owned(), |v| format!("{:.digits$}", v * scale))
    };
    for row in rows {
        println!(
            "{:46} {:>8} {:>8} {:>9} {:>9} {:>9} {:>8}",
            row.method,
            cell(row.accuracy, 1.0, 3),
            cell(row.log_loss, 1.0, 3),
            cell(row.end_point_error_m, 1e3, 1),
            cell(row.path_rmse_m, 1e3, 1),
            cell(row.stiffness_nrmse, 1.0, 3),
            cell(row.coverage_95, 1.0, 3),
        );
    }
}

fn row<'r>(rows: &'r [Row], method: &str) -> &'r Row {
    let mut found = rows.iter().filter(|row| row.method.starts_with(method));
    let row = found.next().unwrap_or_else(|| panic!("no row {method}"));
    assert!(found.next().is_none() || method == OURS);
    row
}

const OURS: &str = "mixture of ProMPs";

#[test]
fn on_the_experiments() {
    let full = std::env::var_os("TONUS_FULL").is_some();
    let sizes = if full {
        Sizes::default()
    } else {
        Sizes {
            pulls_each: 4,
            lifts_each: 10,
            folds: 2,
        }
    };
    let tables = run(&Config::default(), &sizes, &mut |_| {}).unwrap();
    show("hand-over, scheme (c)", &tables.hand_over);
    show("object matching", &tables.object_matching);
    show("pick and place, first half", &tables.pick_and_place);
}

/// Six actions of one person, tested on those of another: ten observations of the first half, duration known.
#[test]
fn on_motion_capture() {
    let (first, second): (Vec<_>, Vec<_>) = people()
        .into_iter()
        .partition(|one| one.file().to_string_lossy().contains("subject1"));
    assert!(!first.is_empty() && !second.is_empty());
    let dofs = ["x", "y", "z"].map(Dof::position).to_vec();
    let hyperparameters = Hyperparameters {
        placement_m: 0.1,
        ..Hyperparameters::new(dofs, Basis::gaussian(20).unwrap())
    };
    let valid = hyperparameters.check().unwrap();
    let rows = of_positions(&first, &second, &valid, (10, 0.5, 0.05)).unwrap();
    show("motion capture, subject 1 to 2, first half", &rows);
}

fn people() -> Vec<Demonstration> {
    let folder = tonus_tests::recordings().join("vmci_pick_place_mocap/csv");
    let entries = std::fs::read_dir(&folder).expect("the folder of the recording");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("a file").path()).collect();
    files.sort();
    let dofs = ["x", "y", "z"].map(str::to_owned);
    let exclude = ["none", "idle"].map(str::to_owned);
    let choice = Choice {
        dofs: &dofs,
        exclude: &exclude,
    };
    let of_file = |file| read(&Table::open(file).expect("a table"), &choice);
    files
        .iter()
        .flat_map(|file| of_file(file).expect("demonstrations"))
        .collect()
}

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
    let found = rows.iter().find(|row| row.method == method);
    found.unwrap_or_else(|| panic!("no row {method}"))
}

const OURS: &str = "mixture of ProMPs";
const WITHOUT_SEMG: &str = "mixture of ProMPs without sEMG";
const ONE_GAUSSIAN: &str = "one Gaussian ProMP over all skills";
const MARGINALS: &str = "product of time marginals";
const REGRESSION: &str = "GMM, Gaussian mixture regression";
const MARKOV: &str = "hidden semi-Markov model, Gaussian regression";
const NEAREST: &str = "nearest demonstration by DTW";
const DMP: &str = "DMP, goals set by hand, skill told";

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
    for rows in [
        &tables.hand_over,
        &tables.object_matching,
        &tables.pick_and_place,
    ] {
        assert_eq!(rows.len(), 8);
        // What a method has not, its row has not.
        for method in [ONE_GAUSSIAN, DMP] {
            assert_eq!(row(rows, method).accuracy, None);
            assert_eq!(row(rows, method).log_loss, None);
        }
        for method in [NEAREST, DMP] {
            assert_eq!(row(rows, method).coverage_95, None);
        }
        assert_eq!(row(rows, NEAREST).log_loss, None);
    }
    hand_over(&tables.hand_over);
    objects(&tables.object_matching);
    assert!(row(&tables.pick_and_place, OURS).accuracy >= Some(0.98));
}

/// One observation of a few tells a ProMP about the whole movement; a bag of instants only about themselves, and a
/// stiffness goal set by hand about no stiffness at all.
fn hand_over(rows: &[Row]) {
    let ours = row(rows, OURS);
    assert_eq!(ours.accuracy, None, "one skill: nothing to recognise");
    assert!(ours.end_point_error_m < Some(0.01), "{ours:?}");
    for method in [REGRESSION, MARKOV] {
        assert!(row(rows, method).path_rmse_m > ours.path_rmse_m.map(|m| 2.0 * m));
    }
    assert!(row(rows, DMP).stiffness_nrmse > ours.stiffness_nrmse.map(|share| 2.0 * share));
    assert!(row(rows, NEAREST).end_point_error_m > ours.end_point_error_m);
}

/// The muscles tell the objects apart; without them nothing does, and one Gaussian over all skills leads the robot
/// between the shelves, as the paper says.
fn objects(rows: &[Row]) {
    let ours = row(rows, OURS);
    assert!(ours.accuracy >= Some(0.98), "{ours:?}");
    let without = row(rows, WITHOUT_SEMG);
    assert!(without.accuracy < Some(0.6), "{without:?}");
    assert!(without.log_loss > ours.log_loss);
    let single = row(rows, ONE_GAUSSIAN);
    assert!(single.end_point_error_m > ours.end_point_error_m.map(|m| 1.5 * m));
    assert!(single.stiffness_nrmse > ours.stiffness_nrmse);
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
    let ours = row(&rows, OURS);
    // Floor of 29 of 36 recognised.
    assert!(ours.accuracy >= Some(29.0 / 36.0), "{ours:?}");
    for method in [MARGINALS, REGRESSION, MARKOV, NEAREST] {
        assert!(row(&rows, method).accuracy < ours.accuracy, "{method}");
    }
    // The product counts correlated evidence again and again: false confidence.
    assert!(row(&rows, MARGINALS).log_loss > ours.log_loss.map(|loss| 2.0 * loss));
    // There is no stiffness to leave out.
    assert_eq!(row(&rows, WITHOUT_SEMG).log_loss, ours.log_loss);
    assert!(rows.iter().all(|row| row.path_rmse_m.is_none()));
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

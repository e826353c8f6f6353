//! The six actions of two people, each with the run it was cut from.

use tonus::demonstration::{Choice, Demonstration, read};
use tonus::table::Table;

/// The hand in one run, as it was recorded.
pub(crate) struct Run {
    pub(crate) t_s: Vec<f64>,
    pub(crate) position_m: Vec<[f64; 3]>,
}

/// One action and the run it happened in.
pub(crate) struct Action<'r> {
    pub(crate) demonstration: Demonstration,
    pub(crate) run: &'r Run,
    /// Its first sample in the run.
    pub(crate) first: usize,
}

impl Action<'_> {
    pub(crate) fn start_s(&self) -> f64 {
        self.run.t_s[self.first]
    }

    pub(crate) fn duration_s(&self) -> f64 {
        self.demonstration.duration_s()
    }

    /// The samples from `lead_s` before the action to `share` of its duration; before the recording's first sample the
    /// hand is held where that has it.
    pub(crate) fn stream(&self, lead_s: f64, share: f64) -> Vec<(f64, [f64; 3])> {
        let Run { t_s, position_m } = self.run;
        let (from_s, to_s) = (
            self.start_s() - lead_s,
            self.start_s() + share * self.duration_s(),
        );
        let interval_s = t_s[1] - t_s[0];
        let missing = ((t_s[0] - from_s) / interval_s).max(0.0) as usize;
        let held = (1..=missing).map(|ago| (t_s[0] - ago as f64 * interval_s, position_m[0]));
        let mut stream: Vec<_> = held.collect();
        stream.reverse();
        let recorded = t_s.iter().copied().zip(position_m.iter().copied());
        stream.extend(recorded.filter(|(time_s, _)| (from_s..=to_s + 1e-9).contains(time_s)));
        stream
    }
}

/// Every run whose file's name starts so.
pub(crate) fn runs(person: &str) -> Vec<(Run, Vec<Demonstration>)> {
    let folder = tonus_tests::recordings().join("vmci_pick_place_mocap/csv");
    let entries = std::fs::read_dir(&folder).expect("the folder of the recording");
    let mut files: Vec<_> = entries.map(|entry| entry.expect("a file").path()).collect();
    files.retain(|file| {
        let name = file.file_name().and_then(|name| name.to_str());
        name.is_some_and(|name| name.starts_with(person))
    });
    files.sort();
    let dofs = ["x", "y", "z"].map(str::to_owned);
    let exclude = ["none", "idle"].map(str::to_owned);
    let of_file = |file: &std::path::PathBuf| {
        let table = Table::open(file).expect("a table");
        let column = |name| table.numbers_in(name, 0..table.rows()).expect("a column");
        let [x, y, z] = ["x", "y", "z"].map(column);
        let position_m = x.iter().zip(&y).zip(&z).map(|((x, y), z)| [*x, *y, *z]);
        let choice = Choice {
            dofs: &dofs,
            exclude: &exclude,
        };
        let run = Run {
            t_s: column("t_s"),
            position_m: position_m.collect(),
        };
        (run, read(&table, &choice).expect("demonstrations"))
    };
    files.iter().map(of_file).collect()
}

/// The actions of these runs.
pub(crate) fn actions(runs: &[(Run, Vec<Demonstration>)]) -> Vec<Action<'_>> {
    runs.iter()
        .flat_map(|(run, demonstrations)| {
            demonstrations.iter().map(move |demonstration| {
                let start_s = demonstration.t_s()[0];
                Action {
                    demonstration: demonstration.clone(),
                    run,
                    first: run.t_s.partition_point(|t| *t < start_s),
                }
            })
        })
        .collect()
}

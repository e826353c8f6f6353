//! CSV files that hold no demonstrations.

use std::path::Path;

use super::{Case, data};

const GOOD: &str = "t_s,x,k,label,trial\n";

/// The good file: two skills, three demonstrations each.
fn good() -> String {
    let mut text = GOOD.to_owned();
    for trial in 0..3 {
        for (label, slope) in [("lift", 1.0), ("push", -2.0)] {
            for step in 0..8 {
                let t_s = f64::from(step) * 0.1;
                let x = slope * t_s + 0.1 * f64::from(trial) * t_s * t_s;
                text += &format!("{t_s},{x},{},{label},{trial}\n", 100.0 + 10.0 * t_s);
            }
        }
    }
    text
}

/// One demonstration of `lift` and what follows it.
fn after(rows: &str) -> String {
    format!("{GOOD}0,1,5,lift,a\n0.1,2,5,lift,a\n0.2,4,5,lift,a\n{rows}")
}

pub(super) fn write(folder: &Path) {
    let file = |name: &str, text: &[u8]| std::fs::write(folder.join(name), text).unwrap();
    file("good.csv", good().as_bytes());
    std::fs::create_dir(folder.join("folder.csv")).unwrap();
    file("empty.csv", b"");
    file("blank.csv", b"\n\n\n");
    file("header.csv", GOOD.as_bytes());
    file("short_row.csv", after("0.3,5,5,lift\n").as_bytes());
    file("long_row.csv", after("\n0.3,5,5,lift,a,9\n").as_bytes());
    file("twice.csv", b"t_s,x,x,label,trial\n0,1,1,a,b\n");
    file("unnamed.csv", b"t_s,,x,label,trial\n0,1,1,a,b\n");
    file("latin.csv", b"t_s,x,label,trial\n0,1,h\xe9ros,a\n");
    file("binary.csv", &[0_u8, 159, 146, 150, 10, 255, 254, 0]);
    file("no_time.csv", b"time,x,label,trial\n0,1,a,b\n");
    file("no_label.csv", b"t_s,x,trial\n0,1,b\n");
    file("no_trial.csv", b"t_s,x,label\n0,1,b\n");
    file("word.csv", after("0.3,five,5,lift,a\n").as_bytes());
    file("comma.csv", after("0.3,\"1,5\",5,lift,a\n").as_bytes());
    file("nan.csv", after("0.3,NaN,5,lift,a\n").as_bytes());
    file("infinite.csv", after("0.3,-inf,5,lift,a\n").as_bytes());
    file("overflow.csv", after("0.3,1e999,5,lift,a\n").as_bytes());
    file("no_time_cell.csv", after(",5,5,lift,a\n").as_bytes());
    file("time_nan.csv", after("nan,5,5,lift,a\n").as_bytes());
    file("time_stops.csv", after("0.2,5,5,lift,a\n").as_bytes());
    file(
        "time_returns.csv",
        after("0.3,5,5,lift,a\n0.1,6,5,lift,a\n").as_bytes(),
    );
    file("one_sample.csv", after("0.3,5,5,push,a\n").as_bytes());
    file(
        "gaps.csv",
        after("0.3,,5,push,a\n0.4,,5,push,a\n0.5,1,5,push,a\n").as_bytes(),
    );
    file("unlabelled.csv", after("0.3,5,5,,a\n").as_bytes());
    file(
        "few.csv",
        after("0,5,5,push,a\n0.1,6,5,push,a\n").as_bytes(),
    );
    let again = "0,1,5,lift,b\n0.1,2,5,lift,b\n0.2,4,5,lift,b\n";
    let third = again.replace(",b", ",c");
    file("lone.csv", after(again).as_bytes());
    file(
        "identical.csv",
        after(&format!("{again}{third}")).as_bytes(),
    );
    file("zero.csv", good().replace(",100,", ",0,").as_bytes());
    let huge = "0,-1e308,5,lift,b\n1,1e308,5,lift,b\n";
    file(
        "huge.csv",
        after(&format!("{huge}{}", huge.replace(",b", ",c"))).as_bytes(),
    );
    file(
        "strange.csv",
        after("0,5,5,jump,a\n0.1,6,5,jump,a\n").as_bytes(),
    );
    let long = "-1e308,1,5,push,a\n1e308,2,5,push,a\n";
    file("eternity.csv", after(long).as_bytes());
}

pub(super) const CASES: &[Case] = &[
    data(
        "train none.csv -o out",
        &["none.csv: cannot be read", "No such file"],
    ),
    data(
        "train folder.csv -o out",
        &["folder.csv: cannot be read", "irectory"],
    ),
    data(
        "train empty.csv -o out",
        &["empty.csv: empty, it needs a header line"],
    ),
    data(
        "train blank.csv -o out",
        &["blank.csv: empty, it needs a header line"],
    ),
    data(
        "train header.csv -o out",
        &["header.csv: no rows after the header line"],
    ),
    data(
        "train short_row.csv -o out --dofs x",
        &["short_row.csv:5: 4 cells, but the header has 5"],
    ),
    data(
        "train long_row.csv -o out --dofs x",
        &["long_row.csv:6: 6 cells, but the header has 5"],
    ),
    data(
        "train twice.csv -o out --dofs x",
        &["twice.csv:1: column `x` appears twice, as number 2 and 3"],
    ),
    data(
        "train unnamed.csv -o out --dofs x",
        &["unnamed.csv:1: column 2 has no name"],
    ),
    data(
        "train latin.csv -o out --dofs x",
        &["latin.csv:2: cell 3 is not UTF-8"],
    ),
    data(
        "train binary.csv -o out --dofs x",
        &["binary.csv:1: cell 1 is not UTF-8"],
    ),
    data(
        "train no_time.csv -o out --dofs x",
        &["no_time.csv:1: no column `t_s`; present: time, x, label, trial"],
    ),
    data(
        "train no_label.csv -o out --dofs x",
        &["no_label.csv:1: no column `label`; present: t_s, x, trial"],
    ),
    data(
        "train no_trial.csv -o out --dofs x",
        &["no_trial.csv:1: no column `trial`; present: t_s, x, label"],
    ),
    data(
        "train good.csv -o out",
        &["good.csv:1: no column `y`; present: t_s, x, k, label, trial"],
    ),
    data(
        "train word.csv -o out --dofs x",
        &["word.csv:5: column `x`: `five` is not a number"],
    ),
    data(
        "train comma.csv -o out --dofs x",
        &["comma.csv:5: column `x`: `1,5` is not a number"],
    ),
    data(
        "train nan.csv -o out --dofs x",
        &["nan.csv:5: column `x`: NaN is not finite"],
    ),
    data(
        "train infinite.csv -o out --dofs x",
        &["infinite.csv:5: column `x`: -inf is not finite"],
    ),
    data(
        "train overflow.csv -o out --dofs x",
        &["overflow.csv:5: column `x`: inf is not finite"],
    ),
    data(
        "train no_time_cell.csv -o out --dofs x",
        &["no_time_cell.csv:5: column `t_s`: empty, a number is needed"],
    ),
    data(
        "train time_nan.csv -o out --dofs x",
        &["time_nan.csv:5: column `t_s`: NaN is not finite"],
    ),
    data(
        "train time_stops.csv -o out --dofs x",
        &["time_stops.csv:5: column `t_s`: 0.2 does not come after 0.2"],
    ),
    data(
        "train time_returns.csv -o out --dofs x",
        &["time_returns.csv:6: column `t_s`: 0.1 does not come after 0.3"],
    ),
    data(
        "train one_sample.csv -o out --dofs x",
        &[
            "one_sample.csv:5: the run of `push`",
            "at least 2 samples, this has 1",
        ],
    ),
    data(
        "train gaps.csv -o out --dofs x",
        &[
            "gaps.csv:5: the run of `push`",
            "at least 2 samples, this has 1",
        ],
    ),
    data(
        "train unlabelled.csv -o out --dofs x",
        &["unlabelled.csv:5: column `label`: empty"],
    ),
    data(
        "train good.csv -o out --dofs x --exclude lift,push",
        &["good.csv: no demonstrations left", "lift, push"],
    ),
    data(
        "train few.csv -o out --dofs x",
        &["skill `lift` has 1 demonstration(s) and needs at least 2"],
    ),
    data(
        "train lone.csv -o out --dofs x",
        &["skill `lift` has 2 demonstration(s) and needs at least 3"],
    ),
    data(
        "train identical.csv -o out --dofs x",
        &["the demonstrations of each skill are identical"],
    ),
    data(
        "train identical.csv -o out --dofs x,k",
        &["DoF `k` is 5.0 in every demonstration"],
    ),
    data(
        "train zero.csv -o out --dofs x,k:N/m:log",
        &["zero.csv: `lift` at 0 s: `k` is 0.0", "must be positive"],
    ),
    data(
        "train huge.csv -o out --dofs x",
        &["DoF `x` holds values too large to learn from"],
    ),
    data(
        "train eternity.csv -o out --dofs x",
        &["eternity.csv:5: the run of `push`", "overflows"],
    ),
    data(
        "info word.csv --exclude lift",
        &["word.csv: no demonstrations left"],
    ),
    data("info binary.csv", &["binary.csv:1: cell 1 is not UTF-8"]),
];

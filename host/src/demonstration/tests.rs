use super::{Choice, Demonstration, DemonstrationError, read, read_with_gaps};
use crate::table::Table;
use std::path::Path;

fn table(text: &str) -> Table {
    Table::read(text.as_bytes(), Path::new("demos.csv")).unwrap()
}

fn names(list: &[&str]) -> Vec<String> {
    list.iter().map(|&name| name.to_owned()).collect()
}

fn refused(text: &str, dofs: &[&str], exclude: &[&str]) -> String {
    let (dofs, exclude) = (names(dofs), names(exclude));
    let choice = Choice {
        dofs: &dofs,
        exclude: &exclude,
    };
    read(&table(text), &choice).unwrap_err().to_string()
}

const TWO_TRIALS: &str = "t_s,x,note,label,trial
0,1,a,reach,one
0.1,2,,reach,one
0.5,4,c,none,one
0.7,5,d,place,one
0.8,6,e,place,one
0,7,f,place,two
0.1,,g,place,two
0.3,9,h,place,two
";

#[test]
fn a_run_of_one_label_in_one_trial_is_a_demonstration() {
    let (dofs, exclude) = (names(&["x"]), names(&["none"]));
    let choice = Choice {
        dofs: &dofs,
        exclude: &exclude,
    };
    let found = read(&table(TWO_TRIALS), &choice).unwrap();
    let seen: Vec<_> = found
        .iter()
        .map(|d| (d.label(), d.trial(), d.t_s(), d.values()[0].as_slice()))
        .collect();
    assert_eq!(
        seen,
        [
            ("reach", "one", &[0.0, 0.1][..], &[1.0, 2.0][..]),
            ("place", "one", &[0.7, 0.8][..], &[5.0, 6.0][..]),
            ("place", "two", &[0.0, 0.3][..], &[7.0, 9.0][..]),
        ]
    );
    assert_eq!(found[0].file(), Path::new("demos.csv"));
}

#[test]
fn what_cannot_be_read_is_named() {
    assert_eq!(
        refused(TWO_TRIALS, &["x"], &[]),
        "demos.csv:4: the run of `none` that starts here: a demonstration needs at least 2 samples, \
         this has 1; exclude the label or mend the rows"
    );
    assert_eq!(
        refused(TWO_TRIALS, &["note"], &["none"]),
        "demos.csv:2: column `note`: `a` is not a number"
    );
    assert_eq!(
        refused(TWO_TRIALS, &["x"], &["none", "reach", "place"]),
        "demos.csv: no demonstrations left: its labels are none, place, reach"
    );
    assert_eq!(
        refused("t_s,x,label,trial\n0,1,a,1\n0,2,a,1\n", &["x"], &[]),
        "demos.csv:3: column `t_s`: 0.0 does not come after 0.0; times must strictly increase"
    );
    assert_eq!(
        refused("t_s,x,label,trial\n0,1,,1\n", &["x"], &[]),
        "demos.csv:2: column `label`: empty, name the skill or a label to exclude (or train with --components)"
    );
    assert_eq!(
        refused("t_s,x,trial\n0,1,1\n", &["x"], &[]),
        "demos.csv:1: no column `label`; present: t_s, x, trial"
    );
}

#[test]
fn values_between_samples_lie_on_the_line_between_them() {
    let demo = Demonstration::new(
        "a",
        "1",
        "f",
        vec![1.0, 2.0, 5.0],
        vec![vec![0.0, 1.0, 4.0]],
    )
    .unwrap();
    assert_eq!(demo.duration_s(), 4.0);
    assert_eq!(demo.phases().collect::<Vec<_>>(), [0.0, 0.25, 1.0]);
    for (phase, value) in [
        (-1.0, 0.0),
        (0.0, 0.0),
        (0.125, 0.5),
        (0.25, 1.0),
        (0.5, 2.0),
        (1.0, 4.0),
        (2.0, 4.0),
    ] {
        assert_eq!(demo.value_at(0, phase), Some(value), "at {phase}");
    }
    assert_eq!(demo.value_at(1, 0.5), None);
}

#[test]
fn numbers_that_are_no_movement_are_refused() {
    let make = |t_s: &[f64], x: &[f64]| {
        Demonstration::new("a", "1", "f", t_s.to_vec(), vec![x.to_vec()]).unwrap_err()
    };
    assert_eq!(
        make(&[0.0], &[1.0]),
        DemonstrationError::TooShort { samples: 1 }
    );
    assert_eq!(
        make(&[0.0, 1.0], &[1.0]),
        DemonstrationError::Length {
            dof: 0,
            values: 1,
            times: 2
        }
    );
    assert!(matches!(
        make(&[0.0, 1.0], &[1.0, f64::NAN]),
        DemonstrationError::NonFinite { sample: 1, .. }
    ));
    assert!(matches!(
        make(&[0.0, f64::NAN], &[1.0, 1.0]),
        DemonstrationError::NotIncreasing { sample: 1, .. }
    ));
    assert_eq!(
        Demonstration::new("a", "1", "f", vec![0.0, 1.0], vec![]).unwrap_err(),
        DemonstrationError::NoDof
    );
}

#[test]
fn an_empty_cell_is_a_gap_of_its_row_or_of_its_column_alone() {
    let text = "t_s,x,y,label,trial
0,1,,a,1
1,,,a,1
2,2,8,a,1
4,,6,a,1
5,3,,a,1
";
    let dofs = names(&["x", "y"]);
    let choice = Choice {
        dofs: &dofs,
        exclude: &[],
    };
    let refused = read(&table(text), &choice).unwrap_err().to_string();
    assert!(refused.contains("this has 1"), "{refused}");
    let found = read_with_gaps(&table(text), &choice).unwrap();
    let one = &found[0];
    assert_eq!(one.t_s(), [0.0, 2.0, 4.0, 5.0]);
    assert!(!one.is_complete());
    assert_eq!(one.present(0), Some(&[true, true, false, true][..]));
    assert_eq!(one.present(1), Some(&[false, true, true, false][..]));
    // On the line between the neighbours, and held at the ends.
    assert!((one.values()[0][2] - 8.0 / 3.0).abs() < 1e-15);
    assert_eq!(one.values()[1], [8.0, 8.0, 6.0, 6.0]);
    let whole = read(
        &table(TWO_TRIALS),
        &Choice {
            dofs: &names(&["x"]),
            exclude: &names(&["none"]),
        },
    )
    .unwrap();
    assert!(whole[0].is_complete());
    assert_eq!(whole[0].present(0), None);
    // Nothing of a DoF at all.
    let nothing = [vec![Some(1.0), Some(2.0)], vec![None, None]];
    let one = Demonstration::with_gaps("a", "1", "f", vec![0.0, 1.0], &nothing).unwrap();
    assert_eq!(one.present(1), Some(&[false, false][..]));
    let infinite = [vec![Some(f64::INFINITY), None]];
    let refused = Demonstration::with_gaps("a", "1", "f", vec![0.0, 1.0], &infinite);
    assert!(matches!(refused, Err(DemonstrationError::NonFinite { .. })));
    let short = [vec![Some(1.0)]];
    let refused = Demonstration::with_gaps("a", "1", "f", vec![0.0, 1.0], &short);
    assert!(matches!(refused, Err(DemonstrationError::Length { .. })));
}

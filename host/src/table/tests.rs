use super::{Table, TableError};
use std::path::Path;

fn read(text: &str) -> Result<Table, TableError> {
    Table::read(text.as_bytes(), Path::new("demos.csv"))
}

fn message(result: Result<impl Sized, TableError>) -> String {
    match result {
        Ok(_) => panic!("accepted"),
        Err(error) => error.to_string(),
    }
}

#[test]
fn numbers_and_text_come_back_as_written() {
    let table = read("t_s,x,label\n0.0, 1.5 ,reach\n0.1,-2e-3,reach one\n").unwrap();
    assert_eq!(table.columns(), ["t_s", "x", "label"]);
    assert_eq!(table.rows(), 2);
    assert_eq!(table.numbers("x").unwrap(), [1.5, -2e-3]);
    assert_eq!(table.text("label").unwrap(), ["reach", "reach one"]);
}

#[test]
fn byte_order_mark_carriage_returns_and_quotes_are_read() {
    let table = read("\u{feff}t_s,\"x\"\r\n0,\"1\"\r\n1,2\r\n").unwrap();
    assert_eq!(table.columns(), ["t_s", "x"]);
    assert_eq!(table.numbers("x").unwrap(), [1.0, 2.0]);
}

#[test]
fn an_empty_cell_is_a_gap_only_where_gaps_are_asked_for() {
    let table = read("t_s,x\n0,\n1,2\n").unwrap();
    assert_eq!(
        table.numbers_or_gaps_in("x", 0..2).unwrap(),
        [None, Some(2.0)]
    );
    assert_eq!(
        message(table.numbers("x")),
        "demos.csv:2: column `x`: empty, a number is needed"
    );
}

#[test]
fn lines_are_the_files_lines() {
    for text in [
        "t_s,x\n\n0,1\n\n\n1,bad\n",
        "\u{feff}t_s,x\r\n\r\n0,1\r\n\r\n\r\n1,bad",
        "\nt_s,x\n0,\"1\"\n\n\n1,bad\n",
    ] {
        let table = read(text).unwrap();
        assert_eq!(
            message(table.numbers("x")),
            "demos.csv:6: column `x`: `bad` is not a number"
        );
    }
    assert_eq!(
        message(read("t_s,x\n0,1\n\n1\n")),
        "demos.csv:4: 1 cells, but the header has 2"
    );
}

#[test]
fn bad_cells_are_named() {
    let table = read("t_s,x,y\n0,nan,1\n0.5,1,-inf\n").unwrap();
    assert_eq!(
        message(table.numbers("x")),
        "demos.csv:2: column `x`: NaN is not finite"
    );
    assert_eq!(
        message(table.numbers("y")),
        "demos.csv:3: column `y`: -inf is not finite"
    );
    assert_eq!(
        message(table.numbers("z")),
        "demos.csv:1: no column `z`; present: t_s, x, y"
    );
}

#[test]
fn times_must_increase() {
    let table = read("t_s\n0\n1\n0\n0\n").unwrap();
    let increasing = |rows: std::ops::Range<usize>| {
        let times_s = table.numbers_in("t_s", rows.clone()).unwrap();
        table.strictly_increasing("t_s", &times_s, rows.start)
    };
    assert!(increasing(0..2).is_ok());
    assert!(increasing(2..3).is_ok());
    assert_eq!(
        message(increasing(0..4)),
        "demos.csv:4: column `t_s`: 0.0 does not come after 1.0; times must strictly increase"
    );
    assert_eq!(
        message(increasing(2..4)),
        "demos.csv:5: column `t_s`: 0.0 does not come after 0.0; times must strictly increase"
    );
}

#[test]
fn only_the_rows_asked_for_must_be_numbers() {
    let table = read("x\nno\n1\n2\nno\n").unwrap();
    assert_eq!(table.numbers_in("x", 1..3).unwrap(), [1.0, 2.0]);
    assert!(table.numbers_in("x", 1..9).is_err());
    assert_eq!(table.numbers_in("x", 7..9).unwrap(), [0.0; 0]);
}

#[test]
fn files_that_are_not_tables_are_refused() {
    assert_eq!(
        message(read("")),
        "demos.csv: empty, it needs a header line and rows"
    );
    assert_eq!(
        message(read("t_s,x\n")),
        "demos.csv: no rows after the header line"
    );
    assert_eq!(
        message(read("t_s,x\n0,1\n1\n")),
        "demos.csv:3: 1 cells, but the header has 2"
    );
    assert_eq!(
        message(read("t_s,x,x\n0,1,2\n")),
        "demos.csv:1: column `x` appears twice, as number 2 and 3"
    );
    assert_eq!(
        message(read("t_s,,x\n0,1,2\n")),
        "demos.csv:1: column 2 has no name"
    );
    let bytes: &[u8] = b"t_s,x\n0,\xff\xfe\n";
    assert_eq!(
        message(Table::read(bytes, Path::new("demos.csv"))),
        "demos.csv:2: cell 2 is not UTF-8 text"
    );
    assert_eq!(
        message(Table::open(Path::new("/nonexistent/demos.csv"))),
        "/nonexistent/demos.csv: cannot be read"
    );
}

#[test]
fn other_separators_are_named() {
    for text in ["t_s;x\n0,5;1\n", "t_s\tx\n0\t1\n"] {
        let refused = read(text).unwrap_err();
        assert!(matches!(refused, TableError::Separator { .. }), "{refused}");
    }
}

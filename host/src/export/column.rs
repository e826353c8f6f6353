//! The columns of a table of rows, with their units.

use tonus_shared::wire::Muscle;

/// A column.
#[derive(Clone, Debug, PartialEq, Eq)]
pub struct Column {
    /// Its name, unit last.
    pub name: String,
    /// Its unit; `1` for shares and counts, empty for text.
    pub unit: &'static str,
    /// What it holds.
    pub description: &'static str,
    /// Whether it is text.
    pub text: bool,
}

/// What stands in a column of a row.
#[derive(Clone, Debug, PartialEq)]
pub enum Cell {
    /// Nothing is known.
    Missing,
    /// A number.
    Number(f64),
    /// A word.
    Text(String),
}

impl From<f64> for Cell {
    fn from(value: f64) -> Self {
        Self::Number(value)
    }
}

fn column(name: impl Into<String>, unit: &'static str, description: &'static str) -> Column {
    Column {
        name: name.into(),
        unit,
        description,
        text: false,
    }
}

fn three(
    all: &mut Vec<Column>,
    before: &str,
    after: &str,
    unit: &'static str,
    description: &'static str,
) {
    for axis in ["x", "y", "z"] {
        all.push(column(format!("{before}{axis}{after}"), unit, description));
    }
}

/// The columns of a row, in the order of its cells. `muscles` are the channels in use.
pub(super) fn columns(muscles: &[Muscle]) -> Vec<Column> {
    let mut all = of_stream(muscles);
    of_newest(&mut all);
    all
}

fn of_stream(muscles: &[Muscle]) -> Vec<Column> {
    let mut all = vec![
        column(
            "t_s",
            "s",
            "when the newest scan was taken, session time, by the comparison of clocks",
        ),
        column("arrived_s", "s", "when the packet came, session time"),
        column(
            "describes_s",
            "s",
            "when activation, co-contraction and stiffness were so, session time",
        ),
        column(
            "device_us",
            "us",
            "when the newest scan was taken, wearable's clock",
        ),
        column("boot_id", "1", "start of the wearable"),
        column("sequence", "1", "number of the packet"),
    ];
    for (number, muscle) in (1..).zip(muscles) {
        let name = format!("envelope_{number}_{}", muscle.name());
        all.push(column(
            name,
            "1",
            "share of the maximum voluntary contraction",
        ));
    }
    for number in 1..=muscles.len() {
        let description = "warnings, bits: 1 saturated, 2 flat, 4 mains hum, 8 lead off";
        all.push(column(format!("quality_{number}"), "1", description));
    }
    all.push(column("activation", "1", "muscle activation, eq. 4"));
    all.push(column(
        "co_contraction",
        "1",
        "co-contraction factor, eq. 8",
    ));
    let of_hand = "stiffness of the hand, shoulder frame";
    three(&mut all, "stiffness_", "_n_per_m", "N/m", of_hand);
    all.push(column(
        "stream_flags",
        "1",
        "what the values rest on, bits as in docs/wire.md",
    ));
    all
}

fn of_newest(all: &mut Vec<Column>) {
    three(
        all,
        "hand_",
        "_m",
        "m",
        "palm, tracker's frame; empty where it is not seen",
    );
    all.push(column(
        "hand_exposed_s",
        "s",
        "when that picture was taken, session time",
    ));
    three(
        all,
        "robot_",
        "_m",
        "m",
        "where the robot said that it is, base frame",
    );
    let kept = "stiffness that the robot said it keeps";
    three(all, "robot_k", "_n_per_m", "N/m", kept);
    all.push(column(
        "robot_measured_s",
        "s",
        "when it was there, session time",
    ));
    three(
        all,
        "setpoint_",
        "_m",
        "m",
        "where the gate told the robot to be, base frame",
    );
    three(
        all,
        "setpoint_k",
        "_n_per_m",
        "N/m",
        "stiffness that the gate told it",
    );
    let text = |name: &str, description| Column {
        text: true,
        ..column(name, "", description)
    };
    all.push(text("gate_state", "state of the robot's gate"));
    all.push(text(
        "skill",
        "what was decided on; `unknown` for none of the skills",
    ));
}

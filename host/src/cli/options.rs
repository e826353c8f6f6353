//! Option values that more than one verb takes.

use std::path::PathBuf;

use anyhow::Result;
use tonus::demonstration::{
    Choice, Demonstration, ReadError, read, read_unlabelled, read_with_gaps,
};
use tonus::model::{Dof, Transform};
use tonus::session::DOFS;
use tonus::table::Table;
use tonus_shared::promp::Basis;

/// Columns of a CSV file that are no signals.
pub(super) const NOT_SIGNALS: [&str; 3] = ["t_s", "label", "trial"];

/// `NAME`, `NAME:UNIT` or `NAME:UNIT:log`.
pub(super) fn dof(text: &str) -> Result<Dof, String> {
    let mut fields = text.split(':');
    let name = fields.next().unwrap_or_default().trim();
    let unit = fields.next().unwrap_or("m");
    let transform = match fields.next() {
        None => Transform::Identity,
        Some("log") => Transform::Log,
        Some(other) => return Err(format!("`{other}` is no transform: `log` is the only one")),
    };
    if name.is_empty() || fields.next().is_some() {
        return Err("give NAME, NAME:UNIT or NAME:UNIT:log".to_owned());
    }
    Ok(Dof {
        name: name.to_owned(),
        unit: unit.to_owned(),
        transform,
    })
}

/// `gaussian:20`, `fourier:21`, `bernstein:8`.
pub(super) fn basis(text: &str) -> Result<Basis, String> {
    let (family, count) = text.split_once(':').unwrap_or((text, "20"));
    let count = count
        .parse()
        .map_err(|_| format!("`{count}` is not a number of functions"))?;
    // More are never filled by demonstrations, and the normal equations grow with their square.
    if count > MAX_FUNCTIONS {
        return Err(format!("at most {MAX_FUNCTIONS} functions"));
    }
    let basis = match family {
        "gaussian" => Basis::gaussian(count),
        "fourier" => Basis::fourier(count),
        "bernstein" => Basis::bernstein(count),
        other => {
            return Err(format!(
                "`{other}` is no basis: gaussian, fourier or bernstein"
            ));
        }
    };
    basis.map_err(|error| error.to_string())
}

const MAX_FUNCTIONS: usize = 200;

/// One instant: `x=0.1,y=0.2`.
#[derive(Clone, Debug)]
pub(super) struct Instant(pub(super) Vec<(String, f64)>);

/// Parses an [`Instant`].
pub(super) fn instant(text: &str) -> Result<Instant, String> {
    let one = |pair: &str| {
        let (name, value) = pair
            .split_once('=')
            .ok_or_else(|| format!("`{pair}` is not NAME=VALUE"))?;
        Ok::<_, String>((name.trim().to_owned(), finite(value.trim())?))
    };
    text.split(',')
        .map(one)
        .collect::<Result<_, _>>()
        .map(Instant)
}

/// Where the movement is to be at a phase: `0.5:x=0.1,y=0.2`.
#[derive(Clone, Debug)]
pub(super) struct ViaPoint(pub(super) f64, pub(super) Instant);

/// Parses a [`ViaPoint`].
pub(super) fn via_point(text: &str) -> Result<ViaPoint, String> {
    let (at, values) = text
        .split_once(':')
        .ok_or_else(|| format!("`{text}` is not S:NAME=VALUE,..."))?;
    Ok(ViaPoint(phase(at.trim())?, instant(values)?))
}

/// Where the movement starts and how it moves there: `x=0.1/0.02,y=0.2/0`, before it a phase other than 0 and a
/// colon.
#[derive(Clone, Debug)]
pub(super) struct Start {
    pub(super) phase: f64,
    /// Name, value, rate per second.
    pub(super) states: Vec<(String, f64, f64)>,
}

/// Parses a [`Start`].
pub(super) fn start(text: &str) -> Result<Start, String> {
    let (at, states) = text.split_once(':').unwrap_or(("0", text));
    let one = |state: &str| {
        let parts = state
            .split_once('=')
            .and_then(|(name, state)| Some((name, state.split_once('/')?)));
        let (name, (value, rate)) =
            parts.ok_or_else(|| format!("`{state}` is not NAME=VALUE/RATE"))?;
        let (value, rate) = (finite(value.trim())?, finite(rate.trim())?);
        Ok::<_, String>((name.trim().to_owned(), value, rate))
    };
    Ok(Start {
        phase: phase(at.trim())?,
        states: states.split(',').map(one).collect::<Result<_, _>>()?,
    })
}

/// A finite number.
pub(super) fn finite(text: &str) -> Result<f64, String> {
    match text.parse::<f64>() {
        Ok(value) if value.is_finite() => Ok(value),
        _ => Err(format!("`{text}` is not a finite number")),
    }
}

/// A finite number above zero.
pub(super) fn positive(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    if value > 0.0 {
        Ok(value)
    } else {
        Err(format!("`{text}` is not above 0"))
    }
}

/// A finite number from zero.
pub(super) fn not_negative(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    if value >= 0.0 {
        Ok(value)
    } else {
        Err(format!("`{text}` is below 0"))
    }
}

/// A phase from 0 to 1.
pub(super) fn phase(text: &str) -> Result<f64, String> {
    let value = finite(text)?;
    if (0.0..=1.0).contains(&value) {
        Ok(value)
    } else {
        Err(format!("`{text}` is no phase: 0 is the start, 1 the end"))
    }
}

/// A part of a whole, above 0 and at most 1.
pub(super) fn fraction(text: &str) -> Result<f64, String> {
    let value = positive(text)?;
    if value <= 1.0 {
        Ok(value)
    } else {
        Err(format!("`{text}` is above 1"))
    }
}

/// All demonstrations of all files, in their order; rows with an empty cell are left out.
pub(super) fn demonstrations(
    files: &[PathBuf],
    dofs: &[Dof],
    exclude: &[String],
) -> Result<Vec<Demonstration>> {
    each(files, dofs, exclude, read)
}

/// The same, with what those rows do hold.
pub(super) fn demonstrations_with_gaps(
    files: &[PathBuf],
    dofs: &[Dof],
    exclude: &[String],
) -> Result<Vec<Demonstration>> {
    each(files, dofs, exclude, read_with_gaps)
}

/// The same, some of them without a label.
pub(super) fn unlabelled_demonstrations(
    files: &[PathBuf],
    dofs: &[Dof],
    exclude: &[String],
) -> Result<Vec<Demonstration>> {
    each(files, dofs, exclude, read_unlabelled)
}

/// All demonstrations of what is followed live.
pub(super) fn live_demonstrations(
    files: &[PathBuf],
    exclude: &[String],
) -> Result<Vec<Demonstration>> {
    each_of(files, &DOFS.map(str::to_owned), exclude, read)
}

fn each(
    files: &[PathBuf],
    dofs: &[Dof],
    exclude: &[String],
    read: fn(&Table, &Choice<'_>) -> Result<Vec<Demonstration>, ReadError>,
) -> Result<Vec<Demonstration>> {
    let names: Vec<_> = dofs.iter().map(|dof| dof.name.clone()).collect();
    each_of(files, &names, exclude, read)
}

fn each_of(
    files: &[PathBuf],
    names: &[String],
    exclude: &[String],
    read: fn(&Table, &Choice<'_>) -> Result<Vec<Demonstration>, ReadError>,
) -> Result<Vec<Demonstration>> {
    let choice = Choice {
        dofs: names,
        exclude,
    };
    let mut all = Vec::new();
    for file in files {
        all.extend(read(&Table::open(file)?, &choice)?);
    }
    Ok(all)
}

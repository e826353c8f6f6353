//! Writes what the suite on the chip is compared with, as Rust source: inputs in `f32`, and expected results in `f64` from
//! the reference files, SciPy, the golden script, and the host's own arithmetic: `vectors OUT.rs`.

use std::fmt::Write as _;
use std::fs;

use rand::RngExt as _;
use rand::SeedableRng as _;
use rand_chacha::ChaCha8Rng;
use tonus::model::Model;
use tonus_shared::Real;
use tonus_shared::promp::{
    Latent, Mixture, Moments, Observation, Order, Row, Skill, curves_scratch_len, mixture_len,
    root_len, trajectory_scratch_len,
};
use tonus_shared::stiffness::{ArmPosture, ArmStiffness};
use tonus_tests::{frames, work::Work};

type Error = Box<dyn std::error::Error>;

/// Latent dimensions on the chip.
const RANK: usize = 16;
/// Phases at which the posterior is compared, and observed phases (three positions at each).
const POINTS: usize = 21;
const INSTANTS: usize = 334;
/// One millimetre, squared.
const VARIANCE: f64 = 1e-6;
const ARMS: usize = 50;

fn main() -> Result<(), Error> {
    let out = std::env::args().nth(1).ok_or("usage: vectors OUT.rs")?;
    let work = Work::read()?;
    let model = work.learn(&work.labelled)?;
    let mut text = String::new();
    posterior(&model, &mut text)?;
    envelopes(&mut text)?;
    stiffness(&mut text)?;
    wire(&mut text)?;
    Ok(fs::write(out, text)?)
}

/// The model's leading latent dimensions, a thousand observations, and what the host expects after them. The host is
/// given what the chip is, all of it rounded to `f32`: only the arithmetic differs.
fn posterior(model: &Model, text: &mut String) -> Result<(), Error> {
    let view = model.view()?;
    let (dofs, basis) = (view.latent.dofs(), view.latent.basis().count());
    let loading: Vec<f64> = (view.latent.loading().chunks(view.latent.rank()))
        .flat_map(|row| narrowed(&row[..RANK]))
        .collect();
    let latent = Latent::new(*view.latent.basis(), dofs, RANK, &loading)?;
    let mut means = Vec::new();
    let mut roots = Vec::new();
    for skill in &view.skills {
        means.push(narrowed(skill.weight_mean()));
        roots.push(leading(skill.root().ok_or("no root")?, view.latent.rank()));
    }
    let residual = narrowed(view.skills[0].residual_variance());
    let parts = view.skills.iter().zip(means.iter().zip(&roots));
    let skills: Vec<Skill<'_, f64>> = parts
        .map(|(skill, (mean, root))| {
            let log_prior = f32::of(skill.log_prior()).widen();
            Skill::new(&latent, mean, Some(root), &residual, log_prior)
        })
        .collect::<Result<_, _>>()?;
    write_model(text, &latent, &skills)?;
    let storage = vec![0.0; mixture_len(skills.len(), basis, RANK)];
    let mut mixture = Mixture::new(latent, &skills, storage)?;
    let movement = mixture.trajectory(0).ok_or("no skill")?;
    let mut rng = ChaCha8Rng::seed_from_u64(1);
    let mut scratch = vec![0.0; trajectory_scratch_len(basis, RANK)];
    let mut seen = Vec::new();
    for instant in 0..INSTANTS {
        for dof in 0..3 {
            let row = Row::position(dof, instant as f64 / (INSTANTS - 1) as f64);
            let value = movement.moments(&row, &mut scratch)?.mean;
            let value = value + VARIANCE.sqrt() * rng.random_range(-1.7..1.7);
            seen.push((dof, f32::of(row.phase), f32::of(value)));
        }
    }
    seen.truncate(1000);
    for (dof, phase, value) in &seen {
        mixture.observe(&Observation {
            row: Row::position(*dof, phase.widen()),
            value: value.widen(),
            variance: f32::of(VARIANCE).widen(),
        })?;
    }
    list(text, "SEEN", "(usize, f32, f32)", seen)?;
    let phases: Vec<f64> = (0..POINTS)
        .map(|i| f64::from(i as f32 / (POINTS - 1) as f32))
        .collect();
    let mut scratch = vec![0.0; curves_scratch_len(dofs, basis, RANK)];
    let mut curves = Vec::new();
    for skill in 0..skills.len() {
        let trajectory = mixture.trajectory(skill).ok_or("no skill")?;
        let mut moments = vec![
            Moments {
                mean: 0.0,
                variance: 0.0
            };
            dofs * POINTS
        ];
        trajectory.curves(Order::Position, &phases, &mut scratch, &mut moments)?;
        curves.extend(
            moments
                .iter()
                .map(|moment| (moment.mean, moment.variance.sqrt())),
        );
    }
    list(text, "PHASES", "f32", phases.iter().copied().map(f32::of))?;
    // Skill by skill, DoF by DoF, phase by phase.
    list(text, "CURVES", "(f64, f64)", curves)?;
    let mut log_posterior = vec![0.0; skills.len()];
    mixture.log_posterior(&mut log_posterior)?;
    list(text, "LOG_POSTERIOR", "f64", log_posterior)
}

fn write_model(
    text: &mut String,
    latent: &Latent<'_, f64>,
    skills: &[Skill<'_, f64>],
) -> Result<(), Error> {
    let (dofs, basis) = (latent.dofs(), latent.basis().count());
    writeln!(
        text,
        "pub(crate) const DOFS: usize = {dofs};\npub(crate) const BASIS: usize = {basis};\n\
         pub(crate) const RANK: usize = {RANK};\npub(crate) const SKILLS: usize = {};\n\
         pub(crate) const VARIANCE: f32 = {VARIANCE:e};",
        skills.len()
    )?;
    list(text, "LOADING", "f32", narrow(latent.loading()))?;
    list(
        text,
        "RESIDUAL",
        "f32",
        narrow(skills[0].residual_variance()),
    )?;
    let means = skills.iter().map(|skill| narrow(skill.weight_mean()));
    list(text, "MEANS", &format!("[f32; {}]", dofs * basis), means)?;
    let roots = skills.iter().filter_map(|skill| skill.root().map(narrow));
    list(text, "ROOTS", &format!("[f32; {}]", root_len(RANK)), roots)?;
    let log_priors = skills.iter().map(|skill| f32::of(skill.log_prior()));
    list(text, "LOG_PRIORS", "f32", log_priors)
}

/// The leading triangle of a packed one of `rank` rows.
fn leading(root: &[f64], rank: usize) -> Vec<f64> {
    let mut rest = root;
    (0..RANK)
        .flat_map(|column| {
            let (entries, after) = rest.split_at(rank - column);
            rest = after;
            narrowed(&entries[..RANK - column])
        })
        .collect()
}

/// SciPy's envelope (`golden/reference`).
fn envelopes(text: &mut String) -> Result<(), Error> {
    let path = concat!(env!("CARGO_MANIFEST_DIR"), "/golden/reference/emg_ref.csv");
    let mut file = csv::Reader::from_path(path)?;
    let header = file.headers()?.clone();
    let column = |name: &str| {
        header
            .iter()
            .position(|is| is == name)
            .ok_or("no such column")
    };
    let (x, expected) = (column("x")?, column("stream_hp2_20Hz")?);
    let mut rows = Vec::new();
    for record in file.records() {
        let record = record?;
        rows.push((
            record[x].parse::<f64>().map(f32::of)?,
            record[expected].parse::<f64>()?,
        ));
    }
    list(text, "ENVELOPE", "(f32, f64)", rows)
}

/// Activation, joint angles, and the Cartesian stiffness of the host.
fn stiffness(text: &mut String) -> Result<(), Error> {
    let arm = ArmStiffness::<f64>::illustrative();
    let mut rng = ChaCha8Rng::seed_from_u64(2);
    let mut rows = Vec::new();
    while rows.len() < ARMS {
        let activation = f32::of(rng.random_range(0.0..2.0));
        let angles = [0.3..1.2, -0.5..0.5, -0.5..0.5, 0.6..2.2]
            .map(|range| f32::of(rng.random_range(range)));
        let posture = ArmPosture::from_angles(angles.map(f32::widen))?;
        let Ok(stiffness) = arm.at(activation.widen(), &posture) else {
            continue;
        };
        let diagonal = <[f64; 3]>::from(stiffness.cartesian.diagonal());
        rows.push((activation, angles, stiffness.co_contraction, diagonal));
    }
    list(text, "ARMS", "(f32, [f32; 4], f64, [f64; 3])", rows)
}

/// The golden script's frames.
fn wire(text: &mut String) -> Result<(), Error> {
    let frames = frames::golden();
    writeln!(
        text,
        "pub(crate) static FRAMES: [&[u8]; {}] = [",
        frames.len()
    )?;
    for (name, bytes) in frames {
        writeln!(text, "    // {name}\n    &{bytes:?},")?;
    }
    writeln!(text, "];")?;
    Ok(())
}

/// Rounded to `f32`, as `f64`.
fn narrowed(numbers: &[f64]) -> Vec<f64> {
    narrow(numbers).into_iter().map(f32::widen).collect()
}

fn narrow(numbers: &[f64]) -> Vec<f32> {
    numbers.iter().copied().map(f32::of).collect()
}

fn list<V: std::fmt::Debug>(
    text: &mut String,
    name: &str,
    of: &str,
    values: impl IntoIterator<Item = V>,
) -> Result<(), Error> {
    let values: Vec<V> = values.into_iter().collect();
    let length = values.len();
    writeln!(text, "pub(crate) static {name}: [{of}; {length}] = [")?;
    for value in values {
        writeln!(text, "    {value:?},")?;
    }
    writeln!(text, "];")?;
    Ok(())
}

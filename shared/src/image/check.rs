//! What an image may say, whoever wrote it. Tables are checked where inference takes them.

use super::{ImageDof, ImageError, LABEL_BYTES, ModelImage, Role, Settings, Transform};
use crate::onset::OnsetDetector;

/// Shortest and longest movement whose mean a skill may have, seconds.
const DURATIONS_S: (f32, f32) = (0.05, 60.0);
/// Largest spread of log duration: a factor of seven.
const MAX_LOG_STD: f32 = 2.0;
/// Shortest and longest interval between observations, seconds.
const INTERVALS_S: (f32, f32) = (0.001, 10.0);
/// Any other time, seconds.
const MAX_TIME_S: f32 = 10.0;
/// Sensors' noise: below it conditioning has nothing to divide by, above it they say nothing.
const NOISES: (f32, f32) = (1e-6, 1e3);

pub(super) fn all(image: &ModelImage<'_>) -> Result<(), ImageError> {
    settings(&image.settings)?;
    for (index, one) in image.dofs.iter().enumerate() {
        dof(index, one)?;
    }
    roles(&image.dofs)?;
    if image.skills.is_empty() {
        return Err(ImageError::Range {
            what: "the number of skills",
            value: 0.0,
            low: 1.0,
            high: super::MAX_SKILLS as f32,
        });
    }
    for (skill, named) in image.named.iter().enumerate() {
        let bytes = named.label.as_bytes();
        if !(1..=LABEL_BYTES).contains(&bytes.len()) || bytes.contains(&0) {
            return Err(ImageError::Label { skill });
        }
        let before = skill.checked_sub(1).and_then(|b| image.named.get(b));
        if before.is_some_and(|before| before.label >= named.label) {
            return Err(ImageError::LabelOrder { skill });
        }
        let (shortest, longest) = DURATIONS_S;
        let (low, high) = (libm::logf(shortest), libm::logf(longest));
        within("a mean log duration", named.log_duration_mean, (low, high))?;
        let spread = named.log_duration_std;
        within("a spread of log duration", spread, (0.0, MAX_LOG_STD))?;
    }
    Ok(())
}

fn settings(settings: &Settings) -> Result<(), ImageError> {
    let Settings {
        placement_m,
        interval_s,
        lead_s,
        onset_late_s,
        onset_std_s,
        onset,
    } = settings;
    within("the placement", *placement_m, (0.0, MAX_TIME_S))?;
    within("the interval", *interval_s, INTERVALS_S)?;
    within("the lead", *lead_s, (0.0, MAX_TIME_S))?;
    within(
        "the onset's lateness",
        *onset_late_s,
        (-MAX_TIME_S, MAX_TIME_S),
    )?;
    within("the onset's deviation", *onset_std_s, (0.0, MAX_TIME_S))?;
    OnsetDetector::<f32>::new(onset)?;
    Ok(())
}

fn dof(index: usize, dof: &ImageDof) -> Result<(), ImageError> {
    let (transform, noises) = match dof.role {
        Role::HumanPosition(axis) | Role::HumanStiffness(axis) if axis > 2 => {
            let what = "position or stiffness";
            return Err(ImageError::Role { what, axis, got: 1 });
        }
        // Never observed: no noise to know.
        Role::Other => return within("the noise of another DoF", dof.noise_std, (0.0, 0.0)),
        Role::HumanPosition(_) => (Transform::Identity, NOISES),
        Role::HumanStiffness(_) => (Transform::Log, NOISES),
    };
    if dof.transform != transform {
        return Err(ImageError::Transform { dof: index });
    }
    within("a sensor's noise", dof.noise_std, noises)
}

/// Every stiffness once; every position once, or none.
fn roles(dofs: &[ImageDof]) -> Result<(), ImageError> {
    let count = |role: Role| dofs.iter().filter(|dof| dof.role == role).count();
    let positions = dofs
        .iter()
        .any(|dof| matches!(dof.role, Role::HumanPosition(_)));
    for axis in 0..3 {
        let got = count(Role::HumanStiffness(axis));
        if got != 1 {
            let what = "stiffness";
            return Err(ImageError::Role { what, axis, got });
        }
        let got = count(Role::HumanPosition(axis));
        if got != usize::from(positions) {
            let what = "position";
            return Err(ImageError::Role { what, axis, got });
        }
    }
    Ok(())
}

fn within(what: &'static str, value: f32, (low, high): (f32, f32)) -> Result<(), ImageError> {
    if (low..=high).contains(&value) {
        return Ok(());
    }
    Err(ImageError::Range {
        what,
        value,
        low,
        high,
    })
}

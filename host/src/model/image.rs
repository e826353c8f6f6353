//! A model as bytes for the chip: `docs/model_image.md`.

use std::collections::BTreeMap;

use tonus_shared::image::{
    self, Capacity, ImageDof, ImageError, ImageSkill, LABEL_BYTES, ModelImage, Role, Settings,
};
use tonus_shared::onset::OnsetConfig;
use tonus_shared::promp::{Basis, Family, Latent, Skill};

use super::reduce::{ReduceError, Reduced};
use super::tempo::LogNormal;
use super::{Model, Transform};

/// What is exported, and what the chip is told with it.
#[derive(Clone, Debug, PartialEq)]
pub struct Export {
    /// Columns of the hand's position, x, y, z; none runs on stiffness alone.
    pub positions: Option<[String; 3]>,
    /// Columns of the hand's stiffness.
    pub stiffnesses: [String; 3],
    /// Whether the model's other DoFs go along, though the chip observes none of them.
    pub others: bool,
    /// Latent dimensions at most.
    pub rank: usize,
    /// Standard deviation of the tracker's noise, metres.
    pub position_sigma_m: f64,
    /// That of a stiffness, as a share of it.
    pub stiffness_sigma: f64,
    /// One observation of each sensor so often, seconds.
    pub interval_s: f64,
    /// As [`TempoConfig::tempo_log_std`](super::tempo::TempoConfig::tempo_log_std).
    pub tempo_log_std: f64,
    /// As [`TempoConfig::lead_s`](super::tempo::TempoConfig::lead_s).
    pub lead_s: f64,
    /// As [`TempoConfig::onset_late_s`](super::tempo::TempoConfig::onset_late_s).
    pub onset_late_s: f64,
    /// As [`TempoConfig::onset_std_s`](super::tempo::TempoConfig::onset_std_s).
    pub onset_std_s: f64,
    /// What counts as a movement.
    pub onset: OnsetConfig,
    /// What the wearable has room for.
    pub capacity: Capacity,
}

/// Why a model cannot be exported.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum ExportError {
    /// A column that the model has not.
    #[error("the model has no DoF `{name}`, it has {}", has.join(", "))]
    NoDof {
        /// The name.
        name: String,
        /// What it has.
        has: Vec<String>,
    },
    /// A label that is too long for the chip.
    #[error(
        "the label `{label}` has {got} bytes, the wearable takes {LABEL_BYTES}: rename the skill"
    )]
    Label {
        /// The label.
        label: String,
        /// Its length in bytes.
        got: usize,
    },
    /// A number that `f32` does not hold.
    #[error("{what} is {value}: no f32")]
    Number {
        /// Which number.
        what: &'static str,
        /// The number.
        value: f64,
    },
    /// The interval between observations.
    #[error("the interval is {interval_s} s: give a positive number, at most 10")]
    Interval {
        /// The interval, seconds.
        interval_s: f64,
    },
    /// Fewer DoFs or directions that cannot be.
    #[error(transparent)]
    Reduce(#[from] ReduceError),
    /// What the chip would refuse.
    #[error(transparent)]
    Image(#[from] ImageError),
}

/// An image, and what it was made of.
#[derive(Clone, Debug, PartialEq)]
pub struct Exported {
    /// The bytes.
    pub bytes: Vec<u8>,
    /// The same model in `f64`.
    pub reduced: Reduced,
}

impl Export {
    /// Makes the image, and reads it back as the chip will.
    ///
    /// # Errors
    /// [`ExportError`] names the field that does not fit.
    pub fn image(&self, model: &Model) -> Result<Exported, ExportError> {
        let roles = self.roles(model)?;
        let chosen: Vec<usize> = roles.keys().copied().collect();
        let (basis, capacity) = (model.parts().basis, &self.capacity);
        let fits = |what, most, got| {
            if got > most {
                return Err(ImageError::Capacity { what, most, got });
            }
            Ok(())
        };
        fits("DoFs", capacity.dofs, chosen.len())?;
        fits("basis functions", capacity.functions, basis.count())?;
        fits("rank", capacity.rank, self.rank)?;
        fits("skills", capacity.skills, model.labels().len())?;
        let reduced = Reduced::of(model, &chosen, self.rank, self.instants(model)?)?;
        let dofs = roles.iter().map(|(&dof, &role)| self.dof(model, dof, role));
        let dofs = dofs.collect::<Result<Vec<_>, _>>()?;
        let bytes = self.encoded(model, &reduced, &dofs)?;
        Ok(Exported { bytes, reduced })
    }

    /// DoFs of the image by their number in the model, in its order.
    fn roles(&self, model: &Model) -> Result<BTreeMap<usize, Role>, ExportError> {
        let mut roles = BTreeMap::new();
        if self.others {
            roles.extend((0..model.dofs().len()).map(|dof| (dof, Role::Other)));
        }
        let named = |names: &[String; 3], role: fn(u8) -> Role| {
            let pairs = names.iter().zip(0..).map(|(name, axis)| {
                let has = || model.dofs().iter().map(|dof| dof.name.clone()).collect();
                let dof = model.dof(name).ok_or_else(|| ExportError::NoDof {
                    name: name.clone(),
                    has: has(),
                })?;
                Ok((dof, role(axis)))
            });
            pairs.collect::<Result<Vec<_>, ExportError>>()
        };
        roles.extend(named(&self.stiffnesses, Role::HumanStiffness)?);
        if let Some(positions) = &self.positions {
            roles.extend(named(positions, Role::HumanPosition)?);
        }
        Ok(roles)
    }

    /// Instants at which a movement of mean duration is observed.
    fn instants(&self, model: &Model) -> Result<usize, ExportError> {
        let interval_s = self.interval_s;
        if !(interval_s > 0.0 && interval_s <= 10.0) {
            return Err(ExportError::Interval { interval_s });
        }
        let durations = model.durations();
        let mean_s = durations.iter().map(|d| d.mean_s).sum::<f64>() / durations.len() as f64;
        Ok((mean_s / interval_s).clamp(1.0, 1000.0) as usize)
    }

    fn dof(&self, model: &Model, dof: usize, role: Role) -> Result<ImageDof, ExportError> {
        let noise_std = match role {
            Role::Other => 0.0,
            Role::HumanPosition(_) => self.position_sigma_m,
            Role::HumanStiffness(_) => self.stiffness_sigma,
        };
        Ok(ImageDof {
            role,
            transform: match model.dofs()[dof].transform {
                Transform::Identity => image::Transform::Identity,
                Transform::Log => image::Transform::Log,
            },
            noise_std: single("a sensor's noise", noise_std)?,
        })
    }

    fn settings(&self, model: &Model) -> Result<Settings, ExportError> {
        Ok(Settings {
            placement_m: single("the placement", model.parts().placement_m)?,
            interval_s: single("the interval", self.interval_s)?,
            lead_s: single("the lead", self.lead_s)?,
            onset_late_s: single("the onset's lateness", self.onset_late_s)?,
            onset_std_s: single("the onset's deviation", self.onset_std_s)?,
            onset: self.onset,
        })
    }

    fn encoded(
        &self,
        model: &Model,
        reduced: &Reduced,
        dofs: &[ImageDof],
    ) -> Result<Vec<u8>, ExportError> {
        let view = reduced.view().map_err(ReduceError::from)?;
        let basis = single_basis(view.latent.basis())?;
        let loading = singles("the loading", view.latent.loading())?;
        let (count, rank) = (view.latent.dofs(), view.latent.rank());
        let latent = Latent::new(basis, count, rank, &loading).map_err(ImageError::from)?;
        let tables = view.skills.iter().map(|skill| {
            Ok([
                singles("a mean weight", skill.weight_mean())?,
                singles("a root", skill.root().unwrap_or_default())?,
                singles("a residual variance", skill.residual_variance())?,
            ])
        });
        let tables = tables.collect::<Result<Vec<_>, ExportError>>()?;
        let named = model.labels().iter().zip(model.durations());
        let each = view.skills.iter().zip(&tables).zip(named);
        let skills = each.map(|((skill, [mean, root, residual]), (label, durations))| {
            if label.len() > LABEL_BYTES {
                let (label, got) = (label.clone(), label.len());
                return Err(ExportError::Label { label, got });
            }
            let lasting = LogNormal::new(durations, self.tempo_log_std);
            let named = ImageSkill {
                label,
                log_duration_mean: single("a log duration", lasting.log_mean)?,
                log_duration_std: single("a log duration's spread", lasting.log_std)?,
            };
            let log_prior = single("a log prior", skill.log_prior())?;
            let made = Skill::new(&latent, mean, Some(root), residual, log_prior);
            let mut made = made.map_err(ImageError::from)?;
            if let Some(freedom) = skill.freedom() {
                let freedom = single("the degrees of freedom", freedom)?;
                made = made.with_freedom(freedom).map_err(ImageError::from)?;
            }
            Ok((named, made))
        });
        let skills = skills.collect::<Result<Vec<_>, ExportError>>()?;
        let image = ModelImage::new(self.settings(model)?, dofs, latent, &skills)?;
        let mut bytes = vec![0; image.encoded_len()];
        image.encode(&mut bytes)?;
        Ok(bytes)
    }
}

fn single_basis(basis: &Basis) -> Result<Basis, ExportError> {
    let family = match basis.family() {
        Family::Gaussian { width } => Family::Gaussian {
            width: f64::from(single("the width", width)?),
        },
        other => other,
    };
    Ok(Basis::new(family, basis.count()).map_err(ImageError::from)?)
}

/// The nearest `f32`; one that overflows is refused.
#[allow(
    clippy::cast_possible_truncation,
    reason = "rounding to nearest is the contract"
)]
fn single(what: &'static str, value: f64) -> Result<f32, ExportError> {
    let nearest = value as f32;
    if nearest.is_finite() {
        return Ok(nearest);
    }
    Err(ExportError::Number { what, value })
}

fn singles(what: &'static str, values: &[f64]) -> Result<Vec<f32>, ExportError> {
    values.iter().map(|value| single(what, *value)).collect()
}

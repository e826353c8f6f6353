//! A model as the chip keeps it: one run of bytes in flash whose tables inference borrows where they lie.
//!
//! `docs/model_image.md` lists every byte. The same checks hold for who writes one and who reads one: what
//! [`ModelImage::encode`] would write, [`ModelImage::parse`] takes. The bytes end with a CRC-32, which finds what the
//! flash or a careless copy did to them; whether they are the model that was sent is for the storage's SHA-256 to say.

mod check;
mod error;
mod layout;
mod write;

use heapless::Vec;

use crate::onset::OnsetConfig;
use crate::promp::{Basis, Latent, Skill};
pub use error::ImageError;
pub use layout::{MAGIC, VERSION, image_len};
use layout::{Reader, Shape, table_lens};
use write::Writer;

/// Degrees of freedom of an image at most.
pub const MAX_DOFS: usize = 16;
/// Skills of an image at most.
pub const MAX_SKILLS: usize = 8;
/// Bytes of a label at most.
pub const LABEL_BYTES: usize = 16;

/// What a build has room for.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub struct Capacity {
    /// Degrees of freedom at most.
    pub dofs: usize,
    /// Basis functions of each at most.
    pub functions: usize,
    /// Latent dimensions at most.
    pub rank: usize,
    /// Skills at most.
    pub skills: usize,
}

/// What the wearable has room for: human and robot, positions and stiffnesses.
pub const WEARABLE: Capacity = Capacity {
    dofs: 12,
    functions: 30,
    rank: 16,
    skills: 4,
};

/// What a DoF of the model is to the wearable.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Role {
    /// It is never observed on the chip: a robot's coordinate.
    Other,
    /// The hand's position along an axis of the shoulder frame (0 x, 1 y, 2 z), metres.
    HumanPosition(u8),
    /// The hand's stiffness along that axis, N/m; its logarithm in the model.
    HumanStiffness(u8),
}

/// How a DoF's value enters the model.
#[derive(Clone, Copy, Debug, PartialEq, Eq)]
pub enum Transform {
    /// As it is.
    Identity,
    /// Its natural logarithm.
    Log,
}

/// One degree of freedom.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct ImageDof {
    /// What it is.
    pub role: Role,
    /// How its value enters.
    pub transform: Transform,
    /// Standard deviation of the sensor's noise as the model has it: metres, or a share where the logarithm enters. Zero
    /// for a DoF that is not observed.
    pub noise_std: f32,
}

/// What belongs to the model as a whole.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Settings {
    /// Standard deviation of where somebody stands, metres. The roots hold it already; it is told, not used.
    pub placement_m: f32,
    /// One observation of each sensor so often, seconds: what a sensor gets wrong it gets wrong a moment later too.
    pub interval_s: f32,
    /// So long before the onset that was detected a movement's observations begin, seconds.
    pub lead_s: f32,
    /// What the detected onset is late by on average (negative: early), seconds.
    pub onset_late_s: f32,
    /// Standard deviation of its error, seconds.
    pub onset_std_s: f32,
    /// What counts as a movement, by the hand's speed.
    pub onset: OnsetConfig,
}

/// One skill.
#[derive(Clone, Copy, Debug)]
pub struct ImageSkill<'a> {
    /// Its name, 1 to 16 bytes.
    pub label: &'a str,
    /// Mean of the logarithm of its duration in seconds.
    pub log_duration_mean: f32,
    /// Standard deviation of that logarithm.
    pub log_duration_std: f32,
}

/// A model, checked. Tables are borrowed: `D*K*r` numbers of the loading, and of every skill `D*K` means, a packed root
/// and `D` residual variances.
#[derive(Clone, Debug)]
pub struct ModelImage<'a> {
    settings: Settings,
    dofs: Vec<ImageDof, MAX_DOFS>,
    latent: Latent<'a, f32>,
    named: Vec<ImageSkill<'a>, MAX_SKILLS>,
    skills: Vec<Skill<'a, f32>, MAX_SKILLS>,
}

impl<'a> ModelImage<'a> {
    /// A model out of its parts.
    ///
    /// # Errors
    /// [`ImageError`] names what cannot be.
    pub fn new(
        settings: Settings,
        dofs: &[ImageDof],
        latent: Latent<'a, f32>,
        skills: &[(ImageSkill<'a>, Skill<'a, f32>)],
    ) -> Result<Self, ImageError> {
        let most = |what, most, got| ImageError::Capacity { what, most, got };
        if dofs.len() != latent.dofs() {
            let (expected, got) = (latent.dofs(), dofs.len());
            return Err(ImageError::Dofs { expected, got });
        }
        let shape = (latent.basis().count(), latent.rank());
        for (what, got) in [("basis functions", shape.0), ("rank", shape.1)] {
            if got > usize::from(u8::MAX) {
                return Err(most(what, usize::from(u8::MAX), got));
            }
        }
        let mut image = Self {
            settings,
            dofs: Vec::from_slice(dofs).map_err(|_| most("DoFs", MAX_DOFS, dofs.len()))?,
            latent,
            named: Vec::new(),
            skills: Vec::new(),
        };
        for (named, skill) in skills {
            let full = most("skills", MAX_SKILLS, skills.len());
            image.named.push(*named).map_err(|_| full)?;
            image.skills.push(*skill).map_err(|_| full)?;
        }
        check::all(&image)?;
        Ok(image)
    }

    /// A model out of bytes that begin at a multiple of four, as the flash's pages do.
    ///
    /// # Errors
    /// [`ImageError`]; no bytes make it panic.
    pub fn parse(bytes: &'a [u8], capacity: &Capacity) -> Result<Self, ImageError> {
        let shape = layout::shape(bytes)?;
        shape.fits(capacity)?;
        layout::sound(bytes, &shape)?;
        let mut reader = Reader::new(bytes, layout::SHAPE_END);
        let basis = reader.basis(shape.functions)?;
        let settings = reader.settings()?;
        let mut dofs = Vec::<ImageDof, MAX_DOFS>::new();
        for index in 0..shape.dofs {
            let _fits_the_capacity = dofs.push(reader.dof(index)?);
        }
        let mut records = Vec::<_, MAX_SKILLS>::new();
        for index in 0..shape.skills {
            let _fits_the_capacity = records.push(reader.skill(index)?);
        }
        let lens = table_lens(shape.dofs, shape.functions, shape.rank);
        let loading = reader.table(lens.loading)?;
        let latent = Latent::new(basis, shape.dofs, shape.rank, loading)?;
        let mut skills = Vec::<_, MAX_SKILLS>::new();
        for record in &records {
            let (mean, root) = (reader.table(lens.mean)?, reader.table(lens.root)?);
            let residual = reader.table(lens.residual)?;
            let skill = Skill::new(&latent, mean, Some(root), residual, record.log_prior)?;
            let skill = match record.freedom {
                Some(freedom) => skill.with_freedom(freedom)?,
                None => skill,
            };
            let _fits_the_capacity = skills.push((record.named, skill));
        }
        Self::new(settings, &dofs, latent, &skills)
    }

    /// Writes the bytes to `out`, [`ModelImage::encoded_len`] of them; returns how many.
    ///
    /// # Errors
    /// [`ImageError::Buffer`] if `out` is shorter.
    pub fn encode(&self, out: &mut [u8]) -> Result<usize, ImageError> {
        let needed = self.encoded_len();
        let got = out.len();
        let out = out
            .get_mut(..needed)
            .ok_or(ImageError::Buffer { needed, got })?;
        let mut writer = Writer::new(out);
        writer.shape(&self.shape());
        writer.basis(self.basis());
        writer.settings(&self.settings);
        for dof in &self.dofs {
            writer.dof(dof);
        }
        for (named, skill) in self.named.iter().zip(&self.skills) {
            writer.skill(named, skill);
        }
        writer.table(self.latent.loading());
        for skill in &self.skills {
            writer.table(skill.weight_mean());
            writer.root(skill, self.latent.rank());
            writer.table(skill.residual_variance());
        }
        writer.finish();
        Ok(needed)
    }

    /// Bytes of the image.
    #[must_use]
    pub fn encoded_len(&self) -> usize {
        let Shape {
            dofs,
            functions,
            rank,
            skills,
        } = self.shape();
        image_len(dofs, functions, rank, skills)
    }

    fn shape(&self) -> Shape {
        Shape {
            dofs: self.dofs.len(),
            functions: self.basis().count(),
            rank: self.latent.rank(),
            skills: self.skills.len(),
        }
    }

    /// What belongs to the model as a whole.
    #[must_use]
    pub const fn settings(&self) -> &Settings {
        &self.settings
    }

    /// The basis.
    #[must_use]
    pub const fn basis(&self) -> &Basis {
        self.latent.basis()
    }

    /// The latent space that all skills share.
    #[must_use]
    pub const fn latent(&self) -> Latent<'a, f32> {
        self.latent
    }

    /// The degrees of freedom.
    #[must_use]
    pub fn dofs(&self) -> &[ImageDof] {
        &self.dofs
    }

    /// The skills as inference takes them.
    #[must_use]
    pub fn skills(&self) -> &[Skill<'a, f32>] {
        &self.skills
    }

    /// Names and durations of the skills, in the same order.
    #[must_use]
    pub fn named(&self) -> &[ImageSkill<'a>] {
        &self.named
    }

    /// Which DoF has a role.
    #[must_use]
    pub fn dof(&self, role: Role) -> Option<usize> {
        self.dofs.iter().position(|dof| dof.role == role)
    }
}

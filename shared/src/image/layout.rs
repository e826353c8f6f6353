//! The bytes, little-endian: `docs/model_image.md` in code.

use super::{
    Capacity, ImageDof, ImageError, ImageSkill, LABEL_BYTES, MAX_DOFS, MAX_SKILLS, Role, Settings,
    Transform,
};
use crate::onset::OnsetConfig;
use crate::promp::{Basis, Family, loading_len, root_len};

/// `TNSM`, the first four bytes.
pub const MAGIC: u32 = u32::from_le_bytes(*b"TNSM");
/// Of this format.
pub const VERSION: u32 = 1;

/// Magic, version, length, four sizes.
pub(super) const SHAPE_END: usize = 16;
/// Shape, basis, settings.
const HEADER_BYTES: usize = 68;
const DOF_BYTES: usize = 8;
const SKILL_BYTES: usize = 32;
const CRC_BYTES: usize = 4;
pub(super) const CRC: crc::Crc<u32> = crc::Crc::<u32>::new(&crc::CRC_32_ISO_HDLC);

pub(super) const GAUSSIAN: u8 = 0;
pub(super) const FOURIER: u8 = 1;
pub(super) const BERNSTEIN: u8 = 2;
pub(super) const IDENTITY: u8 = 0;
pub(super) const LOG: u8 = 1;
/// Codes of the roles: 0 other, 1 to 3 the position's axes, 4 to 6 the stiffness'.
pub(super) const POSITIONS: u8 = 1;
pub(super) const STIFFNESSES: u8 = 4;

// Tables are borrowed as they lie.
const _: () = assert!(cfg!(target_endian = "little"));
const _: () = assert!(HEADER_BYTES.is_multiple_of(4) && SKILL_BYTES.is_multiple_of(4));

/// Numbers of each table.
pub(super) struct TableLens {
    pub(super) loading: usize,
    pub(super) mean: usize,
    pub(super) root: usize,
    pub(super) residual: usize,
}

pub(super) const fn table_lens(dofs: usize, functions: usize, rank: usize) -> TableLens {
    TableLens {
        loading: loading_len(dofs, functions, rank),
        mean: dofs * functions,
        root: root_len(rank),
        residual: dofs,
    }
}

/// Bytes of an image of these sizes (each at most 255).
#[must_use]
pub const fn image_len(dofs: usize, functions: usize, rank: usize, skills: usize) -> usize {
    let lens = table_lens(dofs, functions, rank);
    let numbers = lens.loading + skills * (lens.mean + lens.root + lens.residual);
    HEADER_BYTES + DOF_BYTES * dofs + SKILL_BYTES * skills + 4 * numbers + CRC_BYTES
}

/// The sizes of a model.
pub(super) struct Shape {
    pub(super) dofs: usize,
    pub(super) functions: usize,
    pub(super) rank: usize,
    pub(super) skills: usize,
}

impl Shape {
    pub(super) fn fits(&self, capacity: &Capacity) -> Result<(), ImageError> {
        for (what, most, got) in [
            ("DoFs", capacity.dofs.min(MAX_DOFS), self.dofs),
            ("basis functions", capacity.functions, self.functions),
            ("rank", capacity.rank, self.rank),
            ("skills", capacity.skills.min(MAX_SKILLS), self.skills),
        ] {
            if got > most {
                return Err(ImageError::Capacity { what, most, got });
            }
        }
        Ok(())
    }
}

/// The sizes that the bytes state.
pub(super) fn shape(bytes: &[u8]) -> Result<Shape, ImageError> {
    let short = |expected| ImageError::Length {
        expected,
        got: bytes.len(),
    };
    let (words, _) = bytes.as_chunks::<4>();
    let [magic, version, length, sizes, ..] = words else {
        return Err(short(image_len(1, 1, 1, 1)));
    };
    let [magic, version, length] = [magic, version, length].map(|word| u32::from_le_bytes(*word));
    if magic != MAGIC {
        let (expected, got) = (MAGIC, magic);
        return Err(ImageError::Magic { expected, got });
    }
    if version != VERSION {
        let (expected, got) = (VERSION, version);
        return Err(ImageError::Version { expected, got });
    }
    let expected = length as usize;
    if expected != bytes.len() {
        return Err(short(expected));
    }
    let [dofs, functions, rank, skills] = sizes.map(usize::from);
    Ok(Shape {
        dofs,
        functions,
        rank,
        skills,
    })
}

/// Length, place and checksum.
pub(super) fn sound(bytes: &[u8], shape: &Shape) -> Result<(), ImageError> {
    let expected = image_len(shape.dofs, shape.functions, shape.rank, shape.skills);
    let got = bytes.len();
    let split = got.checked_sub(CRC_BYTES).filter(|_| got == expected);
    let (body, crc) = split
        .and_then(|at| bytes.split_at_checked(at))
        .ok_or(ImageError::Length { expected, got })?;
    let got = le(crc);
    let expected = CRC.checksum(body);
    if got != expected {
        return Err(ImageError::Crc { expected, got });
    }
    Ok(())
}

fn le(bytes: &[u8]) -> u32 {
    let all = bytes.iter().rev();
    all.fold(0, |word, byte| word << 8 | u32::from(*byte))
}

/// A skill's record.
pub(super) struct Record<'a> {
    pub(super) named: ImageSkill<'a>,
    pub(super) log_prior: f32,
    pub(super) freedom: Option<f32>,
}

/// Reads what [`sound`] said is all there.
pub(super) struct Reader<'a> {
    rest: &'a [u8],
    length: usize,
}

impl<'a> Reader<'a> {
    pub(super) fn new(bytes: &'a [u8], from: usize) -> Self {
        Self {
            rest: bytes.get(from..).unwrap_or_default(),
            length: bytes.len(),
        }
    }

    fn take(&mut self, count: usize) -> Result<&'a [u8], ImageError> {
        let got = self.length;
        let (taken, rest) = self
            .rest
            .split_at_checked(count)
            .ok_or(ImageError::Length {
                expected: got - self.rest.len() + count,
                got,
            })?;
        self.rest = rest;
        Ok(taken)
    }

    fn number(&mut self) -> Result<f32, ImageError> {
        Ok(f32::from_bits(le(self.take(4)?)))
    }

    fn numbers<const N: usize>(&mut self) -> Result<[f32; N], ImageError> {
        let mut all = [0.0; N];
        for number in &mut all {
            *number = self.number()?;
        }
        Ok(all)
    }

    /// Two codes and two zeros.
    fn codes(&mut self, what: &'static str, index: usize) -> Result<[u8; 2], ImageError> {
        let word = le(self.take(4)?).to_le_bytes();
        let [one, other, spare @ ..] = word;
        match spare.into_iter().find(|byte| *byte != 0) {
            Some(got) => Err(ImageError::Code { what, index, got }),
            None => Ok([one, other]),
        }
    }

    pub(super) fn basis(&mut self, count: usize) -> Result<Basis, ImageError> {
        let [family, spare] = self.codes("a byte kept free, of the basis", 0)?;
        let [width] = self.numbers()?;
        let code = |what, got| ImageError::Code {
            what,
            index: 0,
            got,
        };
        if spare != 0 {
            return Err(code("a byte kept free, of the basis", spare));
        }
        let family = match family {
            GAUSSIAN => Family::Gaussian {
                width: f64::from(width),
            },
            FOURIER => Family::Fourier,
            BERNSTEIN => Family::Bernstein,
            other => return Err(code("the family of basis", other)),
        };
        if !matches!(family, Family::Gaussian { .. }) && width != 0.0 {
            return Err(ImageError::Range {
                what: "the width of a basis that has none",
                value: width,
                low: 0.0,
                high: 0.0,
            });
        }
        Ok(Basis::new(family, count)?)
    }

    pub(super) fn settings(&mut self) -> Result<Settings, ImageError> {
        let [placement_m, interval_s, lead_s, onset_late_s, onset_std_s] = self.numbers()?;
        let onset: [f32; 6] = self.numbers()?;
        let [
            window_s,
            start_m_per_s,
            rest_multiple,
            release,
            shortest_movement_s,
            shortest_pause_s,
        ] = onset.map(f64::from);
        Ok(Settings {
            placement_m,
            interval_s,
            lead_s,
            onset_late_s,
            onset_std_s,
            onset: OnsetConfig {
                window_s,
                start_m_per_s,
                rest_multiple,
                release,
                shortest_movement_s,
                shortest_pause_s,
            },
        })
    }

    pub(super) fn dof(&mut self, index: usize) -> Result<ImageDof, ImageError> {
        let [role, transform] = self.codes("a byte kept free, of DoF", index)?;
        let code = |what, got| ImageError::Code { what, index, got };
        Ok(ImageDof {
            role: match role {
                0 => Role::Other,
                POSITIONS..STIFFNESSES => Role::HumanPosition(role - POSITIONS),
                STIFFNESSES..7 => Role::HumanStiffness(role - STIFFNESSES),
                other => return Err(code("the role of DoF", other)),
            },
            transform: match transform {
                IDENTITY => Transform::Identity,
                LOG => Transform::Log,
                other => return Err(code("the transform of DoF", other)),
            },
            noise_std: self.number()?,
        })
    }

    pub(super) fn skill(&mut self, skill: usize) -> Result<Record<'a>, ImageError> {
        let padded = self.take(LABEL_BYTES)?;
        let zeros = padded.iter().rev().take_while(|byte| **byte == 0).count();
        let label = padded.get(..padded.len() - zeros).unwrap_or_default();
        let label = core::str::from_utf8(label).map_err(|_| ImageError::Label { skill })?;
        let [log_prior, freedom, log_duration_mean, log_duration_std] = self.numbers()?;
        Ok(Record {
            named: ImageSkill {
                label,
                log_duration_mean,
                log_duration_std,
            },
            log_prior,
            // Positive zero alone is a Gaussian: another way to write it would not be written back.
            freedom: (freedom.to_bits() != 0).then_some(freedom),
        })
    }

    pub(super) fn table(&mut self, numbers: usize) -> Result<&'a [f32], ImageError> {
        let bytes = self.take(4 * numbers)?;
        bytemuck::try_cast_slice(bytes).map_err(|_| ImageError::Alignment)
    }
}

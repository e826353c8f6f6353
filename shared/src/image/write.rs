//! Writing the bytes: the mirror of `layout`.

use super::layout::{
    BERNSTEIN, CRC, FOURIER, GAUSSIAN, IDENTITY, LOG, MAGIC, POSITIONS, STIFFNESSES, Shape, VERSION,
};
use super::{ImageDof, ImageSkill, LABEL_BYTES, Role, Settings, Transform};
use crate::promp::{Basis, Family, Skill};

/// Writes into exactly as many bytes as the image has.
pub(super) struct Writer<'o> {
    out: &'o mut [u8],
    at: usize,
}

impl<'o> Writer<'o> {
    pub(super) const fn new(out: &'o mut [u8]) -> Self {
        Self { out, at: 0 }
    }

    fn put(&mut self, bytes: &[u8]) {
        let end = self.at + bytes.len();
        if let Some(place) = self.out.get_mut(self.at..end) {
            place.copy_from_slice(bytes);
        }
        self.at = end;
    }

    pub(super) fn table(&mut self, numbers: &[f32]) {
        for number in numbers {
            self.put(&number.to_le_bytes());
        }
    }

    #[allow(clippy::cast_possible_truncation, reason = "sizes were checked to fit")]
    pub(super) fn shape(&mut self, shape: &Shape) {
        let Shape {
            dofs,
            functions,
            rank,
            skills,
        } = *shape;
        for word in [MAGIC, VERSION, self.out.len() as u32] {
            self.put(&word.to_le_bytes());
        }
        self.put(&[dofs, functions, rank, skills].map(|size| size as u8));
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "the chip's numbers are f32"
    )]
    pub(super) fn basis(&mut self, basis: &Basis) {
        let (code, width) = match basis.family() {
            Family::Gaussian { width } => (GAUSSIAN, width as f32),
            Family::Fourier => (FOURIER, 0.0),
            Family::Bernstein => (BERNSTEIN, 0.0),
        };
        self.put(&[code, 0, 0, 0]);
        self.table(&[width]);
    }

    #[allow(
        clippy::cast_possible_truncation,
        reason = "the chip's numbers are f32"
    )]
    pub(super) fn settings(&mut self, settings: &Settings) {
        let Settings {
            placement_m,
            interval_s,
            lead_s,
            onset_late_s,
            onset_std_s,
            onset,
        } = *settings;
        self.table(&[placement_m, interval_s, lead_s, onset_late_s, onset_std_s]);
        let detector = [
            onset.window_s,
            onset.start_m_per_s,
            onset.rest_multiple,
            onset.release,
            onset.shortest_movement_s,
            onset.shortest_pause_s,
        ];
        self.table(&detector.map(|number| number as f32));
    }

    pub(super) fn dof(&mut self, dof: &ImageDof) {
        let role = match dof.role {
            Role::Other => 0,
            Role::HumanPosition(axis) => POSITIONS + axis,
            Role::HumanStiffness(axis) => STIFFNESSES + axis,
        };
        let transform = match dof.transform {
            Transform::Identity => IDENTITY,
            Transform::Log => LOG,
        };
        self.put(&[role, transform, 0, 0]);
        self.table(&[dof.noise_std]);
    }

    pub(super) fn skill(&mut self, named: &ImageSkill<'_>, skill: &Skill<'_, f32>) {
        let mut label = [0; LABEL_BYTES];
        for (place, byte) in label.iter_mut().zip(named.label.bytes()) {
            *place = byte;
        }
        self.put(&label);
        let freedom = skill.freedom().unwrap_or(0.0);
        let durations = [named.log_duration_mean, named.log_duration_std];
        self.table(&[skill.log_prior(), freedom, durations[0], durations[1]]);
    }

    /// The root, written out where it is the identity.
    pub(super) fn root(&mut self, skill: &Skill<'_, f32>, rank: usize) {
        if let Some(root) = skill.root() {
            return self.table(root);
        }
        for column in 0..rank {
            self.table(&[1.0]);
            for _ in column + 1..rank {
                self.table(&[0.0]);
            }
        }
    }

    pub(super) fn finish(self) {
        let body = self.out.get(..self.at).unwrap_or_default();
        let crc = CRC.checksum(body);
        if let Some(place) = self.out.get_mut(self.at..) {
            place.copy_from_slice(&crc.to_le_bytes());
        }
    }
}

//! What is said of a movement.

use heapless::Vec;

use super::{Recognition, RecognitionError};
use crate::image::MAX_SKILLS;
use crate::promp::Quantity;
use crate::wire::{Inference, MAX_STIFFNESS_N_PER_M, SkillPosterior};

impl Recognition<'_> {
    /// At a time; `None` at rest.
    pub(super) fn answer(&mut self, now_us: u64) -> Result<Option<Inference>, RecognitionError> {
        if !self.begun() {
            return Ok(None);
        }
        let time_s = self.since_origin_s(now_us);
        let mut all = [0.0; MAX_SKILLS];
        let skills = self.image.skills().len();
        let log_posterior = all.get_mut(..skills).unwrap_or_default();
        self.bank.log_posterior(log_posterior)?;
        let mut top = Vec::new();
        let mut taken = [false; MAX_SKILLS];
        while !top.is_full() {
            let open = log_posterior.iter().zip(&taken).enumerate();
            // A skill of which nothing is left is not among the probable ones.
            let open = open.filter(|(_, (log, taken))| log.is_finite() && !**taken);
            let Some((skill, (log, _))) = open.max_by(|one, other| one.1.0.total_cmp(other.1.0))
            else {
                break;
            };
            let one = SkillPosterior {
                skill: u8::try_from(skill).unwrap_or(u8::MAX),
                log_posterior: *log,
            };
            let _has_room = top.push(one);
            if let Some(taken) = taken.get_mut(skill) {
                *taken = true;
            }
        }
        let best = top.first().map(|one| usize::from(one.skill));
        let phase = self
            .bank
            .phase(best, time_s)
            .map_or(0.0, |phase| phase.mean);
        let mut stiffness_n_per_m = [0.0; 3];
        for (axis, value) in stiffness_n_per_m.iter_mut().enumerate() {
            *value = self.expected(axis, time_s)?;
        }
        Ok(Some(Inference {
            skills: u8::try_from(skills).unwrap_or(u8::MAX),
            top,
            phase,
            stiffness_n_per_m,
        }))
    }

    /// Mean stiffness by all hypotheses, of the log-normal with their mean and variance.
    fn expected(&mut self, axis: usize, time_s: f32) -> Result<f32, RecognitionError> {
        let dof = self.stiffnesses.get(axis).copied().unwrap_or_default();
        let of = (dof, Quantity::Position);
        let moments = self.bank.moments(None, of, time_s, self.scratch)?;
        let value = libm::expf(moments.mean + 0.5 * moments.variance);
        if (f32::MIN_POSITIVE..=MAX_STIFFNESS_N_PER_M).contains(&value) {
            return Ok(value);
        }
        Err(RecognitionError::Stiffness { axis, value })
    }
}

//! Composition: a movement of one skill through via-points, or from where the robot is and how it moves; one
//! skill after another without a jerk; several at once.
//!
//! Everything is in the DoFs' units; a DoF that enters the model as its logarithm is composed as such, so that
//! a bridge or a blend never makes a stiffness negative.

mod blend;

pub use blend::{Part, blend};

use tonus_shared::promp::{
    Belief, Bridge, ComposeError, ConditionError, ModelError, Observation, Row, RowError, State,
    Trajectory, belief_len, trajectory_scratch_len, via_len, via_point,
};

use super::{Dof, Model, NotPositive, View};

/// What cannot be planned.
#[derive(Clone, Debug, PartialEq, thiserror::Error)]
pub enum PlanError {
    /// A DoF or a skill that the model has not.
    #[error("the model has no {what} number {index}, it has {count}")]
    Unknown {
        /// `DoF` or `skill`.
        what: &'static str,
        /// The number asked for, from 0.
        index: usize,
        /// How many there are.
        count: usize,
    },
    /// Plans of different models in one blend.
    #[error("the plans of a blend are not of one model")]
    Models,
    /// A value without a logarithm.
    #[error(transparent)]
    NotPositive(#[from] NotPositive),
    /// A via-point or a start that inference refused.
    #[error(transparent)]
    Condition(#[from] ConditionError),
    /// A row that inference refused.
    #[error(transparent)]
    Row(#[from] RowError),
    /// A model that inference refused.
    #[error(transparent)]
    Model(#[from] ModelError),
    /// A bridge or a blend that cannot be.
    #[error(transparent)]
    Compose(#[from] ComposeError),
}

/// Where one DoF is to be at a phase, or how it is to move there.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Via {
    /// Which DoF.
    pub dof: usize,
    /// When, as a phase.
    pub phase: f64,
    /// In the DoF's unit.
    pub value: f64,
    /// How closely: a standard deviation in the DoF's unit.
    pub std: f64,
}

/// Where one DoF is, and how it moves.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Present {
    /// Which DoF.
    pub dof: usize,
    /// In the DoF's unit.
    pub value: f64,
    /// The same per second.
    pub rate: f64,
}

/// What a plan or a blend expects of one DoF at one phase.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Planned {
    /// Mean, in the DoF's unit.
    pub mean: f64,
    /// Standard deviation of the movement itself.
    pub std: f64,
    /// Change of the mean per second.
    pub rate: f64,
}

/// From when, and until when, a movement is bridged from the present to what the skill expects.
#[derive(Clone, Copy, Debug, PartialEq)]
pub struct Joint {
    /// The phase of the present.
    pub phase: f64,
    /// Phase after it until the skill goes on alone.
    pub overlap: f64,
}

/// One movement of one skill: what it is asked to pass through, and where it starts.
#[derive(Clone, Debug)]
pub struct Plan<'m> {
    model: &'m Model,
    view: &'m View<'m>,
    skill: usize,
    duration_s: f64,
    belief: Belief<f64, Vec<f64>>,
    /// One for each DoF.
    bridges: Vec<Option<Bridge<f64>>>,
    scratch: Vec<f64>,
}

impl<'m> Plan<'m> {
    /// Nothing asked yet, a movement of `duration_s`. `view` is the model's own.
    ///
    /// # Errors
    /// A skill that there is not, a duration that is not positive and finite.
    pub fn new(
        model: &'m Model,
        view: &'m View<'m>,
        skill: usize,
        duration_s: f64,
    ) -> Result<Self, PlanError> {
        let known = skill_of(view, skill)?;
        let belief = Belief::new(known, vec![0.0; belief_len(known.rank())])?;
        Self::with(model, view, (skill, duration_s), belief)
    }

    /// As [`Plan::new`], from what has been observed of the movement: a belief of the same skill, such as a
    /// recogniser's, which goes on by itself.
    ///
    /// # Errors
    /// As [`Plan::new`].
    pub fn given<B: AsRef<[f64]>>(
        model: &'m Model,
        view: &'m View<'m>,
        (skill, duration_s): (usize, f64),
        belief: &Belief<f64, B>,
    ) -> Result<Self, PlanError> {
        let known = skill_of(view, skill)?;
        // Refuses a belief of another rank.
        Trajectory::posterior(view.latent, *known, belief)?;
        let belief = belief.copied(vec![0.0; belief_len(belief.rank())])?;
        Self::with(model, view, (skill, duration_s), belief)
    }

    fn with(
        model: &'m Model,
        view: &'m View<'m>,
        (skill, duration_s): (usize, f64),
        belief: Belief<f64, Vec<f64>>,
    ) -> Result<Self, PlanError> {
        if !(duration_s.is_finite() && duration_s > 0.0) {
            return Err(RowError::Duration { duration_s }.into());
        }
        let (basis, rank) = (view.latent.basis().count(), view.latent.rank());
        let scratch = trajectory_scratch_len(basis, rank).max(via_len(basis, rank));
        Ok(Self {
            model,
            view,
            skill,
            duration_s,
            belief,
            bridges: vec![None; model.dofs().len()],
            scratch: vec![0.0; scratch],
        })
    }

    /// The skill.
    #[must_use]
    pub const fn skill(&self) -> usize {
        self.skill
    }

    /// How long the movement takes, seconds.
    #[must_use]
    pub const fn duration_s(&self) -> f64 {
        self.duration_s
    }

    /// Asks the movement to pass through a value. A DoF in its logarithm is asked to first order:
    /// `std / value`.
    ///
    /// # Errors
    /// A DoF that there is not, what [`via_point`] refuses; the plan is as before then.
    pub fn via(&mut self, via: &Via) -> Result<(), PlanError> {
        let dof = signal(self.model, via.dof)?;
        let observation = Observation {
            row: Row::position(via.dof, via.phase),
            value: dof.encode(via.value)?,
            variance: dof.encode_variance(via.value, via.std)?,
        };
        self.condition(&observation)
    }

    /// Starts the movement where the DoFs are and how they move at `joint.phase`: exactly, whatever the skill's
    /// demonstrations did.
    ///
    /// Each DoF's position and velocity condition the skill, with the standard deviation `std` (share of the
    /// DoF's spread over the demonstrations; for the velocity, that per duration), so that the rest of the
    /// movement and every other DoF answer to them. What is left of the gap a [`Bridge`] closes, and fades
    /// over `joint.overlap`. Joins made before are dropped for these DoFs.
    ///
    /// # Errors
    /// A DoF that there is not, numbers that inference refuses; the plan is as before then.
    pub fn start(&mut self, present: &[Present], joint: Joint, std: f64) -> Result<(), PlanError> {
        let mut plan = self.clone();
        let mut states = Vec::with_capacity(present.len());
        for now in present {
            let dof = signal(plan.model, now.dof)?;
            let state = State {
                position: dof.encode(now.value)?,
                velocity: encode_rate(dof, now),
            };
            let spread = std * plan.model.parts().scale[now.dof];
            let rate = spread / plan.duration_s;
            let velocity = Row::velocity(now.dof, joint.phase, plan.duration_s);
            for (row, value, std) in [
                (Row::position(now.dof, joint.phase), state.position, spread),
                (velocity, state.velocity, rate),
            ] {
                plan.condition(&Observation {
                    row,
                    value,
                    variance: std * std,
                })?;
            }
            states.push((now.dof, state));
        }
        // After all of them: each DoF's start moves the others.
        for (dof, state) in states {
            let span = (joint.phase, joint.overlap);
            let duration_s = plan.duration_s;
            let mut scratch = std::mem::take(&mut plan.scratch);
            let bridge = Bridge::new(
                &plan.trajectory()?,
                dof,
                span,
                duration_s,
                state,
                &mut scratch,
            );
            plan.scratch = scratch;
            plan.bridges[dof] = Some(bridge?);
        }
        *self = plan;
        Ok(())
    }

    /// Takes over from `previous`, which is at the phase `at`: starts all DoFs where it has them and how it moves
    /// them there ([`Plan::start`], at phase 0).
    ///
    /// # Errors
    /// As [`Plan::start`] and [`Plan::predict`]; the plan is as before then.
    pub fn follow(
        &mut self,
        previous: &mut Plan<'_>,
        at: f64,
        overlap: f64,
        std: f64,
    ) -> Result<(), PlanError> {
        let mut present = Vec::with_capacity(self.model.dofs().len());
        for dof in 0..self.model.dofs().len() {
            let (value, rate) = previous.reference(dof, at)?;
            present.push(Present { dof, value, rate });
        }
        let phase = 0.0;
        self.start(&present, Joint { phase, overlap }, std)
    }

    /// What a robot is to follow at a phase: position (the DoF's unit) and velocity (per second). Of a
    /// DoF in its logarithm the median, `exp` of the mean, whose rate is exact.
    ///
    /// # Errors
    /// A DoF that there is not, a phase that is not finite.
    pub fn reference(&mut self, dof: usize, phase: f64) -> Result<(f64, f64), PlanError> {
        let (position, velocity, _) = self.encoded(dof, phase)?;
        let value = signal(self.model, dof)?.decode(position, 0.0).0;
        let rate = signal(self.model, dof)?.decode_rate(value, velocity);
        Ok((value, rate))
    }

    /// What the plan expects of a DoF at a phase. A DoF in its logarithm has the mean of the log-normal, as
    /// everywhere; [`Plan::reference`] has its median.
    ///
    /// # Errors
    /// A DoF that there is not, a phase that is not finite.
    pub fn predict(&mut self, dof: usize, phase: f64) -> Result<Planned, PlanError> {
        let (position, velocity, variance) = self.encoded(dof, phase)?;
        let dof = signal(self.model, dof)?;
        let (mean, std) = dof.decode(position, variance);
        let rate = dof.decode_rate(mean, velocity);
        Ok(Planned { mean, std, rate })
    }

    /// Position, velocity and the position's variance as the model has them.
    fn encoded(&mut self, dof: usize, phase: f64) -> Result<(f64, f64, f64), PlanError> {
        signal(self.model, dof)?;
        let known = skill_of(self.view, self.skill)?;
        let trajectory = Trajectory::posterior(self.view.latent, *known, &self.belief)?;
        let at = trajectory.moments(&Row::position(dof, phase), &mut self.scratch)?;
        let row = Row::velocity(dof, phase, self.duration_s);
        let moving = trajectory.moments(&row, &mut self.scratch)?;
        let (mut position, mut velocity) = (at.mean, moving.mean);
        if let Some(bridge) = &self.bridges[dof] {
            position += bridge.position(phase);
            velocity += bridge.velocity(phase, self.duration_s);
        }
        Ok((position, velocity, at.variance))
    }

    fn condition(&mut self, observation: &Observation<f64>) -> Result<(), PlanError> {
        let known = skill_of(self.view, self.skill)?;
        let latent = &self.view.latent;
        via_point(
            latent,
            known,
            &mut self.belief,
            observation,
            &mut self.scratch,
        )?;
        Ok(())
    }

    fn trajectory(&self) -> Result<Trajectory<'_, f64>, PlanError> {
        let known = skill_of(self.view, self.skill)?;
        Ok(Trajectory::posterior(
            self.view.latent,
            *known,
            &self.belief,
        )?)
    }
}

fn skill_of<'v>(
    view: &'v View<'_>,
    index: usize,
) -> Result<&'v tonus_shared::promp::Skill<'v, f64>, PlanError> {
    view.skills.get(index).ok_or(PlanError::Unknown {
        what: "skill",
        index,
        count: view.skills.len(),
    })
}

fn signal(model: &Model, index: usize) -> Result<&Dof, PlanError> {
    model.dofs().get(index).ok_or(PlanError::Unknown {
        what: "DoF",
        index,
        count: model.dofs().len(),
    })
}

/// The velocity as the model has it: of a logarithm, the rate over the value.
fn encode_rate(dof: &Dof, now: &Present) -> f64 {
    now.rate / dof.decode_rate(now.value, 1.0)
}

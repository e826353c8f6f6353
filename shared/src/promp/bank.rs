//! Recognition when nobody says how long the movement takes or when it began: a bank of hypotheses.

mod answers;
mod error;
mod row;

pub use error::BankError;

use super::belief::{Belief, belief_len, check_variance};
use super::error::ModelError;
use super::hypothesis::{Hypothesis, Observed};
use super::latent::Latent;
use super::skill::Skill;
use super::trajectory::Trajectory;
use crate::Real;
use row::RowCache;

/// Numbers that a bank of at most `hypotheses` hypotheses stores: row scratch `K + r`, a belief for each
/// hypothesis, and one in which a newcomer is weighed before it may displace another.
#[must_use]
pub const fn bank_len(hypotheses: usize, basis: usize, rank: usize) -> usize {
    basis + rank + (hypotheses + 1) * belief_len(rank)
}

/// Hypotheses that are no longer followed.
#[derive(Clone, Copy, Debug, Default, PartialEq, Eq)]
pub struct Dropped {
    /// The least likely when there was no room, or no time.
    pub full: u32,
    /// Those that fell too far behind the best.
    pub floor: u32,
}

/// Hypotheses about one movement (which skill, how long, since when), each conditioned on the same
/// observations at its own phase: `phase = (t - onset) / duration`, held at the ends.
///
/// Every hypothesis explains every observation (one before its onset as the hand waiting at the start of its
/// movement, one after its end as the hand resting where it ends), so that their joint likelihoods are
/// comparable and the posterior over (skill, duration, onset) is Bayes' rule over a finite set:
/// `p(h | y) ~ p(skill) p(duration, onset | skill) p(y | h)`. With one hypothesis for each skill it is
/// a [`super::Mixture`].
///
/// A hypothesis may join late ([`Bank::add`]): it is conditioned on the past that the caller kept. The
/// caller bounds that past by starting anew ([`Bank::reset`]) when a movement begins: hold the last few
/// observations of rest in a ring, and hand them over once motion is detected.
///
/// Time and memory are bounded by the storage: `slots` (as many hypotheses as are followed) and `storage`
/// ([`bank_len`] numbers); arrays on the chip, vectors on the host. When there are more hypotheses than slots
/// the least likely is dropped and counted.
///
/// Times are seconds from any origin near the movement (`f32` resolves 0.1 ms for 20 minutes, 10 ms for a day).
#[derive(Clone, Debug)]
pub struct Bank<'a, T, S, B> {
    latent: Latent<'a, T>,
    skills: &'a [Skill<'a, T>],
    slots: S,
    storage: B,
    /// Hypotheses followed: the first so many slots and blocks.
    live: usize,
    /// Observations taken since the last reset.
    seen: usize,
    /// How far behind the best, in nats, a hypothesis may fall.
    floor: Option<T>,
    dropped: Dropped,
}

impl<'a, T, S, B> Bank<'a, T, S, B>
where
    T: Real,
    S: AsRef<[Hypothesis<T>]> + AsMut<[Hypothesis<T>]>,
    B: AsRef<[T]> + AsMut<[T]>,
{
    /// A bank without hypotheses. Takes `slots` and `storage` over, whatever they hold. `floor_nats`: a hypothesis
    /// whose log-odds against the best fall below `-floor_nats` is dropped after the observation; `None` keeps
    /// all. (With `n` hypotheses the posterior is then off by at most `n exp(-floor_nats)` at that moment, and by more
    /// if a dropped one would have recovered: 20 nats are about 2e-9.)
    ///
    /// # Errors
    /// No skill, a skill of another shape than the latent space, no slot, storage too short, a floor that is not
    /// positive.
    pub fn new(
        latent: Latent<'a, T>,
        skills: &'a [Skill<'a, T>],
        slots: S,
        storage: B,
        floor_nats: Option<T>,
    ) -> Result<Self, ModelError> {
        if skills.is_empty() {
            return Err(ModelError::Empty { what: "skill" });
        }
        for skill in skills {
            skill.matches(&latent)?;
        }
        let capacity = slots.as_ref().len();
        if capacity == 0 {
            return Err(ModelError::Empty { what: "hypothesis" });
        }
        let positive = |floor: &T| floor.is_finite() && *floor > T::zero();
        if let Some(floor) = floor_nats.filter(|floor| !positive(floor)) {
            return Err(ModelError::Floor {
                floor_nats: floor.widen(),
            });
        }
        let needed = bank_len(capacity, latent.basis().count(), latent.rank());
        let got = storage.as_ref().len();
        if got < needed {
            return Err(ModelError::Storage {
                what: "the bank's storage",
                needed,
                got,
            });
        }
        Ok(Self {
            latent,
            skills,
            slots,
            storage,
            live: 0,
            seen: 0,
            floor: floor_nats,
            dropped: Dropped::default(),
        })
    }

    /// Forgets every hypothesis and observation, for the next movement.
    pub fn reset(&mut self) {
        (self.live, self.seen, self.dropped) = (0, 0, Dropped::default());
    }

    /// Follows one more hypothesis. `past` is all that the bank has taken since the last reset, in any order: the
    /// newcomer must explain it too. If there is no slot left, the least likely of all (which may be
    /// the newcomer) is dropped and counted. Returns whether the newcomer is followed. Cost: as
    /// [`Bank::observe`] of one hypothesis for each of `past`, and a belief copied if another makes room.
    ///
    /// # Errors
    /// A skill that there is not, numbers that are not finite, a duration that is not positive, a past of another
    /// length than what the bank has taken, or one that conditioning refuses. The bank is unchanged.
    pub fn add(
        &mut self,
        hypothesis: Hypothesis<T>,
        past: &[Observed<T>],
    ) -> Result<bool, BankError> {
        self.check(&hypothesis, past)?;
        let (latent, skill) = (self.latent, self.skills[hypothesis.skill]);
        let (rank, live, capacity) = (latent.rank(), self.live, self.slots.as_ref().len());
        let (mut cache, blocks, _) = self.split();
        // The first block without a hypothesis; the spare one when every slot is taken.
        let block = &mut blocks[live * belief_len(rank)..][..belief_len(rank)];
        Belief::view(skill.rank(), &mut *block).start(&skill);
        for seen in past {
            check(seen)?;
            cache.prepare(&latent, &skill, &hypothesis, seen, &mut *block)?;
            Belief::view(skill.rank(), &mut *block).commit();
        }
        if live < capacity {
            self.slots.as_mut()[live] = hypothesis;
            self.live += 1;
            return Ok(true);
        }
        self.dropped.full = self.dropped.full.saturating_add(1);
        let joint = self.prior(&hypothesis) + self.belief_at(live, &skill).log_likelihood();
        let Some((least, _)) = self.least().filter(|(_, lowest)| joint > *lowest) else {
            return Ok(false);
        };
        self.slots.as_mut()[least] = hypothesis;
        let (_, blocks, _) = self.split();
        let spare = live * belief_len(rank);
        blocks.copy_within(spare..spare + belief_len(rank), least * belief_len(rank));
        Ok(true)
    }

    /// Conditions every hypothesis on one observed number, each at its own phase; a velocity outside a hypothesis'
    /// movement is expected to be zero. Then drops those that fell below the floor. Cost for `H` hypotheses
    /// at phases of their own: `H (K r + K + 3/2 r^2)` multiply-adds and `H` bases (neighbours at one phase share row
    /// and basis).
    ///
    /// # Errors
    /// No hypothesis, a time that is not finite, and as [`super::Mixture::observe`]. If any hypothesis refuses, none
    /// changes.
    pub fn observe(&mut self, seen: &Observed<T>) -> Result<(), BankError> {
        if self.live == 0 {
            return Err(BankError::NoHypothesis);
        }
        check(seen)?;
        let (latent, skills, rank, live) =
            (self.latent, self.skills, self.latent.rank(), self.live);
        let (mut cache, blocks, slots) = self.split();
        let length = belief_len(rank);
        let hypotheses = slots.iter().take(live);
        let each = hypotheses.map(|hypothesis| (hypothesis, &skills[hypothesis.skill]));
        for ((hypothesis, skill), block) in each.clone().zip(blocks.chunks_exact_mut(length)) {
            cache.prepare(&latent, skill, hypothesis, seen, block)?;
        }
        for ((_, skill), block) in each.zip(blocks.chunks_exact_mut(length)) {
            Belief::view(skill.rank(), block).commit();
        }
        self.seen += 1;
        self.prune();
        Ok(())
    }

    /// Keeps the `most` likely hypotheses (one at least) and drops and counts the others: for who has no time to follow
    /// all of them. They keep their order.
    pub fn keep(&mut self, most: usize) {
        while self.live > most.max(1) {
            let Some((least, _)) = self.least() else {
                return;
            };
            self.dropped.full = self.dropped.full.saturating_add(1);
            let length = belief_len(self.latent.rank());
            self.slots.as_mut()[least..].rotate_left(1);
            let end = self.live * length;
            let (_, blocks, _) = self.split();
            blocks.copy_within((least + 1) * length..end, least * length);
            self.live -= 1;
        }
    }

    /// The hypotheses followed, in the order in which they came; every index of a hypothesis is into these, until
    /// the next that is added or observed.
    #[must_use]
    pub fn hypotheses(&self) -> &[Hypothesis<T>] {
        &self.slots.as_ref()[..self.live]
    }

    /// Observations taken since the last reset.
    #[must_use]
    pub const fn observations(&self) -> usize {
        self.seen
    }

    /// Hypotheses dropped since the last reset.
    #[must_use]
    pub const fn dropped(&self) -> Dropped {
        self.dropped
    }

    /// The skills, in the order of every index of a skill here.
    #[must_use]
    pub const fn skills(&self) -> &'a [Skill<'a, T>] {
        self.skills
    }

    /// The belief of one hypothesis, `None` for an index that is none.
    #[must_use]
    pub fn belief(&self, hypothesis: usize) -> Option<Belief<T, &[T]>> {
        let skill = self.skills.get(self.hypotheses().get(hypothesis)?.skill)?;
        Some(self.belief_at(hypothesis, skill))
    }

    /// The movement of one hypothesis under its belief, by phase ([`Hypothesis::phase`]); `None` for an index that is
    /// none.
    #[must_use]
    pub fn trajectory(&self, hypothesis: usize) -> Option<Trajectory<'_, T>> {
        let skill = self.skills.get(self.hypotheses().get(hypothesis)?.skill)?;
        let lent = self.belief(hypothesis)?.lent();
        Some(Trajectory::of(self.latent, *skill, lent))
    }

    /// Log prior of skill and hypothesis plus joint log-likelihood, `None` for an index that is none.
    #[must_use]
    pub fn log_joint(&self, hypothesis: usize) -> Option<T> {
        let prior = self.prior(self.hypotheses().get(hypothesis)?);
        Some(prior + self.belief(hypothesis)?.log_likelihood())
    }

    fn check(&self, hypothesis: &Hypothesis<T>, past: &[Observed<T>]) -> Result<(), BankError> {
        let Hypothesis {
            skill,
            duration_s,
            onset_s,
            ..
        } = *hypothesis;
        let skills = self.skills.len();
        if skill >= skills {
            return Err(BankError::Skill { skill, skills });
        }
        if !(duration_s.is_finite() && duration_s > T::zero()) {
            return Err(BankError::Duration {
                duration_s: duration_s.widen(),
            });
        }
        check_time(onset_s)?;
        // Twice it is finite, and so is twice a log-likelihood (`Belief::prepare`): their sum is.
        let log_prior = self.prior(hypothesis);
        if !(log_prior + log_prior).is_finite() {
            return Err(BankError::LogPrior {
                log_prior: log_prior.widen(),
            });
        }
        let (seen, got) = (self.seen, past.len());
        if seen == got {
            Ok(())
        } else {
            Err(BankError::Past { seen, got })
        }
    }

    fn prior(&self, hypothesis: &Hypothesis<T>) -> T {
        self.skills[hypothesis.skill].log_prior() + hypothesis.log_prior
    }

    /// Drops what is too far behind the best; the others keep their order.
    fn prune(&mut self) {
        // Compared by hand: the chip has no instruction for the lesser of two.
        let extremes = |so_far: Option<(T, T)>, joint: T| {
            let (least, largest) = so_far.unwrap_or((joint, joint));
            let lesser = if joint < least { joint } else { least };
            let greater = if joint > largest { joint } else { largest };
            Some((lesser, greater))
        };
        let (Some(floor), Some((least, largest))) =
            (self.floor, self.log_joints().fold(None, extremes))
        else {
            return;
        };
        // Mostly none is, and nothing has to be looked at twice.
        if least >= largest - floor {
            return;
        }
        let length = belief_len(self.latent.rank());
        let mut kept = 0;
        for index in 0..self.live {
            // The best itself is never below: some hypothesis always remains.
            if self
                .log_joint(index)
                .is_some_and(|joint| joint < largest - floor)
            {
                self.dropped.floor = self.dropped.floor.saturating_add(1);
                continue;
            }
            if kept != index {
                self.slots.as_mut()[kept] = self.slots.as_ref()[index];
                let (_, blocks, _) = self.split();
                blocks.copy_within(index * length..(index + 1) * length, kept * length);
            }
            kept += 1;
        }
        self.live = kept;
    }

    fn largest(&self, skill: Option<usize>) -> Option<T> {
        let joints = self.hypotheses().iter().zip(self.log_joints());
        let joints = joints.filter(|(h, _)| skill.is_none_or(|skill| skill == h.skill));
        joints.map(|(_, joint)| joint).reduce(T::max)
    }

    fn least(&self) -> Option<(usize, T)> {
        let least = |one: (usize, T), other: (usize, T)| if other.1 < one.1 { other } else { one };
        self.log_joints().enumerate().reduce(least)
    }

    fn log_joints(&self) -> impl Iterator<Item = T> {
        let each = self.hypotheses().iter().enumerate();
        each.map(|(index, hypothesis)| {
            let belief = self.belief_at(index, &self.skills[hypothesis.skill]);
            self.prior(hypothesis) + belief.log_likelihood()
        })
    }

    /// The belief in a block, which is about `skill`.
    fn belief_at(&self, block: usize, skill: &Skill<'_, T>) -> Belief<T, &[T]> {
        let (basis, rank) = (self.latent.basis().count(), self.latent.rank());
        let start = basis + rank + block * belief_len(rank);
        let block = &self.storage.as_ref()[start..start + belief_len(rank)];
        Belief::view(skill.rank(), block)
    }

    /// Row scratch, the beliefs' blocks (the spare one last), the slots.
    fn split(&mut self) -> (RowCache<'_, T>, &mut [T], &mut [Hypothesis<T>]) {
        let (basis, rank) = (self.latent.basis().count(), self.latent.rank());
        let slots = self.slots.as_mut();
        let needed = bank_len(slots.len(), basis, rank);
        let (psi, rest) = self.storage.as_mut()[..needed].split_at_mut(basis);
        let (a, blocks) = rest.split_at_mut(rank);
        (RowCache { psi, a, of: None }, blocks, slots)
    }
}

fn check<T: Real>(seen: &Observed<T>) -> Result<(), BankError> {
    check_time(seen.time_s)?;
    // Before the skills' residuals are added, so that none hides a sensor variance that is wrong.
    Ok(check_variance(seen.variance)?)
}

fn check_time<T: Real>(time_s: T) -> Result<(), BankError> {
    if time_s.is_finite() {
        return Ok(());
    }
    Err(BankError::Time {
        time_s: time_s.widen(),
    })
}

//! The person's second pass: they take an operator's place and show the robot its part by teleoperation.
//!
//! The operator's hand, tracked like any hand, is what the robot is to follow: the hand's way from [`HAND_HOME_M`]
//! is the robot's way from its home, [`REACH`] times as long. The operator follows the script's path
//! ([`super::scripted`]) as well as a person does, and is as firm with their own muscles as when they did the
//! action themselves, so that the robot's stiffness is the operator's, measured on the same arm.
//!
//! The operator sees the robot, and takes out whatever the tracker has wrong for long: the second pass has the
//! tracker's jitter, not its slow bias.

use super::demonstrations::{Sensed, sense};
use super::muscle::{self, CHANNELS, Vigour};
use super::rig::{RigConfig, RigError};
use super::scripted::{self, HOME_M};
use super::seeded;
use super::skills::minimum_jerk;
use super::teleoperation::{Teleoperation, TeleoperationConfig, TeleoperationError};
use super::wearer::{Action, Task};
use rand_chacha::ChaCha8Rng;
use rand_distr::{Distribution, StandardNormal};

/// Where the operator's hand is when the robot is at home: shoulder frame, metres.
pub const HAND_HOME_M: [f64; 3] = [0.34, 0.03, -0.22];
/// Metres that the robot moves for each metre of the operator's hand.
pub const REACH: f64 = 1.0 / 0.6;
/// Standard deviation of where the operator leads the robot on each axis: half-way (two bows), and at the end; metres.
const AIM_SD_M: [f64; 3] = [0.004, 0.004, 0.003];
/// Longest step of the arm's controller, seconds.
const CONTROL_S: f64 = 0.01;

/// One second pass.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct Operation {
    /// The action that the robot's part belongs to, with this pass's own muscles.
    pub action: Action,
    /// How the operator misses the path: standard normal numbers for each shape and axis.
    aim: [[f64; 3]; 3],
}

impl Operation {
    /// Draws how the operator shows the robot's part of `action`.
    pub fn sample(action: &Action, rng: &mut ChaCha8Rng) -> Self {
        let vigour = Vigour::sample(rng);
        Self {
            action: Action { vigour, ..*action },
            aim: std::array::from_fn(|_| std::array::from_fn(|_| StandardNormal.sample(rng))),
        }
    }

    /// Where the operator leads the robot at phase `s`: robot base frame, metres.
    #[must_use]
    pub fn lead_m(&self, s: f64) -> [f64; 3] {
        let bow = |from: f64, to: f64| {
            let rise = minimum_jerk((s - from) / (to - from));
            4.0 * rise * (1.0 - rise)
        };
        let shapes = [bow(0.1, 0.6), bow(0.4, 0.95), minimum_jerk(s / 0.9)];
        let path_m = scripted::robot(&self.action, s).position_m;
        std::array::from_fn(|axis| {
            let missed = self.aim.iter().zip(AIM_SD_M).zip(shapes);
            path_m[axis]
                + missed
                    .map(|((z, sd), shape)| z[axis] * sd * shape)
                    .sum::<f64>()
        })
    }

    /// Position of the operator's hand at phase `s`: shoulder frame, metres.
    #[must_use]
    pub fn hand_m(&self, s: f64) -> [f64; 3] {
        let lead_m = self.lead_m(s);
        std::array::from_fn(|axis| HAND_HOME_M[axis] + (lead_m[axis] - HOME_M[axis]) / REACH)
    }

    /// Activation of the channels at phase `s`, shares of maximum voluntary contraction.
    #[must_use]
    pub fn activation(&self, s: f64) -> [f64; CHANNELS] {
        let Action {
            skill,
            latent,
            vigour,
        } = &self.action;
        muscle::activation(*skill, latent, vigour, s)
    }
}

/// Where an operator whose hand is at `hand_m` (shoulder frame, metres) wants the robot: its base frame, metres.
#[must_use]
pub fn wanted_m(hand_m: [f64; 3]) -> [f64; 3] {
    std::array::from_fn(|axis| HOME_M[axis] + (hand_m[axis] - HAND_HOME_M[axis]) * REACH)
}

/// One action in twelve series: hand position and stiffness, robot position and stiffness.
#[derive(Debug, Clone, PartialEq)]
pub struct Teleoperated {
    /// Times since the action began, seconds.
    pub t_s: Vec<f64>,
    /// `[3 + 3 + 3 + 3][sample]`, metres and N/m.
    pub values: Vec<Vec<f64>>,
}

/// The robot's part cannot be shown.
#[derive(Debug, thiserror::Error)]
pub enum OperatorError {
    /// The wearer.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// The simulated arm.
    #[error(transparent)]
    Teleoperation(#[from] TeleoperationError),
}

/// Lets a person do each action before the tracker and electrodes of `person`, then show the robot's part of each in a
/// second pass before those of `operator`, and joins the two by the time since the action began.
///
/// The robot's position is where the simulated arm gets after the operator's tracked hand, its stiffness the operator's
/// own as streamed, both interpolated to the times of the first pass.
///
/// # Errors
/// [`OperatorError`]: the rig, or a hand that leads the arm out of its reach.
pub fn teleoperated(
    actions: &[Action],
    person: &RigConfig,
    operator: &RigConfig,
) -> Result<Vec<Teleoperated>, OperatorError> {
    let first = actions.iter().map(|&action| Task::Perform(action));
    let human = sense(&first.collect::<Vec<_>>(), 0, person)?;
    let mut rng = seeded(operator.seed, "operator");
    let second = actions
        .iter()
        .map(|action| Task::Operate(Operation::sample(action, &mut rng)));
    let shown = sense(&second.collect::<Vec<_>>(), 0, operator)?;
    let mut arm = Teleoperation::new(&TeleoperationConfig::default())?;
    let joined = human.iter().zip(&shown).map(|(human, shown)| {
        let robot_m = follow(&mut arm, shown)?;
        Ok(join(human, shown, &robot_m))
    });
    joined.collect()
}

/// Where the arm is at each instant of the operator's hand. Between them the hand is taken to move evenly.
fn follow(arm: &mut Teleoperation, shown: &[Sensed]) -> Result<Vec<[f64; 3]>, TeleoperationError> {
    let mut reached_m = Vec::with_capacity(shown.len());
    let mut last: Option<&Sensed> = None;
    for now in shown {
        let to_m = wanted_m(now.hand_m);
        let Some(before) = last.replace(now) else {
            arm.reset(to_m)?;
            reached_m.push(arm.tool_m());
            continue;
        };
        let (from_m, gap_s) = (wanted_m(before.hand_m), now.t_s() - before.t_s());
        let steps = (gap_s / CONTROL_S).ceil().max(1.0);
        let mut step = 0.0;
        while step < steps {
            step += 1.0;
            let wanted_m = between(from_m, to_m, step / steps);
            arm.step(wanted_m, gap_s / steps)?;
        }
        reached_m.push(arm.tool_m());
    }
    Ok(reached_m)
}

/// The robot's series at the times of the person's.
fn join(human: &[Sensed], shown: &[Sensed], robot_m: &[[f64; 3]]) -> Teleoperated {
    let mut values = vec![Vec::new(); 12];
    let mut t_s = Vec::with_capacity(human.len());
    for now in human {
        // Beyond its ends the second pass stands.
        let next = shown.partition_point(|s| s.since_us < now.since_us);
        let next = next.min(shown.len().saturating_sub(1));
        let ends = [next.saturating_sub(1), next];
        let (Some([before, after]), Some([before_m, after_m])) = (
            all(ends.map(|end| shown.get(end))),
            all(ends.map(|end| robot_m.get(end))),
        ) else {
            continue;
        };
        let gap_s = after.t_s() - before.t_s();
        let way = if gap_s > 0.0 {
            ((now.t_s() - before.t_s()) / gap_s).clamp(0.0, 1.0)
        } else {
            1.0
        };
        let robot_m = between(*before_m, *after_m, way);
        let firm = between(before.n_per_m, after.n_per_m, way);
        t_s.push(now.t_s());
        let row = [now.hand_m, now.n_per_m, robot_m, firm].concat();
        for (series, value) in values.iter_mut().zip(row) {
            series.push(value);
        }
    }
    Teleoperated { t_s, values }
}

fn all<T>(two: [Option<T>; 2]) -> Option<[T; 2]> {
    let [first, second] = two;
    Some([first?, second?])
}

fn between(from: [f64; 3], to: [f64; 3], way: f64) -> [f64; 3] {
    std::array::from_fn(|axis| from[axis] + way * (to[axis] - from[axis]))
}

#[cfg(test)]
mod tests {
    use super::*;
    use crate::simulate::skills::{Skill, pull_along, with_object_anywhere};
    use rand::SeedableRng;

    fn actions(rng: &mut ChaCha8Rng) -> Vec<Action> {
        let mut actions: Vec<_> = (Skill::LIFTS.iter().cycle().take(300))
            .map(|&skill| Action::sample(skill, rng))
            .collect();
        for n in 0..300_u32 {
            let latent = pull_along(f64::from(n % 3), rng);
            actions.push(Action::with_latent(Skill::Pull, latent, rng));
            let skill = Skill::PICK_AND_PLACE[n as usize % 3];
            let latent = with_object_anywhere(skill, rng);
            actions.push(Action::with_latent(skill, latent, rng));
        }
        actions
    }

    #[test]
    fn the_hand_wants_the_robot_where_it_leads_it() {
        let mut rng = ChaCha8Rng::seed_from_u64(1);
        for action in actions(&mut rng) {
            let operation = Operation::sample(&action, &mut rng);
            for s in [0.0, 0.3, 0.7, 1.0] {
                let (wanted, lead) = (wanted_m(operation.hand_m(s)), operation.lead_m(s));
                assert!((0..3).all(|axis| (wanted[axis] - lead[axis]).abs() < 1e-12));
            }
        }
    }

    #[test]
    fn operators_stay_within_reach_and_near_the_path() {
        let mut rng = ChaCha8Rng::seed_from_u64(2);
        for action in actions(&mut rng) {
            let operation = Operation::sample(&action, &mut rng);
            for n in 0..=100 {
                let s = f64::from(n) / 100.0;
                let hand_m = operation.hand_m(s);
                let reach_m = hand_m.iter().map(|x| x * x).sum::<f64>().sqrt();
                assert!(
                    (0.25..0.66).contains(&reach_m),
                    "{:?} {hand_m:?}",
                    action.skill
                );
                let path_m = scripted::robot(&action, s).position_m;
                let lead_m = operation.lead_m(s);
                // Five standard deviations of the three shapes together.
                assert!((0..3).all(|axis| (lead_m[axis] - path_m[axis]).abs() < 0.04));
            }
        }
    }
}

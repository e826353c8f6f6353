//! The whole chain on simulated people: learn from demonstrations, then recognise and follow a shuffled run.
//!
//! ```text
//! wearer -> sEMG -> pipeline -> packets -> lossy link -> session -> gate -> robot
//!    |                 ^                                    ^
//!    +--> tracker -----+----- hand position ----------------+
//! ```
//!
//! Demonstrations and run are two sittings of one kind of person, each with its own electrodes, tracker and
//! links, and pass through the same code. The person's truth is used for scoring alone.
//!
//! Now and then the person does something that no demonstration shows. The novelty gate, learnt from the
//! demonstrations alone, is to say so, and the robot to hold.

mod outside;
mod score;
mod stage;

pub use outside::OutsideScore;
pub use score::ActionScore;

use crate::demonstration::{Demonstration, DemonstrationError};
use crate::library::{Library, LibraryError};
use crate::link::simulated::LinkConditions;
use crate::model::recognise::{RecogniseError, Recogniser};
use crate::model::tempo::{TempoConfig, TempoRecogniser};
use crate::robot::gate::State;
use crate::robot::limits::{ConfigError, Fallback, Setpoint};
use crate::robot::simulated::MassError;
use crate::session::{DOFS, NoveltyReport, Session, SessionConfig, SessionError};
use crate::simulate::demonstrations;
use crate::simulate::rig::{Rig, RigConfig, RigError};
use crate::simulate::scripted::HOME_M;
use crate::simulate::skills::Skill;
use crate::simulate::tracker::TrackerNoise;
use crate::simulate::wearer::{Action, Task};
use rand::seq::SliceRandom;
use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use serde::Serialize;
use stage::Stage;
use std::ops::ControlFlow;
use tonus_shared::onset::OnsetConfig;
use tonus_shared::wire::Stream;

/// Demonstrations of each skill to learn from.
const DEMONSTRATIONS_PER_SKILL: usize = 15;
/// Executions of each skill in the run.
const RUNS_PER_SKILL: usize = 4;
/// What the person does in the run besides: in no demonstration.
const OUTSIDE: [Skill; 3] = [Skill::Wave, Skill::Place, Skill::Wave];
/// Targets of the hand-over in the run, across the reach that was demonstrated: shoulder frame y, metres.
const TARGETS_M: [f64; 2] = [0.10, 0.30];
/// Where the duration is inferred, each sensor is observed so often, microseconds: ten times in two seconds.
const INTERVAL_US: u64 = 200_000;
/// Share of known movements that may be held as unknown at any time: more than is seen among so few demonstrations, since
/// the robot is held until the movement ends.
const FALSE_ALARM_RATE: f64 = 0.005;
/// Apparent inertia of the simulated robot's hand, kg.
const INERTIA_KG: [f64; 3] = [2.0; 3];
/// What the robot carries in a lift, kg.
const PAYLOAD_KG: f64 = 0.5;
/// The gate's control period, seconds.
const PERIOD_S: f64 = 1e-3;
/// Keeps the seeds of learning and run apart, and the known actions of the run as they are without others between them.
const RUN_SEED: u64 = 0x7275_6e00;
const OUTSIDE_SEED: u64 = 0x6f75_7400;

/// What the demo is to do.
#[derive(Debug, Clone, Copy, PartialEq)]
pub struct DemoConfig {
    /// Everything random follows from it.
    pub seed: u64,
    /// Ends the run after this much of its time, seconds; none runs to the end.
    pub seconds: Option<f64>,
    /// Share of packets that each link loses.
    pub loss: f64,
    /// Whether start and duration of each movement are inferred; otherwise they are announced, which is an oracle.
    pub inferred: bool,
}

impl Default for DemoConfig {
    fn default() -> Self {
        Self {
            seed: 1,
            seconds: None,
            loss: 0.05,
            inferred: false,
        }
    }
}

/// Why the demo cannot go on.
#[derive(Debug, thiserror::Error)]
pub enum DemoError {
    /// The simulated wearer.
    #[error(transparent)]
    Rig(#[from] RigError),
    /// Learning.
    #[error(transparent)]
    Library(#[from] LibraryError),
    /// A recorded demonstration.
    #[error(transparent)]
    Demonstration(#[from] DemonstrationError),
    /// Recognition.
    #[error(transparent)]
    Recognise(#[from] RecogniseError),
    /// The live loop.
    #[error(transparent)]
    Session(#[from] SessionError),
    /// The robot gate's limits.
    #[error(transparent)]
    Gate(#[from] ConfigError),
    /// The simulated robot.
    #[error(transparent)]
    Robot(#[from] MassError),
}

/// Packets of the run, both ways.
#[derive(Debug, Clone, Copy, Default, PartialEq, Eq, Serialize)]
pub struct Packets {
    /// Sent by wearable and host.
    pub sent: u64,
    /// Of those, lost by the links.
    pub lost: u64,
    /// Of those that came, refused by the decoder.
    pub corrupt: u64,
}

/// Time from the newest scan to the command made of it.
#[derive(Debug, Clone, Copy, PartialEq, Serialize)]
pub struct Latency {
    /// Median, ms.
    pub p50: f64,
    /// 99th percentile, ms.
    pub p99: f64,
}

/// What the demo found.
#[derive(Debug, Clone, PartialEq, Serialize)]
pub struct Report {
    /// The seed, so that anybody can repeat it.
    pub seed: u64,
    /// Every action that was performed to its end.
    pub actions: Vec<ActionScore>,
    /// Actions recognised at their end.
    pub correct: usize,
    /// Actions.
    pub total: usize,
    /// Of these, named unknown although demonstrations show them.
    pub false_alarms: usize,
    /// Every other action that was performed to its end: in no demonstration, and in none of the counts above.
    pub outside: Vec<OutsideScore>,
    /// Share of the three lifts recognised at their end from positions alone; none if none was performed.
    pub accuracy_without_semg: Option<f64>,
    /// Error of the stiffness that the robot was set to, over its true range, while people moved.
    pub stiffness_nrmse: Option<f64>,
    /// Distance of the simulated robot from where it should have been, while people moved, metres.
    pub robot_rmse_m: Option<f64>,
    /// Packets of the run.
    pub packets: Packets,
    /// Age of the newest scan when its command was made; none if there was no command.
    pub latency_ms: Option<Latency>,
}

/// One instant of the run, to be looked at.
#[derive(Debug)]
pub struct Snapshot<'a> {
    /// Time in the run, microseconds.
    pub now_us: u64,
    /// When the run ends, microseconds.
    pub end_us: u64,
    /// What the person does, and how far they are (0 to 1); none in a pause.
    pub action: Option<(Skill, f64)>,
    /// Labels of the model, in the order of `posterior`.
    pub labels: &'a [String],
    /// Probability of each skill.
    pub posterior: &'a [f64],
    /// What the novelty gate says of the movement under way.
    pub novelty: Option<NoveltyReport<'a>>,
    /// The newest stream packet.
    pub stream: Option<&'a Stream>,
    /// Where the hand was last seen, shoulder frame, metres.
    pub hand_m: [f64; 3],
    /// What the robot is told.
    pub setpoint: Setpoint,
    /// Where the robot is, base frame, metres.
    pub robot_m: [f64; 3],
    /// The robot gate's state.
    pub gate: State,
    /// Packets so far.
    pub packets: Packets,
    /// Actions performed so far.
    pub scores: &'a [ActionScore],
    /// Those that are in no demonstration.
    pub outside: &'a [OutsideScore],
}

/// The links of the demo: one connection interval of delay, up to one more of jitter.
fn link(loss: f64) -> LinkConditions {
    LinkConditions {
        loss,
        ..LinkConditions::default()
    }
}

fn rig_config(config: &DemoConfig, seed: u64) -> RigConfig {
    RigConfig {
        noise: TrackerNoise::STATED,
        up: link(config.loss),
        down: link(config.loss),
        seed,
    }
}

/// How the demo's session observes and decides.
fn session_config(use_semg: bool) -> SessionConfig {
    SessionConfig {
        observations: 10,
        position_sigma_m: TrackerNoise::STATED.jitter_sd_m,
        stiffness_sigma: 0.05,
        use_semg,
        decide_at: 0.95,
        decide_after: 2,
        act_within_m: 0.06,
        home_m: HOME_M,
        home_stiffness_n_per_m: Fallback::default().stiffness_n_per_m,
        damping_ratio: 1.0,
    }
}

/// What the person does in the run: every skill equally often, shuffled; hand-overs to targets that no
/// demonstration had. Anywhere among them [`OUTSIDE`].
fn shuffled_run(seed: u64) -> Vec<Action> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ RUN_SEED);
    let mut skills: Vec<Skill> = (0..RUNS_PER_SKILL).flat_map(|_| Skill::ALL).collect();
    skills.shuffle(&mut rng);
    let perform = |skill| match skill {
        Skill::HandOver => {
            let [near, far] = TARGETS_M;
            let target_m = rng.random_range(near..far);
            Action::hand_over(target_m, &mut rng)
        }
        lift => Action::sample(lift, &mut rng),
    };
    let mut run: Vec<Action> = skills.into_iter().map(perform).collect();
    let mut rng = ChaCha8Rng::seed_from_u64(seed ^ OUTSIDE_SEED);
    for skill in OUTSIDE {
        let place = rng.random_range(0..=run.len());
        run.insert(place, Action::sample(skill, &mut rng));
    }
    run
}

/// A recorded instant in the order of [`DOFS`].
fn values(row: &demonstrations::Row) -> [f64; DOFS.len()] {
    let [hx, hy, hz] = row.human_m;
    let [hkx, hky, hkz] = row.human_n_per_m;
    let [rx, ry, rz] = row.robot.position_m;
    let [rkx, rky, rkz] = row.robot.stiffness_n_per_m;
    [hx, hy, hz, hkx, hky, hkz, rx, ry, rz, rkx, rky, rkz]
}

/// Learns the demo's skills, and the gate on what is none of them, from demonstrations recorded through the whole chain.
///
/// # Errors
/// [`DemoError`] says which part failed.
pub fn learn_skills(config: &DemoConfig) -> Result<Library, DemoError> {
    let mut rng = ChaCha8Rng::seed_from_u64(config.seed);
    let actions: Vec<Action> = (0..DEMONSTRATIONS_PER_SKILL)
        .flat_map(|_| Skill::ALL)
        .map(|skill| Action::sample(skill, &mut rng))
        .collect();
    let recorded = demonstrations::record(&actions, &rig_config(config, config.seed))?;
    let named = recorded.iter().enumerate().map(|(trial, recording)| {
        let t_s = recording.rows.iter().map(|row| row.t_s).collect();
        let series = |dof: usize| recording.rows.iter().map(|row| values(row)[dof]).collect();
        let values = (0..DOFS.len()).map(series).collect();
        let label = recording.action.skill.label();
        Demonstration::new(label, trial.to_string(), "simulated wearer", t_s, values)
    });
    let named = named.collect::<Result<Vec<_>, _>>()?;
    Ok(Library::learn(&named, FALSE_ALARM_RATE)?)
}

/// Performs the shuffled run with what was learnt, showing `watch` every 20 ms of it; `watch` may end it early.
///
/// # Errors
/// [`DemoError`] says which part failed.
pub fn perform(
    config: &DemoConfig,
    library: &Library,
    mut watch: impl FnMut(&Snapshot<'_>) -> ControlFlow<()>,
) -> Result<Report, DemoError> {
    let actions = shuffled_run(config.seed);
    // Where nothing is announced, the person rests between movements, as people do.
    let task = if config.inferred {
        Task::PerformRested
    } else {
        Task::Perform
    };
    let tasks: Vec<Task> = actions.into_iter().map(task).collect();
    let mut rig = Rig::new(&tasks, &rig_config(config, config.seed ^ RUN_SEED))?;
    let end_us = rig.spans().last().map_or(0, |span| span.end_us);
    let view = library.model.view().map_err(RecogniseError::from)?;
    let model = &library.model;
    let session = |use_semg| -> Result<Session<'_>, DemoError> {
        let told = session_config(use_semg);
        Ok(if config.inferred {
            let bank = TempoRecogniser::new(model, &view, TempoConfig::default())?;
            Session::inferring(bank, &OnsetConfig::default(), INTERVAL_US, told)?
        } else {
            Session::new(Recogniser::new(model, &view)?, told)?
        })
    };
    let sessions = [session(true)?.watching(&library.gate)?, session(false)?];
    let mut stage = Stage::new(sessions, model.labels(), rig.spans().to_vec())?;
    while let Some(step) = rig.step()? {
        stage.live(&step)?;
        let (up, down) = rig.counters();
        stage.packets.sent = up.sent + down.sent;
        stage.packets.lost = up.lost + down.lost;
        #[allow(clippy::cast_precision_loss, reason = "minutes")]
        let over = (config.seconds).is_some_and(|limit_s| step.now_us as f64 * 1e-6 >= limit_s);
        let look = step.now_us.is_multiple_of(20_000);
        if over || (look && watch(&stage.snapshot(step.now_us, end_us)).is_break()) {
            break;
        }
    }
    Ok(stage.report(config.seed))
}

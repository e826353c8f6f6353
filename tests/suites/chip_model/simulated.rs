//! A model of simulated demonstrations, and new movements as packets.

use std::sync::LazyLock;

use rand::{RngExt, SeedableRng};
use rand_chacha::ChaCha8Rng;
use tonus::demonstration::Demonstration;
use tonus::link::simulated::LinkConditions;
use tonus::model::image::Export;
use tonus::model::{Dof, Hyperparameters, Model, Predictive, learn};
use tonus::simulate::demonstrations::record;
use tonus::simulate::rig::{Rig, RigConfig};
use tonus::simulate::skills::{DURATION_US, Skill, with_object_anywhere};
use tonus::simulate::tracker::TrackerNoise;
use tonus::simulate::wearer::{Action, Task};
use tonus_shared::image::WEARABLE;
use tonus_shared::onset::OnsetConfig;
use tonus_shared::promp::Basis;
use tonus_shared::wire::{Packet, Stream};

const NAMES: [&str; 6] = ["x", "y", "z", "kx", "ky", "kz"];
const EACH: usize = 12;
/// As the experiment on unknown tempos has it: these are slow movements.
pub(crate) const ONSET: OnsetConfig = OnsetConfig {
    window_s: 0.12,
    start_m_per_s: 0.06,
    rest_multiple: 0.0,
    release: 0.5,
    shortest_movement_s: 0.03,
    shortest_pause_s: 0.03,
};

/// Three skills of six DoFs, twelve demonstrations of each.
pub(crate) static MODEL: LazyLock<Model> = LazyLock::new(|| learnt(Predictive::LeaveOneOut));
/// The same as Gaussians.
pub(crate) static GAUSSIAN: LazyLock<Model> = LazyLock::new(|| learnt(Predictive::PlugIn));

fn rig(seed: u64) -> RigConfig {
    RigConfig {
        noise: TrackerNoise {
            bias_sd_m: 0.0,
            ..TrackerNoise::STATED
        },
        up: LinkConditions::default(),
        down: LinkConditions::default(),
        seed,
    }
}

fn action(skill: Skill, rng: &mut ChaCha8Rng) -> Action {
    let latent = with_object_anywhere(skill, rng);
    Action::with_latent(skill, latent, rng)
}

static DEMONSTRATIONS: LazyLock<Vec<Demonstration>> = LazyLock::new(|| {
    let mut rng = ChaCha8Rng::seed_from_u64(41);
    let skills = (0..EACH).flat_map(|_| Skill::PICK_AND_PLACE);
    let actions: Vec<_> = skills.map(|skill| action(skill, &mut rng)).collect();
    let recorded = record(&actions, &rig(41)).unwrap();
    let named = recorded.iter().enumerate().map(|(trial, one)| {
        let t_s = one.rows.iter().map(|row| row.t_s).collect();
        let hand = (0..3).map(|axis| one.rows.iter().map(|row| row.human_m[axis]).collect());
        let firm = (0..3).map(|axis| one.rows.iter().map(|row| row.human_n_per_m[axis]).collect());
        let label = one.action.skill.label();
        Demonstration::new(
            label,
            trial.to_string(),
            "simulated",
            t_s,
            hand.chain(firm).collect(),
        )
    });
    named.map(Result::unwrap).collect()
});

fn learnt(predictive: Predictive) -> Model {
    let dofs = NAMES.map(|name| match name.starts_with('k') {
        true => Dof::stiffness(name),
        false => Dof::position(name),
    });
    let given = Hyperparameters {
        predictive,
        ..Hyperparameters::new(dofs.to_vec(), Basis::gaussian(20).unwrap())
    };
    learn(&DEMONSTRATIONS, &given.check().unwrap()).unwrap()
}

pub(crate) fn export(rank: usize) -> Export {
    let [x, y, z, kx, ky, kz] = NAMES.map(str::to_owned);
    Export {
        positions: Some([x, y, z]),
        stiffnesses: [kx, ky, kz],
        others: false,
        rank,
        position_sigma_m: TrackerNoise::STATED.jitter_sd_m,
        stiffness_sigma: 0.05,
        interval_s: 0.1,
        tempo_log_std: 0.2,
        lead_s: 0.3,
        onset_late_s: 0.0,
        onset_std_s: 0.05,
        onset: ONSET,
        capacity: WEARABLE,
    }
}

/// What reaches who listens on the body: packets as they leave the pipeline, the hand as the tracker sees it.
pub(crate) enum Heard {
    Stream(u64, Stream),
    Hand(u64, [f32; 3]),
}

/// A movement from a moment before it to its end.
pub(crate) struct Movement {
    pub(crate) label: &'static str,
    /// When it was heard, microseconds.
    pub(crate) heard: Vec<(u64, Heard)>,
    pub(crate) half_us: u64,
    pub(crate) end_us: u64,
}

/// New movements of each skill at 0.7 to 1.4 times the demonstrated duration.
pub(crate) fn movements(each: usize, seed: u64) -> Vec<Movement> {
    let mut rng = ChaCha8Rng::seed_from_u64(seed);
    let skills: Vec<_> = (0..each).flat_map(|_| Skill::PICK_AND_PLACE).collect();
    let tasks = skills.iter().map(|&skill| {
        let action = action(skill, &mut rng);
        let tempo: f64 = rng.random_range(0.7_f64.ln()..1.4_f64.ln());
        let duration_us = (DURATION_US as f64 * tempo.exp()) as u64;
        Task::Paced {
            action,
            duration_us,
        }
    });
    let tasks: Vec<_> = tasks.collect();
    let mut rig = Rig::new(&tasks, &rig(seed)).unwrap();
    let spans = rig.spans().to_vec();
    let of_span = spans.iter().zip(&skills).map(|(span, skill)| Movement {
        label: skill.label(),
        heard: Vec::new(),
        half_us: (span.start_us + span.end_us) / 2,
        end_us: span.end_us,
    });
    let mut movements: Vec<_> = of_span.collect();
    while let Some(step) = rig.step().unwrap() {
        let within = |span: &tonus::simulate::wearer::Span| {
            (span.start_us - 150_000..=span.end_us).contains(&step.now_us)
        };
        let Some(place) = spans.iter().position(within) else {
            continue;
        };
        let heard = &mut movements[place].heard;
        for frame in &step.sent {
            if let Packet::Stream(stream) = frame.packet {
                heard.push((step.now_us, Heard::Stream(frame.header.device_us, stream)));
            }
        }
        if let Some(hand) = step.hand {
            let position_m = hand.position_m.map(|value| value as f32);
            heard.push((step.now_us, Heard::Hand(hand.exposed_us, position_m)));
        }
    }
    movements
}

//! The shared code on the chip's processor against the host's `f64`, SciPy and the golden frames.

use tonus_shared::Real;
use tonus_shared::promp::{
    Basis, Latent, Mixture, Observation, Row, Skill, mixture_len, trajectory_scratch_len,
};
use tonus_shared::semg::chain::{Chain, ChainConfig, ChainState};
use tonus_shared::stiffness::{ArmPosture, ArmStiffness};
use tonus_shared::wire::{MAX_FRAME_BYTES, decode};

use crate::vectors::{
    ARMS, BASIS, CURVES, DOFS, ENVELOPE, FRAMES, LOADING, LOG_POSTERIOR, LOG_PRIORS, MEANS, PHASES,
    RANK, RESIDUAL, ROOTS, SEEN, SKILLS, VARIANCE,
};

/// Largest difference of the posterior after a thousand observations, in its own standard deviations.
const POSTERIOR: f64 = 1e-3;
/// ... of a log posterior, in nats, or in units of itself where that is more.
const LOG: f64 = 1e-3;
/// ... of an envelope, of the recording's peak.
const FILTER: f64 = 1e-4;
/// ... of a stiffness, of itself.
const STIFFNESS: f64 = 1e-4;

/// Panics at the first result that is further off than its bound; prints how far the worst is.
pub(crate) fn check() {
    posterior();
    envelope();
    stiffness();
    wire();
}

fn within(what: &str, worst: f64, bound: f64) {
    cortex_m_semihosting::hprintln!("# {}: off by {:e} of {:e}", what, worst, bound);
    assert!(worst < bound, "{what}: off by {worst:e}, {bound:e} allowed");
}

#[inline(never)]
fn posterior() {
    let latent = Latent::new(Basis::gaussian(BASIS).unwrap(), DOFS, RANK, &LOADING).unwrap();
    let skills: [_; SKILLS] = core::array::from_fn(|skill| {
        let root = Some(&ROOTS[skill][..]);
        Skill::new(&latent, &MEANS[skill], root, &RESIDUAL, LOG_PRIORS[skill]).unwrap()
    });
    let storage = [0.0; mixture_len(SKILLS, BASIS, RANK)];
    let mut mixture = Mixture::new(latent, &skills, storage).unwrap();
    for (dof, phase, value) in SEEN {
        let observation = Observation {
            row: Row::position(dof, phase),
            value,
            variance: VARIANCE,
        };
        mixture.observe(&observation).unwrap();
    }
    let mut scratch = [0.0; trajectory_scratch_len(BASIS, RANK)];
    let mut expected = CURVES.iter();
    let mut worst: f64 = 0.0;
    for skill in 0..SKILLS {
        let trajectory = mixture.trajectory(skill).unwrap();
        for dof in 0..DOFS {
            for phase in PHASES {
                let (mean, std) = *expected.next().unwrap();
                let moments = trajectory
                    .moments(&Row::position(dof, phase), &mut scratch)
                    .unwrap();
                let spread = libm::sqrt(moments.variance.widen());
                for off in [moments.mean.widen() - mean, spread - std] {
                    worst = worst.max(off.abs() / std);
                }
            }
        }
    }
    within("posterior, standard deviations", worst, POSTERIOR);
    let mut log_posterior = [0.0; SKILLS];
    mixture.log_posterior(&mut log_posterior).unwrap();
    let worst = worst_of(&log_posterior, &LOG_POSTERIOR, 1.0);
    within("log posterior", worst, LOG);
}

#[inline(never)]
fn envelope() {
    let chain = Chain::<f32>::design(&ChainConfig::at_rate(200.0)).unwrap();
    let mut state = ChainState::new();
    let (mut worst, mut peak): (f64, f64) = (0.0, 0.0);
    for (x, expected) in ENVELOPE {
        let envelope = chain.step(&mut state, x).unwrap();
        worst = worst.max((envelope.widen() - expected).abs());
        peak = peak.max(expected.abs());
    }
    within("envelope, of its peak", worst / peak, FILTER);
}

#[inline(never)]
fn stiffness() {
    let arm = ArmStiffness::<f32>::illustrative();
    let mut worst: f64 = 0.0;
    for (activation, angles, co_contraction, diagonal) in ARMS {
        let posture = ArmPosture::from_angles(angles).unwrap();
        let stiffness = arm.at(activation, &posture).unwrap();
        let cartesian = <[f32; 3]>::from(stiffness.cartesian.diagonal());
        worst = worst
            .max(worst_of(
                &[stiffness.co_contraction],
                &[co_contraction],
                0.0,
            ))
            .max(worst_of(&cartesian, &diagonal, 0.0));
    }
    within("stiffness, of itself", worst, STIFFNESS);
}

/// Every golden frame is understood, and comes out again byte for byte.
#[inline(never)]
fn wire() {
    for bytes in FRAMES {
        let mut out = [0; MAX_FRAME_BYTES];
        let length = decode(bytes).unwrap().encode(&mut out).unwrap();
        assert!(&out[..length] == bytes, "a frame changed on the way");
    }
    cortex_m_semihosting::hprintln!("# {} golden frames", FRAMES.len());
}

/// The largest difference, of the expected number or of `least` where that is more.
fn worst_of(numbers: &[f32], expected: &[f64], least: f64) -> f64 {
    let off = numbers
        .iter()
        .zip(expected)
        .map(|(number, expected)| (number.widen() - expected).abs() / expected.abs().max(least));
    off.fold(0.0, f64::max)
}
